"""What a process that is killed cannot tidy up: its temporary folders, and the processes that work for it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from notabug.scenes_usd.temporary import remove_left, temporary_folder


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for temporary files."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_a_folder_is_gone_afterwards(place: Path) -> None:
    with temporary_folder() as folder:
        (folder / "in").mkdir()
        remove_left()  # as another process would: it is held
        assert folder.parent == place
        assert (folder / "in").is_dir()
    assert not list(place.iterdir())
    with pytest.raises(ZeroDivisionError), temporary_folder():
        raise ZeroDivisionError
    assert not list(place.iterdir())


def test_where_nothing_can_be_held_nothing_is_removed_by_others(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*_: object) -> None:
        raise OSError("no locks here")

    with monkeypatch.context() as patch:
        patch.setattr("fcntl.flock", refuses)
        manager = temporary_folder()
        folder = manager.__enter__()
    os.utime(folder, (time.time() - 3600.0,) * 2)
    remove_left()
    assert folder.is_dir()
    manager.__exit__(None, None, None)
    assert not list(place.iterdir())


HOLDS = """
import tempfile, time
from notabug.scenes_usd.temporary import temporary_folder
tempfile.tempdir = {place!r}
with temporary_folder() as folder:
    (folder / "file").touch()
    print(folder, flush=True)
    time.sleep(3600)
"""


def test_what_a_killed_process_left_is_removed_by_the_next_and_what_is_held_is_not(place: Path) -> None:
    words = [sys.executable, "-c", HOLDS.format(place=str(place))]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        folder = Path(holder.stdout.readline().strip())
        with temporary_folder():
            assert (folder / "file").is_file()
        holder.kill()
    assert (folder / "file").is_file()
    with temporary_folder():
        assert not folder.exists()


def test_only_what_is_ours_is_removed(place: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    outside = tmp_path_factory.mktemp("outside")
    (outside / "mine").touch()
    (place / "notabug-held-link").symlink_to(outside)
    (place / "notabug-held-file").touch()
    (place / "notabug-new-young").mkdir()
    (place / "notabug-new-old").mkdir()
    os.utime(place / "notabug-new-old", (time.time() - 3600.0,) * 2)
    (place / "notabug-others").mkdir()
    remove_left()
    assert {path.name for path in place.iterdir()} == {
        "notabug-held-link",
        "notabug-held-file",
        "notabug-new-young",
        "notabug-others",
    }
    assert (outside / "mine").is_file()


STARTS = """
import os, subprocess, sys, time
code = "from notabug.scenes_usd.temporary import *; end_with(int(sys.argv[1])); print(0, flush=True); time.sleep(3600)"
child = subprocess.Popen([sys.executable, "-c", code, {parent}], stdout=subprocess.PIPE)
child.stdout.readline()
print(child.pid, flush=True)
time.sleep(3600)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux tells a process of its parent's end")
@pytest.mark.parametrize("parent", ["str(os.getpid())", "'1'"])
def test_a_process_ends_with_its_parent_or_where_that_has_ended(parent: str) -> None:
    words = [sys.executable, "-c", STARTS.format(parent=parent)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as starter:
        assert starter.stdout is not None
        number = int(starter.stdout.readline())
        starter.send_signal(signal.SIGKILL)
    for _ in range(3000):
        state = Path(f"/proc/{number}/stat")
        if not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] == "Z":
            return
        time.sleep(0.02)
    raise AssertionError("it outlives its parent")
