"""The verdict bench: its split, its statistics against closed forms, and one group from drawing to record."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from notabug.bench.verdict.catalogue import FAULTS, LIMITATIONS, staged
from notabug.bench.verdict.command import command
from notabug.bench.verdict.design import FULL, QUICK, SEEDS, Group, groups, seeds_of
from notabug.bench.verdict.evaluate import expose, moved, shows
from notabug.bench.verdict.image_formation import BY_NAME, filtered
from notabug.bench.verdict.run import Record, kept, run
from notabug.bench.verdict.scene_setup import STAGES, jittered, resized
from notabug.bench.verdict.summary import OURS, area, best_threshold, confusion, rate, scores
from notabug.exit_codes import ExitCode
from notabug.scenes_usd.reader import read_scene


def record(**changes: object) -> Record:
    return {"label": "bug", "scene": "a/b", "word": "bug", "shows": True, **changes}


def test_there_are_forty_faults_in_every_class() -> None:
    assert len({each.name for each in FAULTS}) >= 40
    assert {each.group for each in FAULTS} >= {
        "geometry", "intersection", "reflection", "mirrors", "refraction", "texture", "camera", "film", "light",
    }  # fmt: skip


@pytest.fixture(scope="module")
def design() -> list[Group]:
    return groups(replace(FULL, sides=("tuning", "evaluation")))


def test_every_fault_and_limitation_is_drawn_on_both_sides(design: list[Group]) -> None:
    wanted = {each.name for each in (*FAULTS, *LIMITATIONS)}
    for side in ("tuning", "evaluation"):
        assert {each.name for each in design if each.side == side} - {""} == wanted


def test_no_drawing_is_on_both_sides(design: list[Group]) -> None:
    sides: dict[tuple[object, ...], set[str]] = {}
    for each in design:
        sides.setdefault((each.scene, each.seed), set()).add(each.side)
    assert all(len(each) == 1 for each in sides.values())
    assert set(seeds_of("a/b", "tuning")) | set(seeds_of("a/b", "evaluation")) == set(SEEDS)


def test_clean_pictures_are_enough_for_one_in_a_thousand() -> None:
    clean = [each for each in groups(FULL) if each.label == "clean"]
    assert {each.side for each in clean} == {"evaluation"}
    assert sum(each.repeats if BY_NAME[name].samples else 1 for each in clean for name in each.conditions) >= 3000


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_changes_some_scene(name: str) -> None:
    scenes = (read_scene(each) for each in ("terminator/sphere", "texture/uneven_quad", "phong/floor_lobes"))
    assert any(staged(each, name).digest() != each.digest() for each in scenes)


def test_seeds_see_another_scene() -> None:
    scene = resized(read_scene("terminator/sphere"), 64)
    assert (scene.width, scene.height) == (64, 64)
    assert len({jittered(scene, seed).digest() for seed in (0, *SEEDS)}) == 1 + len(SEEDS)
    assert jittered(scene, 0) is scene


def test_the_area_under_the_curve() -> None:
    assert area([3, 4], [1, 2]) == 1.0
    assert area([1, 2], [3, 4]) == 0.0
    assert area([1, 3], [2, 2]) == 0.5
    assert area([1, 1], [1]) == 0.5
    assert best_threshold([3, 4], [1, 2]) == (2.0, 1.0)


def test_a_rate_has_the_interval_of_scenes() -> None:
    """One scene that is always wrong and three that never are: the rate is 1 / 4, and could be far more, or none."""
    found = [record(scene=scene, word="bug" if scene == "a" else "pass") for scene in "abcd" for _ in range(25)]
    wrong = rate(found, lambda each: each["word"] == "bug")
    assert wrong["share"] == 0.25
    assert wrong["interval"][0] == 0.0
    assert wrong["interval"][1] >= 0.5
    none = rate(found, lambda each: each["word"] == "?")
    assert none["interval"][1] == pytest.approx(1 - 0.025 ** (1 / 100))


def test_the_confusion_counts_every_picture() -> None:
    found = [record(), record(word="pass"), record(label="clean", word="pass")]
    assert confusion(found)["bug"] == {"pass": 1, "limitation": 0, "bug": 1, "inconclusive": 0}
    assert sum(sum(row.values()) for row in confusion(found).values()) == 3


def test_what_a_picture_shows() -> None:
    reference = np.full((40, 40, 3), 0.5)
    spot = reference.copy()
    spot[0, :2] = 0.6  # 2 of 1,600 pixels
    none = np.zeros_like(reference)
    alone = (reference, reference)
    assert not shows(reference, reference, none, alone)
    assert not shows(reference * 1.003, reference, none, alone)
    assert shows(reference * 1.01, reference, none, alone)
    assert not shows(spot, reference, none, alone)
    spot[0, :6] = 0.6
    assert shows(spot, reference, none, alone)
    assert not shows(spot, reference, np.full_like(reference, 0.1), alone)


@pytest.mark.parametrize("condition", ["point", "box", "gaussian"])
def test_a_shift_shows_beyond_its_tolerance(condition: str) -> None:
    """A half-plane: moved by a fifth of a pixel it shows nothing wrong, by two fifths it does."""
    x = np.arange(200)
    steep = np.repeat((np.add.outer(0.31 * x, x) > 130.0)[..., None], 3, axis=2).astype(float)

    def told(subsamples: int) -> bool:
        there = np.pad(steep, ((0, 0), (subsamples, 0), (0, 0)), mode="edge")[:, : len(x)]
        picture, reference = (filtered(each, BY_NAME[condition]) for each in (there, steep))
        return shows(picture, reference, np.zeros_like(picture), moved(steep, BY_NAME[condition]))

    assert not told(0)
    assert not told(1)
    assert told(2)


@pytest.mark.parametrize(("label", "name"), [("clean", ""), ("bug", "light_gain"), ("limitation", "facet_self_shadow")])
def test_a_group_from_drawing_to_record(label: str, name: str, tmp_path: Path) -> None:
    scene = "terminator/sphere"
    strength = 1.2 if label == "bug" else 1.0
    # a bug whose box is the condition that is named, and a clean picture that the gates see
    seed = 1 if label == "bug" else seeds_of(scene, "tuning")[0]
    # facets so large that their shadows show: the gates see only what does
    facets = (("tessellation", "8x4"),) if label == "limitation" else ()
    group = Group(label, name, "any", strength, scene, facets, seed, "tuning", ("box",), 64)  # type: ignore[arg-type]
    (found,) = expose(group)
    assert found["word"] == ("pass" if label == "clean" else label)
    if label == "bug":
        assert found["bugs"] == ["light_gain"]
        assert found["shows"]
    if label == "limitation":
        assert found["limitations"] == ["facet_self_shadow"]
    assert found["gates"]


@pytest.mark.parametrize(
    ("name", "scene", "variants"),
    [("acne", "acne/sphere", {"camera_distance": "1e3"}), ("coincident_surfaces", "visibility/coincident_planes", {})],
)
def test_what_a_limitation_declares_is_declared(name: str, scene: str, variants: dict[str, str]) -> None:
    group = Group("limitation", name, "any", 1.0, scene, tuple(variants.items()), 5, "evaluation", ("point",), 64)
    (found,) = expose(group)
    assert (found["word"], found["limitations"], found["shows"]) == ("limitation", [name], True)


def test_what_lies_beside_a_fault_does_not_show_it() -> None:
    """Half of the drawings have facets too: a picture too tall by a millionth shows those and no fault."""
    facets = (("tessellation", "8x4"),)
    drawings = (
        Group("bug", "aspect", "camera", 1.000001, "terminator/sphere", facets, seed, "tuning", ("box",), 64)
        for seed in SEEDS
    )
    found = [expose(each)[0] for each in drawings]
    assert {each["word"] for each in found} == {"pass", "limitation"}
    assert not any(each["shows"] for each in found)


def test_a_fault_that_undoes_a_limitation_leaves_the_right_picture() -> None:
    """Facets' shadows on their own mesh are shadows of faces met from behind; without them the picture is right."""
    drawings = [
        Group("bug", "shadow_ray_culled", "intersection", 1.0, "acne/sphere", (), seed, "tuning", ("box",), 64)
        for seed in SEEDS
    ]
    (found,) = expose(next(each for each in drawings if each.draw("beside") % 2))
    assert (found["word"], found["shows"]) == ("pass", False)


