"""``python docs/renderers.py RUN...``: write below the notes of docs/renderers/NAME.md what runs found of the renderer.

What stands above the line ``MARK`` is written by hand and kept.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from notabug.adapters.base import Quality
from notabug.adapters.registry import adapter
from notabug.report.page import load
from notabug.results.wording import number, readable

FOLDER = Path(__file__).with_name("renderers")
MARK = "<!-- from runs, by docs/renderers.py -->"


def page(name: str, version: str, results: Sequence[Mapping[str, Any]]) -> str:
    """What ``results`` say of the renderer ``name``, as Markdown."""
    known = adapter(name)
    words = Counter(result["verdict"] for result in results)
    in_renderer = sum(result["seconds"].get("render", 0.0) for result in results)
    drawn = sum(count for word, count in words.items() if word not in ("unsupported", "error"))
    mean = in_renderer / max(1, drawn)
    told = ", ".join(f"{count} {word}" for word, count in words.most_common())
    declared = known.declaration(Quality())
    every = {field.name: getattr(declared, field.name) for field in fields(declared)}
    stated = {name: value for name, value in every.items() if value not in ("unknown", "", -1.0, math.inf)}
    lines = [
        MARK,
        "",
        "## What runs found",
        "",
        f"Version {version}; {len(results)} scenes: {told}; {number(mean)} s a scene in the renderer.",
        "",
        f"Draws: {', '.join(sorted(known.capabilities))}.",
        "",
        "| declared | |",
        "|---|---|",
        *(f"| {readable(name)} | {_value(value)} |" for name, value in stated.items()),
        "",
        "| scene | verdict | findings | area, px |",
        "|---|---|---|---|",
        *(_row(result) for result in results if result["verdict"] != "unsupported"),
    ]
    return "\n".join(lines) + "\n"


def _value(value: object) -> str:
    return number(value) if isinstance(value, float) else str(value)


def _row(result: Mapping[str, Any]) -> str:
    """A line of the table of scenes."""
    findings = result["findings"]
    names = ", ".join(f"{finding['kind']}: {readable(finding['name'])}" for finding in findings)
    area = ", ".join(number(round(finding["area_px"])) for finding in findings)
    scene = f"`{result['scene']}` {result['variant']}".rstrip()
    return f"| {scene} | {result['verdict']} | {names} | {area} |"


def main(folders: Sequence[str]) -> None:
    """Write the page of every renderer that the runs in ``folders`` hold and that has notes."""
    runs = [load(Path(folder)) for folder in folders]
    versions = {name: found["version"] for run in runs for name, found in run["renderers"].items()}
    for name, version in versions.items():
        target = FOLDER / f"{name}.md"
        if not target.is_file():
            continue
        notes = target.read_text("utf-8").partition(MARK)[0].rstrip()
        results = [result for run in runs for result in run["results"] if result["renderer"] == name]
        target.write_text(f"{notes}\n\n{page(name, version, results)}", "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
