"""Cards of opacity in the deck of exports: what they write is read as a cutout."""

from __future__ import annotations

from pathlib import Path

import pytest

from notabug.bench.generality.decks import DECK
from notabug.bench.generality.features.decks import DECKS, features
from notabug.bench.generality.features.draw import write_export
from notabug.scenes_usd.own import take_scene


def first(card: str) -> int:
    """The first export with the card whose mesh need not be refined."""
    return next(i for i in range(50 * DECK) if (found := features(0, i)).opacity == card and found.geometry == "mesh")


def test_every_deck_has_as_many_cards() -> None:
    assert {name: sum(cards.values()) for name, cards in DECKS.items()} == dict.fromkeys(DECKS, DECK)


@pytest.mark.parametrize("card", ["cutout", "channel"])
def test_a_card_of_opacity_is_a_cutout(card: str, tmp_path: Path) -> None:
    scene = take_scene(write_export(0, first(card), tmp_path)).scene
    (cut,) = (each for each in scene.materials if each.opacity_map >= 0)
    assert 0.2 <= cut.cutoff <= 0.6
    mask = scene.textures[cut.opacity_map].pixels
    assert mask.min() < cut.cutoff < mask.max()
