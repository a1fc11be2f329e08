"""A small gallery, the browser that opens it, from disk and over http, and what it asked for and complained about.

Without Chromium these tests are skipped; they fail instead where NOTABUG_REQUIRE asks for anything, as CI does.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.gallery.site import build
from notabug.metrics.verdict import Finding, Leg, Verdict
from notabug.results.record import Result
from notabug.runs.folders import write_json
from notabug.scenes_usd.picture import write_exr

SCENE, VARIANT = "texture/uneven_quad", "split=quad"
SIZE = 256


def every_kind_of_half() -> npt.NDArray[np.float32]:
    """(256, 256, 3) of finite half floats: every one of them at least once, subnormal and negative ones too."""
    halves = np.arange(1 << 16, dtype=np.uint16).view(np.float16)
    values = np.nan_to_num(halves.astype(np.float32), nan=0.5, posinf=0.25, neginf=0.125).reshape(SIZE, SIZE)
    return np.stack([values, values[::-1], values[:, ::-1]], axis=2)


def write_run(out: Path, results: list[Result]) -> Path:
    out.mkdir(parents=True, exist_ok=True)
    tool: dict[str, Any] = {
        "name": "notabug",
        "version": "0",
        "code": "0",
        "python": "3",
        "platform": "p",
        "libraries": {},
    }
    document = {"schema": 1, "tool": tool, "finished": True, "renderers": {}, "results": [x.as_dict() for x in results]}
    write_json(out / "run.json", document)
    return out


def small_run(out: Path, word: Any = "limitation", area: float = 40.0) -> Path:
    """One renderer's picture of one scene, with maps and a finding of two regions."""
    out.mkdir(parents=True)
    pixels = every_kind_of_half()
    write_exr(out / "picture.exr", pixels)
    write_exr(out / "nearest.exr", pixels * 0.5)
    leg = np.zeros((SIZE, SIZE, 1), np.float32)
    leg[40:60, 20:50] = 0.5
    write_exr(out / "leg.exr", leg)
    kind: Any = "bug" if word == "bug" else "limitation"
    boxes = ((20, 40, 50, 60), (100, 100, 120, 130))
    found = Finding(kind, "quad_split_02", area, (20, 40, 120, 130), jnd=3.0, z=9.0, regions=boxes)
    verdict = Verdict(word, (found,), {"limitation": Leg(600, 0.1, 0.5), "bug": Leg()}, message="a diagonal")
    images = {"nearest": "nearest.exr", "limitation_map": "leg.exr"}
    result = Result(SCENE, VARIANT, "grey", "1.0", verdict, image="picture.exr", images=images, size=(SIZE, SIZE))
    return write_run(out, [result])


@pytest.fixture(scope="session")
def halves() -> npt.NDArray[np.float32]:
    """What the run's only renderer drew."""
    return every_kind_of_half()


@dataclass
class Site:
    """A built gallery and how to reach it."""

    out: Path
    base: str

    def address(self, page: str) -> str:
        return f"{self.base}/{page}"


@pytest.fixture(scope="session")
def built(shared: Any) -> Path:
    """The gallery's folder."""
    site: Path = shared("gallery", _build) / "site"
    return site


def _build(folder: Path) -> None:
    runs = [small_run(folder / "old", "bug", 90.0), small_run(folder / "new")]
    plots = folder / "plots"
    plots.mkdir()
    (plots / "speed.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"><path d="M0 0h9"/></svg>'
    )
    build(runs, folder / "site", only=[SCENE], step=32, bench=plots)


@pytest.fixture(scope="session", params=["file", "http"])
def site(request: pytest.FixtureRequest, built: Path) -> Iterator[Site]:
    if request.param == "file":
        yield Site(built, built.as_uri())
        return

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the base class names it
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(built))) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield Site(built, f"http://127.0.0.1:{server.server_port}")
        server.shutdown()
        thread.join()


@dataclass
class Tab:
    """A page of the browser, and what went wrong on it."""

    page: Any
    requests: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)

    def open(self, address: str) -> Any:
        self.page.goto("about:blank")
        self.page.goto(address)
        return self.page

    def view(self, site: Site, state: str = "") -> Any:
        """The viewer, when its pictures are there."""
        page = self.open(site.address(f"viewer.html#scene={SCENE}&{state}"))
        page.wait_for_selector("#status", state="hidden")
        return page

    def go_on(self, site: Site, state: str) -> Any:
        """The viewer where it stands, or newly opened, in another state, when its pictures are there."""
        if "viewer.html" not in self.page.url:
            return self.view(site, state)
        self.page.evaluate(
            """(address) => new Promise((done) => {
              addEventListener("hashchange", () => setTimeout(done), {once: true});
              location.hash = address; })""",
            f"#scene={SCENE}&{state}",
        )
        self.page.wait_for_selector("#status", state="hidden")
        return self.page


def missing(reason: str) -> Any:
    """Skip, or fail where everything is required."""
    if os.environ.get("NOTABUG_REQUIRE"):
        pytest.fail(f"NOTABUG_REQUIRE is set, but {reason}")
    pytest.skip(reason)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    names = ("chromium", "chromium-browser", "google-chrome")
    program = next((found for name in names if (found := shutil.which(name))), None)
    if program is None:
        missing("there is no Chromium: apt install chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        missing("there is no playwright: pip install playwright")
    with sync_playwright() as playwright:
        options = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        found = playwright.chromium.launch(executable_path=program, args=options)
        yield found
        found.close()


STANDARDS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]


def barriers(page: Any) -> list[str]:
    """What axe-core finds on a page: contrast, names, roles, headings, sizes of targets, regions that scroll."""
    try:
        source = files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8")
    except ModuleNotFoundError:
        missing("there is no axe-core: pip install axe-playwright-python")
    page.evaluate(source)
    found = page.evaluate(
        """async (tags) => {
          const what = (node) => [...node.any, ...node.all, ...node.none][0]?.message;
          const told = (rule, node) => `${rule.id}: ${node.html.slice(0, 120)}: ${what(node)}`;
          const found = await axe.run(document, {runOnly: tags});
          return found.violations.flatMap((rule) => rule.nodes.map((node) => told(rule, node)));
        }""",
        STANDARDS,
    )
    return list(found)


def too_wide(page: Any) -> list[str]:
    """The elements that end beyond the window, or whose content is wider than they are and is cut off by nobody."""
    found = page.evaluate(
        """() => [...document.querySelectorAll("body *")].filter((e) => e.checkVisibility() && e.clientWidth > 1
          && (e.getBoundingClientRect().right > innerWidth + 1
            || (e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX === "visible"
              && !["INPUT", "SELECT", "OPTION", "CANVAS"].includes(e.tagName))))
          .filter((e) => !e.closest(".scroll, .hidden")).map((e) => e.outerHTML.slice(0, 120))"""
    )
    return list(found)


@pytest.fixture(params=[1280])
def tab(request: pytest.FixtureRequest, browser: Any) -> Iterator[Tab]:
    context = browser.new_context(viewport={"width": request.param, "height": 860})
    page = context.new_page()
    made = Tab(page)
    page.on("console", lambda each: made.complaints.append(each.text) if each.type in ("error", "warning") else None)
    page.on("pageerror", lambda each: made.complaints.append(str(each)))
    page.on("dialog", lambda each: (made.complaints.append(f"dialog {each.message}"), each.dismiss()))
    page.on("request", lambda each: made.requests.append(each.url))
    yield made
    context.close()
