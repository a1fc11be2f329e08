"""The process that OpenGL runs in: ``python -m notabug.adapters.opengl_child FOLDER``, or ``--probe``.

It reads ``job.json`` and ``arrays.npz`` from the folder, and writes ``picture.npy``, (h, w, 3) float32, and for one
sample a pixel ``depth.npy``, (h, w) float64: the depth buffer read back, the nearest surface's. ``--probe`` prints what
a context says of itself. The context needs no window: it comes from EGL. A driver may abort, and takes only this
process with it.
"""

from __future__ import annotations

import ctypes
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from notabug.adapters.opengl_shaders import FRAGMENT, LIGHT, VERTEX

if TYPE_CHECKING:
    import moderngl

    from notabug.adapters.job_types import Arrays, GlJob

_DEVICES = 4  # EGL devices to be tried: a graphics card may be there and not for us
_TILE = 2048  # samples along an edge of what is drawn at once
_LAYERS = 256
# Constants of the OpenGL registry.
_FRAMEBUFFER, _RENDERBUFFER = 0x8D40, 0x8D41
_LOWER_LEFT, _ZERO_TO_ONE = 0x8CA1, 0x935F
_DEPTH_COMPONENT, _UNSIGNED_INT, _FLOAT = 0x1902, 0x1405, 0x1406
_FORMATS = {"fixed16": 0x81A5, "float32": 0x8CAC, "reversed32": 0x8CAC}  # moderngl's own is fixed24
_COMPLETE = 0x8CD5

