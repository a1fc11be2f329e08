"""The fault matrix: what a renderer can do wrong, what becomes of it, and that no other job is lost."""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from notabug.adapters.config import renderer_tables
from notabug.adapters.configured import configured
from notabug.adapters.export.formats import write_pfm
from notabug.record import Result
from notabug.references.predict import predict
from notabug.run import Plan, run
from notabug.scenes_usd.reader import find, read_scene
from notabug.selection import choose

pytestmark = pytest.mark.slow

PROGRAM = Path(__file__).with_name("misbehaving.py")

MATRIX = {
    "hangs": ("error", "its time limit"),
    "ignores_sigterm": ("error", "its time limit"),
    "spins": ("error", "its limit of processor time"),
    "detaches": ("error", "left no picture"),
    "detaches_and_draws": ("pass", ""),
    "detaches_and_hangs": ("error", "its time limit"),
    "no_image": ("error", "left no picture"),
    "stale_image": ("error", "older than the job"),
    "linked_image": ("error", "a link to another file"),
    "wrong_size": ("error", "the picture is 4 x 4, expected is 32 x 32"),
    "truncated": ("error", "damaged or truncated|cannot be read"),
    "non_finite": ("bug", "NaN or infinite"),
    "negative": ("bug", "negative"),
    "one_channel": ("error", "1 channels"),
    "not_a_picture": ("error", "cannot be read"),
    "huge_header": ("error", "cannot be read"),
    "gigabyte": ("error", "its output limit"),
    "fills_the_disk": ("error", "its output limit"),
    "floods_the_log": ("error", "exit code 1"),
    "eats_memory": ("error", "its memory limit"),
    "crashes": ("error", "SIGSEGV"),
    "killed_half_way": ("error", "SIGKILL"),
    "exits_with_3": ("error", "exit code 3"),
}
CONFIG = """
[renderers.wild]
command = ["{python}", "-S", "-E", "{program}", "{{scene}}", "{{image}}", "{{folder}}/pictures"]
image = "pfm"
filter = "point"
capabilities = ["mesh", "distant_light", "shadows"]
timeout = 4
cpu = 1
memory = "400 MiB"
output = "48 MiB"
retries = {retries}
"""
GOOD = ("good", "also_good", "good_too")


class Quiet:
    """A watcher that sees nothing."""

    def begin(self, jobs: int) -> None: ...
    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None: ...
    def done(self, result: Result, kept: bool) -> None: ...


def a_scene(path: Path) -> None:
    """The plain card at 32 x 32 under another name, so that a job is quick."""
    text = find("calibration/plain_card").read_text(encoding="utf-8").replace("(256, 256)", "(32, 32)")
    path.write_text(text, encoding="utf-8")


def lay_out(here: Path, names: list[str], retries: int) -> tuple[Plan, Path]:
    """Scenes called ``names``, the pictures that they should give, and the plan to draw them with the wild renderer."""
    pictures = here / "pictures"
    pictures.mkdir()
    for name in names:
        a_scene(here / f"{name}.usda")
    small = predict(read_scene(here / f"{names[0]}.usda")).point.astype(np.float64)
    for name in names:
        write_pfm(pictures / f"{name}.pfm", small)
    card = predict(read_scene("calibration/plain_card")).point.astype(np.float64)
    write_pfm(pictures / "calibration-plain_card.pfm", card)
    (here / "notabug.toml").write_text(CONFIG.format(python=sys.executable, program=PROGRAM, retries=retries))
    (table,) = renderer_tables(here / "notabug.toml").values()
    wild = configured("wild", table, {})
    choices = choose([str(here / f"{name}.usda") for name in names], {})
    return Plan(choices, {"wild": (wild, wild.find())}, here / "out"), pictures


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Result], Path, float]:
    """One run over every misdeed, with good scenes before, between and after; the seconds that it took."""
    here = tmp_path_factory.mktemp("matrix")
    misdeeds = list(MATRIX)
    half = len(misdeeds) // 2
    plan, pictures = lay_out(here, [GOOD[0], *misdeeds[:half], GOOD[1], *misdeeds[half:], GOOD[2]], retries=0)
    begun = time.perf_counter()
    state = run(plan, Quiet())
    return {each.scene: each for each in state.results}, pictures, time.perf_counter() - begun


@pytest.mark.parametrize("misdeed", MATRIX)
def test_a_misdeed_is_named(misdeed: str, results: tuple[dict[str, Result], Path, float]) -> None:
    verdict = results[0][misdeed].verdict
    word, message = MATRIX[misdeed]
    assert verdict.word == word, verdict.message
    assert re.search(message, verdict.message)


def test_no_other_job_is_lost(
    results: tuple[dict[str, Result], Path, float], capsys: pytest.CaptureFixture[str]
) -> None:
    found, _, seconds = results
    lost = [name for name in GOOD if found[name].verdict.word != "pass"]
    rows = [f"{'injected':<20} {'detected as':<100} other jobs lost"]
    for name in MATRIX:
        verdict = found[name].verdict
        said = f"{verdict.word}: {' '.join(verdict.message.split())}".rstrip(": ")
        rows.append(f"{name:<20} {said[:100]:<100} {len(lost)}")
    with capsys.disabled():
        print("\n" + "\n".join(rows) + f"\n{len(found)} jobs in {seconds:.1f} s")
    assert lost == []


def test_nothing_is_left_running(results: tuple[dict[str, Result], Path, float]) -> None:
    notes = list(results[1].glob("daemon-*.pid"))
    assert len(notes) >= 3
    for note in notes:
        state = Path(f"/proc/{note.stem.removeprefix('daemon-')}/stat")
        assert not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] == "Z", note.read_text()


def test_what_filled_the_disk_is_gone(results: tuple[dict[str, Result], Path, float]) -> None:
    out = results[1].parent / "out"
    assert sum(path.stat().st_size for path in out.rglob("*") if path.is_file()) < 32 << 20


def test_a_job_that_failed_is_tried_again_where_retries_are_set(tmp_path: Path) -> None:
    plan, _ = lay_out(tmp_path, ["fails_once", "exits_with_3"], retries=1)
    assert [each.verdict.word for each in run(plan, Quiet()).results] == ["pass", "error"]
