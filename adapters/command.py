"""A renderer that a configuration table describes: a command, what it reads and writes, and what is true of it.

``docs/your-renderer.md`` is the manual. The command is a list and no shell ever reads it. It is called for each
picture, or started once as in ``server.py``. A picture is written into a fresh folder, so that it is no older one; it
is taken as declared and never corrected.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

from notabug.adapters.base import Apart, Declaration, Found, Quality, Render, RendererError, RendererMissingError
from notabug.adapters.declared import PIXELS
from notabug.adapters.export.formats import export
from notabug.adapters.job_folder import job_folder, picture_path
from notabug.adapters.process import DEFAULT, Ended, Limits, failure, made_picture, run_child
from notabug.adapters.python_modules import with_modules
from notabug.adapters.requirements import check_supported
from notabug.adapters.server import START_SECONDS, Server
from notabug.adapters.settings import filled
from notabug.adapters.spheres import as_given
from notabug.adapters.trees import remove
from notabug.scenes_usd.picture import PictureError, read_header, read_picture, write_exr
from notabug.scenes_usd.scene import Scene

_TICK = 2.0  # seconds by which a file system's clock may lag


@dataclass(frozen=True, slots=True)
class Command:
    """A program that draws one picture a call, or as a server one picture after the other.

    Attributes
    ----------
    command, environment : words with the placeholders of ``settings.PLACEHOLDERS``. A word of command or version that
        names a file in ``folder`` stands for that file, wherever the program runs.
    folder : that of the configuration file; a program with a slash in its name is found from there.
    version : the version itself, or the words of a command whose first line of output it is. With neither, the contents
        of the program stand for it.
    files : globs, from ``folder``, of what else the pictures depend on. A finished result depends on their contents, on
        those of every file in ``folder`` that a word of command or version names, and where that is a Python program
        on the modules in ``folder`` that it imports.
    scene, image : the format that the program reads, and the suffix of what it writes.
    pixels, srgb : number format and encoding of its pictures.
    layer : the layer or part of its files that is the picture, where they hold several; "" where that is clear.
    samples : samples per pixel where a run asks for none.
    server, start_timeout : it is started once, and has so many seconds to say that it is ready.
    retries : how often a call that failed is repeated.
    key : a hash of the table, since a finished result depends on all of it.
    """

    name: str
    command: tuple[str, ...]
    folder: Path
    declared: Declaration
    capabilities: frozenset[str]
    not_together: tuple[Apart, ...] = ()
    scene: str = "json"
    image: str = "exr"
    pixels: str = "float"
    srgb: bool = False
    layer: str = ""
    samples: int = 1
    version: tuple[str, ...] | str = ""
    files: tuple[str, ...] = ()
    environment: dict[str, str] = field(default_factory=dict)
    timeout: float = 600.0
    limits: Limits = DEFAULT
    server: bool = False
    start_timeout: float = START_SECONDS
    retries: int = 0
    install: str = "see the configuration file"
    key: str = ""

    def declaration(self, quality: Quality) -> Declaration:
        return replace(self.declared, samples=quality.samples or self.samples)

    def find(self) -> Found:
        program = self._program()
        if isinstance(self.version, str):
            told = self.version or f"of contents {self._contents(Path(program))}"
        else:
            ended = run_child(self._words(self.version), where=self.name, folder=self.folder, timeout=30.0)
            if ended.exit or ended.stopped or not ended.log.strip():
                raise RendererMissingError(
                    "the program does not tell its version",
                    where=f"adapter {self.name!r}",
                    got=ended.log.strip()[:200] or "nothing",
                    do=self.install,
                )
            told = ended.log.strip().splitlines()[0][:200]
        return Found(told, program, key=f"{self.key} {self._contents()}")

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        scene = as_given(scene, self.declared)
        check_supported(self, scene)
        seeds = quality.seeds if self.declared.noisy else quality.seeds[:1] or (0,)
        samples = quality.samples or self.samples
        with job_folder(out, "command") as folder:
            source = export(scene, self.scene, folder, quality)
            return tuple(self._draw(scene, source, out, seed, samples, quality) for seed in seeds)

    def _draw(self, scene: Scene, source: Path, out: Path, seed: int, samples: int, quality: Quality) -> Render:
        for attempt in range(self.retries + 1):
            try:
                return self._once(scene, source, out, seed, samples, quality)
            except RendererError:
                if attempt == self.retries or not source.exists():  # what filled the disk took the scene with it
                    raise
        raise AssertionError("unreachable")

    def _once(self, scene: Scene, source: Path, out: Path, seed: int, samples: int, quality: Quality) -> Render:
        folder = source.parent
        picture = folder / _PICTURES / f"image{seed}.{self.image}"
        remove(picture.parent)  # of a call that failed
        picture.parent.mkdir(exist_ok=True)
        told: dict[str, str | int] = {
            "scene": str(source),
            "image": str(picture),
            "width": scene.width,
            "height": scene.height,
            "samples": samples,
            "seed": seed,
            "threads": quality.threads or os.cpu_count() or 1,
        }
        began = time.time()
        ended = self._called(told, folder, min(self.timeout, quality.timeout))
        if ended.stopped == "output":
            remove(folder)
        ended.check(self.name)
        self._check(picture, (scene.width, scene.height), began, ended)
        return Render(self._keep(picture, out, seed, ended), seed, samples, ended.seconds, ended.command, ended.log)

    def _called(self, told: dict[str, str | int], folder: Path, timeout: float) -> Ended:
        """How the program ended, or its server's work on a picture, which is ``told`` it."""
        values = {key: str(value) for key, value in told.items()} | {"folder": str(self.folder)}
        environment = {key: filled(text, values) for key, text in self.environment.items()}
        if not self.server:
            words = self._words(self.command, values, folder)
            return run_child(
                words, where=self.name, folder=folder, timeout=timeout, environment=environment, limits=self.limits
            )
        words = self._words(self.command, values)
        seen = Path(words[0]).stat()
        state = f"{self.key} {self._contents()} {seen.st_size} {seen.st_mtime_ns}"
        server = Server(tuple(words), self.name, environment, state, self.start_timeout, self.limits)
        return server.draw(told, folder, timeout)

    def _check(self, picture: Path, size: tuple[int, int], began: float, ended: Ended) -> None:
        """Raise RendererError where ``picture`` is not of the declared kind and of ``size``, and written just now."""
        where, log = self.name, ended.log
        if picture.resolve() != picture:  # the file, or the folder that was made for it
            raise failure("the picture is a link to another file", where=where, log=log, do="write the file itself")
        made_picture(picture, where=where, log=log)
        if picture.stat().st_mtime < began - _TICK:
            raise failure(
                "the picture is older than the job: it is a copy of an earlier one",
                where=where,
                log=log,
                do="let the renderer write the file anew",
            )
        try:
            header = read_header(picture, self.layer)
        except PictureError as error:
            raise _unreadable(error, where, log) from error
        if header.channels not in (3, 4):
            raise failure(
                f"the picture has {header.channels} channels", where=where, log=log, do="write red, green and blue"
            )
        if (header.width, header.height) != size:
            raise failure(
                f"the picture is {header.width} x {header.height}, expected is {size[0]} x {size[1]}",
                where=where,
                log=log,
                do="give the program {width} and {height}, or let it read them from the scene",
            )
        declared = PIXELS[self.pixels]
        if header.quantum > declared.quantum or (header.relative_quantum, declared.relative) == (False, True):
            found = next((name for name, each in PIXELS.items() if each.quantum == header.quantum), "another format")
            raise failure(
                f"the picture's numbers are {found}, declared is {self.pixels}",
                where=where,
                log=log,
                do=f'write {self.pixels}, or set pixels = "{found}"',
            )

    def _keep(self, picture: Path, out: Path, seed: int, ended: Ended) -> Path:
        if not self.srgb and not self.layer:
            kept = out / f"seed{seed}.{self.image}"
            remove(kept)
            picture.replace(kept)
            return kept
        kept = picture_path(out, "linear", seed)
        try:
            write_exr(kept, read_picture(picture, layer=self.layer, srgb=self.srgb).pixels)
        except PictureError as error:
            raise _unreadable(error, self.name, ended.log) from error
        return kept

    def _words(
        self, words: tuple[str, ...], values: dict[str, str] | None = None, job: Path | None = None
    ) -> list[str]:
        """What is called: a word such as ``mine.py`` that names a file of the configuration's folder becomes its path.

        The program runs in a folder of its own, so the word alone would not find it. A file of the ``job`` comes first.
        """
        known = {"folder": str(self.folder), **(values or {})}

        def found(word: str) -> str:
            there = self.folder / word
            return str(there) if _is_file(there) and not (job is not None and _is_file(job / word)) else word

        return [self._program(words[0]), *(found(filled(word, known)) for word in words[1:])]

    def _program(self, word: str = "") -> str:
        word = filled(word or self.command[0], {"folder": str(self.folder)})
        found = shutil.which(str(self.folder / word) if os.sep in word else word)
        if found is None:
            raise RendererMissingError(
                f"no executable {word!r}",
                where=f"adapter {self.name!r}",
                expected=f"a program {'below ' + str(self.folder) if os.sep in word else 'on PATH'}",
                do=self.install,
            )
        return found

    def _contents(self, *programs: Path) -> str:
        """A hash of ``programs`` and of all files in the configuration's folder that the pictures depend on."""
        words = [*self.command[1:], *(self.version[1:] if isinstance(self.version, tuple) else ())]
        if os.sep in self.command[0]:
            words.insert(0, self.command[0])
        holes = dict.fromkeys(_NONE, "") | {"folder": str(self.folder)}
        paths = [self.folder / filled(word, holes) for word in words]
        named = [path for path in paths if _is_file(path)]
        globbed = [path for glob in self.files for path in self.folder.glob(glob) if path.is_file()]
        state = hashlib.blake2b(digest_size=6)
        for path in dict.fromkeys([*programs, *with_modules(named), *sorted(globbed)]):
            state.update(hashlib.blake2b(path.read_bytes(), digest_size=16).digest())
        return state.hexdigest()


def _is_file(path: Path) -> bool:
    """Is there such a file? No word of a command is too long to ask: ``python -c`` is given whole programs."""
    try:
        return path.is_file()
    except OSError:
        return False


def _unreadable(error: PictureError, where: str, log: str) -> RendererError:
    what = f"its picture cannot be read: {error.what}"
    layers = error.got if error.got.startswith("layers") else ""
    return failure(
        what + (f"; {layers}" if layers else ""), where=where, log=log, do='set layer = "NAME"' if layers else ""
    )


_PICTURES = "picture"  # in the job's folder: a picture has a folder of its own, apart from the scene's files
_NONE = ("scene", "image", "width", "height", "samples", "seed", "threads")
