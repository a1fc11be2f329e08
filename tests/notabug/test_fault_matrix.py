"""The fault matrix: what a renderer can do wrong, what becomes of it, and that no other job is lost."""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

import pytest

from notabug.adapters.config import renderer_tables
from notabug.adapters.configured import configured
from notabug.bench.faults_misdeeds import GOOD, LIMITS, MATRIX, with_good, wrong
from notabug.bench.faults_setting import Setting, lay_out
from notabug.results.record import Result
from notabug.runs.plan import Plan
from notabug.runs.run import run
from notabug.runs.selection import choose
from notabug.runs.workers import Alone, Processes, Workers

pytestmark = pytest.mark.slow

MISDEEDS = (
    "hangs",
    "ignores_sigterm",
    "spins",
    "detaches",
    "detaches_and_draws",
    "detaches_and_hangs",
    "no_image",
    "stale_image",
    "linked_image",
    "links_the_folder_of_its_picture",
    "wrong_size",
    "truncated",
    "non_finite",
    "negative",
    "one_channel",
    "not_a_picture",
    "huge_header",
    "gigabyte",
    "fills_the_disk",
    "floods_the_log",
    "eats_memory",
    "crashes",
    "killed_half_way",
    "exits_with_3",
)
"""One of each kind; ``notabug bench faults`` takes all."""
PATIENT = {**LIMITS, "timeout": 60}  # for what ends at another limit, however busy the machine is
SHORT = {**LIMITS, "timeout": 6}  # for what is stopped when its time is up
AT_ONCE = 4  # jobs: what hangs does so beside each other


class Matrix(NamedTuple):
    """The results of the runs, where they were laid out, and the seconds that they took."""

    results: dict[str, Result]
    settings: tuple[Setting, ...]
    seconds: float


class Quiet:
    """A watcher that sees nothing."""

    def begin(self, jobs: int) -> None: ...
    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None: ...
    def done(self, result: Result, kept: bool) -> None: ...


def plan_for(setting: Setting, workers: Workers) -> Plan:
    (table,) = renderer_tables(setting.folder / "notabug.toml").values()
    wild = configured("wild", table, {})
    choices = choose([str(setting.folder / source) for source in setting.sources], {})
    return Plan(choices, {"wild": (wild, wild.find())}, setting.out, workers=workers)


@pytest.fixture(scope="module")
def matrix(tmp_path_factory: pytest.TempPathFactory) -> Matrix:
    """Runs over the misdeeds that hang and over the others, with good scenes before, between and after."""
    hanging = [name for name in MISDEEDS if MATRIX[name][1] == "its time limit"]
    others = [name for name in MISDEEDS if name not in hanging]
    assert len(hanging) > 1
    begun, found, settings = time.perf_counter(), {}, []
    for names, limits in ((hanging, SHORT), (others, PATIENT)):
        setting = lay_out(tmp_path_factory.mktemp("matrix"), with_good(names), **limits)
        with Processes(AT_ONCE, 1) as workers:
            state = run(plan_for(setting, workers), Quiet())
        lost = {name: each for name, each in found.items() if name in GOOD and each.verdict.word != "pass"}
        found |= {each.scene: each for each in state.results} | lost
        settings.append(setting)
    return Matrix(found, tuple(settings), time.perf_counter() - begun)


@pytest.mark.parametrize("misdeed", MISDEEDS)
def test_a_misdeed_is_named(misdeed: str, matrix: Matrix) -> None:
    verdict = matrix.results[misdeed].verdict
    assert wrong(misdeed, verdict.word, verdict.message) == ""


def test_no_other_job_is_lost(matrix: Matrix, capsys: pytest.CaptureFixture[str]) -> None:
    found, _, seconds = matrix
    lost = [name for name in GOOD if found[name].verdict.word != "pass"]
    rows = [f"{'injected':<20} {'detected as':<100} other jobs lost"]
    for name in MISDEEDS:
        verdict = found[name].verdict
        said = f"{verdict.word}: {' '.join(verdict.message.split())}".rstrip(": ")
        rows.append(f"{name:<20} {said[:100]:<100} {len(lost)}")
    with capsys.disabled():
        print("\n" + "\n".join(rows) + f"\n{len(found)} jobs in {seconds:.1f} s")
    assert lost == []


def test_nothing_is_left_running(matrix: Matrix) -> None:
    notes = [note for setting in matrix.settings for note in setting.pictures.glob("daemon-*.pid")]
    assert len(notes) >= 3
    for note in notes:
        state = Path(f"/proc/{note.stem.removeprefix('daemon-')}/stat")
        assert not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] == "Z", note.read_text()


def test_what_filled_the_disk_is_gone(matrix: Matrix) -> None:
    for setting in matrix.settings:
        assert sum(path.stat().st_size for path in setting.out.rglob("*") if path.is_file()) < 32 << 20


def test_a_job_that_failed_is_tried_again_where_retries_are_set(tmp_path: Path) -> None:
    setting = lay_out(tmp_path, ["fails_once", "exits_with_3"], **{**LIMITS, "retries": 1})
    assert [each.verdict.word for each in run(plan_for(setting, Alone()), Quiet()).results] == ["pass", "error"]
