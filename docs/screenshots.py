"""``python docs/screenshots.py GALLERY [RUN]``: a gallery's pages and a run's report, as the README shows them."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

PAGES = {
    "gallery": "index.html",
    "matrix": "matrix.html",
    "viewer": "viewer.html#scene=terminator/sphere&a=reference&b=povray&mode=side&at=150,92",
}

# The pictures of a report are loaded and decoded when they come into view.
SEEN = """() => Promise.all([...document.images]
  .filter((each) => each.checkVisibility() && each.getBoundingClientRect().top < innerHeight)
  .map((each) => { each.loading = "eager"; return each.decode(); }))"""


def main(gallery: Path | None, run: Path | None) -> None:
    program = shutil.which("chromium")
    if program is None:
        sys.exit("no Chromium: apt install chromium")
    options = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=options)
        page = browser.new_page(viewport={"width": 1280, "height": 860})
        page.set_default_timeout(120_000)  # milliseconds: the first page of a busy machine takes its time
        if run is not None:
            page.goto((run / "report.html").resolve().as_uri())
            page.wait_for_load_state("load")
            page.evaluate(SEEN)
            page.screenshot(path=Path(__file__).with_name("overview.png"))
        page.emulate_media(color_scheme="dark")  # a gallery's; the report's is light
        for name, address in PAGES.items() if gallery is not None else ():
            page.goto(f"{gallery.resolve().as_uri()}/{address}")
            page.wait_for_load_state("networkidle")
            if name == "viewer":
                page.wait_for_selector("#status", state="hidden")
                page.wait_for_selector("#terms dt")
            page.screenshot(path=Path(__file__).with_name(f"{name}.png"))
        browser.close()


if __name__ == "__main__":
    given = [Path(word) if word != "-" else None for word in sys.argv[1:3]]
    main(*(given + [None] * (2 - len(given)) if given else [Path("notabug-gallery"), Path("notabug-out")]))
