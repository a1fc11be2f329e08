"""The cache's folder: where there is no place to write a temporary one will do, and what was chosen must be good."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from notabug.scenes_usd import cache_folder
from notabug.scenes_usd.cache_folder import CacheError, cache_root

NOBODY = 65534


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """As in a new process without any settings."""
    for name in ("NOTABUG_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    for each in (cache_folder._usual, cache_folder._writable):
        each.cache_clear()
    yield
    left = os.environ.get("NOTABUG_CACHE", "")
    if Path(left).name.startswith("notabug-cache-"):
        shutil.rmtree(left, ignore_errors=True)
    for each in (cache_folder._usual, cache_folder._writable):
        each.cache_clear()


def test_the_usual_folder_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_root() == tmp_path / ".cache" / "notabug"
    assert cache_root().is_dir()
    assert "NOTABUG_CACHE" not in os.environ


def test_a_chosen_folder_is_made_and_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "a" / "b"))
    assert cache_root() == tmp_path / "a" / "b"
    assert list((tmp_path / "a" / "b").iterdir()) == []


@pytest.mark.parametrize("home", ["/proc", "/dev/null", "/sys", "a file", "~"])
def test_without_a_home_a_temporary_folder_is_shared_and_told_once(
    home: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    if home == "~":  # as expanduser leaves it where the user is unknown
        monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: f"~/.cache/{name}")
    else:
        (tmp_path / "a file").touch()
        monkeypatch.setenv("HOME", str(tmp_path / home))
    found = cache_root()
    assert cache_root() == found
    assert os.environ["NOTABUG_CACHE"] == str(found), "children share it"
    (found / "x").touch()
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "cannot use the cache" in said
    assert "NOTABUG_CACHE" in said
    assert not (tmp_path / "~").exists()


@pytest.mark.parametrize("chosen", ["/proc/x", "/dev/null", "/sys/x/y", "a file/x"])
def test_a_chosen_folder_that_cannot_be_is_an_error(
    chosen: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a file").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NOTABUG_CACHE", chosen)
    with pytest.raises(CacheError, match=f"NOTABUG_CACHE={chosen}: the cache cannot be used"):
        cache_root()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_a_read_only_folder_of_another_user(tmp_path: Path) -> None:
    code = (
        "import os, platformdirs; from notabug.scenes_usd.cache_folder import cache_root; "
        f"platformdirs.user_cache_dir('x'); os.setuid({NOBODY}); print(cache_root())"
    )
    home = tmp_path / "home"
    (home / ".cache" / "notabug").mkdir(parents=True)
    for each in (home, *home.rglob("*")):
        each.chmod(0o555)
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={"HOME": str(home), "PATH": os.environ["PATH"], "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "notabug-cache-" in done.stdout
    assert "Permission denied" in done.stderr
    assert not Path(done.stdout.strip()).exists(), "it is removed at the end"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_cache_of_another_user_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "theirs"
    folder.mkdir()
    os.chown(folder, NOBODY, NOBODY)
    monkeypatch.setenv("NOTABUG_CACHE", str(folder))
    with pytest.raises(CacheError, match=r"it belongs to .*NOTABUG_OWNERS="):
        cache_root()
    cache_folder._writable.cache_clear()
    monkeypatch.setenv("NOTABUG_OWNERS", f"somebody, {NOBODY}")
    assert cache_root() == folder


def test_a_cache_that_anybody_may_write_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "open"
    folder.mkdir()
    folder.chmod(0o777)
    monkeypatch.setenv("NOTABUG_CACHE", str(folder))
    with pytest.raises(CacheError, match=r"anybody may write to it: chmod o-w"):
        cache_root()
