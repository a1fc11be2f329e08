"""The process that keeps a browser open: ``python -P browser_child.py BROWSER LIBRARY SCRIPT``.

It is spoken to as ``kept.py`` says; see ``child_job.py`` for what is in a job's folder. LIBRARY is the renderer's own
JavaScript, a module where its name ends in ``.module.js``. SCRIPT has ``setup(library)``, which returns what is told of
the device, and ``draw(job)``, which returns (h, w, 4) float32, bottom row first. Chromium is spoken to through two
pipes; its profile is a folder in the working directory.

``--probe`` as a fourth word prints the browser's version and the device, and ends.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from notabug.adapters.job_types import Arrays, Job, ShapeSaid, TextureSaid

_FREE = 10  # the first file descriptor that is surely neither of the two that Chromium reads and writes
_READS, _WRITES = 3, 4
_GRACE = 0.5  # seconds that the browser has to end
_SWITCHES = (
    *("--headless=new", "--remote-debugging-pipe", "--no-first-run", "--no-default-browser-check"),
    *("--allow-file-access-from-files", "--disable-background-networking", "--disable-component-update"),
    *("--disable-extensions", "--disable-dev-shm-usage", "--disable-sync", "--mute-audio", "--log-level=3"),
    *("--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--use-gl=angle"),
)
_UNPACK = """
window.unpack = said => {  // {"base64", "type"} wherever it stands becomes an array of that type
  if (said === null || typeof said !== 'object') return said;
  if (Array.isArray(said)) return said.map(window.unpack);
  if ('base64' in said) {
    const text = atob(said.base64), bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    return new window[said.type](bytes.buffer);
  }
  return Object.fromEntries(Object.entries(said).map(([name, part]) => [name, window.unpack(part)]));
};
window.pack = pixels => {
  const bytes = new Uint8Array(pixels.buffer, pixels.byteOffset, pixels.byteLength), parts = [];
  for (let i = 0; i < bytes.length; i += 32768) parts.push(String.fromCharCode(...bytes.subarray(i, i + 32768)));
  return btoa(parts.join(''));
};
"""


class Browser:
    """A Chromium without a window and one page of it; its profile is in ``folder``."""

    def __init__(self, program: str, angle: str, folder: str) -> None:
        read, self._input = _pipe()
        self._output, write = _pipe()
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        words = [program, *_SWITCHES, f"--use-angle={angle}", f"--user-data-dir={folder}"]
        words += ["--no-sandbox"] if root else []  # Chromium's sandbox does not work for root
        self.process = subprocess.Popen(
            [*words, "about:blank"],
            stdin=subprocess.DEVNULL,
            stdout=sys.stderr,
            preexec_fn=lambda: (os.dup2(read, _READS), os.dup2(write, _WRITES)),
            pass_fds=(_READS, _WRITES),
        )
        os.close(read)
        os.close(write)
        self._count, self._rest, self._session = 0, b"", ""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

    def call(self, method: str, **parameters: object) -> Any:
        """What Chromium answers to ``method``."""
        self._count += 1
        message: dict[str, object] = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        left = memoryview(json.dumps(message).encode() + b"\0")
        try:
            while left:
                left = left[os.write(self._input, left) :]
        except BrokenPipeError:
            raise SystemExit("the browser has ended") from None
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error'].get('message')}")
                return answer["result"]

    def _next(self) -> Any:
        parts = [self._rest]
        while b"\0" not in parts[-1]:
            parts.append(os.read(self._output, 1 << 20))
            if not parts[-1]:
                raise SystemExit("the browser has ended")
        whole, _, self._rest = b"".join(parts).partition(b"\0")
        return json.loads(whole)

    def run(self, expression: str) -> Any:
        """The value of a JavaScript expression, waited for where it is a promise."""
        told = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in told:
            details = told["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description") or details["text"])
        return told["result"].get("value")


def _pipe() -> tuple[int, int]:
    """A pipe with no end at a number that Chromium's ends get."""
    ends = os.pipe()
    moved = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, _FREE) for end in ends]
    for end in ends:
        os.close(end)
    return moved[0], moved[1]


