"""The report in a browser: it leads to the bug, hides what is not asked for, copies, goes by keyboard, fits a phone."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.metrics.verdict import GLYPH, Finding, Leg, Verdict
from notabug.report.page import draw
from notabug.results.record import Result
from notabug.runs.folders import write_json
from notabug.scenes_usd.picture import write_exr
from tests.notabug.gallery.conftest import barriers, too_wide

SIDE = 32


def finding(kind: Any, name: str, area: float, message: str) -> Finding:
    return Finding(kind, name, area, (4, 4, 12, 12), jnd=5.0, z=40.0, message=message)


def results() -> list[Result]:
    """Two bugs of one renderer, the larger one last, errors and lacks that are alike, limitations and passes."""

    def made(scene: str, renderer: str, verdict: Verdict, **more: Any) -> Result:
        images = {"reference": "reference.exr"} | ({"bug_map": "map.exr"} if verdict.legs["bug"].pixels else {})
        command = f"notabug run {scene} -r {renderer}"
        shown = {"image": "picture.exr", "images": images, "size": (SIDE, SIDE)}
        return Result(scene, "split=quad", renderer, "1.0", verdict, command=command, **(shown | more))

    legs = {"limitation": Leg(), "bug": Leg(64, 0.1, 0.5)}
    small = Verdict("bug", (finding("bug", "light_gain", 3.0, "gain 1.01: every value is multiplied by it"),))
    large = Verdict("bug", (finding("bug", "no_epsilon", 60.0, "rays meet the surface that they start on"),), legs)
    limited = Verdict("limitation", (finding("limitation", "quad_split_02", 40.0, "uv are linear in two triangles"),))
    lost: dict[str, Any] = {"image": "", "images": {}}
    wrong = [
        Verdict("error", message=f"adapter 'mine': mine failed, got exit code 3; log: out/{each}/log.txt")
        for each in ("a", "b", "c")
    ]
    lacks = [
        Verdict("unsupported", message=f"adapter 'mine': scene 'x' needs {each}; choose")
        for each in ("glass", "glass, sphere")
    ]
    return [
        made("acne/pass", "other", Verdict("pass")),
        made("acne/small", "mine", small, state="new", fails=True),
        made("texture/quad", "other", limited, state="as expected", expected="limitation"),
        made("acne/large", "mine", large, state="new", fails=True),
        *(made(f"error/{at}", "mine", each, fails=True, log=f"{at}/log.txt", **lost) for at, each in enumerate(wrong)),
        *(made(f"lack/{at}", "mine", each, **lost) for at, each in enumerate(lacks)),
        *(made(f"pass/{at}", "other", Verdict("pass")) for at in range(20)),
    ]  # fmt: skip


def write(out: Path, found: list[Result]) -> Path:
    out.mkdir(parents=True)
    pixels = np.random.default_rng(1).random((SIDE, SIDE, 3), np.float32)
    write_exr(out / "picture.exr", pixels)
    write_exr(out / "reference.exr", pixels * np.float32(0.9))
    off = np.zeros((SIDE, SIDE, 1), np.float32)
    off[7, 9] = 0.5
    write_exr(out / "map.exr", off)
    tool = {"name": "notabug", "version": "0", "code": "0", "models": "0+0", "python": "3", "platform": "p"}
    document = {"schema": 1, "tool": tool | {"libraries": {}}, "finished": True, "renderers": {}}
    write_json(out / "run.json", document | {"results": [each.as_dict() for each in found]})
    return out


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run, and its page against an earlier one that had the large bug's scene right and the small one's wrong."""
    folder = tmp_path_factory.mktemp("report")
    was = {"acne/large": Verdict("pass"), "acne/pass": Verdict("bug")}
    before = [replace(each, verdict=was.get(each.scene, each.verdict)) for each in results() if each.scene != "pass/19"]
    write(folder / "before", before)
    write(folder / "run", results())
    draw(folder / "run", baseline=folder / "before")
    return folder / "run"


