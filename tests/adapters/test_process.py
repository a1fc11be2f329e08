"""Children that misbehave."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import psutil
import pytest

from notabug.adapters import trees
from notabug.adapters.base import RendererError
from notabug.adapters.process import LOG_BYTES, Ended, Limits, made_picture, run_child
from notabug.adapters.process_tree import MARK, Tree, adopt_orphans


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


LEAVES = """
import os, subprocess, sys, time
sleeper = [sys.executable, "-S", "-c", "import time; time.sleep(3600)"]
def note(pid):
    with open("pids", "a") as file:
        file.write(f"{pid}\\n")
"""
WAYS = {
    "an empty environment": "note(subprocess.Popen(sleeper, env={}, start_new_session=True).pid)",
    "two forks": """
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        note(os.getpid())
        os.execve(sys.executable, sleeper, {})
    os._exit(0)
os.wait()
time.sleep(0.1)
""",
    "a shell": """
subprocess.run(["sh", "-c", "env -i setsid sh -c 'echo $$ >> pids; exec sleep 3600' & sleep 0.2"])
""",
    "without its keeper": """
note(subprocess.Popen(sleeper, start_new_session=True).pid)
os.kill(os.getppid(), 9)
time.sleep(3600)
""",
}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs a reaper of orphans")
@pytest.mark.parametrize("how", WAYS)
def test_nothing_outlives_a_job_however_it_detached(how: str, tmp_path: Path) -> None:
    run(LEAVES + WAYS[how], tmp_path)
    pids = [int(each) for each in (tmp_path / "pids").read_text().split()]
    assert pids
    assert all(is_gone(each) for each in pids)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs a reaper of orphans")
@pytest.mark.parametrize("ending", [signal.SIGTERM, signal.SIGKILL, signal.SIGINT])
@pytest.mark.parametrize("how", ["an empty environment", "two forks"])
def test_a_renderer_ends_with_whoever_started_it(ending: signal.Signals, how: str, tmp_path: Path) -> None:
    program = f"{LEAVES}{WAYS[how]}\nnote(os.getpid())\nopen('ready', 'w').close()\ntime.sleep(3600)"
    # a shell that starts the tests in the background lets its children ignore SIGINT
    code = f"""
import signal, sys
from pathlib import Path
from notabug.adapters.process import run_child
signal.signal(signal.SIGINT, signal.default_int_handler)
run_child([sys.executable, "-c", {program!r}], where="trial", folder=Path({str(tmp_path)!r}), timeout=600.0)
"""
    parent = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
    for _ in range(6000):
        if (tmp_path / "ready").exists():
            break
        time.sleep(0.01)
    parent.send_signal(ending)
    parent.wait()
    pids = [int(each) for each in (tmp_path / "pids").read_text().split()]
    assert len(pids) == 2
    for _ in range(1000):
        if all(is_gone(each) for each in pids):
            break
        time.sleep(0.01)
    assert all(is_gone(each) for each in pids)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs a reaper of orphans")
def test_no_zombie_is_left(tmp_path: Path) -> None:
    before = {each.pid for each in psutil.Process().children(recursive=True)}  # of parents that the test above killed
    run("import os\nfor _ in range(100):\n if os.fork() == 0: os._exit(0)", tmp_path)
    run("import os\nfor _ in range(100):\n if os.fork() == 0:\n  os.setsid()\n  os._exit(0)", tmp_path)
    (tmp_path / "pids").touch()
    run(LEAVES + WAYS["without its keeper"], tmp_path)

    def left() -> list[psutil.Process]:
        return [each for each in psutil.Process().children(recursive=True) if each.pid not in before]

    for _ in range(500):  # what was killed may take a moment to end; nobody waits for a zombie, so it would stay
        if not left():
            break
        time.sleep(0.02)
    assert not left()


def test_output_in_nested_folders_counts(tmp_path: Path) -> None:
    code = """
import os
for _ in range(20):
    os.mkdir("in"); os.chdir("in")
