"""docs/pages.py: what a page weighs, when it shows something, what a terminal shows, and that too much is told."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from notabug.report.page import draw
from tests.notabug.gallery.test_report import results, write

SOURCE = Path(__file__).resolve().parents[3] / "docs" / "pages.py"


@pytest.fixture(scope="module")
def pages() -> ModuleType:
    spec = importlib.util.spec_from_file_location("docs_pages", SOURCE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["docs_pages"] = module
    spec.loader.exec_module(module)
    return module


def test_a_report_is_weighed_with_what_it_loads(pages: ModuleType, browser: Any, tmp_path: Path) -> None:
    report = draw(write(tmp_path / "run with spaces é", results()))
    weight = pages.weigh(browser, report)
    pictures = sum(path.stat().st_size for path in (report.parent / "report_files").iterdir())
    assert weight.page == report.stat().st_size
    assert weight.whole == weight.page + pictures
    assert weight.page < weight.loaded <= weight.whole <= pages.HEAVIEST
    assert weight.paint > 0.0
    pages.photograph(browser, report, tmp_path, "report")
    assert len(list(tmp_path.glob("report-*.png"))) == 4


def test_what_is_too_heavy_or_too_late_is_told(pages: ModuleType) -> None:
    assert pages.Weighed(1, 2, pages.HEAVIEST, pages.SLOWEST).too_much() == []
    assert pages.Weighed(1, 2, pages.HEAVIEST + 1, 0.1).too_much() == ["heavier than 2 MiB"]
    assert pages.Weighed(1, 2, 3, 0.31).too_much() == ["later than 0.3 s"]


def test_a_command_is_drawn_as_in_a_terminal_of_80_columns(pages: ModuleType) -> None:
    text = pages.in_a_terminal(["--help"])
    assert "\x1b[" in text  # at a terminal there are colours
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)
    assert "Judge a renderer" in plain
    assert max(len(line) for line in plain.splitlines()) <= pages.COLUMNS
    svg = pages.drawn("half\x1b[2K\rwhole \x1b[31mred\x1b[0m", ["--help"])
    assert "whole" in svg
    assert "half" not in svg
