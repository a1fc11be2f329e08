"""Workarounds: each reduces its artifact, each caveat shows, and the command says so."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from notabug.adapters.base import Adapter, Quality
from notabug.adapters.inhouse import InHouse
from notabug.adapters.zbuffer import ZBuffer
from notabug.bench.generality.jobs import sized
from notabug.metrics.verdict import Finding, Leg, Verdict
from notabug.references.workarounds.workaround import Workaround, workarounds
from notabug.runs.plan import Plan
from notabug.runs.run import run
from notabug.runs.selection import Choice
from notabug.runs.workarounds import Row, choices, chosen, rows
from notabug.scenes_usd.card import CLASSES
from notabug.scenes_usd.catalogue import entry
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.reader import read_scene

PAPER = {
    *("epsilon", "reverse_ray_refinement", "snyder_barr_offset", "finer_tessellation", "evenly_sized_cells"),
    *("evenly_spaced_facets", "raised_surfaces", "same_triangles", "consistent_winner", "near_plane", "subdivision"),
    *("c1_interpolation", "uv_aware_simplification", "matched_exponent"),
}
EVERY = list(workarounds())
SIDE = 64  # pixels
CHEAP = [x for x in EVERY if x.limits and x.name != "c1_interpolation"]
OTHERS = {"near_plane": ZBuffer(), "shadow_bias": ZBuffer(name="shadowmap", as_lit=True)}  # not of the tracer


class Silent:
    """A watcher that looks away."""

    def begin(self, jobs: int) -> None: ...
    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None: ...
    def done(self, result: Any, kept: bool) -> None: ...


def small(selected: list[Workaround]) -> list[Choice]:
    """The choices of ``selected`` with pictures of a quarter of the pixels: what is asked holds at every size."""
    return [
        replace(choice, scene=sized(read_scene(choice.source, choice.variants), SIDE)) for choice in choices(selected)
    ]


@pytest.fixture(scope="module")
def row(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Workaround], Row]:
    """The row of a workaround on an in-house renderer; pictures that workarounds share are drawn once."""
    out = tmp_path_factory.mktemp("workarounds")
    made: dict[str, Row] = {}

    def one(workaround: Workaround) -> Row:
        if workaround.name not in made:
            adapter: Adapter = OTHERS.get(workaround.name, InHouse())
            plan = Plan(small([workaround]), {adapter.name: (adapter, adapter.find())}, out, Quality())
            (made[workaround.name],) = rows([workaround], run(plan, Silent()).results)
        return made[workaround.name]

    return one


def test_every_workaround_of_the_paper_is_there_and_well_formed() -> None:
    names = [each.name for each in EVERY]
    assert set(names) >= PAPER
    assert len(names) == len(set(names))
    for each in EVERY:
        assert each.artifact_class in CLASSES
        assert each.reduces
        for setting in each.settings:
            known = entry(setting.scene).variants
            assert all(value in known[name] for name, value in setting.variants.items()), setting


@pytest.mark.parametrize("workaround", EVERY, ids=lambda each: each.name)
def test_it_reduces_its_artifact(row: Callable[[Workaround], Row], workaround: Workaround) -> None:
    found = row(workaround)
    assert found.shown, [each.name for each in found.before.result.verdict.findings]
    assert found.reduced, (found.before.as_dict(), found.after.as_dict())
    assert found.after.area < 0.8 * found.before.area


@pytest.mark.parametrize("workaround", CHEAP, ids=lambda each: each.name)
def test_its_caveat_shows(row: Callable[[Workaround], Row], workaround: Workaround) -> None:
    """In-house float64 resolves a gap of 1e-6: there the limit that is too small is no limit."""
    found = row(workaround)
    assert len(found.limits) == len(workaround.limits)
    for limit in found.limits:
        if limit.setting.variants.get("gap") != "1e-6":
            assert limit.area > found.after.area, limit.as_dict()


def test_a_simplified_mesh_is_never_the_whole_one(row: Callable[[Workaround], Row]) -> None:
    """The caveat of simplification with regard to uv, which the setting with the workaround shows itself."""
    assert row(next(each for each in EVERY if each.name == "uv_aware_simplification")).after.area > 0


def test_finer_facets_cost_what_they_gain_squared(row: Callable[[Workaround], Row]) -> None:
    """The caveat of tessellation: 36 times the facets, a sixth of the area (within the scatter of the outline)."""
    found = row(next(each for each in EVERY if each.name == "finer_tessellation"))
    assert found.after.facets / found.before.facets > 30
    assert 4 < found.before.area / found.after.area < 8


def test_words_name_workarounds_scenes_and_classes() -> None:
    assert [each.name for each in chosen([])] == [each.name for each in EVERY]
    assert [each.name for each in chosen(["near_plane"])] == ["near_plane"]
    assert {each.artifact_class for each in chosen(["texture"])} == {"texture"}
    assert "snyder_barr_offset" in {each.name for each in chosen(["terminator/bowl"])}
    with pytest.raises(SelectionError, match="no workaround"):
        chosen(["nothing"])


def _facets(area: float) -> Verdict:
    finding = Finding("limitation", "facet_self_shadow", area, (0, 0, 9, 9), jnd=2.0)
    return Verdict("limitation", (finding,), {"limitation": Leg(9, area / 1000), "bug": Leg()})


def test_the_command_prints_and_records_before_and_after(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    judge = door.judge
    fine = {"tessellation": "96x48"}

    def by_variant(pictures: Any, scene: Any, declaration: Any, **options: Any) -> Any:
        judge.verdicts[scene.id] = _facets(5.0 if scene.variants == fine else 50.0)
        return judge(pictures, scene, declaration, **options)

    monkeypatch.setattr("notabug.runs.judge_files.judge", by_variant)
    assert door.run("--workarounds", "finer_tessellation") == 0
    assert "reduced" in door.stdout
    (found,) = json.loads((door.out / "run.json").read_text())["workarounds"]
    assert (found["workaround"], found["renderer"], found["outcome"]) == ("finer_tessellation", "grey", "reduced")
    assert (found["before"]["area_px"], found["after"]["area_px"]) == (50.0, 5.0)
    assert door.run("--workarounds", "finer_tessellation", "--json") == 0
    assert json.loads(door.stdout)["workarounds"] == [found]


def test_a_workaround_that_does_not_work_fails_the_run(door: Any) -> None:
    door.judge.verdicts["terminator/sphere"] = _facets(50.0)
    assert door.run("--workarounds", "finer_tessellation") == 1
    assert "not reduced" in door.stdout


def test_variants_are_the_workarounds_own(door: Any) -> None:
    assert door.run("--workarounds", "--variant", "tessellation=8x4") == 2
    assert "themselves" in door.stderr


def test_the_list_names_the_class_served(door: Any) -> None:
    assert door("list", "workarounds", "--json") == 0
    listed = json.loads(door.stdout)["workarounds"]
    assert {each["workaround"]: each["class"] for each in listed} == {x.name: x.artifact_class for x in EVERY}
