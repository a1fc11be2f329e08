"""Damaged pictures, scenes, configurations, expectations and records, each drawn from a seed and its own number.

A case is fine where it is read, or refused by a NotabugError: anything else, a trace above all, is a fault of notabug.
"""

from __future__ import annotations

import json
import random
import tempfile
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path

from notabug.scenes_usd.errors import NotabugError

KINDS = ("pictures", "scenes", "configurations", "expectations", "records")
MOST_EDITS = 8
LONGEST_CUT = 64  # bytes that one edit removes or doubles
WORDS = (
    *(
        b"nan",
        b"inf",
        b"-1",
        b"1e400",
        b"9" * 400,
        b"0",
        b"null",
        b"true",
        b"[]",
        b"{}",
        b'""',
        b"\0",
        b"\xff",
        b"\\ud800",
    ),
    *(b"../", b"/etc/passwd", b"`${P}`", b"[" * 50, b"{" * 50, b"\n", b"=", b'"', b"@", b"\x1b]0;x\x07", b"x" * 5000),
)
CONFIGURATION = """
[renderers.mine]
command = ["./render", "{scene}", "{image}", "--samples", "{samples}"]
version = "1.2"
scene = "obj"
image = "exr"
filter = "box"
radius = 0.5
capabilities = ["mesh", "shadows"]
environment = { THREADS = "{threads}" }
retries = 1
memory = "2 GiB"
cpu = 60.0

[renderers.other]
adapter = "zbuffer"
depth = "fixed16"
"""
EXPECTATIONS = """
[[accepted]]
renderer = "povray"
scene = "texture/uneven_quad"
variant = "split=quad"
verdict = "limitation"
name = "quad_split_02"
because = "two triangles"
models = "0.1.0+ea8a5366"
area_px = [9795.6, 11972.4]
jnd = [70.98, 86.76]
expires = 2027-06-30
"""


def damaged(kind: str, seed: int, number: int) -> tuple[str, bytes]:
    """The suffix and the contents of case ``number`` of ``kind``: the same each time."""
    chance = random.Random(f"{seed} {kind} {number}")  # noqa: S311 - no secret depends on it
    suffix, whole = chance.choice(bases(kind))
    data = bytearray(whole)
    for _ in range(chance.randint(1, MOST_EDITS)):
        at = chance.randrange(len(data) + 1)
        span = chance.randint(1, LONGEST_CUT)
        edit = chance.randrange(5)
        if edit == 0 and data:
            data[at % len(data)] = chance.randrange(256)
        elif edit == 1:
            del data[at : at + span]
        elif edit == 2:
            data[at:at] = data[at : at + span] * chance.randint(1, 4)
        elif edit == 3:
            data[at:at] = chance.choice(WORDS)
        else:
            data[at : at + chance.randint(1, 8)] = chance.choice(WORDS)
    if chance.random() < 0.1:
        del data[chance.randrange(len(data) + 1) :]
    return suffix, bytes(data)


@cache
def bases(kind: str) -> tuple[tuple[str, bytes], ...]:
    """What is damaged: good files of ``kind`` by suffix."""
    if kind == "configurations":
        return ((".toml", CONFIGURATION.encode()),)
    if kind == "expectations":
        return ((".toml", EXPECTATIONS.encode()),)
    if kind == "records":
        return ((".json", json.dumps(record()).encode()),)
    if kind == "scenes":
        from notabug.scenes_usd.reader import CORPUS

        names = ("calibration/plain_card", "texture/uneven_quad", "mirror/corner", "terminator/bowl")
        return tuple((".usda", (CORPUS / f"{name}.usda").read_bytes()) for name in names)
    return _pictures()


def _pictures() -> tuple[tuple[str, bytes], ...]:
    """A small picture in each format that renderers write."""
    import numpy as np

    from notabug.scenes_usd.picture import write_coded, write_exr, write_png

    pixels = np.random.default_rng(1).random((6, 5, 3)).astype(np.float32)
    with tempfile.TemporaryDirectory(prefix="notabug-") as name:
        folder = Path(name)
        write_exr(folder / "a.exr", pixels)
        write_png(folder / "a.png", pixels)
        for suffix in (".tif", ".hdr"):
            write_coded(folder / f"a{suffix}", pixels, "float", {})
        (folder / "a.pfm").write_bytes(b"PF\n5 6\n-1.0\n" + pixels[::-1].tobytes())
        return tuple((path.suffix, path.read_bytes()) for path in sorted(folder.iterdir()))


def record() -> dict[str, object]:
    """A run's record with one result that has a finding."""
    from notabug.metrics.verdict import Finding, Verdict
    from notabug.results.record import DEFAULTS, SCHEMA, Result

    found = Finding("bug", "flat_normals", 4.0, (0, 0, 2, 2), jnd=3.0, message="why")
    result = Result("a/b", "s=1", "grey", "1", Verdict("bug", (found,), message="m"), image="a/b/s/grey/mean.exr")
    renderers = {"grey": {"version": "1", "where": "/x"}, "gone": {"missing": "apt install gone"}}
    return {"schema": SCHEMA, **DEFAULTS, "renderers": renderers, "results": [result.as_dict()], "calibration": []}


def fault(kind: str, seed: int, number: int) -> str:
    """What is wrong with how case ``number`` of ``kind`` is taken, or ""."""
    suffix, data = damaged(kind, seed, number)
    with tempfile.TemporaryDirectory(prefix="notabug-") as name:
        path = Path(name) / ("run.json" if kind == "records" else f"case{suffix}")
        path.write_bytes(data)
        try:
            _TAKERS[kind](path)
        except NotabugError:
            return ""
        except Exception as error:
            return f"{type(error).__name__}: {error}"[:300]
    return ""


def _picture(path: Path) -> None:
    from notabug.scenes_usd.picture import read_header, read_picture

    read_header(path)
    read_picture(path)


def _scene(path: Path) -> None:
    from notabug.scenes_usd.reader_stage import read_stage

    read_stage(path, path.stem, {})


def _configuration(path: Path) -> None:
    from notabug.adapters.config import renderer_tables
    from notabug.adapters.configured import configured
    from notabug.adapters.zbuffer import ZBuffer

    for name, table in renderer_tables(path).items():
        configured(name, table, {"zbuffer": ZBuffer()})


def _expectations(path: Path) -> None:
    from notabug.results.expect_file import read

    read(path)


def _record(path: Path) -> None:
    from notabug.report.builds import WRITERS
    from notabug.report.page import draw
    from notabug.results.record import Result, load

    document = load(path.parent)
    results = [Result.from_dict(each) for each in document["results"]]
    for write in WRITERS.values():
        write(document, results, path.parent)
    draw(path.parent)


_TAKERS: dict[str, Callable[[Path], None]] = {
    "pictures": _picture,
    "scenes": _scene,
    "configurations": _configuration,
    "expectations": _expectations,
    "records": _record,
}


def is_sound() -> bool:
    """Whether the files that cases are made from are right themselves, so that each tests more than a refusal."""
    for kind in KINDS:
        for suffix, data in bases(kind):
            with tempfile.TemporaryDirectory(prefix="notabug-") as name:
                path = Path(name) / ("run.json" if kind == "records" else f"case{suffix}")
                path.write_bytes(data)
                if suffix == ".toml":
                    tomllib.loads(data.decode())
                if kind != "scenes":  # their textures are not beside them
                    _TAKERS[kind](path)
    return True