def until(page: Any, script: str) -> None:
    """Wait for ``script`` to be true: the page's policy forbids Playwright's own way of waiting."""
    for _ in range(200):
        if page.evaluate(script):
            return
        page.wait_for_timeout(50)
    pytest.fail(f"never true: {script}")


@pytest.fixture(params=["sidecar", "single"])
def page(request: pytest.FixtureRequest, run: Path, tab: Any, tmp_path: Path) -> Any:
    if request.param == "sidecar":
        return tab.open((run / "report.html").as_uri())
    alone = write(tmp_path / "run", results())
    drawn = draw(alone, baseline=run.parent / "before", single_file=True)
    assert not (alone / "report_files").exists()
    moved = drawn.rename(tmp_path / "moved.html")
    return tab.open(moved.as_uri())


def test_the_worst_bug_comes_first_with_its_pictures_and_what_to_do(page: Any, tab: Any) -> None:
    first = page.locator(".row:visible").first
    assert "acne/large" in first.locator("h3").text_content()
    assert "rays meet the surface that they start on (60 pixels, visible)" in first.locator(".cause").text_content()
    titles = first.locator(".pictures figcaption").all_text_contents()
    assert titles == ["picture", "reference", "difference, FLIP up to 0.5"]
    until(page, "[...document.querySelectorAll('.card img')].slice(0, 3).every((i) => i.naturalWidth == 32)")
    assert "--pixel 9,7" in first.locator("code").first.text_content()
    first.locator("summary", has_text="Accept it").click()
    assert "notabug accept acne/large -r mine --variant split=quad" in first.locator(".accept").text_content()
    assert 'name = "no_epsilon"' in first.locator(".accept").text_content()
    second = page.locator(".row:visible").nth(1)
    assert "radiance up to" in second.locator("figcaption").nth(2).text_content()  # a gain has no map
    assert not tab.complaints
    assert all(each.startswith(("about:", "file:", "data:")) for each in tab.requests)


@pytest.mark.sweep_except("sidecar-1280")
def test_the_summary_counts_and_says_what_changed(page: Any) -> None:
    assert page.locator(".headline").text_content() == "2 bug, 3 error, 1 limitation, 21 pass, 2 unsupported"
    changes = page.locator(".changes").all_text_contents()
    assert re.search(r"5\s*new\s*acne/small mine", changes[0])
    assert re.search(r"1\s*new\s*acne/large mine", changes[1])
    assert re.search(r"1\s*fixed\s*acne/pass other", changes[1])
    page.get_by_label("show 2 bug of mine alone").click()
    assert page.locator(".row:visible").count() == 2
    assert page.locator(".group:visible").count() == 1


@pytest.mark.sweep_except("single-1280")
def test_a_search_narrows_the_list_of_links_and_moves_nothing(page: Any) -> None:
    links, bar = page.locator(".changes a"), page.locator(".filter")
    everything, before = links.count(), bar.bounding_box()
    page.locator("#search").fill("acne/large")
    found = page.locator(".changes a:visible").all_text_contents()
    assert found
    assert len(found) < everything
    assert all("acne/large" in name for name in found)
    assert "shown" in page.locator("#shown").text_content()
    assert bar.bounding_box()["height"] == before["height"]
    page.locator("#search").fill("")
    assert page.locator(".changes a:visible").count() == everything


@pytest.mark.sweep_except("single-1280")
def test_one_mistake_is_told_once(page: Any) -> None:
    told = page.locator("#errors .same > p").first.text_content()
    assert re.search(r"mine\s*: 3 results alike: adapter 'mine': mine failed", told)
    assert "0/log.txt and 2 more" in page.locator("#errors").text_content()
    assert "2 results: it lacks glass (2), sphere (1)" in page.locator("#unsupported .same > p").first.text_content()


