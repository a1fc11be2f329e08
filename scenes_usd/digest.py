"""The digest of what a scene holds: by it caches know a scene again."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np


def fed(values: Iterable[object]) -> str:
    """A digest of ``values``, in their order; paths of files do not enter."""
    state = hashlib.blake2b(digest_size=16)
    for value in values:
        _feed(state, value)
    return state.hexdigest()


def _feed(state: hashlib.blake2b, value: object) -> None:
    """Add ``value`` to the hash ``state``: arrays by dtype, shape and bytes, dataclasses field by field."""
    if isinstance(value, np.ndarray):
        state.update(f"{value.dtype}{value.shape}".encode())
        state.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, tuple):
        state.update(f"({len(value)}".encode())
        for each in value:
            _feed(state, each)
    elif is_dataclass(value):
        state.update(type(value).__name__.encode())
        for each in fields(value):
            item = getattr(value, each.name)
            if "left out" in each.metadata:  # what came later, where it is as it was before, so that digests stay
                if each.metadata["left out"] == item:
                    continue
                state.update(each.name.encode())  # else two of them that change places would be taken for one another
            if not isinstance(item, Path):
                _feed(state, item)
    else:
        state.update(repr(value).encode())
