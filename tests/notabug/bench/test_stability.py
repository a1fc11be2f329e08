"""Sweeps: kinds of failure on made-up pictures, the search for the onset, and our own renderers against theory."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Declaration, Found, RendererError, UnsupportedError
from notabug.bench import stability_scenes as stages
from notabug.bench.stability import FINE, Bench, Course, course, measure
from notabug.bench.stability_contestants import EPSILON, Contestant, contestants
from notabug.bench.stability_kinds import Truth, kinds, truth, wrong
from notabug.bench.stability_sweeps import SWEEPS
from notabug.bench.stability_theory import UNIT, Arithmetic
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
SIDE = 64
EXACT = Declaration("float64", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return replace(stages.still_life(), width=SIDE, height=SIDE)


@pytest.fixture(scope="module")
def right(scene: Scene) -> Truth:
    return truth(scene)


def drawn(scene: Scene, shadows: str = "facets") -> Floats:
    return trace_picture(scene, Options(shadows=shadows), threads=1)  # type: ignore[arg-type]


def most(picture: Floats, seen: Floats, of: Truth) -> str:
    found = kinds(picture, seen, of, EXACT)
    return max(found, key=lambda each: found[each])


def test_the_right_picture_has_no_wrong_pixel(scene: Scene, right: Truth) -> None:
    picture, seen = drawn(scene), drawn(stages.headlit(scene))
    assert not wrong(picture, right.lit, EXACT).any()
    assert kinds(picture, seen, right, EXACT) == {}


def test_a_value_beyond_the_tolerance_is_wrong(scene: Scene, right: Truth) -> None:
    assert wrong(drawn(scene) * 1.02, right.lit, EXACT).mean() > 0.3


def test_kinds_of_failure(scene: Scene, right: Truth) -> None:
    picture, seen = drawn(scene), drawn(stages.headlit(scene))
    noise = np.random.default_rng(1).random((SIDE, SIDE, 1)) < 0.4
    assert most(np.where(noise, 0.0, picture), seen, right) == "acne"
    assert most(drawn(scene, "none"), seen, right) == "lost shadow"
    assert most(np.where(noise, np.nan, picture), seen, right) == "non-finite"
    assert most(np.where(noise, 0.0, picture), np.where(noise, 0.0, seen), right) == "hole"
    assert most(picture * 0.9, seen * 0.9, right) in ("wrong shade", "displaced outline")
    assert kinds(picture * 0.9, seen, right, EXACT).keys() == {"wrong shade"}
    less = replace(scene, objects=scene.objects[:1] + scene.objects[2:])
    found = kinds(drawn(less), drawn(stages.headlit(less)), right, EXACT)
    assert "lost object" in found


def test_a_moved_shadow_is_displaced_not_lost(scene: Scene, right: Truth) -> None:
    reached = (right.lit.point > 0.5 * right.unshadowed).any(axis=2)
    picture = right.unshadowed * np.roll(reached, 2, axis=1)[..., None]
    assert most(picture, drawn(stages.headlit(scene)), right) == "displaced shadow"


def test_fighting_sheets_are_stripes() -> None:
    scene = replace(stages.near_gap(1e-7), width=SIDE, height=SIDE)
    of = truth(scene)
    below = replace(scene, objects=scene.objects[:1])
    fight = (np.indices((SIDE, SIDE)).sum(axis=0) % 2 == 0)[..., None]
    picture = np.where(fight, drawn(scene), drawn(below))
    seen = np.where(fight, drawn(stages.headlit(scene)), drawn(stages.headlit(below)))
    assert most(picture, seen, of) == "stripes"
    assert most(drawn(below), drawn(stages.headlit(below)), of) == "lost object"


@dataclass
class Breaking:
    """Draws right up to ``limit``, and black beyond it."""

    limit: float
    drawn: list[float] = field(default_factory=list)

    def draw(self, scene: Scene) -> Floats:
        distance = float(np.linalg.norm(scene.camera.to_world[3, :3] - scene.meshes.__next__().points.mean(axis=0)))
        self.drawn.append(distance)
        return drawn(scene) * (distance < self.limit)


def entrant(draw: Callable[[Scene], Floats], **more: object) -> Contestant:
    values = {"arithmetic": Arithmetic(UNIT["float32"], UNIT["float32"])} | more
    return Contestant("fake", "1", declaration=EXACT, draw=draw, **values)  # type: ignore[arg-type]


@pytest.mark.parametrize("limit", [3e2, 8e4])
def test_the_onset_is_bisected_to_a_factor_of_two(limit: float, tmp_path: Path) -> None:
    found = course(Bench(tmp_path, side=16), SWEEPS["far_camera"], entrant(Breaking(limit).draw))
    assert found.onset is not None
    assert limit / FINE / 1.05 <= found.onset <= limit * FINE * 1.05
    assert found.kind in ("hole", "lost object")


def test_a_renderer_that_never_breaks_has_no_onset(tmp_path: Path) -> None:
    found = course(Bench(tmp_path, side=16), SWEEPS["far_camera"], entrant(Breaking(math.inf).draw), quick=True)
    assert (found.onset, found.kind) == (None, "")


def test_one_that_is_wrong_from_the_start_breaks_there(tmp_path: Path) -> None:
    found = course(Bench(tmp_path, side=16), SWEEPS["far_camera"], entrant(Breaking(0.0).draw))
    assert found.onset == stages.DISTANCE


def test_one_that_fails_is_reported_not_raised(tmp_path: Path) -> None:
    def fail(_: Scene) -> Floats:
        raise RendererError("out of memory")

    found = course(Bench(tmp_path, side=16), SWEEPS["gap"], entrant(fail), quick=True)
    assert (found.kind, found.points[0].message) == ("refused", "out of memory")


def test_a_stopped_sweep_goes_on_where_it_stopped(tmp_path: Path) -> None:
    first, second = Breaking(1e3), Breaking(1e3)
    a = course(Bench(tmp_path, side=16), SWEEPS["far_camera"], entrant(first.draw))
    b = course(Bench(tmp_path, side=16), SWEEPS["far_camera"], entrant(second.draw))
    assert a == b
    assert len(first.drawn) > 3
    assert second.drawn == []
    course(Bench(tmp_path, side=16, resume=False), SWEEPS["far_camera"], entrant(second.draw))
    assert second.drawn == first.drawn


def test_whatever_is_installed_takes_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """Panda3D cannot, which interpolates colours, nor LuxCore, which does not draw pixel centres."""
    from notabug.adapters.registry import adapters

    known = set(adapters()) - {"inhouse", "zbuffer", "shadowmap", "panda3d", "luxcore"}
    for each in known:
        monkeypatch.setattr(type(adapters()[each]), "find", lambda adapter: Found("1", f"where {adapter.name} is"))
    entrants = contestants()
    assert known <= {each.name for each in entrants}
    assert {each.declaration.filter for each in entrants} == {"point"}


@pytest.mark.parametrize(("name", "drawn"), [("vtk", True), ("tachyon", True), ("pygfx", False), ("babylon", False)])
def test_a_lobe_of_its_own_is_no_failure(monkeypatch: pytest.MonkeyPatch, name: str, drawn: bool) -> None:
    """A renderer with another lobe is not wrong at every exponent: it does not take part in that sweep."""
    from notabug.adapters.registry import adapters

    each = adapters()[name]
    monkeypatch.setattr(type(each), "find", lambda adapter: Found("1", f"where {adapter.name} is"))
    (entrant,) = (contestant for contestant in contestants() if contestant.name == name)
    monkeypatch.setattr(type(each), "render", lambda *given: pytest.fail("drawn"))
    with pytest.raises(pytest.fail.Exception if drawn else UnsupportedError):
        entrant.draw(SWEEPS["exponent"].scene(10.0))
    with pytest.raises(pytest.fail.Exception):
        entrant.draw(SWEEPS["offset"].scene(1.0))


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], Course]:
    """Our own renderers on the sweeps whose onset is known."""
    bench = Bench(tmp_path_factory.mktemp("stability"), side=SIDE)
    entrants = [each for each in contestants() if each.name.startswith(("inhouse", "zbuffer"))]
    sweeps = [SWEEPS[name] for name in ("far_camera", "offset", "gap", "near_plane")]
    return {(each.sweep, each.renderer): each for each in measure(bench, sweeps, entrants)}


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize(
    ("sweep", "renderer", "kind"),
    [
        ("far_camera", f"inhouse {{}}, epsilon {EPSILON:g}", "acne"),
        ("offset", f"inhouse {{}}, epsilon {EPSILON:g}", "acne"),
        ("far_camera", "inhouse {}", ""),
        ("offset", "inhouse {}", ""),
        ("near_plane", "zbuffer {}", "stripes"),
        ("gap", "zbuffer {}", "stripes"),
        ("gap", "inhouse {}", "stripes"),
    ],
)
def test_our_onsets_lie_within_a_decade_of_theory(
    ours: dict[tuple[str, str], Course], sweep: str, renderer: str, kind: str, precision: str
) -> None:
    found = ours[sweep, renderer.format(precision)]
    assert found.decades_off is not None
    assert abs(found.decades_off) <= 1.0
    assert kind in ("", found.kind)


@pytest.mark.slow
def test_a_ray_tracer_does_not_see_the_near_plane(ours: dict[tuple[str, str], Course]) -> None:
    assert ours["near_plane", "inhouse float32"].onset is None


def test_theory_of_double_precision_is_nine_decades_away() -> None:
    single, double = (Arithmetic(UNIT[each], UNIT[each]) for each in ("float32", "float64"))
    for name in ("far_camera", "offset", "gap", "exponent", "uv_magnitude"):
        apart = math.log10(SWEEPS[name].predicted(double) / SWEEPS[name].predicted(single))
        assert abs(apart) == pytest.approx(math.log10(2.0**29), abs=0.01)
