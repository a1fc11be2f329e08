"""``python docs/screenshots.py GALLERY``: pictures of a gallery's first page, matrix and viewer for the README."""

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


def main(gallery: Path) -> None:
    program = shutil.which("chromium")
    if program is None:
        sys.exit("no Chromium: apt install chromium")
    options = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=options)
        page = browser.new_page(viewport={"width": 1280, "height": 860})
        for name, address in PAGES.items():
            page.goto(f"{gallery.resolve().as_uri()}/{address}")
            page.wait_for_load_state("networkidle")
            if name == "viewer":
                page.wait_for_selector("#status", state="hidden")
                page.wait_for_selector("#terms dt")
            page.screenshot(path=Path(__file__).with_name(f"{name}.png"))
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "notabug-gallery"))
