"""Faults of scene text and of jobs: each changes what it says, and nothing where there is nothing for it."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.adapters.mitsuba import Mitsuba
from notabug.adapters.mitsuba_job import job
from notabug.adapters.povray import PovRay
from notabug.adapters.povray_scene import scene_text, texture_images
from notabug.bench.generality.decks import DECK
from notabug.bench.generality.draw import write_random_scene
from notabug.bench.generality.examine import pictures_by
from notabug.bench.generality.faults import CONNECTED, changed, kinds, order, with_fault
from notabug.bench.generality.jobs import Job, expose, sized
from notabug.bench.generality.limitations import ALWAYS, NEAREST, choices, declared, nearest
from notabug.bench.generality.mitsuba_faults import MITSUBA_FAULTS
from notabug.bench.generality.povray_faults import POVRAY_FAULTS
from notabug.bench.generality.summary import judging
from notabug.references.models.model import models
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene, Texture


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> list[Scene]:
    """A block of random scenes: together they hold every feature."""
    folder = tmp_path_factory.mktemp("faults")
    return [sized(read_scene(write_random_scene(0, k, folder / str(k))), 32) for k in range(DECK)]


@pytest.fixture(scope="module")
def texts(scenes: list[Scene]) -> list[str]:
    found = []
    for scene in scenes:
        channel = 0 if any(len(set(each.specular)) > 1 for each in scene.materials) else None
        try:
            found.append(scene_text(scene, images=texture_images(scene), channel=channel))
        except Exception:  # what POV-Ray cannot say
            continue
    return found


@pytest.fixture(scope="module")
def documents(scenes: list[Scene]) -> list[Any]:
    found = []
    for scene in scenes:
        try:
            found.append(job(scene, Quality(samples=4)))
        except Exception:  # what Mitsuba cannot say
            continue
    return found


def test_there_are_a_dozen_kinds_for_each() -> None:
    assert len(POVRAY_FAULTS) >= 12
    assert len(MITSUBA_FAULTS) >= 12


@pytest.mark.parametrize("name", POVRAY_FAULTS)
def test_a_fault_of_the_text_acts_on_some_scene_and_keeps_the_lines(name: str, texts: list[str]) -> None:
    edited = [(text, POVRAY_FAULTS[name].edit(text)) for text in texts]
    assert any(before != after for before, after in edited)
    for before, after in edited:
        assert after.count("{") == after.count("}")
        assert after.startswith("#version 3.7;")
        assert "camera {" in after
        assert len(after.splitlines()) in (len(before.splitlines()), len(before.splitlines()) - 1)


@pytest.mark.parametrize("name", MITSUBA_FAULTS)
def test_a_fault_of_the_job_acts_on_some_scene(name: str, documents: list[Any]) -> None:
    acted = False
    for document, arrays in documents:
        other, parts = copy.deepcopy(document), {key: each.copy() for key, each in arrays.items()}
        MITSUBA_FAULTS[name].edit(other, parts)
        same = other == document and all(np.array_equal(parts[key], arrays[key]) for key in arrays)
        acted |= not same
        assert set(parts) == set(arrays)
        for each in other["objects"]:
            counts = {len(parts[each[part]]) for part in ("points", "normals", "uv") if part in each}
            assert len(counts) <= 1
    assert acted


def test_numbers_are_scaled_where_they_stand() -> None:
    text = "light_source { <1,2,3> rgb <4,5,6> fade_power 2 fade_distance 1e-06 }\n"
    assert "rgb <5,6.25,7.5> fade" in POVRAY_FAULTS["light brighter"].edit(text)
    assert "rgb <5,5,6> fade" in POVRAY_FAULTS["light redder"].edit(text)
    assert "<1,2,3>" in POVRAY_FAULTS["light brighter"].edit(text)
    assert POVRAY_FAULTS["light missing"].edit(text) == text  # the only light stays
    assert POVRAY_FAULTS["light missing"].edit(text * 2) == text


def test_every_fault_comes_first_in_turn() -> None:
    for name in ("povray", "mitsuba"):
        firsts = {order(0, index, name)[0] for index in range(0, 2 * len(kinds(name)), 2)}
        assert firsts == set(kinds(name))


def test_what_counts_is_connected() -> None:
    clean = np.full((20, 20, 3), 0.5, np.float32)
    blot, dots = clean.copy(), clean.copy()
    blot[3:6, 4:8] *= 1.06
    dots[::4, ::4] *= 2.0
    assert changed([blot], [clean]) == CONNECTED
    assert changed([dots], [clean]) == 1
    assert changed([clean * 1.04], [clean]) == 0
    assert changed([clean], [clean]) == 0


def test_a_fault_goes_only_with_its_renderer() -> None:
    fault = POVRAY_FAULTS["light brighter"]
    assert with_fault(PovRay(), fault).edit is fault.edit  # type: ignore[attr-defined]
    for who in (Mitsuba(), InHouse()):
        with pytest.raises(TypeError):
            with_fault(who, fault)


@pytest.mark.slow
def test_povray_draws_the_fault(povray: PovRay, scenes: list[Scene]) -> None:
    quality = Quality(samples=1)
    right = pictures_by(povray, scenes[4], quality)
    wrong = pictures_by(with_fault(povray, POVRAY_FAULTS["light brighter"]), scenes[4], quality)
    lit = right[0] > 0.05
    assert np.allclose(wrong[0][lit] / right[0][lit], 1.25, atol=2e-3)


@pytest.mark.slow
def test_mitsuba_draws_the_fault(mitsuba: Mitsuba, scenes: list[Scene]) -> None:
    quality = Quality(samples=1)
    right = pictures_by(mitsuba, scenes[4], quality)
    wrong = pictures_by(with_fault(mitsuba, MITSUBA_FAULTS["light redder"]), scenes[4], quality)
    lit = right[0][..., 0] > 0.05
    assert np.allclose(wrong[0][lit][:, 0] / right[0][lit][:, 0], 1.25, atol=1e-4)
    assert np.allclose(wrong[0][..., 1:], right[0][..., 1:], atol=1e-5)


@pytest.mark.slow
def test_a_fault_is_called_a_bug(mitsuba: Any, tmp_path: Path) -> None:
    (made,) = expose(Job("faults", 0, 4, ("mitsuba",), naming=False, side=32, fault="light brighter"))
    assert made["shows"]
    assert made["changed"] >= CONNECTED
    assert made["word"] == "bug", made


def test_choices_are_limitations_and_conventions_of_the_scene(scenes: list[Scene]) -> None:
    for scene in scenes:
        kind = {each.name: each.kind for each in models(scene)}
        for name, model in choices(scene).items():
            assert (name == NEAREST) == (model is None)
            assert model is None or kind[name] in ("limitation", "convention")
            assert declared(name, model).samples == 16
    every = {name for scene in scenes for name in choices(scene)}
    assert {NEAREST, "gouraud_interpolation", "flat_interpolation", "silhouette_flip", "quad_split_02"} <= every
    assert every.isdisjoint(ALWAYS)  # they are in every picture


def test_what_is_declared_is_what_the_model_asks_for(scenes: list[Scene]) -> None:
    for scene in scenes:
        for name, model in choices(scene).items():
            for field, value in () if model is None else model.conditions:
                assert field in ("resolves", "shadows") or str(getattr(declared(name, model), field)) == value
    assert declared(NEAREST, None).texture_filter == "nearest"


def test_every_right_name_is_one_that_the_judge_can_tell(tmp_path: Path) -> None:
    """Of 60 scenes, which hold every feature, or of the whole picture."""
    made = (write_random_scene(1, k, tmp_path / str(k)) for k in range(3 * DECK))
    known = {each.name for path in made for each in models(read_scene(path)) if each.kind == "fault"}
    known |= {"pixel_shift"}
    for name, fault in [*POVRAY_FAULTS.items(), *MITSUBA_FAULTS.items()]:
        assert fault.right, name
        assert set(fault.right) <= known, name


def test_the_nearest_texel_fills_its_block() -> None:
    texture = Texture(Path("a.png"), np.arange(12.0).reshape(2, 2, 3))
    made = nearest(texture).pixels
    side = len(made) // 2
    assert made.shape == (2 * side, 2 * side, 3)
    assert np.array_equal(made[:side, :side], np.broadcast_to(texture.pixels[0, 0], (side, side, 3)))
    assert replace(texture, pixels=made).pixels[-1, -1].tolist() == [9.0, 10.0, 11.0]


@pytest.mark.slow
def test_a_limitation_by_another_program_is_no_bug() -> None:
    made = expose(Job("limitations", 0, 3, (), naming=False, side=32))
    assert [each["renderer"] for each in made] == ["declared", "undeclared"]
    assert {each["word"] for each in made} <= {"pass", "limitation", "inconclusive"}, made


def test_the_time_that_a_verdict_takes_is_told() -> None:
    records = [{"judging": {"seconds": float(n), "processor": 2.0 * n}} for n in range(101)]
    assert judging(records) == {
        "seconds": {"median": 50.0, "95 %": 95.0, "longest": 100.0},
        "processor": {"median": 100.0, "95 %": 190.0, "longest": 200.0},
    }
    assert judging([]) == {}
