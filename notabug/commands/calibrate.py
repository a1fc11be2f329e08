"""The ``calibrate`` command: draws a card, reads it off, says what to change; remembered by renderer and version."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from notabug.adapters.base import Adapter, Found, Quality, UnsupportedError
from notabug.adapters.registry import adapter as adapter_called
from notabug.adapters.registry import adapters
from notabug.exit_codes import ExitCode
from notabug.metrics.calibration import Reading, read_card
from notabug.metrics.formulas import BOX_DEVIATION
from notabug.metrics.verdict import Verdict
from notabug.printable import escaped
from notabug.references.cache import cache_root
from notabug.references.predict import predict
from notabug.results.wording import number, readable
from notabug.runs.calibration import CARDS, as_judged, objection, textured
from notabug.runs.folders import write_json
from notabug.runs.judge_files import judge_pictures
from notabug.runs.plan import find_renderers, left_out
from notabug.runs.progress import console
from notabug.runs.provenance import fingerprint
from notabug.runs.selection import Choice
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.temporary import temporary_folder

UNNAMED_BUG = "nothing stands between the renderer and the card, but the card shows a bug, as a run will say"


@dataclass(frozen=True, slots=True)
class Calibrated:
    """What calibration found: ``fine`` where the renderer is judged, else ``sentence`` says what to change."""

    renderer: str
    version: str
    fine: bool
    sentence: str
    card: str = ""
    verdict: str = ""
    reading: dict[str, Any] = field(default_factory=dict)
    cached: bool = False


def command(renderers: Sequence[str], samples: int, timeout: float, fresh: bool, as_json: bool) -> ExitCode:
    """Calibrate ``renderers`` (all that are installed when empty) and print what was read."""
    quiet = console(stderr=True)
    asked = {name: adapter_called(name) for name in dict.fromkeys(renderers)} if renderers else adapters()
    whys: dict[str, str] = {}
    found, missing = find_renderers(asked, whys.__setitem__)
    for line in left_out(whys, asked=bool(renderers)):
        quiet.print(line, markup=False, soft_wrap=True)
    quality = Quality(samples=samples, timeout=timeout)
    results = [calibrate(each, there, quality, fresh=fresh) for each, there in found.values()]
    if as_json:
        print(escaped(json.dumps({"calibration": [asdict(each) for each in results]}, ensure_ascii=False)))
    else:
        for each in results:
            _show(each)
    if any(each.fine and each.verdict == "bug" for each in results):
        return ExitCode.BUG
    failed = any(not each.fine for each in results) or (bool(renderers) and bool(missing))
    return ExitCode.RENDERER if failed else ExitCode.OK


def calibrate(adapter: Adapter, found: Found, quality: Quality, *, fresh: bool = False) -> Calibrated:
    """The calibration of ``adapter``, from the cache where its version, its settings and our code are the same."""
    parts = [adapter.name, found.version, found.key, repr(quality), repr(adapter.declaration(quality))]
    code = fingerprint("scenes_usd", "references", "adapters", "metrics")
    key = hashlib.blake2b(json.dumps([*parts, code]).encode(), digest_size=16).hexdigest()
    path = cache_root() / "calibration" / f"{key}.json"
    if not fresh:
        try:
            known = replace(Calibrated(**json.loads(path.read_text("utf-8"))), cached=True)
            if known.fine:  # what was refused may have been mended where nobody looks, and is drawn again
                return known
        except (OSError, ValueError, TypeError):
            pass
    try:
        made = _measure(adapter, found, quality)
    except NotabugError as error:  # not remembered: the next time it may work
        return Calibrated(adapter.name, found.version, False, str(error))
    with contextlib.suppress(OSError):  # on a full disk it is measured again the next time
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(path, asdict(made))
    return made


def _measure(adapter: Adapter, found: Found, quality: Quality) -> Calibrated:
    unsupported = ""
    for place, choice in enumerate(CARDS):
        try:
            drawn = _draw(adapter, choice, quality)
        except UnsupportedError as error:
            unsupported = unsupported or str(error)
            continue
        rest = CARDS[place + 1 :] if textured(choice.id) else ()
        refused = objection(drawn.reading, drawn.verdict, partial(_other, adapter, rest, quality))
        passed = drawn.verdict.word in ("pass", "limitation")
        sentence = refused or ("" if passed else f"{UNNAMED_BUG}: {drawn.verdict.message}")
        reading = _plain(as_judged(drawn.reading, drawn.verdict))
        return Calibrated(adapter.name, found.version, not refused, sentence, drawn.card, drawn.verdict.word, reading)
    return Calibrated(adapter.name, found.version, False, f"it can draw none of the cards: {unsupported}")


@dataclass(frozen=True, slots=True)
class _Drawn:
    """A card that was drawn: its name, what its numbers say, and the verdict on it."""

    card: str
    reading: Reading
    verdict: Verdict


def _draw(adapter: Adapter, choice: Choice, quality: Quality) -> _Drawn:
    """Draw the card twice, the second time with the first seed only; raises UnsupportedError."""
    scene = read_scene(choice.source, choice.variants)
    with temporary_folder() as folder:
        first, second = folder / "first", folder / "second"
        first.mkdir()
        second.mkdir()
        renders = adapter.render(scene, first, quality)
        again = adapter.render(scene, second, replace(quality, seeds=quality.seeds[:1]))
        read = [read_picture(each.image) for each in renders]
        pictures = [each.pixels for each in read]
        repeats = np.array_equal(read_picture(again[0].image).pixels, pictures[0], equal_nan=True)
        declaration = adapter.declaration(quality)
        reading = read_card(pictures, predict(scene), declaration, repeats)
        paths = [each.image for each in renders]
        verdict = judge_pictures(paths, scene, declaration, None, pictures=read).verdict
    return _Drawn(f"{scene.id} {scene.variant}".rstrip(), reading, verdict)


def _other(adapter: Adapter, cards: Sequence[Choice], quality: Quality) -> Reading | None:
    """The reading of the first of ``cards`` that ``adapter`` can draw."""
    for choice in cards:
        try:
            return _draw(adapter, choice, quality).reading
        except UnsupportedError:
            continue
    return None


def _plain(reading: Reading) -> dict[str, object]:
    plain = asdict(reading)
    plain["shift"], plain["causes"] = list(reading.shift), list(reading.causes)
    return plain


def _show(each: Calibrated) -> None:
    out = console()
    mark = Text("! refused", style="bold magenta")
    if each.fine:
        mark = Text("✓ calibrated", style="green") if not each.sentence else Text("✗ bug", style="bold red")
    out.print(mark.append(f"  {each.renderer} {each.version}", style="default not bold"), soft_wrap=True)
    if each.sentence:
        out.print(f"  {each.sentence}", markup=False, soft_wrap=True)
    if not each.reading:
        return
    read = each.reading
    table = Table(box=None, show_header=False, pad_edge=False)
    repeats = {True: "yes", False: "no", None: "not tried"}[read["repeats"]]
    for name, value in (
        ("card", f"{each.card}: {each.verdict}{', remembered' if each.cached else ''}"),
        ("gain, gamma", f"{number(read['gain'], 5)}, {number(read['gamma'], 4)}{' (sRGB)' if read['srgb'] else ''}"),
        ("orientation, channels", f"{readable(read['orientation']) or 'upright'}, {read['channels']}"),
        ("shift (right, down)", f"{read['shift'][0]:+.2f}, {read['shift'][1]:+.2f} pixels"),
        ("magnification", number(read["scale"], 5)),
        ("pixel filter", _width(read["width"])),
        ("noise between seeds", number(read["noise"], 3)),
        ("same seed, same picture", repeats),
    ):
        table.add_row(f"  {name}", Text(value))
    out.print(table)


def _width(found: float) -> str:
    """The width of the pixel filter in words: what is no wider than a box of one pixel may as well be a point."""
    if found <= BOX_DEVIATION + 0.005:  # a hundredth is what is shown
        return "no wider than one pixel: a point or a box"
    return (
        f"{found:.2f} pixels (standard deviation; a box of one pixel has {BOX_DEVIATION:.2f}, a tent of radius 1 0.41)"
    )
