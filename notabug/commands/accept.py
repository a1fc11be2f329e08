"""The ``accept`` command: one result of the last run becomes one entry of the expectation file, for review."""

from __future__ import annotations

import datetime
import json
import math
import os
from collections.abc import Sequence
from pathlib import Path

from notabug.exit_codes import ExitCode
from notabug.results.expect_file import ACCEPTED, HEAD, ExpectationError, values, with_entry
from notabug.results.expectation import Band, Entry, found_names
from notabug.results.record import Result, load
from notabug.results.wording import area, strongest
from notabug.runs.folders import write_text
from notabug.runs.progress import console
from notabug.runs.selection import parse_variants
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.view import AS_IT_IS, View, variant_word

LEAST = {"area_px": 2.0, "jnd": 0.05}  # a band is never narrower to either side: rounding, compilers, machines


def command(
    *,
    scene: str,
    renderer: str,
    variants: Sequence[str],
    view: View = AS_IT_IS,
    because: str,
    link: str,
    expires: str,
    band: float,
    out: Path,
    path: Path,
    as_json: bool = False,
) -> ExitCode:
    """Write the entry for the result of ``scene``, ``renderer`` and ``variants`` in the run ``out`` to ``path``."""
    if os.environ.get("CI", "").strip().lower() not in ("", "0", "false"):
        raise ExpectationError("a build server accepts nothing", where="CI is set", do="accept it at your desk")
    if not because.strip():
        raise SelectionError("an entry needs a reason", where="--because")
    document = load(out)
    result = _result([Result.from_dict(each) for each in document["results"]], scene, renderer, variants, view)
    entry = entry_for(result, because.strip(), document["tool"]["models"], link, _date(expires), band)
    text = path.read_text(encoding="utf-8") if path.is_file() else HEAD
    write_text(path, with_entry(text, entry))
    if as_json:
        print(json.dumps({"file": str(path), "accepted": values(entry)}, ensure_ascii=False, default=str))
        return ExitCode.OK
    band_text = ", ".join(f"{key} {getattr(entry, key)}" for key in LEAST if getattr(entry, key))
    what = ": ".join(part for part in (entry.verdict, entry.name) if part)
    console().print(f"{path}: {' '.join(filter(None, entry.key))}, {what}", markup=False, soft_wrap=True)
    if band_text:
        console().print(f"  {band_text}", markup=False)
    return ExitCode.OK


def entry_for(
    result: Result, because: str, models: str, link: str, expires: datetime.date | None, share: float
) -> Entry:
    """The entry that expects ``result`` again, its area and jnd within ``share`` of what they are."""
    word = result.verdict.word
    if word not in ACCEPTED:
        raise SelectionError("there is nothing to accept", where=f"{result.scene} {result.renderer}", got=word)
    names = found_names(result)
    return Entry(
        renderer=result.renderer,
        scene=result.scene,
        variant=result.variant,
        verdict=word,
        name=" + ".join(sorted(names)),
        area_px=_band(area(result), share, LEAST["area_px"]) if names else None,
        jnd=_band(strongest(result), share, LEAST["jnd"]) if names else None,
        because=because,
        link=link,
        expires=expires,
        models=models,
    )


def _band(value: float, share: float, least: float) -> Band | None:
    """Around ``value``, rounded outwards to hundredths; nothing is said of a value that is not finite."""
    if not math.isfinite(value):
        return None
    room = max(share * value, least)
    return (max(0.0, math.floor((value - room) * 100) / 100), math.ceil((value + room) * 100) / 100)


def _result(results: Sequence[Result], scene: str, renderer: str, variants: Sequence[str], view: View) -> Result:
    wanted = {variant_word(key, value) for key, values in parse_variants(variants).items() for value in values}
    wanted |= set(view.words)
    found = [
        result
        for result in results
        if result.scene == scene and result.renderer == renderer and wanted <= set(result.variant.split(","))
    ]
    if len(found) == 1:
        return found[0]
    if found:
        got = "; ".join(each.variant for each in found)
        raise SelectionError(f"{len(found)} variants in the run", where=scene, got=got, do="name one with --variant")
    got = ", ".join(sorted({f"{result.scene} {result.renderer}" for result in results})[:8])
    raise SelectionError("no such result in the run", where=f"{scene} {renderer}", got=got or "an empty run")


def _date(text: str) -> datetime.date | None:
    if not text:
        return None
    try:
        return datetime.date.fromisoformat(text)
    except ValueError:
        raise SelectionError("not a date", where="--expires", expected="YYYY-MM-DD", got=repr(text)) from None
