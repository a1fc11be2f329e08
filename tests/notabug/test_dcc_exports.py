"""Whole files as Blender, Houdini and Maya export them, unedited: no false bug, and what is planted is one."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererMissingError, UnsupportedError
from notabug.adapters.registry import adapter
from notabug.metrics.judge import judge
from notabug.references.predict import preview
from notabug.runs.judge_files import BLACK
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.picture import read_picture, write_png
from notabug.scenes_usd.scene import Light, Scene, Texture
from notabug.scenes_usd.view import View

EXPORTS = Path(__file__).with_name("exports")
NAMES = ("blender", "houdini", "maya")
ADAPTED = ("maya",)  # it has two cameras, and is animated; the others are read as they are
WIDTH = 32  # pixels across
SAMPLES = 16
Edit = Callable[[Scene], Scene]


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The exports and the texture beside them, as a DCC would leave them."""
    folder = tmp_path_factory.mktemp("exported")
    for name in NAMES:
        shutil.copyfile(EXPORTS / f"{name}.usda", folder / f"{name}.usda")
    (folder / "textures").mkdir()
    write_png(folder / "textures" / "picture.png", np.random.default_rng(4).uniform(0.1, 0.9, (4, 4, 3)))
    return folder


def small(scene: Scene) -> Scene:
    """With fewer pixels, all of them square."""
    height = round(WIDTH * scene.height / scene.width)
    lens = replace(scene.camera, tan_y=scene.camera.tan_x * height / WIDTH)
    return replace(scene, width=WIDTH, height=height, camera=lens)


def taken(folder: Path, name: str, view: View | None = None) -> Scene:
    return small(take_scene(folder / f"{name}.usda", {}, view).scene)


def verdict(renderer: str, drawn: Scene, meant: Scene, folder: Path) -> str:
    """The verdict on a picture by ``renderer`` of ``drawn``, held against ``meant``."""
    who, quality = adapter(renderer), Quality(samples=SAMPLES, seeds=(0, 1), threads=1)
    try:
        who.find()
    except RendererMissingError as error:
        pytest.skip(str(error))
    made = who.render(drawn, folder, quality)
    pictures = [read_picture(each.image).pixels for each in made]
    return judge(pictures, meant, who.declaration(quality), perceive=False, naming=False).verdict.word


@pytest.mark.parametrize(
    ("name", "renderer"), [*((name, who) for name in NAMES for who in ("inhouse", "mitsuba")), ("maya", "povray")]
)
@pytest.mark.sweep_except("blender-mitsuba", "houdini-inhouse", "maya-inhouse", "maya-mitsuba", "maya-povray")
def test_an_export_is_judged_as_it_is(name: str, renderer: str, exported: Path, tmp_path: Path) -> None:
    scene = taken(exported, name)
    assert np.mean(preview(scene).max(axis=2) > 0.02) > 0.1, "there is something to be seen"
    assert verdict(renderer, scene, scene, tmp_path) in ("pass", "limitation")


@pytest.mark.parametrize("name", ["blender", "houdini"])
def test_a_renderer_without_its_surfaces_says_so(name: str, exported: Path, tmp_path: Path) -> None:
    """They have roughness: a Lambertian in its place would be another scene."""
    with pytest.raises(UnsupportedError, match="needs dielectric, ggx"):
        adapter("povray").render(taken(exported, name), tmp_path, Quality(samples=1))


def light_moved(scene: Scene) -> Scene:
    def moved(light: Light) -> Light:
        x, y, z = light.position
        return replace(light, position=(x + 1.5, y, z)) if light.kind in ("point", "sphere") else light

    return replace(scene, lights=tuple(moved(light) for light in scene.lights))


def texture_read_as_raw(scene: Scene) -> Scene:
    def raw(texture: Texture) -> Texture:
        assert texture.colour_space == "sRGB"
        return replace(texture, pixels=np.where(texture.pixels <= 0.0031308, texture.pixels * 12.92,
                                                1.055 * texture.pixels ** (1 / 2.4) - 0.055))  # fmt: skip

    return replace(scene, textures=tuple(raw(texture) for texture in scene.textures))