@pytest.mark.sweep_except("single-1280")
def test_what_the_filter_empties_vanishes(page: Any) -> None:
    everything = page.locator(".group:visible").count()
    for word in ("error", "limitation", "pass", "unsupported"):
        page.locator(f"[name=word][value={word}]").uncheck()
    assert page.locator(".row:visible").count() == 2
    assert page.locator(".group:visible").count() == 1
    assert page.evaluate("document.documentElement.scrollHeight") < 3000
    page.fill("#search", "epsilon")
    assert page.locator(".row:visible").count() == 1
    page.fill("#search", "no such words")
    assert page.locator(".row:visible").count() == page.locator(".group:visible").count() == 0
    page.get_by_role("button", name="show all").click()
    assert page.locator(".group:visible").count() == everything
    page.fill("#search", "pass/7")
    assert page.locator(".row:visible").count() == 1  # what is found is unfolded
    page.fill("#search", "")
    page.locator("#changed").check()
    assert page.locator(".row:not([hidden])").count() == 6


@pytest.mark.sweep_except("sidecar-1280")
def test_an_address_opens_its_row(page: Any) -> None:
    row = page.locator(".row[data-text^='pass/7']")
    assert not row.is_visible()
    page.evaluate(f"location.hash = '{row.get_attribute('id')}'")
    until(page, f"document.getElementById('{row.get_attribute('id')}').open")
    assert row.locator("img").first.is_visible()
    ids = page.evaluate("[...document.querySelectorAll('[id]')].map((e) => e.id)")
    assert len(ids) == len(set(ids))
    assert page.locator(".row .anchor").count() == page.locator(".row").count() == 29


@pytest.mark.sweep_except("single-1280")
def test_it_goes_by_keyboard(page: Any) -> None:
    page.keyboard.press("j")
    page.keyboard.press("j")
    assert "acne/small" in page.locator(".at h3").text_content()
    page.keyboard.press("k")
    assert "acne/large" in page.locator(".at h3").text_content()
    page.keyboard.press("z")
    assert page.locator("#viewer img").get_attribute("alt").endswith("picture")
    page.keyboard.press("ArrowRight")
    assert page.locator("#viewer img").get_attribute("alt").endswith("reference")
    page.keyboard.press("3")
    assert "FLIP" in page.locator("#viewer figcaption").text_content()
    page.keyboard.press("Escape")
    page.keyboard.press("?")
    legend = page.locator("#legend")
    assert all(word in legend.text_content() for word in ("area", "jnd", "z", "FLIP"))
    page.keyboard.press("Escape")
    page.keyboard.press("/")
    page.keyboard.type("jok")
    assert page.input_value("#search") == "jok"


@pytest.mark.sweep_except("sidecar-1280")
def test_commands_are_copied(page: Any) -> None:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.locator(".card .copy").nth(1).click()
    page.get_by_role("button", name="draw it again").first.filter(has_text="copied").wait_for()
    assert page.evaluate("navigator.clipboard.readText()") == "notabug run acne/large -r mine"


def test_float_pictures_are_at_hand_beside_the_run(tab: Any, run: Path) -> None:
    page = tab.open((run / "report.html").as_uri())
    links = page.evaluate("[...document.querySelectorAll('.downloads a')].map((a) => a.getAttribute('href'))")
    assert {"picture.exr", "reference.exr", "map.exr"} == set(links)


@pytest.mark.parametrize("tab", [1280, 390], indirect=True)
def test_nothing_is_wider_than_its_column(tab: Any, run: Path) -> None:
    page = tab.open((run / "report.html").as_uri())
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
    wide = page.evaluate(
        """() => [...document.querySelectorAll("main *, .filter *")].filter((e) =>
          e.checkVisibility() && e.getBoundingClientRect().right > innerWidth + 1)
          .map((e) => e.outerHTML.slice(0, 99))"""
    )
    assert wide == []
    assert too_wide(page) == []


