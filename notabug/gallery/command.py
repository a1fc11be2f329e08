"""The ``gallery`` command: build the site, say where it is and how large."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from notabug.exit_codes import ExitCode
from notabug.gallery.site import build
from notabug.gallery.steps import told_on
from notabug.runs.progress import console


def command(
    runs: Sequence[Path],
    out: Path,
    *,
    every_variant: bool,
    with_models: bool,
    step: int,
    bench: Path | None,
    white: float,
    only: Sequence[str],
    as_json: bool = False,
) -> ExitCode:
    """Write the gallery and print its first page."""
    page = build(
        runs,
        out,
        every_variant=every_variant,
        with_models=with_models,
        step=step,
        bench=bench,
        white=white,
        only=only,
        steps=told_on(console(stderr=True)),
    )
    size = sum(each.stat().st_size for each in out.rglob("*") if each.is_file())
    if as_json:
        print(json.dumps({"gallery": str(page), "bytes": size}, ensure_ascii=False))
        return ExitCode.OK
    print(page)
    console(stderr=True).print(f"{size / 1e6:.1f} MB; open it from disk, or put the folder on any web host")
    return ExitCode.OK
