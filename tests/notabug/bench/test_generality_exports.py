"""Whole exports of Blender, Houdini and Maya by renderers that draw all they have: no false bug, and faults by name."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from notabug.adapters.registry import adapter, needs
from notabug.bench.generality.command import jobs
from notabug.bench.generality.examine import Record
from notabug.bench.generality.exports import EXPORTS, FAULTS, NAMES, RENDERERS, SIDE, exported, planted, table, taken
from notabug.bench.generality.jobs import Job, as_parts, expose
from notabug.bench.generality.summary import is_bad, summary
from notabug.references.predict import preview
from notabug.scenes_usd.own import take_scene

SIDES = {"mitsuba": SIDE, "cycles": 24}  # pixels; Cycles takes 16 samples on a light for each of a pixel
DRAWN = [(name, renderer) for name in NAMES for renderer in RENDERERS]


def record_of(name: str, renderer: str, fault: str = "", *, naming: bool = True, side: int = SIDE) -> Record:
    (record,) = expose(Job("exports", 0, NAMES.index(name), (renderer,), naming, side, name, fault))
    return record


@pytest.fixture
def who(request: pytest.FixtureRequest) -> Any:
    """The renderer that the test is about, where it is installed."""
    return request.getfixturevalue(request.getfixturevalue("renderer"))


@pytest.mark.parametrize(("name", "renderer"), DRAWN)
@pytest.mark.sweep_except("blender-mitsuba", "maya-cycles")
def test_an_export_is_no_bug_as_it_is(name: str, renderer: str, who: Any) -> None:
    record = record_of(name, renderer, side=SIDES[renderer])
    assert (record["word"], record.get("bugs")) == ("pass", []), f"{who.name}: {record['message']}"


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize(("name", "renderer"), DRAWN)
@pytest.mark.sweep_except("blender-mitsuba-metallic ignored", "maya-cycles-sRGB on the roughness map")
def test_a_planted_fault_is_a_bug_by_name(name: str, renderer: str, fault: str, who: Any) -> None:
    record = record_of(name, renderer, fault, side=SIDES[renderer])
    assert record["word"] == "bug", f"{who.name}: {record['message']}"
    assert record["bugs"][0] in FAULTS[fault].right


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.sweep_except(
    "houdini-light size", "maya-roughness squared twice", "blender-green of the normal map flipped"
)
def test_the_in_house_renderer_with_a_planted_fault_is_a_bug(name: str, fault: str) -> None:
    """What is planted is in the file itself: a renderer of which nothing is known but its pictures shows it."""
    record = record_of(name, "inhouse", fault, naming=False, side=32)
    assert record["word"] == "bug"


@pytest.mark.parametrize("name", NAMES)
def test_an_export_has_what_the_faults_need(name: str, tmp_path: Path) -> None:
    scene = taken(exported(name, tmp_path))
    asked = needs(scene)
    assert asked >= {"ggx", "dielectric", "normal_map", "texture"}
    assert asked & {"sphere_light", "rect_light", "disk_light"}
    assert any(material.preview and material.preview.metallic == 1.0 for material in scene.materials)
    assert any(material.preview and material.preview.roughness_map >= 0 for material in scene.materials)
    assert (preview(scene).max(axis=2) > 0.02).mean() > 0.3, "there is something to be seen"
    assert {who for who in RENDERERS if not asked - adapter(who).capabilities} == set(RENDERERS)


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", NAMES)
def test_a_fault_is_an_edit_of_a_copy(name: str, fault: str, tmp_path: Path) -> None:
    before = (EXPORTS / f"{name}.usda").read_bytes()
    meant = taken(exported(name, tmp_path / "meant"), 8)
    drawn = taken(planted(name, fault, tmp_path / "drawn"), 8)
    assert drawn.digest() != meant.digest()
    assert (len(drawn.objects), len(drawn.lights)) == (len(meant.objects), len(meant.lights))
    assert (EXPORTS / f"{name}.usda").read_bytes() == before


def test_blenders_export_is_read_as_it_is_and_is_blenders() -> None:
    path = EXPORTS / "blender.usda"
    assert re.search(r'doc = "Blender v\d', path.read_text("utf-8"))
    taken_as = take_scene(path)
    assert len(taken_as.scene.textures) == 3
    assert not [line for line in taken_as.says if "light" in line or "material" in line.lower()], "nothing is replaced"


def test_the_jobs_and_the_table() -> None:
    assert as_parts(["exports"]) == ["exports"]
    made = jobs(["exports"], 0, 0, RENDERERS, quick=False, naming=True, side=0)
    assert len(made) == len(NAMES) * (1 + len(FAULTS)) * len(RENDERERS)
    assert {job.side for job in made} == {SIDE}
    clean: Record = {"part": "exports", "mesh": "maya", "renderer": "mitsuba", "word": "pass", "bugs": []}
    faulty = {**clean, "fault": "light size", "right": ["light_size"], "shows": True, "named": True, "word": "bug"}
    records = [clean, {**faulty, "bugs": ["light_size"]}, {**faulty, "renderer": "cycles", "bugs": ["unexplained"]}]
    assert table(records) == [
        ("export", "fault", "mitsuba", "cycles"),
        ("maya", "as it is", "pass", ""),
        ("maya", "light size", "bug: light size", "bug: unexplained"),
    ]
    found = summary(records)["exports"]
    assert (found["called_bug"]["hits"], found["named_right"]["hits"], found["false_bugs"]) == (2, 1, [])
    assert not is_bad(found)
    assert is_bad(summary([{**clean, "word": "bug", "bugs": ["unexplained"]}])["exports"])