Pixels = npt.NDArray[np.float32]


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    context = create_context()
    limit = min(context.info["GL_MAX_VIEWPORT_DIMS"])
    if max(job["width"], job["height"]) * job["grid"] > limit:
        sys.exit(f"{job['grid']} x {job['grid']} samples a pixel make the picture larger than {limit}, OpenGL's limit")
    drawing = _Drawing(context, job, arrays)
    grid = job["grid"]
    width, height = job["width"] * grid, job["height"] * grid
    step = max(1, _TILE // grid) * grid
    picture = np.zeros((job["height"], job["width"], 3), np.float32)
    depth = np.zeros((height, width))
    for y in range(0, height, step):
        for x in range(0, width, step):
            w, h = min(step, width - x), min(step, height - y)
            drawn, deep = drawing.tile(x, y, w, h)
            rows, columns = slice(height - y - h, height - y), slice(x, x + w)
            cells = drawn.reshape(h // grid, grid, w // grid, grid, 3).mean(axis=(1, 3), dtype=np.float64)
            picture[rows.start // grid : rows.stop // grid, x // grid : (x + w) // grid] = cells
            depth[rows, columns] = deep
    np.save(folder / "picture.npy", picture)
    if grid == 1:
        np.save(folder / "depth.npy", depth)


def _egl(device: int) -> dict[str, Any]:
    """What moderngl is told of the ``device``; its own stub does not know all of it."""
    return {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1", "device_index": device}


def create_context() -> moderngl.Context:
    """A context of the first EGL device that gives one."""
    import moderngl

    why = []
    for device in range(_DEVICES):
        try:
            made: moderngl.Context = moderngl.create_context(standalone=True, **_egl(device))
            return made
        except Exception as error:  # moderngl raises nothing more precise
            why.append(f"EGL device {device}: {error}")
    sys.exit("\n".join(why))


def probe() -> None:
    context = create_context()
    print(json.dumps({"renderer": context.info["GL_RENDERER"], "version": context.info["GL_VERSION"]}))


def _function(name: str, *arguments: type) -> Callable[..., object]:
    """An OpenGL function that moderngl does not wrap."""
    find = ctypes.CDLL("libEGL.so.1").eglGetProcAddress
    find.restype, find.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    address = find(name.encode())
    if not address:
        sys.exit(f"this OpenGL has no {name}")
    return ctypes.CFUNCTYPE(ctypes.c_uint, *arguments)(address)


class _Drawing:
    """A scene on the graphics side, drawn tile by tile."""

    def __init__(self, context: moderngl.Context, job: GlJob, arrays: Arrays) -> None:
        self.context, self.job = context, job
        self.peel: bool = job["transparent"]
        head = f"#version 330\n#define LIGHTS {max(1, len(job['lights']))}\n#define PEEL {int(self.peel)}\n{LIGHT}"
        self.program = context.program(vertex_shader=head + VERTEX, fragment_shader=head + FRAGMENT)
        self._set("view", np.array(job["view"], np.float32).tobytes())  # row vectors by rows are columns by columns
        self._set("projection", np.array(job["projection"], np.float32).tobytes())
        self._set("eye", np.array(job["eye"], np.float32).tobytes())
        lights = job["lights"] or [{"distant": True, "place": [0, 0, 1], "power": [0, 0, 0]}]
        self._set("lights", np.int32(len(lights)).tobytes())
        self._set("distant", np.array([light["distant"] for light in lights], np.int32).tobytes())
        self._set("place", np.array([light["place"] for light in lights], np.float32).tobytes())
        self._set("power", np.array([light["power"] for light in lights], np.float32).tobytes())
        fixed = job["depth"].startswith("fixed")
        steps = 2.0 ** int(job["depth"][5:]) - 1.0 if fixed else -1.0 if job["depth"] == "reversed32" else 0.0
        self._set("steps", np.float32(steps).tobytes())
        self._set("texels", np.int32(0).tobytes())
        self._set("before", np.int32(1).tobytes())
        self.textures = {
            number: context.texture(each.shape[1::-1], 3, np.ascontiguousarray(each).tobytes(), dtype="f4")
            for number, each in ((n, arrays[t["pixels"]]) for n, t in job["textures"].items())
        }
        self.targets: dict[tuple[int, int], list[moderngl.Framebuffer]] = {}
        self.shapes = []
        for each in job["objects"]:
            vertices = context.buffer(arrays[each["vertices"]].tobytes())
            used = [n for n in ("position", "normal", "uv") if n in self.program]
            layout = " ".join(
                f"{size}f" if n in used else f"{4 * size}x" for n, size in (("position", 3), ("normal", 3), ("uv", 2))
            )
            self.shapes.append(context.vertex_array(self.program, [(vertices, layout, *used)]))
        if job["depth"] == "reversed32":
            _function("glClipControl", ctypes.c_uint, ctypes.c_uint)(_LOWER_LEFT, _ZERO_TO_ONE)

    def _set(self, name: str, value: bytes) -> None:
        """Set a uniform, where the compiler left it in."""
        if name in self.program:
            uniform: Any = self.program[name]
            uniform.write(value)

    def tile(self, x: int, y: int, width: int, height: int) -> tuple[Pixels, npt.NDArray[np.float64]]:
        """Samples (h, w, 3) and depths (h, w) of the tile whose lower left corner is (x, y), top row first."""
        if (width, height) not in self.targets:
            self.targets[width, height] = [self._target(width, height) for _ in range(2 if self.peel else 1)]
        targets = self.targets[width, height]
        whole = (-x, -y, self.job["width"] * self.job["grid"], self.job["height"] * self.job["grid"])
        total = np.zeros((height, width, 3))
        rest = np.ones((height, width, 1))
        depth = None
        for layer in range(_LAYERS if self.peel else 1):
            target = targets[layer % 2]
            self._draw(target, targets[layer % 2 - 1] if layer else None, whole)
            drawn = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(height, width, 4)
            if depth is None:
                depth = self._depth(target, width, height)
            if layer and not drawn[..., 3].any():
                break
            total += rest * drawn[..., 3:] * drawn[..., :3]
            rest *= 1.0 - drawn[..., 3:]
        assert depth is not None
        return total[::-1].astype(np.float32), depth[::-1]

    def _target(self, width: int, height: int) -> moderngl.Framebuffer:
        size = (width, height)
        colours = [self.context.texture(size, 4, dtype="f4") for _ in range(2 if self.peel else 1)]
        depth = self.context.depth_renderbuffer(size)
        target = self.context.framebuffer(colours, depth)
        if self.job["depth"] == "fixed24":
            return target
        uint = ctypes.c_uint
        _function("glBindRenderbuffer", uint, uint)(_RENDERBUFFER, depth.glo)
        storage = _function("glRenderbufferStorage", uint, uint, ctypes.c_int, ctypes.c_int)
        storage(_RENDERBUFFER, _FORMATS[self.job["depth"]], width, height)
        target.use()
        state = _function("glCheckFramebufferStatus", uint)(_FRAMEBUFFER)
        if state != _COMPLETE:
            sys.exit(f"no framebuffer with a depth buffer of the format {self.job['depth']}: status {state:#x}")
        return target

    def _draw(
        self, target: moderngl.Framebuffer, before: moderngl.Framebuffer | None, whole: tuple[int, int, int, int]
    ) -> None:
        import moderngl

        reverse = self.job["depth"] == "reversed32"
        target.use()
        self.context.enable_only(moderngl.DEPTH_TEST)
        self.context.depth_func = ">" if reverse else "<"
        target.clear(0.0, 0.0, 0.0, 0.0, depth=0.0 if reverse else 1.0)
        target.viewport = whole
        if before is not None:
            layer: Any = before.color_attachments[1]
            layer.use(1)
        self._set("first_layer", np.int32(before is None).tobytes())
        first = 0
        for each, shape in zip(self.job["objects"], self.shapes, strict=True):
            texture = self.job["textures"].get(str(each["texture"]))
            self._set("textured", np.int32(texture is not None).tobytes())
            if texture is not None:
                self._set("wrap", np.array(texture["wrap"], np.int32).tobytes())
                self.textures[str(each["texture"])].use(0)
            for name, number in (
                ("diffuse", each["diffuse"]),
                ("specular", each["specular"]),
                ("exponent", each["exponent"]),
                ("opacity", each["opacity"]),
            ):
                self._set(name, np.array(number, np.float32).tobytes())
            self._set("gouraud", np.int32(each["gouraud"]).tobytes())
            self._set("lobe", np.int32(each["lobe"]).tobytes())
            self._set("first_triangle", np.int32(first).tobytes())
            shape.render(moderngl.TRIANGLES)
            first += shape.vertices // 3

    def _depth(self, target: moderngl.Framebuffer, width: int, height: int) -> npt.NDArray[np.float64]:
        """The depth buffer, bottom row first, in [0, 1]."""
        target.use()
        fixed = self.job["depth"].startswith("fixed")
        into = np.zeros((height, width), np.uint32 if fixed else np.float32)
        signature = (*(ctypes.c_int,) * 4, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p)
        read = _function("glReadPixels", *signature)
        read(0, 0, width, height, _DEPTH_COMPONENT, _UNSIGNED_INT if fixed else _FLOAT, into.ctypes.data)
        depth: npt.NDArray[np.float64] = into.astype(np.float64)
        return depth / (2.0**32 - 1.0) if fixed else depth


if __name__ == "__main__":
    probe() if sys.argv[1] == "--probe" else main(Path(sys.argv[1]))
