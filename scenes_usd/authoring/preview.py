"""preview/*: one small scene for each feature of UsdPreviewSurface, its textures and the lights of UsdLux.

Each is a layer over one base: a curved tile under two lights. What a feature looks like is what the specification says
of it, so a renderer that draws every one of them right has read the specification as its authors wrote it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.preview_features import FEATURES, LOOK, THIRD, Feature
from notabug.scenes_usd.authoring.preview_lights import LIGHTS
from notabug.scenes_usd.authoring.shapes import cells
from notabug.scenes_usd.authoring.stage import Row, as_float32, camera, lambert, looking, mesh, over, placed
from notabug.scenes_usd.authoring.usda import block, card, indent, vector

SIDE = 64  # pixels
CELLS = 24  # along an edge of the tile
RISE = 0.45  # of the tile's middle above its corners
TILES = 8  # squares along an edge of the textures


def files() -> dict[str, bytes]:
    """The scenes, their base and their textures by their path below scenes_usd."""
    made = {f"preview/textures/{name}.png": png(pixels) for name, pixels in _pictures().items()}
    made["preview/meshes/base.usda"] = _base()
    return made | {f"preview/{each.name}.usda": _layer(each) for each in (*FEATURES, *LIGHTS)}


def _layer(feature: Feature) -> bytes:
    words = {"class": "own", "claim": feature.claim, "cites": feature.cites}
    look = block('over "Look"', over("Surface", *feature.surface.splitlines()), *feature.shaders)
    parts = [block('over "Materials"', look), *feature.lights]
    if feature.tile:
        parts.append(over("Tile", *feature.tile))
    root = block(f'over "Scene" (\n{indent(card(words))}\n)', *parts)
    return f"{_header('    subLayers = [@./meshes/base.usda@]')}\n{root}\n".encode()


def _header(more: str = "") -> str:
    lines = (
        '    defaultPrim = "Scene"',
        '    doc = "Written by python -m notabug.scenes_usd.authoring; edit the script there, not this file."',
        "    metersPerUnit = 1",
        '    renderSettingsPrimPath = "/Render/Settings"',
        *([more] if more else []),
        '    upAxis = "Y"',
    )
    return "#usda 1.0\n(\n" + "\n".join(lines) + "\n)\n"


def _base() -> bytes:
    """The tile, a wall behind it, their materials, two lights, the camera and the settings."""
    look = block(
        'def Material "Look"',
        f"token outputs:surface.connect = <{LOOK}/Surface.outputs:surface>",
        'def Shader "Surface"\n{\n    uniform token info:id = "UsdPreviewSurface"\n    token outputs:surface\n}',
    )
    key = block(
        'def SphereLight "Key"',
        "float inputs:intensity = 150\nbool inputs:normalize = 1\nbool treatAsPoint = 1\n" + placed((-1.6, 2.2, 3.6)),
    )
    turn = looking((-0.5, -0.2, -1.0))
    fill = block(
        'def DistantLight "Fill"',
        "float inputs:angle = 0\ncolor3f inputs:color = (1, 0.85, 0.7)\nfloat inputs:intensity = 0.8\n"
        + placed(turn=turn),
    )
    root = block(
        'def Xform "Scene"',
        camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), 0.3, (0.1, 100.0)),
        key,
        fill,
        block('def Scope "Materials"', look, lambert("Back", (0.7, 0.2, 0.15))),
        _tile(),
        mesh("Wall", [(-3, -3, -1), (3, -3, -1), (3, 3, -1), (-3, 3, -1)], [(0, 1, 2, 3)], material="Back"),
    )
    settings = block(
        'def RenderSettings "Settings"',
        f"rel camera = </Scene/Camera>\nuniform int2 resolution = {vector((SIDE, SIDE))}",
    )
    render = block('def Scope "Render"', settings)
    return f"{_header()}\n{root}\n\n{render}\n".encode()


def _tile() -> str:
    """The part of a paraboloid over a square, which is a little larger than the picture: no silhouette is seen."""
    points: list[Row] = []
    normals: list[Row] = []
    uv: list[Row] = []
    for j in range(CELLS + 1):
        for i in range(CELLS + 1):
            x, y = (2.0 * k / CELLS - 1.0 for k in (i, j))
            points.append((1.4 * x, 1.4 * y, RISE * (1.0 - 0.5 * (x * x + y * y))))
            normal = np.array([RISE * x / 1.4, RISE * y / 1.4, 1.0])
            normals.append(tuple((normal / np.linalg.norm(normal)).tolist()))
            uv.append((i / CELLS, j / CELLS))
    faces = [face for a, b, c, d in cells(CELLS, CELLS) for face in ((a, b, c), (a, c, d))]
    other = ", ".join(vector((1.0 - u, v)) for u, v in uv)
    second = f'texCoord2f[] primvars:other = [{other}] (\n    interpolation = "vertex"\n)'
    return mesh(
        "Tile",
        as_float32(points),
        faces,
        material="Look",
        normals=as_float32(normals),
        uv=as_float32(uv),
        lines=[second],
    )


def _pictures() -> Mapping[str, npt.NDArray[np.uint8]]:
    """The textures, (h, w, 3), or with alpha (h, w, 4); row 0 is the upper one."""
    row, column = np.mgrid[0:TILES, 0:TILES]
    even = ((row + column) % 2 == 0)[..., None]
    checks = np.where(even, (220, 190, 120), (40, 90, 160))
    corners = np.where(even, (200, 200, 190), (150, 150, 140))
    first, last = slice(0, 2), slice(-2, None)
    corners[first, first], corners[first, last] = (220, 40, 30), (40, 170, 60)
    corners[last, first], corners[last, last] = (50, 80, 220), (230, 190, 40)
    ramp = np.linspace(60, 250, TILES).astype(int)
    level = np.broadcast_to(ramp[None, :, None], (TILES, TILES, 3))
    packed = np.stack(
        [
            np.full((TILES, TILES), 20),
            np.broadcast_to(ramp[:, None], (TILES, TILES)),
            np.broadcast_to(ramp[None, ::-1], (TILES, TILES)),
        ],
        axis=2,
    )
    third = np.full((2, 2, 3), round(float(THIRD) * 255))
    half = np.broadcast_to(np.where(column < TILES // 2, 128, 255)[..., None], (TILES, TILES, 3))
    away = np.hypot(row - (TILES - 1) / 2, column - (TILES - 1) / 2)
    alpha = np.clip(255 - 38 * away, 0, 255).astype(int)  # a disk that fades towards the corners
    leaf = np.concatenate([checks, alpha[..., None]], axis=2)
    flat = np.broadcast_to((128, 128, 255), (2, 2, 3))
    tilt = 0.35 * np.stack(
        [np.sin(2 * np.pi * (column + 0.5) / TILES), np.cos(2 * np.pi * (row + 0.5) / TILES)], axis=2
    )
    bumps = np.concatenate([tilt, np.sqrt(1.0 - (tilt**2).sum(axis=2, keepdims=True))], axis=2)
    sky = np.repeat(np.linspace(150, 40, 8)[:, None, None] * (0.8, 0.9, 1.0), 16, axis=1)
    sky[2, 5], sky[4, 10] = (255, 225, 180), (80, 160, 255)
    pictures = {
        "checks": checks, "corners": corners, "ramp": level, "packed": packed, "third": third, "half": half,
        "leaf": leaf, "flat": flat, "bumps": np.round((bumps + 1.0) * 127.5), "sky": sky,
    }  # fmt: skip
    return {name: np.ascontiguousarray(pixels.astype(np.uint8)) for name, pixels in pictures.items()}