def _opened(browser: Browser, library: Path, script: Path, folder: Path) -> str:
    """Load the renderer and the script; what the script says of the device."""
    page = folder / "page.html"
    classic = "" if library.name.endswith(".module.js") else f'<script src="{library.as_uri()}"></script>'
    page.write_text(f"<!doctype html><script>{_UNPACK}</script>{classic}", "utf-8")
    browser.call("Page.navigate", url=page.as_uri())
    browser.run("new Promise(go => document.readyState === 'complete' ? go() : addEventListener('load', () => go()))")
    loaded = f"await import({json.dumps(library.as_uri())})" if not classic else "null"
    return str(
        browser.run(
            f"(async () => {{ window.script = await import({json.dumps(script.as_uri())});"
            f" return await window.script.setup({loaded}); }})()"
        )
    )


def _drawn(browser: Browser, folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        told = plain(job, dict(stored))
    text = browser.run(f"(async () => window.pack(await window.script.draw(window.unpack({json.dumps(told)}))))()")
    grid, width, height = job["grid"], job["width"], job["height"]
    pixels = np.frombuffer(base64.b64decode(text), np.float32).reshape(height, grid, width, grid, 4)[::-1, ::-1]
    np.save(folder / "picture.npy", pixels[..., :3].mean(axis=(1, 3), dtype=np.float64).astype(np.float32))


_PASSED_ON = ("width", "height", "camera", "lights", "materials", "grid", "unit", "shadow_map")


def plain(job: Job, arrays: Arrays) -> dict[str, object]:
    """The job with its arrays in it. Every mesh has one vertex for each corner of its triangles, and normals."""
    return {
        **{name: value for name, value in job.items() if name in _PASSED_ON},
        "textures": [_texture(texture, arrays[texture["pixels"]]) for texture in job["textures"]],
        "objects": [_mesh(shape, arrays, job["unit"]) for shape in job["objects"]],
    }


def _texture(said: TextureSaid, pixels: npt.NDArray[np.float32]) -> dict[str, object]:
    """RGBA in float32, bottom row first: v grows up."""
    whole = np.ones((*pixels.shape[:2], 4), np.float32)
    whole[..., :3] = pixels[::-1]
    return {"wrap": said["wrap"], "width": pixels.shape[1], "height": pixels.shape[0], "pixels": _packed(whole)}


def _mesh(shape: ShapeSaid, arrays: Arrays, unit: float) -> dict[str, object]:
    corners = arrays[shape["triangles"]].ravel()
    points = arrays[shape["points"]][arrays[shape["corners"]][corners]]
    if "normals" in shape:
        normals = arrays[shape["normals"]][corners]
    else:
        a, b, c = np.moveaxis(points.reshape(-1, 3, 3), 1, 0)
        across = np.cross(b - a, c - a)
        length = np.linalg.norm(across, axis=-1, keepdims=True)
        normals = np.repeat(across / np.where(length > 0.0, length, 1.0), 3, axis=0)
    uv = arrays[shape["uv"]][corners] if "uv" in shape else np.zeros((len(corners), 2))
    parts = {"positions": points * unit, "normals": normals, "uv": uv}
    return {"material": shape["material"], **{name: _packed(part) for name, part in parts.items()}}


def _packed(array: npt.NDArray[np.floating]) -> dict[str, str]:
    little = np.ascontiguousarray(array, "<f4")
    return {"base64": base64.b64encode(little.tobytes()).decode("ascii"), "type": "Float32Array"}


def _serve(draw: Callable[[Path], None], lines: IO[str]) -> None:
    """Draw the folder of each line, and answer."""
    for line in lines:
        try:
            draw(Path(line.rstrip("\n")))
            _answer("done")
        except Exception as error:  # a scene that cannot be drawn must not end the browser
            _answer(f"failed {json.dumps(str(error))}")


def _answer(said: str) -> None:
    """Begin a new line: what the browser printed may have no end."""
    print(f"\n{os.environ.get('NOTABUG_JOB', '')} {said}", flush=True)


def main() -> None:
    program, library, script = sys.argv[1:4]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    here = Path.cwd()
    browser = Browser(program, os.environ["NOTABUG_ANGLE"], str(here / "profile"))
    try:
        version = browser.call("Browser.getVersion")["product"]
        device = _opened(browser, Path(library), Path(script), here)
        said = f"{version.replace('/', ' ')}, {device}"
        if sys.argv[4:] == ["--probe"]:
            print(f"\ndevice: {said}", flush=True)
        else:
            _answer(said)
            _serve(lambda job: _drawn(browser, job), sys.stdin)
    finally:
        browser.process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            browser.process.wait(_GRACE)
        browser.process.kill()


if __name__ == "__main__":
    main()
