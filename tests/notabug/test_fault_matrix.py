"""The fault matrix: what a renderer can do wrong, what becomes of it, and that no other job is lost."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from notabug.adapters.config import renderer_tables
from notabug.adapters.configured import configured
from notabug.bench.faults_misdeeds import GOOD, LIMITS, with_good, wrong
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
AT_ONCE = 4  # jobs, most of which wait for a renderer that hangs until its time is up


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
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Result], Setting, float]:
    """One run over the misdeeds, with good scenes before, between and after; the seconds that it took."""
    setting = lay_out(tmp_path_factory.mktemp("matrix"), with_good(MISDEEDS), **{**LIMITS, "timeout": 8})
    begun = time.perf_counter()
    with Processes(AT_ONCE, 1) as workers:
        state = run(plan_for(setting, workers), Quiet())
    return {each.scene: each for each in state.results}, setting, time.perf_counter() - begun


@pytest.mark.parametrize("misdeed", MISDEEDS)
def test_a_misdeed_is_named(misdeed: str, results: tuple[dict[str, Result], Setting, float]) -> None:
    verdict = results[0][misdeed].verdict
    assert wrong(misdeed, verdict.word, verdict.message) == ""


def test_no_other_job_is_lost(
    results: tuple[dict[str, Result], Setting, float], capsys: pytest.CaptureFixture[str]
) -> None:
    found, _, seconds = results
    lost = [name for name in GOOD if found[name].verdict.word != "pass"]
    rows = [f"{'injected':<20} {'detected as':<100} other jobs lost"]
    for name in MISDEEDS:
        verdict = found[name].verdict
        said = f"{verdict.word}: {' '.join(verdict.message.split())}".rstrip(": ")
        rows.append(f"{name:<20} {said[:100]:<100} {len(lost)}")
    with capsys.disabled():
        print("\n" + "\n".join(rows) + f"\n{len(found)} jobs in {seconds:.1f} s")
    assert lost == []


def test_nothing_is_left_running(results: tuple[dict[str, Result], Setting, float]) -> None:
    notes = list(results[1].pictures.glob("daemon-*.pid"))
    assert len(notes) >= 3
    for note in notes:
        state = Path(f"/proc/{note.stem.removeprefix('daemon-')}/stat")
        assert not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] == "Z", note.read_text()


def test_what_filled_the_disk_is_gone(results: tuple[dict[str, Result], Setting, float]) -> None:
    assert sum(path.stat().st_size for path in results[1].out.rglob("*") if path.is_file()) < 32 << 20


def test_a_job_that_failed_is_tried_again_where_retries_are_set(tmp_path: Path) -> None:
    setting = lay_out(tmp_path, ["fails_once", "exits_with_3"], **{**LIMITS, "retries": 1})
    assert [each.verdict.word for each in run(plan_for(setting, Alone()), Quiet()).results] == ["pass", "error"]
