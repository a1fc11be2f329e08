"""``python docs/pages.py --to DIR [PAGE ...] [--terminal "WORDS"]``: photograph pages as people meet them, weigh them.

Each PAGE (a report.html, a gallery's or the site's index.html) is taken in both widths, light and dark. Printed are
the bytes of the page, of what it loads before anybody scrolls, and of all its pictures, and the time to the first
paint: the least of several loads, each in a browser context of its own. ``--terminal`` runs one command of notabug in a
terminal of 80 columns and photographs that. Whoever changes a page looks at the pictures; the exit code is 1 where a
page is heavier or slower than it may be.
"""

from __future__ import annotations

import argparse
import os
import pty
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

HEAVIEST = 2 << 20  # bytes of a report or page with all that it may load: one sends it, and phones load it
SLOWEST = 0.3  # seconds to the first paint: from there on a page is felt to be late
LOADS = 3  # of which the quickest counts: a machine may be busy
WIDTHS = {"wide": (1280, 860), "narrow": (390, 844)}  # pixels: a window, and a telephone
COLUMNS = 80
PATIENCE = 400  # looks at the first paint, of 50 ms each
PAINT = "() => performance.getEntriesByName('first-contentful-paint').map((entry) => entry.startTime)[0] ?? null"


@dataclass(frozen=True, slots=True)
class Weighed:
    """Bytes of a page alone, with what it loads unasked, and with all its pictures; seconds to its first paint."""

    page: int
    loaded: int
    whole: int
    paint: float

    def __str__(self) -> str:
        sizes = (f"{size / 1024:.0f} KiB" for size in (self.page, self.loaded, self.whole))
        return "page {}, at first sight {}, with all pictures {}".format(*sizes) + f"; first paint {self.paint:.2f} s"

    def too_much(self) -> list[str]:
        """What of it is more than it may be."""
        heavy = [f"heavier than {HEAVIEST >> 20} MiB"] if self.whole > HEAVIEST else []
        return heavy + ([f"later than {SLOWEST} s"] if self.paint > SLOWEST else [])


def first_paint(tab: Page) -> float:
    """Seconds from the start of the navigation; a page's own policy forbids Playwright's way of waiting for it."""
    for _ in range(PATIENCE):
        found = tab.evaluate(PAINT)
        if found is not None:
            return float(found) / 1000.0
        tab.wait_for_timeout(50)
    raise TimeoutError(f"{tab.url} paints nothing")


def weigh(browser: Browser, page: Path) -> Weighed:
    """The weight of the page at that path, and its time to the first paint."""
    paints, loaded = [], {page.resolve()}
    for _ in range(LOADS):
        context = browser.new_context(viewport={"width": 1280, "height": 860})
        tab = context.new_page()
        tab.on("request", lambda request: loaded.add(Path(unquote(urlsplit(request.url).path))))
        tab.goto(page.resolve().as_uri())
        tab.wait_for_load_state("load")
        paints.append(first_paint(tab))
        context.close()
    beside = page.with_name(f"{page.stem}_files")
    own = page.stat().st_size
    pictures = sum(path.stat().st_size for path in beside.rglob("*") if path.is_file()) if beside.is_dir() else 0
    at_first = sum(path.stat().st_size for path in loaded if path.is_file())
    return Weighed(own, at_first, max(at_first, own + pictures), min(paints))


def photograph(browser: Browser, page: Path, to: Path, name: str) -> None:
    """The page's first window in every width, light and dark."""
    for width, (across, down) in WIDTHS.items():
        for scheme in ("light", "dark"):
            tab = browser.new_page(viewport={"width": across, "height": down}, color_scheme=scheme)  # type: ignore[arg-type]
            tab.goto(page.resolve().as_uri())
            tab.wait_for_load_state("load")
            tab.wait_for_timeout(300)  # milliseconds, in which pictures in view are decoded
            tab.screenshot(path=to / f"{name}-{width}-{scheme}.png")
            tab.close()


def in_a_terminal(words: list[str]) -> str:
    """What a command of notabug prints where it is at a terminal of 80 columns, with its colours."""
    here, there = pty.openpty()
    environment = os.environ | {"COLUMNS": str(COLUMNS), "LINES": "40", "TERM": "xterm-256color"}
    environment.pop("NO_COLOR", None)
    command = [sys.executable, "-m", "notabug", *words]
    with subprocess.Popen(command, stdout=there, stderr=there, stdin=there, env=environment) as process:
        os.close(there)
        printed = b""
        while True:
            try:
                part = os.read(here, 1 << 16)
            except OSError:  # so Linux says that the other end is closed
                break
            if not part:
                break
            printed += part
        process.wait()
    os.close(here)
    return printed.decode("utf-8", "replace").replace("\r\n", "\n")


def drawn(text: str, words: list[str]) -> str:
    """A terminal's text with escapes for colours as a picture (SVG), without lines that were wiped."""
    from io import StringIO

    from rich.console import Console
    from rich.text import Text

    kept = "\n".join(line.rsplit("\r", 1)[-1] for line in re.sub(r"\x1b\[[0-9;?]*[A-HJKfhl]", "", text).split("\n"))
    console = Console(record=True, width=COLUMNS, file=StringIO(), force_terminal=True)
    console.print(f"$ notabug {shlex.join(words)}", markup=False, highlight=False)
    console.print(Text.from_ansi(kept))
    return console.export_svg(title=f"{COLUMNS} columns")


def main(pages: list[Path], to: Path, terminal: str) -> int:
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    if program is None:
        sys.exit("no Chromium: apt install chromium")
    to.mkdir(parents=True, exist_ok=True)
    wrong = 0
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        for page in pages:
            weight = weigh(browser, page)
            faults = weight.too_much()
            wrong += bool(faults)
            print(f"{page}: {weight}{''.join(f'; {fault}' for fault in faults)}", flush=True)
            photograph(browser, page, to, f"{page.resolve().parent.name}-{page.stem}")
        if terminal:
            words = shlex.split(terminal)
            picture = to / "terminal.svg"
            picture.write_text(drawn(in_a_terminal(words), words), encoding="utf-8")
            tab = browser.new_page(viewport={"width": 1100, "height": 900})
            tab.goto(picture.resolve().as_uri())
            tab.screenshot(path=to / "terminal.png")
        browser.close()
    print(f"look at the pictures in {to}")
    return 1 if wrong else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*", type=Path, metavar="PAGE")
    parser.add_argument("--to", type=Path, required=True, metavar="DIR")
    parser.add_argument("--terminal", default="", metavar="WORDS")
    given = parser.parse_args()
    sys.exit(main(given.pages, given.to, given.terminal))
