"""Children that misbehave."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

from notabug.adapters.base import RendererError
from notabug.adapters.process import LOG_BYTES, Ended, made_picture, run_child


def run(code: str, folder: Path, timeout: float = 60.0, **environment: str) -> Ended:
    return run_child(
        [sys.executable, "-c", code], where="trial", folder=folder, timeout=timeout, environment=environment
    )


def is_gone(pid: int) -> bool:
    """Whether the process has ended; one that nobody has waited for yet counts as ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


def test_log_holds_both_streams_and_the_child_runs_in_its_folder(tmp_path: Path) -> None:
    code = "import os, sys; print(os.getcwd(), flush=True); print(os.environ['GIVEN'], file=sys.stderr)"
    ended = run(code, tmp_path, GIVEN="a value; $(touch bad)")
    assert ended.check("trial") is ended
    assert ended.log.split("\n") == [str(tmp_path.resolve()), "a value; $(touch bad)", ""]
    assert not list(tmp_path.iterdir())


def test_exit_code_becomes_an_error_with_the_end_of_the_log(tmp_path: Path) -> None:
    ended = run("print('first\\n' * 100 + 'the reason'); raise SystemExit(7)", tmp_path)
    with pytest.raises(RendererError, match=r"adapter 'trial'.*exit code 7(.|\n)*the reason") as error:
        ended.check("trial")
    assert str(error.value).count("first") < 20
    assert error.value.log.count("first") == 100


def test_abort_is_named(tmp_path: Path) -> None:
    with pytest.raises(RendererError, match="SIGABRT"):
        run("import os; os.abort()", tmp_path).check("trial")


def test_child_that_never_ends_is_stopped(tmp_path: Path) -> None:
    ended = run("print('begun', flush=True)\nwhile True: pass", tmp_path, timeout=1.0)
    assert ended.timed_out
    with pytest.raises(RendererError, match=r"its time limit; raise the time limit"):
        ended.check("trial")


def test_children_of_the_child_end_with_it(tmp_path: Path) -> None:
    ended = run_child(["sh", "-c", "sleep 1000 & echo $!"], where="trial", folder=tmp_path, timeout=60.0)
    ended.check("trial")
    for _ in range(200):
        if is_gone(int(ended.log)):
            break
        time.sleep(0.01)
    assert is_gone(int(ended.log))


def test_endless_output_keeps_only_its_end(tmp_path: Path) -> None:
    ended = run(f"print('x' * {LOG_BYTES * 50}); print('end')", tmp_path)
    assert len(ended.log) <= LOG_BYTES
    assert ended.log.endswith("x\nend\n")


def test_output_that_is_no_text_is_kept_readable(tmp_path: Path) -> None:
    assert run("import os; os.write(1, b'\\xff\\xfe ok')", tmp_path).log.endswith(" ok")


def test_program_that_cannot_start(tmp_path: Path) -> None:
    (tmp_path / "data").write_text("no program")
    with pytest.raises(RendererError, match="cannot start"):
        run_child([str(tmp_path / "data")], where="trial", folder=tmp_path, timeout=1.0)


def test_picture_that_was_not_made(tmp_path: Path) -> None:
    with pytest.raises(RendererError, match="left no picture"):
        made_picture(tmp_path / "none.png", where="trial", log="")
    (tmp_path / "empty.png").touch()
    with pytest.raises(RendererError, match="left no picture"):
        made_picture(tmp_path / "empty.png", where="trial", log="")


def test_child_reads_no_terminal(tmp_path: Path) -> None:
    assert run("import sys; print(repr(sys.stdin.read()))", tmp_path).log == "''\n"
    assert os.getpid() != 0
