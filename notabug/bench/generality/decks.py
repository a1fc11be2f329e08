"""Which features each scene has: every feature is dealt from a deck, so that few scenes hold all and many hold pairs.

A deck has twenty cards. Each block of twenty scenes deals every deck once, in an order of its own (Latin hypercube
sampling, McKay, Beckman and Conover 1979): the share of each feature is exact in every block, and pairs of features
meet as often as chance has it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

DECK = 20  # cards, and scenes in a block

# Faces without area and coincident corners, in a tenth of the scenes.
DEGENERATE = True
# Quads that are not flat, as most quads of scanned or sculpted meshes are.
BENT_QUADS = True

DECKS: dict[str, dict[str, int]] = {
    "shape": {"box": 3, "torus": 3, "ball": 3, "sphere": 4, "capsule": 2, "extrusion": 2, "sheet": 3},
    "cells": {"triangles": 7, "quads": 8, "ngons": 5},
    "transform": {"rigid": 5, "uneven": 5, "shear": 5, "mirror": 5},
    "placing": {"baked": 9, "ops": 7, "matrix": 4},
    "normals": {"flat": 6, "vertex": 8, "faceVarying": 6},
    "look": {"lambert": 3, "textured": 5, "phong": 3, "blinn": 3, "mirror": 2, "glass": 2, "opacity": 2},
    "floor": {"plain": 8, "textured": 6, "shiny": 2, "none": 4},
    "lights": {"point": 5, "distant": 5, "two": 6, "three": 4},
    "objects": {"1": 5, "2": 8, "3": 5, "4": 2},
    "up": {"Y": 15, "Z": 5},
    "frame": {"square": 12, "wide": 4, "tall": 4},
    "wrap": {"repeat": 10, "clamp": 10},
    "colours": {"raw": 10, "sRGB": 10},
    "quality": {"default": 10, "point": 5, "box": 5},
    "degenerate": {"no": 18, "yes": 2},
}


@dataclass(frozen=True, slots=True)
class Traits:
    """What a scene holds: a card of each deck."""

    shape: str
    cells: str
    transform: str
    placing: str
    normals: str
    look: str
    floor: str
    lights: str
    objects: str
    up: str
    frame: str
    wrap: str
    colours: str
    quality: str
    degenerate: str

    def words(self) -> str:
        """The traits in one line, for tables."""
        return " ".join(str(getattr(self, each.name)) for each in fields(self))


def traits(seed: int, index: int) -> Traits:
    """The traits of scene ``index`` of ``seed``."""
    made = dealt(DECKS, seed, index)
    if not DEGENERATE:
        made["degenerate"] = "no"
    return Traits(**made)


def dealt(decks: Mapping[str, Mapping[str, int]], seed: int, index: int) -> dict[str, str]:
    """The card of each of ``decks`` for scene ``index`` of ``seed``."""
    block, place = divmod(index, DECK)
    made = {}
    for number, (name, weights) in enumerate(decks.items()):
        deck = [card for card, count in weights.items() for _ in range(count)]
        order = np.random.default_rng((seed, 1, block, number)).permutation(DECK)
        made[name] = deck[int(order[place])]
    return made


def generator(seed: int, index: int) -> np.random.Generator:
    """The random numbers of scene ``index`` of ``seed``: the same on every machine."""
    return np.random.default_rng((seed, 0, index))