open("big", "wb").write(bytes(4 << 20))
"""
    ended = run_child(
        [sys.executable, "-c", code], where="trial", folder=tmp_path, timeout=60.0, limits=Limits(output=3 << 20)
    )
    assert ended.stopped == "output"


@pytest.mark.parametrize("what", ["nested", "many", "unread"])
def test_output_that_cannot_be_counted_is_too_much(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trees, "MOST", 200)
    (tmp_path / "few").mkdir()
    assert trees.size(tmp_path, 1 << 20) <= 1 << 20
    if what == "many":
        for index in range(300):
            (tmp_path / "few" / str(index)).touch()
    elif what == "nested":
        nest(tmp_path / "few", 3000)
    else:
        real = os.scandir

        def refused(path: Any) -> Any:
            if str(path).endswith("few"):
                raise PermissionError(13, "Permission denied", str(path))
            return real(path)

        monkeypatch.setattr("os.scandir", refused)
    assert trees.size(tmp_path, 1 << 20) > 1 << 20
    monkeypatch.undo()
    trees.empty(tmp_path)
    assert not list(tmp_path.iterdir())


def nest(folder: Path, depth: int) -> None:
    """``depth`` folders, each in the one before: too deep for any path."""
    opened = os.open(folder, os.O_RDONLY)
    for _ in range(depth):
        os.mkdir("in", dir_fd=opened)
        inner = os.open("in", os.O_RDONLY, dir_fd=opened)
        os.close(opened)
        opened = inner
    os.close(opened)


def test_removing_follows_no_link(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "file").write_text("mine")
    (tmp_path / "job" / "in").mkdir(parents=True)
    (tmp_path / "job" / "in" / "link").symlink_to(tmp_path / "mine")
    (tmp_path / "job" / "link").symlink_to(tmp_path / "mine")
    (tmp_path / "job" / "kept").touch()
    trees.empty(tmp_path / "job", frozenset({"kept"}))
    assert [each.name for each in (tmp_path / "job").iterdir()] == ["kept"]
    assert (tmp_path / "mine" / "file").read_text() == "mine"
    (tmp_path / "run").symlink_to(tmp_path / "mine")
    trees.remove(tmp_path / "run")
    assert (tmp_path / "mine" / "file").is_file()


def test_making_a_folder_takes_links_and_files_out_of_its_way(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "a").symlink_to(tmp_path / "mine")
    trees.make(tmp_path / "run" / "a" / "b", tmp_path / "run")
    (tmp_path / "run" / "a" / "c").write_text("a file")
    trees.make(tmp_path / "run" / "a" / "c" / "d", tmp_path / "run")
    assert (tmp_path / "run" / "a" / "c" / "d").is_dir()
    assert not list((tmp_path / "mine").iterdir())


def test_a_renderer_that_replaces_a_folder_of_the_run_is_told_so(tmp_path: Path) -> None:
    job = tmp_path / "renders" / "job"
    job.mkdir(parents=True)
    (tmp_path / "mine").mkdir()
    code = f"import os; os.rename('{tmp_path}/renders', '{tmp_path}/away'); os.symlink('mine', '{tmp_path}/renders')"
    with pytest.raises(RendererError, match="replaced a folder of the run"):
        run(code, job)


@pytest.mark.skipif(not Path(f"/proc/self/task/{os.getpid()}/children").exists(), reason="the kernel has no such list")
def test_a_quick_look_sees_the_same_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Children, their children, one that a thread has started, and one that an interpreter left behind."""
    adopt_orphans()
    tree = Tree()
    environment = {**os.environ, MARK: tree.mark}
    sleeps = "import time; time.sleep(60)"
    starts = f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {sleeps!r}]); "
    started: list[subprocess.Popen[bytes]] = []

    def start(program: str) -> None:
        started.append(subprocess.Popen([sys.executable, "-c", program], env=environment))

    start(starts + sleeps)
    start(starts)  # its child is left to this process
    thread = threading.Thread(target=start, args=(sleeps,))
    thread.start()
    thread.join()
    tree.root = started[0].pid
    started[1].wait()
    try:
        end = time.monotonic() + 60.0
        while len(exact := {each.pid for each in tree.members()}) < 4 and time.monotonic() < end:
            time.sleep(0.05)
        fresh = Tree(mark=tree.mark, root=tree.root)
        assert len(exact) == 4
        assert {each.pid for each in fresh.members(quickly=True)} == exact
        monkeypatch.setattr("notabug.adapters.process_tree._lists_children", lambda: False)
        assert {each.pid for each in Tree(mark=tree.mark, root=tree.root).members(quickly=True)} == exact
    finally:
        tree.kill()
        for child in started:
            child.kill()
            child.wait()
