"""report.html: drawn only from the record, escaped throughout, and its pictures show the right colours."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import pytest

from notabug.metrics.verdict import Finding, Verdict
from notabug.report.page import draw
from notabug.report.pictures import levels, png, tone_map
from notabug.results.record import Result
from notabug.runs.folders import write_json
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import write_exr

HOSTILE = "<script>alert(1)</script>\"'&"


def write(out: Path, *results: Result) -> None:
    out.mkdir(exist_ok=True)
    libraries: dict[str, str] = {"numpy": HOSTILE}
    write_json(
        out / "run.json",
        {
            "schema": 1,
            "tool": {
                "name": "notabug",
                "version": "0",
                "code": "0",
                "python": "3",
                "platform": "p",
                "libraries": libraries,
            },
            "finished": True,
            "renderers": {HOSTILE: {"version": HOSTILE, "where": ""}, "gone": {"missing": HOSTILE}},
            "results": [each.as_dict() for each in results],
        },
    )


class Tags(HTMLParser):
    """Every tag with its attributes."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))


def tags(page: Path) -> list[tuple[str, dict[str, str | None]]]:
    parser = Tags()
    parser.feed(page.read_text())
    return parser.tags


def test_hostile_text_stays_text(tmp_path: Path) -> None:
    finding = Finding("bug", HOSTILE, 1.0, (0, 0, 1, 1), message=HOSTILE)
    verdict = Verdict("bug", (finding,), triggers=(HOSTILE,), message=HOSTILE, numbers={HOSTILE: 1.0})
    common: dict[str, Any] = {
        "command": HOSTILE,
        "claim": HOSTILE,
        "expected": HOSTILE,
        "image": "a.exr",
        "size": (2, 2),
    }
    write(tmp_path, Result(HOSTILE, HOSTILE, HOSTILE, HOSTILE, verdict, **common))
    write_exr(tmp_path / "a.exr", np.zeros((2, 2, 3)))
    page = draw(tmp_path)
    found = tags(page)
    assert [tag for tag, _ in found].count("script") == 1
    assert "<script>alert" not in page.read_text()
    assert not [name for _, attributes in found for name in attributes if name.startswith("on")]


