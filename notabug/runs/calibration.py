"""Calibration of adapters: which card a renderer draws first, and what a card's result says against its adapter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from notabug.adapters.base import Adapter, Quality
from notabug.metrics.verdict import Finding, Verdict
from notabug.results.gate import OF_FILES
from notabug.results.record import Result
from notabug.runs.selection import Choice

if TYPE_CHECKING:  # of no use where a card passes
    from notabug.metrics.calibration import Reading

CARDS = (
    Choice("calibration/card", "calibration/card"),
    Choice("calibration/plain_card", "calibration/plain_card", {"light": "distant"}),
    Choice("calibration/plain_card", "calibration/plain_card", {"light": "point"}),
)
"""In the order in which they are tried: the others are for renderers without textures, or without distant lights."""

ADAPTER_FAULTS = frozenset(
    {
        *("upside_down", "mirrored", "rotated", "pixel_shift", "field_of_view", "wrong_size", "wrong_scene"),
        *("light_gain", "gamma", "srgb_encoded", "channels_swapped", "wrong_channels", "black"),
        *("decoded_by_power", "encoded_by_power", "swapped_uv", "flipped_v"),
    }
)
"""Findings on a card that accuse the adapter, not the renderer: until they are gone nothing is judged."""

_OF_TEXTURE = {
    "upside_down": "v of the texture runs downwards: (0, 0) is the bottom left corner of a texture's picture",
    "mirrored": "u of the texture runs to the left: (0, 0) is the bottom left corner of a texture's picture",
    "rotated": "u and v of the texture run backwards: (0, 0) is the bottom left corner of a texture's picture",
}
"""What is wrong where the card with a texture is turned and the one without is not."""


def objection(reading: Reading, verdict: Verdict, plain: Callable[[], Reading | None]) -> str:
    """Why nothing of a renderer is judged after its card, or "": the one rule of ``calibrate`` and of ``run``.

    ``reading`` holds the numbers of the card's picture and ``verdict`` is the judge's. ``plain`` gives the reading of
    the card without a texture, or None where that cannot be drawn. A card that passes is fine, whatever its numbers
    are, unless it is another one at every drawing. A bug that neither calls the adapter's is the renderer's own, to be
    judged.
    """
    if OF_FILES in verdict.triggers:
        return verdict.message  # the disk's, of which no renderer is to blame
    if verdict.word == "error":
        return f"the card could not be drawn ({verdict.message})"
    if verdict.word in ("pass", "limitation"):
        return reading.sentence if reading.causes == ("noise_undeclared",) else ""
    if reading.orientation in reading.causes:
        upright = plain()
        if upright is not None and not upright.orientation and "not_the_card" not in upright.causes:
            return _OF_TEXTURE[reading.orientation]
    if reading.causes and not _better_judged(reading, verdict):
        return reading.sentence
    return "; ".join(each.message or each.name.replace("_", " ") for each in _accusing(verdict))


def as_judged(reading: Reading, verdict: Verdict) -> Reading:
    """``reading`` with the judge's shift and gain where it is the judge that accuses the adapter.

    Beside a sentence of the judge's the table would deny it otherwise.
    """
    accused = {each.name for each in _accusing(verdict)}
    if not accused or (reading.causes and not _better_judged(reading, verdict)):
        return reading
    told = verdict.numbers
    if "pixel_shift" in accused and {"shift_x", "shift_y"} <= told.keys():
        reading = replace(reading, shift=(told["shift_x"], told["shift_y"]))
    if "light_gain" in accused and "gain" in told:
        reading = replace(reading, gain=told["gain"])
    return reading


def _better_judged(reading: Reading, verdict: Verdict) -> bool:
    """Whether a shift was read, and nothing else, that the judge finds too.

    The judge tells it by predicted pictures. With one sample a pixel the edges of the card alone may mistake a tenth of
    a pixel, or see no shift at all.
    """
    return reading.causes == ("pixel_shift",) and [each.name for each in _accusing(verdict)] == ["pixel_shift"]


def _accusing(verdict: Verdict) -> list[Finding]:
    """The findings of the judge that accuse the adapter."""
    return [each for each in verdict.findings if each.kind == "bug" and each.name in ADAPTER_FAULTS]


def refusal(
    card: Result, adapter: Adapter, quality: Quality, out: Path, plain: Callable[[], Result | None] = lambda: None
) -> str:
    """Why nothing of ``adapter`` is judged, or "". A bug on the card that no adapter's fault explains is a bug.

    ``card`` is its result on the card, with the picture below ``out``; ``plain`` draws the card without a texture.
    """
    verdict = card.verdict
    if verdict.word == "unsupported":
        if getattr(adapter, "taken_at_its_word", False):
            return ""
        return f"it can draw none of the cards ({verdict.message})"
    if verdict.word in ("pass", "limitation", "error"):
        from notabug.metrics.calibration import Reading

        return objection(Reading(), verdict, lambda: None)

    def other() -> Reading | None:
        found = plain()
        return None if found is None or not found.image else _read(found, adapter, quality, out)

    return objection(_read(card, adapter, quality, out), verdict, other)


def textured(card: str) -> bool:
    """Whether the card of that id shows its colours by a texture."""
    return card == CARDS[0].id


def _read(card: Result, adapter: Adapter, quality: Quality, out: Path) -> Reading:
    """What the numbers of the card's picture say."""
    from notabug.metrics.calibration import read_card
    from notabug.references.predict import predict
    from notabug.scenes_usd.picture import read_picture
    from notabug.scenes_usd.reader import read_scene

    choice = next(each for each in CARDS if each.id == card.scene and each.variant in ("", card.variant))
    envelope = predict(read_scene(choice.source, choice.variants))
    return read_card([read_picture(out / card.image).pixels], envelope, adapter.declaration(quality))
