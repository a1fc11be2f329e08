"""Step 3 of docs/judge.md, what is admitted: what sets of models predict of one scene, each traced once, some kept.

Most models change little of a picture. So the envelope of a set is traced only near the pixels whose centres show that
it differs from an envelope that is known: that of the most similar set among those asked for last, or the reference.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import fields, is_dataclass, replace
from functools import partial
from itertools import product
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import Admissible, admissible, reckonable
from notabug.metrics.channels import pixels, put
from notabug.metrics.image_checks import finite
from notabug.metrics.image_filters import Bools, widened
from notabug.metrics.policy import POLICY
from notabug.metrics.telling import doing
from notabug.references.models.camera import pixel_shift
from notabug.references.models.model import Model
from notabug.references.predict import Near, predict_near, preview, preview_at
from notabug.references.tracer.envelope import Envelope
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
Places = npt.NDArray[np.intp]
Key = tuple[tuple[str, ...], ...]
Models = tuple[Model, ...]
Kept = TypeVar("Kept")

MOST_SETS, MOST_PICTURES, MOST_ENVELOPES = 96 << 20, 32 << 20, 32 << 20  # bytes that are kept of each


class Predictions:
    """Of one ``scene`` and one ``declaration``: what sets of models admit, and their quick pictures.

    A set of models that predicts what is not finite (a distance to the power of 90) predicts nothing: it is taken for
    one that changes nothing, so it can neither explain nor excuse anything.
    """

    def __init__(
        self,
        scene: Scene,
        bare: Envelope,
        reference: Admissible,
        declaration: Declaration,
        tolerance: float,
        leeway: Floats | None,
        unsure: Floats | None = None,
    ) -> None:
        self._scene, self._reference = scene, reference
        self._bare = Near(bare, "")
        peak = float(reference.value.max(initial=0.0))
        self._admits = partial(
            admissible, declaration=declaration, tolerance=tolerance, peak=peak, leeway=leeway, unsure=unsure
        )
        self._pictures: _Recent[Floats] = _Recent(MOST_PICTURES)
        self._glimpses: _Recent[Floats] = _Recent(MOST_PICTURES // 4)
        self._still = preview(scene)
        self._looked = np.zeros(reference.edge.shape, np.bool_)  # one array for all copies
        self._also: Bools | None = None
        self._fine: Bools | None = None
        self._forget()

    def _forget(self) -> None:
        self._sets: _Recent[Admissible] = _Recent(MOST_SETS)
        self._envelopes: _Recent[Near] = _Recent(MOST_ENVELOPES)

    def closely(self, at: Bools) -> Predictions:
        """The same predictions, with the pixels ``at`` (h, w) and those beside them traced whatever centres show.

        So are those that were asked for before: what a close look has explained must not need explaining again.
        """
        self._looked |= widened(at, 1)
        result = copy(self)
        result._forget()
        result._also = self._looked.copy()
        result._reference = result._beside_centres((), self._reference)
        return result

    def finely(self, at: Bools) -> Predictions:
        """The same predictions, at the pixels ``at`` (h, w) as exact as references are."""
        result = copy(self)
        result._forget()
        result._fine = at
        result._bare = predict_near(self._scene, (), self._bare, self._also, at)
        result._reference = result._admits(result._bare.envelope, fine=at)
        return result

    def __call__(self, chosen: Models) -> Admissible:
        """What ``chosen`` admit."""
        if not chosen:
            return self._reference
        return self._sets.get(_key(chosen), lambda: self._admitted(chosen))

    def preview(self, chosen: Models, at: Places | None = None) -> Floats:
        """The picture (h, w, 3) of ``chosen`` by one sample at each pixel's centre; or its pixels ``at``, (n, 3)."""
        key = _key(chosen)
        if at is None or not chosen or key in self._pictures:
            picture = self._pictures.get(key, lambda: self._quick(chosen)) if chosen else self._still
            return picture if at is None else pixels(picture, at)
        places = hashlib.blake2b(at.tobytes(), digest_size=16).hexdigest()
        return self._glimpses.get((*key, (places,)), lambda: self._glimpse(chosen, at))

    def _admitted(self, chosen: Models) -> Admissible:
        envelope = self._envelope(chosen)
        if not reckonable(envelope):
            return self._reference
        return self._beside_centres(chosen, self._admits(envelope, fine=self._fine))

    def _beside_centres(self, chosen: Models, found: Admissible) -> Admissible:
        """``found`` with what rays just beside the centres show of edges that are looked at closely.

        Last bits decide what a renderer shows of an edge that meets a pixel's centre. Subsamples cannot tell such an
        edge from one that meets the pixel's corner, where both sides of it are brighter and darker than the centre.
        """
        if self._also is None or not found.share_is_point:
            return found
        at = np.flatnonzero(found.edge & self._also)
        if not at.size:
            return found
        lo, hi = pixels(found.lo, at), pixels(found.hi, at)
        for right, down in product((-POLICY.admissible.beside, 0.0, POLICY.admissible.beside), repeat=2):
            beside = pixel_shift(self._scene.width, self._scene.height, right, down)
            shown = preview_at(self._scene, (*chosen, beside), at)
            if np.isfinite(shown).all():
                lo, hi = np.minimum(lo, shown), np.maximum(hi, shown)
        lo, hi = put(found.lo, at, lo), put(found.hi, at, hi)
        return replace(found, lo=lo, hi=hi, sampled=(lo, hi, np.zeros_like(found.value)))

    def _envelope(self, chosen: Models) -> Envelope:
        return self._envelopes.get(_key(chosen), lambda: self._near(chosen)).envelope

    def _near(self, chosen: Models) -> Near:
        """The envelope of ``chosen`` from that of the kept set which has the fewest other models."""
        doing(f"predicts {', '.join(dict.fromkeys(each.name.partition('#')[0] for each in chosen))}")
        key = _key(chosen)
        known, base = self._bare, len(key)
        for other, each in self._envelopes.newest():
            unlike = len(set(key) ^ set(other))
            if unlike < base or (unlike == base < len(key) and other[0] == key[0]):  # a fault stands first
                known, base = each, unlike
        return predict_near(self._scene, chosen, known, self._also, self._fine)

    def _quick(self, chosen: Models) -> Floats:
        picture = preview(self._scene, chosen)
        return picture if finite(picture).all() else self._still

    def _glimpse(self, chosen: Models, at: Places) -> Floats:
        found = preview_at(self._scene, chosen, at)
        return found if finite(found).all() else pixels(self._still, at)


class _Recent(Generic[Kept]):
    """Things made once and kept by key, until newer ones take more than ``most`` bytes."""

    def __init__(self, most: int) -> None:
        self._most, self._bytes = most, 0
        self._kept: OrderedDict[Key, Kept] = OrderedDict()

    def __contains__(self, key: Key) -> bool:
        return key in self._kept

    def newest(self) -> Iterator[tuple[Key, Kept]]:
        """All that is kept, the newest first."""
        return reversed(self._kept.items())

    def get(self, key: Key, make: Callable[[], Kept]) -> Kept:
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        made = make()
        self._kept[key] = made
        self._bytes += _size(made)
        while self._bytes > self._most and len(self._kept) > 1:
            self._bytes -= _size(self._kept.popitem(last=False)[1])
        return made


def _size(value: object) -> int:
    """The bytes of an array, or of the arrays in a dataclass."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    return sum(_size(getattr(value, each.name)) for each in fields(value)) if is_dataclass(value) else 0


def _key(chosen: Models) -> Key:
    """What tells sets of models apart; the claim holds what those of one name differ in: an axis, a strength."""
    return tuple((each.name, each.claim, str(each.strength), repr(each.options)) for each in chosen)
