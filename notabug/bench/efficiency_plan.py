"""Which knobs are turned on which scenes, and what theory says of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from notabug.adapters.base import Adapter, RendererMissingError
from notabug.adapters.inhouse import InHouse
from notabug.adapters.llvm import find_library
from notabug.adapters.mitsuba import Mitsuba
from notabug.adapters.povray import PovRay
from notabug.adapters.registry import adapter
from notabug.bench.efficiency import Line, Setting
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

SIDE = 64
CLASSES = (
    *("acne/sphere", "terminator/sphere", "phong/lobes", "separation/cutoff", "mirror/corner"),
    *("visibility/near_clip", "texture/perspective_floor"),
)
RANDOM = (-0.5, "independent samples: the rms error falls as samples^-1/2")
GRID = (-0.75, "a regular grid across edges: samples^-3/4 (Mitchell 1996)")
FACETS = (-0.75, "a band of width 1/n, dark by up to 1/n, n^2 facets: facets^-3/4")
QUADS = (-1.0, "linear interpolation in cells of width h is off by h^2: facets^-1")

# Renderers that are one adapter each, with what they make of more samples. Their own conventions are in their floors.
SINGLE = {
    **dict.fromkeys(("babylon", "filament", "panda3d", "pygfx", "tachyon", "threejs", "vtk"), GRID),
    **dict.fromkeys(("cycles", "luxcore"), RANDOM),
}

ALL = ("8x4", "16x8", "24x12", "48x24", "96x48")
GRIDS = ("split02", "grid2", "grid4", "grid8", "grid15", "grid30")

Renderer = tuple[str, Adapter, tuple[int, ...], tuple[float, str]]


def renderers(*, quick: bool = False) -> list[Renderer]:
    """(name, adapter, samples, theory) of those that are installed."""
    few = (4, 16) if quick else (4, 16, 64)
    found: list[Renderer] = [
        ("inhouse float64", InHouse(), few, RANDOM),
        ("inhouse float32", InHouse(precision="float32"), few, RANDOM),
    ]
    if _there(PovRay()):
        found.append(("povray", PovRay(), few, GRID))
    if _there(Mitsuba()):
        found.append(("mitsuba scalar", Mitsuba(variant="scalar_rgb"), few, RANDOM))
        if find_library().path is not None:
            found.append(("mitsuba llvm", Mitsuba(variant="llvm_ad_rgb"), few if quick else (*few, 256), RANDOM))
    others = ((name, adapter(name), theory) for name, theory in sorted(SINGLE.items()))
    found += [(name, each, few, theory) for name, each, theory in others if _there(each)]
    return found


def _there(adapter: Adapter) -> bool:
    try:
        adapter.find()
    except RendererMissingError:
        return False
    return True


def plan(names: Sequence[str] = (), *, quick: bool = False, side: int = 0) -> list[list[Line]]:
    """Groups of lines that are timed in turn: a scene and a knob each. ``names`` selects scenes."""
    who, side = renderers(quick=quick), side or SIDE
    groups = [_samples(name, who, side) for name in (names or (CLASSES[:2] if quick else CLASSES))]
    if not quick and not names:
        groups += [
            _variants("terminator/sphere", "tessellation", ALL, who, side, FACETS),
            _variants("texture/uneven_quad", "split", GRIDS, who, side, QUADS),
            [_epsilons(precision, side) for precision in ("float32", "float64")],
        ]
    return groups


def _sized(scene: Scene, side: int) -> Scene:
    return replace(scene, width=side, height=round(side * scene.height / scene.width))


def _samples(name: str, who: Sequence[Renderer], side: int) -> list[Line]:
    scene = _sized(read_scene(name), side)
    return [
        Line(name, title, "samples", tuple(Setting(n, adapter, scene, n) for n in samples), *theory)
        for title, adapter, samples, theory in who
    ]


def _variants(
    name: str, set_: str, chosen: Sequence[str], who: Sequence[Renderer], side: int, theory: tuple[float, str]
) -> list[Line]:
    """Variants that differ in their number of facets, at pixel centres; the knob is that of the largest mesh."""
    scenes = [_sized(read_scene(name, {set_: each}), side) for each in chosen]
    facets = [max(len(mesh.counts) for mesh in scene.meshes) for scene in scenes]
    return [
        Line(
            name,
            title,
            "facets",
            tuple(Setting(n, adapter, scene, 1) for n, scene in zip(facets, scenes, strict=True)),
            *theory,
        )
        for title, adapter, _, _ in who
        if title in ("inhouse float64", "povray", "mitsuba llvm")
    ]


def _epsilons(precision: str, side: int) -> Line:
    """A fixed epsilon from far too small to far too large: no power law, a valley."""
    name = "terminator/sphere"
    scene = _sized(read_scene(name, {"tessellation": "96x48"}), side)
    values = [10.0**-k for k in range(9, -1, -1)]
    settings = tuple(
        Setting(value, InHouse(precision=precision, start="absolute", epsilon=value), scene, 1)  # type: ignore[arg-type]
        for value in values
    )
    return Line(name, f"inhouse {precision}", "epsilon", settings, None, "acne below, lost shadows above: a valley")
