"""The page is drawn from JSON alone, its words are computed, and nothing from outside gets into it unescaped."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from notabug.bench import page, prose
from notabug.bench.plots import PALETTE, Curve, draw, style
from notabug.bench.stability import Course, Point

TOOL = {"platform": "somewhere", "version": "1"}


def course(renderer: str, onset: float | None, predicted: float | None, kind: str = "acne") -> Course:
    points = (Point(1.0, 0.0), Point(10.0, 0.001), Point(100.0, 0.3, {kind: 9}))
    return Course("offset", renderer, "1", points, onset, kind if onset else "", predicted)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    rows: list[dict[str, Any]] = [
        course("first", 50.0, 60.0).as_dict(),
        course("<script>alert(1)</script>", None, None).as_dict(),
    ]
    document = {"tool": TOOL, "about": "About.", "seconds": 1.0, "results": rows}
    (tmp_path / "stability.json").write_text(json.dumps(document), "utf-8")
    return tmp_path


def test_the_page_holds_plot_words_and_numbers(out: Path) -> None:
    text = page.draw(out).read_text("utf-8")
    assert "<svg" in text
    assert "first breaks at 50 units (acne), at the predicted 60." in text
    assert "<script>" not in text
    assert "&lt;script&gt;" in text
    assert '<h2 id="efficiency"' not in text


def test_the_plots_are_files_of_their_own_and_the_same_every_time(out: Path) -> None:
    page.draw(out)
    (plot,) = (out / "plots").glob("*.svg")
    first = plot.read_bytes()
    ElementTree.fromstring(first)
    page.draw(out)
    assert plot.read_bytes() == first
    assert PALETTE[0].lower() in first.decode().lower()


def test_words_tell_agreement_from_disagreement() -> None:
    far = prose.about_sweep([course("late", 5e4, 50.0)])
    assert "3.0 decades after the prediction" in far
    assert "3.0 decades before the prediction" in prose.about_sweep([course("early", 0.05, 50.0)])
    assert "where error analysis expects nothing" in prose.about_sweep([course("odd", 50.0, None)])
    assert prose.about_sweep([course("good", None, None)]) == "good is right all the way."


def test_labels_do_not_overlap(tmp_path: Path) -> None:
    curves = [Curve(f"line {k}", (1.0, 10.0), (0.5, 0.5)) for k in range(9)]
    path = draw(curves, tmp_path / "p.svg", "x", "y")
    tree = ElementTree.parse(path)
    found = {}
    for each in tree.iter("{http://www.w3.org/2000/svg}text"):
        if (each.text or "").startswith("line"):
            place = each.attrib.get("transform") or each.attrib.get("y", "")
            found[each.text] = place
    assert len(found) == 9
    assert len(set(found.values())) == 9


def test_lines_of_a_plot_are_told_apart() -> None:
    """Twice as many as there are colours, and more: seventeen renderers took part in a sweep."""
    assert len({style(number) for number in range(27)}) == 27
    assert [style(number)[0] for number in range(len(PALETTE))] == list(PALETTE)