@pytest.mark.parametrize("tab", [1280, 390], indirect=True)
@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.sweep_except("dark-390", "light-1280")
def test_axe_finds_no_barrier(tab: Any, run: Path, scheme: str) -> None:
    page = tab.open((run / "report.html").as_uri())
    page.emulate_media(color_scheme=scheme)
    assert barriers(page) == []
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    assert barriers(page) == []
    page.get_by_role("button", name="legend").click()
    assert barriers(page) == []


@pytest.mark.parametrize("tab", [1280, 390], indirect=True)
def test_the_summary_names_what_it_counts(tab: Any, run: Path) -> None:
    """Each number has its word beside it, at any width, and what there is none of is left out."""
    page = tab.open((run / "report.html").as_uri())
    assert page.locator(".summary thead").is_hidden()
    shown = page.evaluate(
        """() => [...document.querySelectorAll(".summary tbody tr")].map((row) => [...row.cells].filter(
          (cell) => cell.checkVisibility()).map((cell) => cell.innerText.trim().split(/\\s+/)[0]
          + getComputedStyle(cell, "::after").content.replaceAll('"', "").replace("none", "")))"""
    )
    rows = {name: numbers for name, *numbers in shown}
    assert rows["mine"] == ["2 bug", "3 error", "2 unsupported", "5 new", "1 new since baseline"]


def test_every_stop_of_the_tab_key_is_seen(tab: Any, run: Path) -> None:
    page = tab.open((run / "report.html").as_uri())
    seen = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        stop, style = page.evaluate(
            "[document.activeElement.outerHTML.slice(0, 80), getComputedStyle(document.activeElement).outlineStyle]"
        )
        seen.add(stop)
        assert style != "none", stop
    assert len(seen) > 20


def test_light_and_dark(tab: Any, run: Path) -> None:
    page = tab.open((run / "report.html").as_uri())
    grounds = []
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme)
        grounds.append(page.evaluate("getComputedStyle(document.body).backgroundColor"))
    page.get_by_role("button", name="light or dark").click()
    grounds.append(page.evaluate("getComputedStyle(document.body).backgroundColor"))
    assert grounds == ["rgb(30, 30, 30)", "rgb(255, 255, 255)", "rgb(30, 30, 30)"]


def test_light_text_stands_out_from_its_ground() -> None:
    """WCAG 2.2, 1.4.3: 4.5 to 1, in both places where the light colours stand."""
    style = (Path(__file__).parents[3] / "notabug/gallery/static/base.css").read_text()
    style, printed = style.split("@media print")
    assert "color-scheme: light" in printed, "in ink, whatever the screen has"
    blocks = re.findall(r"\{\s*(color-scheme: light;[^}]*)\}", style)
    assert len(blocks) == 2
    assert blocks[0].split() == blocks[1].split()
    colours = dict(re.findall(r"--([a-z]+): (#[0-9a-f]{3,6})", blocks[0]))

    def luminance(colour: str) -> float:
        full = colour if len(colour) == 7 else "#" + "".join(2 * digit for digit in colour[1:])
        v = np.array([int(full[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        return float(np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722])

    for ground in ("ground", "panel", "well"):
        for text in ("text", "quiet", "convention", *GLYPH):
            pair = sorted((luminance(colours[text]), luminance(colours[ground])))
            assert (pair[1] + 0.05) / (pair[0] + 0.05) >= 4.5, (text, ground)


@pytest.mark.sweep_except("single-1280")
def test_every_control_and_picture_has_a_name(page: Any) -> None:
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    nameless = page.evaluate(
        """() => [...document.querySelectorAll("a, button, input, select, img:not(#viewer img)")].filter((e) =>
          !(e.textContent.trim() || e.getAttribute("aria-label") || e.alt
            || [...(e.labels ?? [])].map((l) => l.textContent).join("").trim()
            || e.querySelector("img")?.alt)).map((e) => e.outerHTML)"""
    )
    assert nameless == []
