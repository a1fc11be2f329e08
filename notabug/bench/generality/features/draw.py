"""A random scene as a design tool exports it, written as a .usda file: the same bytes for a seed and a number."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from notabug.bench.generality.decks import generator
from notabug.bench.generality.features.decks import Features, features
from notabug.bench.generality.features.geometry import BOUND, bound, mesh_lines, thing
from notabug.bench.generality.features.lights import lights
from notabug.bench.generality.features.looks import surface
from notabug.bench.generality.looks import colour
from notabug.bench.generality.placing import matrix_op, placed
from notabug.bench.generality.shapes import Floats, floor
from notabug.runs.folders import write_text
from notabug.scenes_usd.authoring.stage import APERTURE
from notabug.scenes_usd.authoring.usda import block, number, vector
from notabug.scenes_usd.framing import FAR, NEAR, direction, fitting_distance, look_at

APART = 2.1  # between the middles of things that stand side by side, whose sizes are about 1
WITHOUT_COORDINATES = ("solid",)
SIDE = (320, 240)  # pixels that render settings ask for, where a file has them; the bench draws fewer


def write_export(seed: int, index: int, folder: Path) -> Path:
    """Write export ``index`` of ``seed`` and its pictures into ``folder``; the path of the scene."""
    folder.mkdir(parents=True, exist_ok=True)
    rng, what = generator(seed, index), features(seed, index)
    eye = float(rng.uniform(0.0, 360.0))
    prims, looks, files, corners = _things(rng, what)
    camera, middle, away = _camera(rng, what, corners, eye)
    shining, skies = lights(rng, what, middle, max(away / 2.0, 2.0), eye)
    for name, data in (files | skies).items():
        (folder / name).write_bytes(data)
    turned = 'float xformOp:rotateX = 90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]'
    small = 'float3 xformOp:scale = (100, 100, 100)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    frame = {"z_up": [turned], "centimetres": [small]}.get(what.stage, [])
    parts = [block('def Scope "Looks"', *looks), camera, *shining, *prims]
    text = _stage(what, block('def Xform "Export"', *frame, *parts))
    path = folder / f"export-{seed}-{index:04}.usda"
    write_text(path, text)
    return path


def _things(rng: np.random.Generator, what: Features) -> tuple[list[str], list[str], dict[str, bytes], Floats]:
    """Prims, materials, pictures, and the corners that the camera has to see."""
    prims, looks, corners = list[str](), list[str](), list[Floats]()
    files = dict[str, bytes]()
    turn, count = float(rng.uniform(0.0, 2 * math.pi)), int(what.objects)
    for k in range(count):
        kind = what.geometry if not k else str(rng.choice(["mesh", "catmullClark", "solid"]))
        uv = kind not in WITHOUT_COORDINATES
        material = what.surface if not k else str(rng.choice(["dielectric", "metal", "specular"]))
        maps, bumps = (what.maps, what.normal_map) if uv and not k else ("none", "none")
        opacity = what.opacity if uv and not k else "none"
        made = surface(rng, what, f"Look{k}", material, maps=maps, bumps=bumps, opacity=opacity)
        looks.append(made.text)
        files |= made.files
        second = f"Look{k}"
        if kind == "subsets":
            second = f"Look{k}b"
            looks.append(surface(rng, what, second, "dielectric", maps="none", bumps="none").text)
        around = 0.0 if count == 1 else APART / 2 / math.sin(math.pi / max(count, 2))
        angle = turn + 2 * math.pi * k / max(count, 2)
        where = np.array([around * math.sin(angle), float(rng.uniform(1.0, 1.7)), around * math.cos(angle)])
        place = placed(rng, what.transform, where, float(rng.uniform(0.6, 0.95)))
        texts, reach = thing(rng, what, f"Thing{k}", kind, place, f"Look{k}", second, uv=uv)
        prims += texts
        corners.append(reach)
    if what.binding == "displayColor":  # no material at all
        shown = f"color3f[] primvars:displayColor = [{vector(colour(rng, 0.2, 0.9))}]"
        prims = [text.replace(bound("Look0"), shown) for text in prims]
    if what.floor != "none":
        kind = {"plain": "plain", "glossy": "specular", "textured": "dielectric"}[what.floor]
        made = surface(rng, what, "Ground", kind, maps="diffuse" if what.floor == "textured" else "none", bumps="none")
        looks.append(made.text)
        files |= made.files
        half = rng.uniform(2.5, 4.0, 2)
        ground = floor(int(rng.integers(1, 5)), float(half[0]), float(half[1]), "quads")
        lines = mesh_lines(rng, what, "mesh", ground, uv=True)
        prims.append(block(f'def Mesh "Ground"{BOUND}', "\n".join([*lines, bound("Ground")])))
    return prims, looks, files, np.concatenate(corners)


def _camera(rng: np.random.Generator, what: Features, corners: Floats, azimuth: float) -> tuple[str, Floats, float]:
    """The camera's text, the middle of what it looks at, and its distance from there."""
    tan_x = float(rng.uniform(0.2, 0.6))
    tan_y = tan_x * SIDE[1] / SIDE[0]
    towards = direction(azimuth, float(rng.uniform(12.0, 60.0)))
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    up = np.array([0.0, 1.0, 0.0])
    axes = look_at(middle + towards, middle, up)[:3, :3]
    away = fitting_distance(corners, middle, axes, tan_x, tan_y, float(rng.uniform(0.7, 1.0)))
    aperture = APERTURE
    lines = [f"float focalLength = {number(APERTURE / (2 * tan_x))}"]
    if what.projection == "orthographic":  # its apertures are tenths of the unit that the camera is placed in
        aperture = 10.0 * 2.0 * tan_x * away
        lines = ['token projection = "orthographic"']
    if what.projection == "offset":
        offsets = [aperture * float(rng.uniform(-0.1, 0.1)) for _ in range(2)]
        lines += [
            f"float horizontalApertureOffset = {number(offsets[0])}",
            f"float verticalApertureOffset = {number(offsets[1])}",
        ]
    lines += [
        f"float2 clippingRange = {vector((NEAR * away, 100 * FAR * away))}",
        f"float horizontalAperture = {number(aperture)}",
        f"float verticalAperture = {number(aperture * SIDE[1] / SIDE[0])}",
        matrix_op(look_at(middle + away * towards, middle, up)),
    ]
    return block('def Camera "Camera"', "\n".join(lines)), middle, away


def _stage(what: Features, root: str) -> str:
    head = (
        '#usda 1.0\n(\n    defaultPrim = "Export"\n    doc = "An export of the generality bench"\n'
        f"    metersPerUnit = {0.01 if what.stage == 'centimetres' else 1}\n"
        f'    upAxis = "{"Z" if what.stage == "z_up" else "Y"}"\n'
    )
    if what.settings == "none":
        return f"{head})\n\n{root}\n"
    settings = block(
        'def RenderSettings "Settings"', f"rel camera = </Export/Camera>\nuniform int2 resolution = {vector(SIDE)}"
    )
    render = block('def Scope "Render"', settings)
    return f'{head}    renderSettingsPrimPath = "/Render/Settings"\n)\n\n{root}\n\n{render}\n'
