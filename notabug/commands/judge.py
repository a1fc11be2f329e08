"""The ``judge`` command: pictures made anywhere, taken as declared."""

from __future__ import annotations

import json
import math
import shlex
import shutil
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from rich.console import Console
from rich.text import Text

from notabug.adapters import declared
from notabug.adapters.base import Declaration, Filter
from notabug.adapters.declared import RADIUS, SRGB_SLOPE
from notabug.exit_codes import ExitCode
from notabug.printable import escaped
from notabug.results.gate import Gate, code_of
from notabug.results.record import Result, json_ready, run_document
from notabug.results.wording import number, readable
from notabug.runs.folders import folder_name, write_json
from notabug.runs.judge_files import judge_pictures
from notabug.runs.own_folder import claim
from notabug.runs.progress import console, verdict_text
from notabug.runs.provenance import tool
from notabug.runs.selection import parse_variants
from notabug.runs.waiting import saying
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.picture import Picture, read_picture, write_exr
from notabug.scenes_usd.reader import find
from notabug.scenes_usd.view import AS_IT_IS, View


def command(
    *,
    images: Sequence[Path],
    source: str,
    variants: Sequence[str],
    view: View = AS_IT_IS,
    filter_name: str,
    radius: float | None,
    precision: str,
    srgb: bool,
    noisy: bool | None,
    samples: int,
    out: Path | None,
    as_json: bool,
    declare_words: Sequence[str] = (),
    layer: str = "",
    quiet: bool = False,
) -> ExitCode:
    """Judge ``images`` as seeds of one renderer and print the verdict."""
    begun = time.perf_counter()
    if out is not None:
        claim(out, "run")
    chosen = one_variant(variants)
    find(source, chosen, view)  # what is wrong with the words is told before anything is read
    pictures = [read_picture(path, layer=layer, srgb=srgb) for path in images]
    height, width = pictures[0].pixels.shape[:2]
    taken = take_scene(source, chosen, replace(view, size=(width, height)), "picture")
    scene = taken.scene
    if taken.told(source):
        console(stderr=True).print(Text(taken.told(source)), soft_wrap=True)
    said = declared.said(declare_words)
    declaration = declare(pictures, filter_name, radius, precision, srgb=srgb, noisy=noisy, samples=samples, said=said)
    folder = out / folder_name(scene.id) if out else None
    paths = list(images) if folder is None else _kept(images, pictures, folder, anew=srgb or bool(layer))
    with saying(console(stderr=True), f"judging {scene.id}", quiet=quiet):
        outcome = judge_pictures(paths, scene, declaration, folder, pictures=pictures, srgb=srgb)
    result = Result(
        scene=scene.id,
        variant=scene.variant,
        renderer="file",
        renderer_version="",
        verdict=outcome.verdict,
        seeds=len(images),
        seconds={"render": 0.0, "judge": outcome.seconds},
        image=outcome.image.relative_to(out).as_posix() if out else str(images[0]),
        images={name: path.relative_to(out).as_posix() for name, path in outcome.images.items()} if out else {},
        size=outcome.size,
        command=shlex.join(["notabug", *sys.argv[1:]]),
        claim=scene.card.claim,
        channels=outcome.channels,
        notes=(*outcome.notes, *scene.notes),
    )
    result = Gate().judged(result)
    total = time.perf_counter() - begun
    plain = run_document(
        tool=tool(),
        command=["notabug", *sys.argv[1:]],
        seconds={"total": total, "render": 0.0, "outside": total},
        renderers={"file": {"version": "", "where": ""}},
        results=[result],
    )
    said = {name: getattr(declaration, name) for name in Declaration.__slots__}
    document = {**plain, "declaration": json_ready(said)}
    if out is not None:
        write_json(out / "run.json", document)
        from notabug.report.page import draw  # takes a while to load, which a verdict alone need not wait for

        page = draw(out)
        console(stderr=True).print(str(page), markup=False, soft_wrap=True)
    if as_json:
        print(escaped(json.dumps(document, ensure_ascii=False, allow_nan=False)))
    else:
        _show(console(), result, quiet=quiet)
    return code_of([result])