def test_nothing_is_fetched_and_only_our_own_script_may_run(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", np.full((4, 4, 3), 0.5))
    write(tmp_path, Result("a/b", "", "r", "1", Verdict("pass"), image="a.exr", size=(4, 4)))
    page = draw(tmp_path)
    found = tags(page)
    for _, attributes in found:
        for name in ("src", "href", "action"):
            address = attributes.get(name) or "data:"
            assert address.startswith(("data:", "#")) or (tmp_path / address).is_file()
    policy = next(each["content"] for tag, each in found if tag == "meta" and "http-equiv" in each)
    assert policy is not None
    assert "default-src 'none'" in policy
    text = page.read_text()
    for tag, directive in (("script", "script-src"), ("style", "style-src")):
        content = text.partition(f"<{tag}>")[2].partition(f"</{tag}>")[0]
        digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert f"{directive} 'sha256-{digest}'" in policy


@pytest.mark.parametrize("name", ["../secret.exr", "/etc/passwd", "link.exr"])
def test_a_record_cannot_show_other_files(tmp_path: Path, name: str) -> None:
    secret = tmp_path / "secret.exr"
    write_exr(secret, np.zeros((4, 4, 3)))
    out = tmp_path / "out"
    write(out, Result("a/b", "", "r", "1", Verdict("pass"), image=name))
    (out / "link.exr").symlink_to(secret)
    for alone in (False, True):
        text = draw(out, single_file=alone).read_text()
        assert "is not shown" in text
        assert "data:image/png" not in text
        assert not list(out.rglob("*.png"))


def test_every_verdict_is_said_in_words_and_every_picture_has_a_text(tmp_path: Path) -> None:
    words: list[Any] = ["pass", "limitation", "bug", "inconclusive", "unsupported", "error"]
    write_exr(tmp_path / "a.exr", np.zeros((4, 4, 3)))
    write(tmp_path, *(Result("a/b", word, "r", "1", Verdict(word), image="a.exr") for word in words))
    page = draw(tmp_path)
    text = re.sub(r"<[^>]*>", " ", page.read_text().partition("<main")[2])
    for word in words:
        assert re.search(rf"\b{word}\b", text)
    shown = [each for tag, each in tags(page) if tag == "img" and "src" in each]
    assert len(shown) == len(words)
    assert all(each.get("alt") for each in shown)


def test_a_page_keeps_only_the_pictures_that_it_shows(tmp_path: Path) -> None:
    """Equal pictures are one file; those of an earlier page go, other files stay."""
    write_exr(tmp_path / "a.exr", np.zeros((4, 4, 3)))
    write_exr(tmp_path / "b.exr", np.ones((4, 4, 3)))
    result = Result("a/b", "", "r", "1", Verdict("pass"), image="a.exr", size=(4, 4))
    write(tmp_path, result, replace(result, scene="a/c"), replace(result, scene="a/d", image="b.exr"))
    draw(tmp_path)
    pictures = tmp_path / "report_files"
    assert len(list(pictures.iterdir())) == 2
    (pictures / "mine.txt").write_text("mine")
    write(tmp_path, result)
    draw(tmp_path)
    assert sorted(each.suffix for each in pictures.iterdir()) == [".png", ".txt"]


def test_a_baseline_that_is_no_run_is_refused(door: Any, tmp_path: Path) -> None:
    assert door.run("terminator/sphere", "--baseline", str(tmp_path / "none")) == 2
    assert "there is no run here" in door.stderr
    assert door.grey.drawn == []


def test_a_lost_picture_costs_only_itself(tmp_path: Path) -> None:
    write(tmp_path, Result("a/b", "", "r", "1", Verdict("pass"), image="lost.exr", command="notabug run a/b"))
    text = draw(tmp_path).read_text()
    assert "no such file" in text
    assert "notabug run a/b" in text


@pytest.mark.parametrize("content", [None, "{", "[]", '{"schema": 2}'])
def test_what_is_no_run_is_refused(tmp_path: Path, content: str | None) -> None:
    if content is not None:
        (tmp_path / "run.json").write_text(content)
    with pytest.raises(NotabugError, match=r"run\.json"):
        draw(tmp_path)


def test_tone_map_is_srgb() -> None:
    """IEC 61966-2-1: linear 0.215861 is 128/255; 0.0031308 is where the line meets the curve; above white clips."""
    linear = np.array([0.0, 0.215861, 0.0031308, 1.0, 7.0, -1.0])
    shown = tone_map(np.repeat(linear[None, :, None], 3, axis=2))
    assert shown[0, :, 0].tolist() == [0, 128, 10, 255, 255, 0]
    assert tone_map(np.full((1, 1, 3), 2.0), white=2.0).max() == 255
    assert tone_map(np.full((1, 1, 3), np.nan)).tolist() == [[[255, 0, 255]]]


def test_png_reads_back(tmp_path: Path) -> None:
    """An independent reader sees the same bytes."""
    rng = np.random.default_rng(1)
    colours = rng.integers(0, 256, (7, 5, 3), dtype=np.uint8)
    heat = levels(np.linspace(0.0, 1.0, 12).reshape(3, 4))
    for name, pixels in (("rgb", colours), ("heat", heat)):
        path = tmp_path / f"{name}.png"
        path.write_bytes(png(pixels))
        back = OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.UINT8)
        if name == "rgb":
            assert np.array_equal(back[:, :, :3], pixels)
        else:  # magma: black first, pale yellow (252, 253, 191) last
            assert back[0, 0, :3].tolist() == [0, 0, 3] or back[0, 0, :3].tolist() == [0, 0, 4]
            assert back[-1, -1, :3].tolist() == [252, 253, 191]


def test_report_command_draws_again(door: Any) -> None:
    door.run("terminator/sphere")
    page = door.out / "report.html"
    first = page.read_text()
    page.unlink()
    assert door("report", str(door.out)) == 0
    assert page.read_text() == first
    assert json.loads((door.out / "run.json").read_text())["results"][0]["command"] in first
