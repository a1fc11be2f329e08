"""The gallery's pages: reached by keyboard, filtered by address, fit for a phone, and deaf to hostile names."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.gallery.site import build
from notabug.gallery.taxonomy import taxonomy
from notabug.metrics.verdict import GLYPH, Finding, Verdict
from notabug.results.record import Result
from notabug.scenes_usd.card import CLASSES
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import write_exr
from tests.notabug.gallery.conftest import barriers, too_wide, write_run

PAGES = ["index.html", "class/texture.html", "matrix.html", "viewer.html", "trend.html", "bench.html"]
HOSTILE = "../..\\\"'><script>alert(1)</script><img src=x onerror=alert(2)>${7*7}{{7*7}}\u2028"


# What a page looks like and how it answers is looked at once: that it comes from a server as well, the tests of every
# page, of its address and of its size say.
FROM_A_FILE = pytest.mark.parametrize("site", ["file"], indirect=True)


def test_every_page_opens_without_complaint(tab: Any, site: Any) -> None:
    for page in PAGES:
        tab.open(site.address(page)).wait_for_load_state("load")
        assert tab.page.title()
        assert tab.page.locator("main").count() == 1
    assert not tab.complaints
    assert all(each.startswith((site.base, "about:", "data:")) for each in tab.requests)


@FROM_A_FILE
@pytest.mark.parametrize("tab", [1280, 390], indirect=True)
@pytest.mark.sweep_except("390-file")
def test_nothing_is_wider_than_the_window(tab: Any, site: Any) -> None:
    for page in PAGES:
        tab.open(site.address(page)).wait_for_load_state("load")
        assert tab.page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0, page
        assert too_wide(tab.page) == [], page


@FROM_A_FILE
def test_the_width_test_can_fail(tab: Any, site: Any) -> None:
    page = tab.open(site.address("index.html"))
    page.evaluate("document.querySelector('h2').style.cssText = 'width: 40px; white-space: nowrap'")
    assert any(each.startswith("<h2") for each in too_wide(page))


@pytest.mark.parametrize("tab", [1280, 390], indirect=True)
@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.sweep_except("dark-1280", "light-390")
def test_axe_finds_no_barrier(tab: Any, built: Path, scheme: str) -> None:
    tab.page.emulate_media(color_scheme=scheme)
    for page in PAGES:
        tab.open(f"{built.as_uri()}/{page}").wait_for_load_state("load")
        if page == "viewer.html":
            tab.page.wait_for_selector("#status", state="hidden")
        assert barriers(tab.page) == [], page


def test_axe_finds_what_is_wrong(tab: Any, built: Path) -> None:
    tab.page.emulate_media(color_scheme="dark")
    page = tab.open(f"{built.as_uri()}/index.html")
    page.evaluate("document.querySelector('.tally').style.color = '#555'; document.querySelector('img').alt = ''")
    page.evaluate("document.querySelector('img').removeAttribute('alt')")
    assert {each.split(":")[0] for each in barriers(page)} == {"color-contrast", "image-alt"}


GROUND = "getComputedStyle(document.body).backgroundColor"


@FROM_A_FILE
@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_light_and_dark_are_the_systems_until_a_reader_says_otherwise(tab: Any, site: Any, scheme: str) -> None:
    """The choice holds on every page, and what lies over a picture is light on dark whatever the page is."""
    dark, light = "rgb(30, 30, 30)", "rgb(255, 255, 255)"
    tab.page.emulate_media(color_scheme=scheme)
    page = tab.open(site.address("index.html"))
    assert page.evaluate(GROUND) == (dark if scheme == "dark" else light)
    page.locator("#theme").click()
    assert page.evaluate(GROUND) == (light if scheme == "dark" else dark)
    for other in ("matrix.html", "viewer.html"):
        page = tab.open(site.address(other))
        assert page.evaluate(GROUND) == (light if scheme == "dark" else dark), other
    assert page.evaluate("getComputedStyle(document.querySelector('.stage')).backgroundColor") == "rgb(24, 24, 24)"
    page.locator("#theme").click()
    assert page.evaluate(GROUND) == (dark if scheme == "dark" else light)


def test_a_subset_says_how_many_classes_it_shows(tab: Any, built: Path) -> None:
    page = tab.open(f"{built.as_uri()}/index.html")
    said = " ".join(page.locator(".opening p").text_content().split())
    assert f"Of the {len(CLASSES) - 1} kinds of artifact this gallery shows 1, each with its cause" in said
    assert page.locator(".taxonomy > li").count() == 1


@FROM_A_FILE
def test_the_site_is_walked_by_keyboard(tab: Any, site: Any) -> None:
    """From the first page to a class, to its scene in the viewer, and back to the matrix, by tab and enter alone."""
    page = tab.open(site.address("index.html"))

    def press_on(wanted: str) -> None:
        for _ in range(80):
            page.keyboard.press("Tab")
            told = page.evaluate(
                "(({tagName, textContent, href}) => tagName + textContent + href)(document.activeElement)"
            )
            if not told.startswith("A"):
                continue
            if re.search(wanted, told):
                seen = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
                assert seen != "none"
                with page.expect_navigation(wait_until="load"):
                    page.keyboard.press("Enter")
                return
        pytest.fail(f"no tab stop {wanted}")

    press_on("class/texture")
    assert page.locator("h1").text_content() == "Naive texture interpolation"
    press_on("viewer.html#scene=texture")
    page.wait_for_selector("#status", state="hidden")
    press_on("matrix")
    press_on(r"viewer.*b=grey")
    page.wait_for_selector("#status", state="hidden")
    assert page.input_value("#b").startswith("grey")
    press_on("trend")
    press_on("bench")
    assert page.locator("figure img").count() == 1
    assert not tab.complaints


@FROM_A_FILE
def test_every_control_and_picture_has_a_name(tab: Any, site: Any) -> None:
    for page in PAGES:
        tab.open(site.address(page)).wait_for_load_state("load")
        nameless = tab.page.evaluate(
            """() => [...document.querySelectorAll(
              "a, button, input, select, canvas:not([aria-hidden]), img, svg[role]")].filter((e) => {
              const text = e.textContent.trim() || e.getAttribute("aria-label") || e.title || e.alt
                || [...(e.labels ?? [])].map((l) => l.textContent).join("").trim()
                || [...e.querySelectorAll("img")].map((i) => i.alt).join("");
              return !text && !(e.tagName === "IMG" && e.closest("a")?.textContent.trim());
            }).map((e) => e.outerHTML)"""
        )
        assert nameless == [], page


@pytest.mark.parametrize("tab", [1280, 390], indirect=True)
@pytest.mark.sweep_except("390")
def test_features_of_the_preview_surface_have_a_page(tab: Any, tmp_path: Path) -> None:
    scene = "preview/ior_24"
    (tmp_path / "run").mkdir()
    write_exr(tmp_path / "run" / "picture.exr", np.full((64, 64, 3), 0.3, np.float32))
    told = Verdict("bug", (Finding("bug", "ior_ignored", 900.0, (0, 0, 60, 60)),), message="ior is taken for 1.5")
    drawn = Result(scene, "", "grey", "1.0", told, image="picture.exr", size=(64, 64), claim="It reflects more.")
    lacks = Result(scene, "", "other", "1.0", Verdict("unsupported"), size=(64, 64), claim="It reflects more.")
    run = write_run(tmp_path / "run", [drawn, lacks])
    site = build([run], tmp_path / "site", only=[scene]).parent
    page = tab.open(f"{site.as_uri()}/features.html")
    cells = page.locator("tbody tr td").all_text_contents()
    assert [" ".join(cell.split()) for cell in cells] == ["", "✗ bug: ior ignored", "– unsupported"]
    assert "It reflects more." in page.locator("tbody th").text_content()
    assert page.locator("nav.site a", has_text="features").get_attribute("aria-current") == "page"
    assert barriers(page) == []
    assert too_wide(page) == []


def test_a_gallery_without_them_has_no_such_page(built: Path) -> None:
    assert not (built / "features.html").exists()
    assert "features.html" not in (built / "index.html").read_text("utf-8")


def test_text_stands_out_from_its_ground() -> None:
    """WCAG 2.2, 1.4.3: 4.5 to 1 for every colour of text on each ground."""
    style = (Path(__file__).parents[3] / "notabug/gallery/static/base.css").read_text()
    root = style[: style.index("}")]
    colours = dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6})", root))

    def luminance(colour: str) -> float:
        v = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        return float(np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722])

    for ground in ("ground", "panel", "well"):
        for text in ("text", "quiet", "convention", *GLYPH):
            light, dark = luminance(colours[text]), luminance(colours[ground])
            assert (light + 0.05) / (dark + 0.05) >= 4.5, (text, ground)


def test_filters_are_in_the_address(tab: Any, site: Any) -> None:
    page = tab.open(site.address("matrix.html"))
    assert page.locator(".exhibit:visible").count() == 1
    page.select_option("[name=verdict]", "bug")
    assert page.locator(".exhibit:visible").count() == 0
    assert "verdict=bug" in page.evaluate("location.hash")
    assert page.get_by_text("Nothing fits").is_visible()
    page = tab.open(site.address("matrix.html#verdict=limitation&finding=quad_split_02&q=uneven"))
    assert page.locator(".exhibit:visible").count() == 1
    assert page.input_value("[name=q]") == "uneven"
    page.fill("[name=q]", "no such words")
    assert page.locator(".exhibit:visible").count() == 0
    page.get_by_role("button", name="show all").click()
    assert page.locator(".exhibit:visible").count() == 1


@FROM_A_FILE
def test_trend_says_first_what_changed(tab: Any, site: Any) -> None:
    page = tab.open(site.address("trend.html"))
    first = page.locator(".changes li").first
    assert "bug → limitation" in first.text_content()
    assert first.locator("b").text_content() == "better"
    assert "90 → 40" in page.locator(".courses").text_content()


def test_first_page_is_small(tab: Any, site: Any) -> None:
    sizes: list[int] = []
    tab.page.on("response", lambda each: sizes.append(len(each.body())) if each.status == 200 else None)
    tab.open(site.address("index.html")).wait_for_load_state("networkidle")
    assert 0 < sum(sizes) < 300_000


def test_hostile_names_are_inert(browser: Any, tmp_path: Path, hostile_run: Any) -> None:
    out = tmp_path / "a" / "b" / "site"
    build([hostile_run(tmp_path / "run", HOSTILE)], out, only=["*script*"], with_models=False)
    assert {each.name for each in tmp_path.iterdir()} == {"a", "run"}
    assert {each.name for each in (tmp_path / "a" / "b").iterdir()} == {"site"}
    for path in out.rglob("*"):
        assert re.fullmatch(r"[A-Za-z0-9_.-]+", path.name)
    page = browser.new_page()
    alarms: list[str] = []
    page.on("dialog", lambda each: (alarms.append(each.message), each.dismiss()))
    page.on("pageerror", lambda each: alarms.append(str(each)))
    page.on("console", lambda each: alarms.append(each.text) if each.type == "error" else None)
    for name in ("index.html", "matrix.html", "viewer.html"):
        page.goto((out / name).as_uri())
        page.wait_for_timeout(300)
        scripts = page.evaluate("[...document.scripts].map((s) => s.src + s.textContent)")
        assert all(re.search(r"/(assets|data)/[\w./-]+\.js$", each) for each in scripts)
    page.goto((out / "matrix.html").as_uri())
    assert "<script>alert(1)</script>" in page.locator(".exhibit h2").text_content()
    page.locator(".tile a").nth(1).click()
    page.wait_for_selector("#status", state="hidden")
    assert page.locator("#headline").text_content() == HOSTILE
    assert not alarms
    page.close()


def test_a_run_shows_only_its_own_files(tmp_path: Path, hostile_run: Any) -> None:
    secret = tmp_path / "secret.exr"
    write_exr(secret, np.full((4, 4, 3), 0.123))
    run = hostile_run(tmp_path / "run", "own", image="../secret.exr")
    build([run], tmp_path / "site", only=["own"], with_models=False)
    assert not list((tmp_path / "site" / "thumbs").iterdir())
    assert "is not shown" in (tmp_path / "site" / "matrix.html").read_text()


def test_what_an_earlier_gallery_left_is_removed(tmp_path: Path, hostile_run: Any) -> None:
    run = hostile_run(tmp_path / "run", "own")
    build([run], tmp_path / "site", only=["own"], with_models=False)
    first = {each.name for each in (tmp_path / "site" / "data").iterdir()}
    write_exr(run / "a.exr", np.full((8, 8, 3), 0.75))
    build([run], tmp_path / "site", only=["own"], with_models=False)
    second = {each.name for each in (tmp_path / "site" / "data").iterdir()}
    assert len(first) == len(second)
    assert first != second


def test_no_plots_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(NotabugError, match="no plots"):
        build([], tmp_path / "site", bench=tmp_path, with_models=False)


def test_every_class_has_its_words() -> None:
    assert tuple(each.id for each in taxonomy()) == CLASSES


@pytest.fixture
def hostile_run() -> Any:
    def write(out: Path, text: str, image: str = "a.exr") -> Path:
        out.mkdir()
        write_exr(out / "a.exr", np.full((8, 8, 3), 0.5))
        finding = Finding("bug", text, 1.0, (0, 0, 2, 2), message=text)
        verdict = Verdict("bug", (finding,), message=text)
        result = Result(
            text, text, text, text, verdict, image=image, size=(8, 8), command=text, claim=text, expected=text,
            images={"reference": image},
        )  # fmt: skip
        tool: dict[str, Any] = {"name": text, "version": text, "libraries": {}}
        document = {"schema": 1, "tool": tool, "finished": True, "renderers": {}, "results": [result.as_dict()]}
        (out / "run.json").write_text(json.dumps(document))
        return out

    return write
