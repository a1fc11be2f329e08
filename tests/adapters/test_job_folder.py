"""A job's own folder: gone when all went well, kept to look at after an error, and never with half a file in it."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from notabug.adapters.base import RendererError
from notabug.adapters.job_folder import job_folder


def test_it_is_removed_at_the_end_unless_it_is_wished_for(tmp_path: Path) -> None:
    with job_folder(tmp_path, "mine") as folder:
        (folder / "scene.json").write_text("{}")
    assert not list(tmp_path.iterdir())
    with job_folder(tmp_path, "mine", keep=True) as folder:
        (folder / "scene.json").write_text("{}")
    assert (folder / "scene.json").is_file()


def _fails(out: Path, error: Exception, *, keep: bool = False) -> None:
    with job_folder(out, "mine", keep=keep) as folder:
        (folder / "scene.json").write_text('{"half')
        raise error


def test_it_is_kept_after_an_error_of_the_renderer(tmp_path: Path) -> None:
    with pytest.raises(RendererError):
        _fails(tmp_path, RendererError("it failed", where="mine"))
    (folder,) = tmp_path.iterdir()
    assert (folder / "scene.json").is_file()


@pytest.mark.parametrize("keep", [False, True])
def test_what_a_full_disk_left_half_written_is_not_kept(tmp_path: Path, keep: bool) -> None:
    with pytest.raises(OSError, match="space"):
        _fails(tmp_path, OSError(errno.ENOSPC, "no space left on device"), keep=keep)
    assert not list(tmp_path.iterdir())
