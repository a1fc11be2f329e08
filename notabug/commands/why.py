"""The ``why`` command: what each model predicts at one pixel, term by term, and which one fits."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from notabug.adapters.declared import said
from notabug.commands.judge import declare, one_variant, what_was_read
from notabug.exit_codes import ExitCode
from notabug.metrics.why import explain_pixel
from notabug.printable import escaped
from notabug.results.of_run import found as found_run
from notabug.runs.progress import console
from notabug.runs.waiting import saying
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.view import AS_IT_IS, View

SHOWN = 5  # explanations, the best ones
CLOSEST = 24  # models that are looked at closely to find them


def command(
    *,
    image: Path,
    source: str,
    variants: Sequence[str],
    view: View = AS_IT_IS,
    pixel: str,
    filter_name: str,
    precision: str,
    srgb: bool,
    as_json: bool,
    declare_words: Sequence[str] = (),
    layer: str = "",
    every: bool = False,
) -> ExitCode:
    """Explain the pixel ``X,Y`` (y down, from 0) of ``image`` by the best models, or by ``every`` one.

    Without ``source`` the picture is one of a run, which knows its scene; without ``pixel`` its worst one is taken.
    """
    known = None if source else found_run(image)
    picture = read_picture(image, layer=layer, srgb=srgb)
    height, width = picture.pixels.shape[:2]
    if known is None:
        scene = take_scene(source, one_variant(variants), replace(view, size=(width, height)), "picture").scene
    else:
        scene = known.scene()
    place = known.worst_pixel() if known is not None and not pixel else None
    x, y = place or parse_pixel(pixel, width, height)
    if known is None:
        declaration = declare([picture], filter_name, None, precision, srgb=srgb, noisy=None, said=said(declare_words))
    else:
        declaration = replace(known.declaration(), **said(declare_words))
    verdict = None if known is None else known.result.verdict
    closest = None if every or as_json else CLOSEST
    with saying(console(stderr=True), f"explaining pixel ({x}, {y})"):
        found = explain_pixel(picture.pixels, scene, declaration, x, y, closest=closest, verdict=verdict)
    if as_json:
        read = {"channels": list(picture.judged), "notes": list(picture.notes)}
        print(escaped(json.dumps(found.as_dict() | read, ensure_ascii=False, allow_nan=False)))
    else:
        console().print(found.as_text(None if every else SHOWN), markup=False, soft_wrap=True)
        console().print(what_was_read(picture.judged, picture.notes), style="dim", markup=False, soft_wrap=True)
    return ExitCode.OK


def parse_pixel(text: str, width: int, height: int) -> tuple[int, int]:
    """``X,Y`` inside of a picture.

    >>> parse_pixel("140,88", 256, 256)
    (140, 88)
    """
    x, comma, y = text.partition(",")
    if not (comma and x.strip().isdecimal() and y.strip().isdecimal()):
        raise SelectionError("not a pixel", where="--pixel", expected="X,Y such as 140,88", got=repr(text))
    if int(x) >= width or int(y) >= height:
        raise SelectionError("outside of the picture", where="--pixel", expected=f"below {width},{height}", got=text)
    return int(x), int(y)
