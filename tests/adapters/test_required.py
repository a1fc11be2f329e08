"""A missing renderer skips its tests, and fails them where NOTABUG_REQUIRE names it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.mark.parametrize(
    ("required", "code", "told"), [("mitsuba", 0, "1 skipped"), ("mitsuba,povray", 1, "NOTABUG_REQUIRE names povray")]
)
def test_missing_renderer(tmp_path: Path, required: str, code: int, told: str) -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", f"{HERE / 'test_povray.py'}::test_found"],
        cwd=HERE.parents[1],
        env={**os.environ, "PATH": str(tmp_path), "NOTABUG_REQUIRE": required},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == code, ran.stdout
    assert told in ran.stdout
    assert "apt install povray" in ran.stdout