def one_variant(words: Sequence[str]) -> dict[str, str]:
    """``SET=NAME`` words as a choice: a picture shows one variant of each set."""
    wanted = parse_variants(words)
    for name, values in wanted.items():
        if len(values) > 1:
            raise SelectionError(
                f"{len(values)} variants of {name!r}", where="--variant", expected="one: a picture shows one"
            )
    return {name: values[0] for name, values in wanted.items()}


def declare(
    pictures: Sequence[Picture],
    filter_name: str,
    radius: float | None,
    precision: str,
    *,
    srgb: bool,
    noisy: bool | None,
    samples: int = 0,
    said: Mapping[str, object] | None = None,
) -> Declaration:
    """What is known about pictures that came as files: the options, and the number format of the coarsest file.

    ``said`` is what is declared beyond the options. Nothing else is known.
    """
    coarsest = max(pictures, key=lambda picture: picture.quantum)
    made = Declaration(
        precision="float64" if precision == "float64" else "float32",
        filter=cast(Filter, filter_name),
        radius=RADIUS[filter_name] if radius is None else radius,
        quantum=coarsest.quantum * (SRGB_SLOPE if srgb else 1.0),
        relative_quantum=coarsest.relative_quantum,
        shared_exponent=coarsest.shared_exponent,
        white=1.0 if coarsest.stored.startswith(("uint", "int")) else math.inf,
        noisy=(True if len(pictures) > 1 else None) if noisy is None else noisy,
        samples=samples,
        **declared.unknown(),
    )
    fields: dict[str, Any] = {"hit_error": -1.0, **(said or {})}
    return replace(made, **fields) if said else made


def _kept(images: Sequence[Path], pictures: Sequence[Picture], folder: Path, *, anew: bool) -> list[Path]:
    """The pictures as files in ``folder``: copies, or written ``anew`` as they were read."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for index, (image, picture) in enumerate(zip(images, pictures, strict=True)):
        path = folder / f"picture-{index}{'.exr' if anew else image.suffix}"
        if anew:
            write_exr(path, picture.pixels)
        else:
            shutil.copyfile(image, path)
        paths.append(path)
    return paths


def what_was_read(channels: Sequence[str], notes: Sequence[str]) -> str:
    """One line: the channels that were judged, and what reading them took.

    >>> what_was_read(["R", "G", "B"], ["its Orientation is 4: rows are stored bottom up"])
    'judged: R, G, B; its Orientation is 4: rows are stored bottom up'
    """
    return f"judged: {'; '.join([', '.join(channels), *notes])}"


def _show(out: Console, result: Result, *, quiet: bool) -> None:
    verdict = result.verdict
    where = " ".join(part for part in (result.scene, result.variant) if part)
    out.print(verdict_text(result).append(f"  {where}", style="default not bold"))
    if verdict.message:
        out.print(verdict.message, markup=False)
    if quiet:
        return
    for finding in verdict.findings:
        x0, y0, x1, y1 = finding.region
        line = f"  {finding.kind}: {readable(finding.name)}, {number(round(finding.area_px, 1))} px in "
        line += f"[{x0}, {x1}) x [{y0}, {y1}), "
        line += f"jnd {number(finding.jnd, 2)}, z {number(finding.z)}{'' if finding.visible else ', invisible'}"
        out.print(Text(line + (f": {finding.message}" if finding.message else "")))
    out.print(what_was_read(result.channels, result.notes), style="dim", markup=False, soft_wrap=True)
    numbers = ", ".join(f"{readable(name)} {number(value, 4)}" for name, value in verdict.numbers.items())
    if numbers:
        out.print(numbers, style="dim", markup=False)