def offset_ignored(scene: Scene) -> Scene:
    assert scene.camera.shift_x or scene.camera.shift_y
    return replace(scene, camera=replace(scene.camera, shift_x=0.0, shift_y=0.0))


def drawn_in_perspective(scene: Scene) -> Scene:
    assert scene.camera.orthographic
    near = scene.camera.to_world.copy()
    near[3, 2] = 40.0
    lens = replace(scene.camera, orthographic=False, tan_x=scene.camera.tan_x / 40.0, tan_y=scene.camera.tan_y / 40.0)
    return replace(scene, camera=replace(lens, to_world=near))


FAULTS: tuple[tuple[str, Edit | View], ...] = (
    ("blender", light_moved),
    ("blender", texture_read_as_raw),
    ("blender", offset_ignored),
    ("houdini", offset_ignored),
    ("houdini", View(purposes=frozenset({"default", "proxy"}))),
    ("maya", View(time=48.0)),
    ("maya", drawn_in_perspective),
)


def called(part: str | Edit | View) -> str:
    if isinstance(part, View):
        return "".join(part.words)
    return part if isinstance(part, str) else part.__name__


def wrong(folder: Path, name: str, fault: Edit | View) -> Scene:
    return taken(folder, name, fault) if isinstance(fault, View) else fault(taken(folder, name))


@pytest.mark.parametrize(
    ("name", "fault"), FAULTS, ids=lambda part: getattr(part, "__name__", "".join(getattr(part, "words", [str(part)])))
)
def test_what_is_planted_is_a_bug(name: str, fault: Edit | View, exported: Path, tmp_path: Path) -> None:
    assert verdict("inhouse", wrong(exported, name, fault), taken(exported, name), tmp_path) == "bug"


@pytest.mark.parametrize(
    ("renderer", "name", "fault"),
    [("mitsuba", *FAULTS[0]), ("mitsuba", *FAULTS[3]), ("povray", *FAULTS[5])],
    ids=["light", "offset", "frame"],
)
def test_renderers_with_a_planted_fault(
    name: str, fault: Edit | View, renderer: str, exported: Path, tmp_path: Path
) -> None:
    assert verdict(renderer, wrong(exported, name, fault), taken(exported, name), tmp_path) == "bug"


def test_run_takes_them_without_an_edit(exported: Path, desk: Any, tmp_path: Path) -> None:
    """On the command line: a line for the one that is adapted, and a result of each."""
    before = {name: (exported / f"{name}.usda").read_bytes() for name in NAMES}
    files = [str(exported / f"{name}.usda") for name in NAMES]
    out = tmp_path / "out"
    assert desk.say("run", *files, "-r", "inhouse", "-j", "1", "--samples", "1", "--out", str(out)) == 0
    told = desk.capture.readouterr().err
    assert told.count("adapted in memory") == len(ADAPTED)
    assert all(f"{name}.usda: adapted in memory" in told for name in ADAPTED)
    results = json.loads((out / "run.json").read_text("utf-8"))["results"]
    assert {each["scene"]: each["verdict"] in ("pass", "limitation") for each in results} == dict.fromkeys(NAMES, True)
    assert {name: (exported / f"{name}.usda").read_bytes() for name in NAMES} == before


def test_a_picture_that_shows_nothing_says_so(exported: Path, desk: Any, tmp_path: Path) -> None:
    """The sun shines upwards here, alone: every renderer is right, and nothing is learnt."""
    text = (exported / "houdini.usda").read_text("utf-8")
    turned = text.replace("(0.8, 0, 0.6, 0), (0.36, 0.8, -0.48, 0), (-0.48, 0.6, 0.64, 0)",
                          "(0.8, 0, -0.6, 0), (0.36, 0.8, 0.48, 0), (0.48, -0.6, 0.64, 0)")  # fmt: skip
    assert turned != text
    turned = turned.replace('def RectLight "key"', 'class RectLight "key"')
    (exported / "dark.usda").write_text(turned, "utf-8")
    out = tmp_path / "out"
    assert desk.say("run", str(exported / "dark.usda"), "-r", "inhouse", "-j", "1", "--out", str(out)) == 0
    (result,) = json.loads((out / "run.json").read_text("utf-8"))["results"]
    assert BLACK in result["notes"]
