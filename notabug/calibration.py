"""Calibration of adapters: which card a renderer draws first, and what a card's result says against its adapter."""

from __future__ import annotations

from pathlib import Path

from notabug.adapters.base import Adapter, Quality
from notabug.record import Result
from notabug.selection import Choice

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
    }
)
"""Findings on a card that accuse the adapter, not the renderer: until they are gone nothing is judged."""


def refusal(card: Result, adapter: Adapter, quality: Quality, out: Path) -> str:
    """Why nothing of ``adapter`` is judged, or "". A bug on the card that no adapter's fault explains is a bug.

    ``card`` is its result on the card, with the picture below ``out``.
    """
    verdict = card.verdict
    if verdict.word == "unsupported":
        if getattr(adapter, "taken_at_its_word", False):
            return ""
        return f"it can draw none of the cards ({verdict.message})"
    if verdict.word == "error":
        return f"the card could not be drawn ({verdict.message})"
    if verdict.word in ("pass", "limitation"):
        return ""
    faults = [each for each in verdict.findings if each.kind == "bug" and each.name in ADAPTER_FAULTS]
    if faults:
        return "; ".join(each.message or each.name.replace("_", " ") for each in faults)
    return _read(card, adapter, quality, out)


def _read(card: Result, adapter: Adapter, quality: Quality, out: Path) -> str:
    """What the numbers of the card's picture say where the judge has no single name for it: two faults at once."""
    from notabug.metrics.calibration import read_card
    from notabug.references.predict import predict
    from notabug.scenes_usd.picture import read_picture
    from notabug.scenes_usd.reader import read_scene

    choice = next(each for each in CARDS if each.id == card.scene and each.variant in ("", card.variant))
    envelope = predict(read_scene(choice.source, choice.variants))
    reading = read_card([read_picture(out / card.image).pixels], envelope, adapter.declaration(quality))
    return reading.sentence if reading.causes else ""
