"""once: what is found of a scene or a mesh, kept as long as somebody holds the scene or the mesh, and no longer."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

Thing = TypeVar("Thing")
Found = TypeVar("Found")


def once(find: Callable[[Thing], Found]) -> Callable[[Thing], Found]:
    """``find``, done once for each thing, which is told from others by identity.

    A cache of the last few things instead would hold their arrays: a judge edits a scene hundreds of times, textures of
    many megabytes with it, and drops each edited scene after one look.
    """
    known: WeakKeyDictionary[Thing, Found] = WeakKeyDictionary()

    @wraps(find)
    def remembered(thing: Thing) -> Found:
        try:
            return known[thing]
        except KeyError:
            found = known[thing] = find(thing)
            return found

    return remembered