def test_a_finished_group_is_kept(tmp_path: Path) -> None:
    group = replace(groups(QUICK)[0])
    assert kept(group, tmp_path) is None
    (tmp_path / f"{group.key()}.json").write_text('[{"word": "pass"}]')

    def never(group: Group) -> list[Record]:
        raise AssertionError

    assert list(run([group], never, tmp_path)) == [[{"word": "pass"}]]


def test_a_gate_without_a_number_rejects() -> None:
    """An infinite picture has no mean in ICtCp; a rank of nan would make every area under a curve nan."""
    records = [{"severity": 2.0, "gates": {"mean": each}} for each in (float("nan"), 0.5, float("inf"))]
    assert scores(records, "mean") == [1e9, 0.5, 1e9]
    assert scores(records, OURS) == [2.0] * 3


def test_an_interrupted_bench_reports_what_there_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object) -> Iterator[list[Record]]:
        yield []
        raise KeyboardInterrupt

    for name, value in (("run", stopped), ("groups", lambda _: [1, 2, 3]), ("renderer_groups", lambda _: [4])):
        monkeypatch.setattr(f"notabug.bench.verdict.command.{name}", value)
    assert command(quick=True, as_json=True, out=tmp_path) == ExitCode.OK
    assert json.loads(capsys.readouterr().out)["groups"] == [1, 4]
    assert json.loads((tmp_path / "verdict.json").read_text())["groups"] == [1, 4]


def test_acne_under_a_wide_filter_is_named() -> None:
    """A Gaussian filter makes neighbours alike, as a blot does, but less."""
    far = (("camera_distance", "1e3"),)
    group = Group("limitation", "acne", "acne", 1.0, "acne/mirror", far, 2, "tuning", ("tent", "gaussian"), 96)
    assert [each["limitations"] for each in expose(group)] == [["acne"], ["acne"]]
