"""What is legal at its utmost: every adapter draws it as the tracer does, or refuses it by name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Adapter, UnsupportedError
from notabug.adapters.export.description import describe
from notabug.adapters.export.obj import write_obj
from notabug.adapters.inhouse import InHouse
from notabug.adapters.povray_scene import scene_text
from notabug.adapters.zbuffer import ZBuffer
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.scene import Mesh

DENORMAL = 1.401298464324817e-45  # the least float32 above 0
EXPONENTS = [0.0, DENORMAL, 1e-30, 1e-3, 1e6, 1e12]
SMALL = 16


@pytest.fixture(params=["povray", "mitsuba", "opengl", "inhouse", "zbuffer"])
def adapter(request: pytest.FixtureRequest) -> Adapter:
    own: dict[str, Adapter] = {"inhouse": InHouse(), "zbuffer": ZBuffer()}
    return own[request.param] if request.param in own else request.getfixturevalue(request.param)


def scene_of(stage: Any, light: Any = None, **look: Any) -> Any:
    material = stage.replace(stage.grey(0.3), **look)
    light = light or stage.point((0.5, 0.3, 2.0))
    return stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)), [material], size=(SMALL, SMALL))


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
@pytest.mark.sweep_except("povray-blinn", "mitsuba-phong", "opengl-blinn", "inhouse-blinn", "zbuffer-phong")
def test_every_exponent(stage: Any, adapter: Adapter, lobe: str) -> None:
    """max(c, 0)^0 is 1 where the cosine c is above 0, and a denormal exponent is as good as 0."""
    for exponent in EXPONENTS:
        scene = scene_of(stage, specular=(0.2, 0.2, 0.2), exponent=exponent, lobe=lobe)
        expected = trace_picture(scene)
        assert expected.max() > 0.05
        assert np.abs(stage.draw(adapter, scene) - expected).max() < 3e-5, exponent


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_povrays_text_divides_by_nothing(stage: Any, exponent: float) -> None:
    for lobe in ("phong", "blinn"):
        text = scene_text(scene_of(stage, specular=(0.2,) * 3, exponent=exponent, lobe=lobe))
        assert "inf" not in text
        assert "nan" not in text


@pytest.mark.parametrize(
    "look",
    [
        {"diffuse": (0.0, 0.0, 0.0)},
        {"diffuse": (1e-38, 1e-38, 1e-38)},
        {"diffuse": (1.0, 1.0, 1.0)},
        {"opacity": 0.0},
        {"opacity": 1e-30},
        {"opacity": 1.0 - 1e-8},
        {"mirror": (1.0, 1.0, 1.0)},
        {"transmission": (1.0, 1.0, 1.0), "ior": 1.0, "diffuse": (0.0, 0.0, 0.0)},
        {"transmission": (0.5, 0.5, 0.5), "ior": 1e-3, "diffuse": (0.0, 0.0, 0.0)},
        {"transmission": (0.5, 0.5, 0.5), "ior": 1e30, "diffuse": (0.0, 0.0, 0.0)},
    ],
    ids=str,
)
@pytest.mark.sweep_except(
    "povray-{'opacity': 1e-30}",
    "povray-{'mirror': (1.0, 1.0, 1.0)}",
    "povray-{'transmission': (0.5, 0.5, 0.5), 'ior': 1e+30, 'diffuse': (0.0, 0.0, 0.0)}",
    "mitsuba-{'opacity': 1e-30}",
    "mitsuba-{'mirror': (1.0, 1.0, 1.0)}",
    "mitsuba-{'transmission': (0.5, 0.5, 0.5), 'ior': 1e+30, 'diffuse': (0.0, 0.0, 0.0)}",
    "opengl-{'transmission': (1.0, 1.0, 1.0), 'ior': 1.0, 'diffuse': (0.0, 0.0, 0.0)}",
    "inhouse-{'diffuse': (0.0, 0.0, 0.0)}",
    "inhouse-{'diffuse': (1e-38, 1e-38, 1e-38)}",
    "inhouse-{'diffuse': (1.0, 1.0, 1.0)}",
    "inhouse-{'opacity': 0.0}",
    "inhouse-{'opacity': 0.99999999}",
    "zbuffer-{'transmission': (0.5, 0.5, 0.5), 'ior': 0.001, 'diffuse': (0.0, 0.0, 0.0)}",
)
def test_every_material(stage: Any, adapter: Adapter, look: dict[str, Any]) -> None:
    scene = scene_of(stage, **look)
    if set(look) & {"mirror", "transmission"} and not adapter.capabilities >= {"mirror", "transmission"}:
        with pytest.raises(UnsupportedError, match="needs"):
            stage.draw(adapter, scene)
        return
    assert np.abs(stage.draw(adapter, scene) - trace_picture(scene)).max() < 3e-5


@pytest.mark.parametrize("intensity", [0.0, 1e-30, 1e4])
@pytest.mark.sweep_except(
    "povray-0.0", "mitsuba-1e-30", "opengl-10000.0", "inhouse-10000.0", "zbuffer-0.0", "zbuffer-1e-30"
)
def test_every_light(stage: Any, adapter: Adapter, intensity: float) -> None:
    scene = scene_of(stage, stage.point((0.5, 0.3, 2.0), (intensity,) * 3))
    expected = trace_picture(scene)
    assert np.abs(stage.draw(adapter, scene) - expected).max() <= 3e-5 * max(1.0, float(expected.max()))


def odd_faces() -> Mesh:
    """A quad with two corners in one place and a uv for each, a concave quad, a bent one and a flat one."""
    pinched = [(0, 0, 0), (0, 0, 0), (-1, -1, 0), (1, -1, 0)]
    concave = [(1, 1, 0), (-1, 1, 0), (0, 0.5, 0), (0.3, -0.5, 0)]
    bent = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0)]
    flat = [(2, 0, 0), (3, 0, 0), (3, 1, 0), (2, 1, 0)]
    points = np.array(pinched + concave + bent + flat, float)
    uv = np.random.default_rng(0).random((16, 2))
    return Mesh("/M", points, np.full(4, 4, np.int32), np.arange(16, dtype=np.int32), 0, uv=uv)


def test_exports_hold_only_faces_that_readers_can_read(stage: Any, tmp_path: Path) -> None:
    """OBJ: convex quads stay quads, others are their triangles, none without an area; JSON lists the same triangles."""
    mesh = odd_faces()
    scene = stage.scene([mesh], [stage.point((0, 0, 3))], stage.camera((0, 0, 5)))
    text = write_obj(scene, tmp_path).read_text()
    faces = [line.split()[1:] for line in text.splitlines() if line.startswith("f ")]
    assert sorted(len(face) for face in faces) == [3, 3, 3, 4, 4]
    corners = [[int(word.split("/")[1]) - 1 for word in face] for face in faces]
    for face in corners:
        a, b, c = mesh.points[mesh.corners[face[:3]]]
        assert np.linalg.norm(np.cross(b - a, c - a)) > 0.1
    triangles = json.loads(json.dumps(describe(scene)))["objects"][0]["triangles"]
    assert len(triangles) == 7
    assert [face for face in corners if len(face) == 3] == triangles[:3]
