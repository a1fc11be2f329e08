"""Step 6 of docs/judge.md, what explains it: the pixels of a picture that nothing accuses which deserve a second look.

A pixel's tolerance holds what 4 x 4 subsamples of it may miss. Renderers that take regular samples miss as much, but in
the mean of random samples that is noise, and the seeds tell how much of it there is. Then only the prediction misses
something, and it can be made more exact, at the few pixels where that decides.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from notabug.metrics.admissible import Admissible, Floats, residual
from notabug.metrics.channels import spread
from notabug.metrics.explain import Explanation
from notabug.metrics.image_filters import Bools
from notabug.metrics.noise import Measured, in_tiles, pooled
from notabug.metrics.significance import significance
from notabug.scenes_usd.scene import Scene


def doubtful(measured: Measured, found: Explanation, scene: Scene) -> Bools:
    """The pixels (h, w) of ``measured`` that ``found`` admits for no other reason than what subsamples may miss.

    There are none unless the renderer declares random samples: see admissible.at_random. Pixels beside an edge are
    among them, as what lies beyond their border is not theirs; but not where rays go on from a surface, since no id
    tells of edges in mirrors and glass.
    """
    target = found.target
    if target.missed is None or target.inner is None or not measured.noisy:
        return np.zeros(target.edge.shape, np.bool_)
    further = any(material.sends_on for material in scene.materials)
    inner = ~target.edge if further else target.inner
    at = np.logical_and.reduce([inner, *(alpha == 0 for alpha in found.alphas.values())])
    each = spread(at & target.edge)
    lo, hi = (np.where(each, target.value, end) for end in (target.lo, target.hi))
    strict = replace(target, lo=lo, hi=hi, tau=target.tau - target.missed, edge=~at)
    tested = significance(residual(measured.mean, strict) * spread(at), shared_out(measured, target, at), strict)
    return np.asarray(
        (tested.pixels | in_tiles(tested.tiles, *at.shape)) & at & (target.edge | (target.missed > 0).any(axis=2))
    )


def shared_out(measured: Measured, target: Admissible, at: Bools) -> Measured:
    """``measured`` with the noise of the pixels ``at`` (h, w), which no edge crosses, told from that of edges nearby.

    What is pooled around a pixel is mostly the noise of the edges there. Of that a pixel has the share that ``target``
    predicts, or what those ``at`` which lie around it have of noise, if that is more.
    """
    assert target.sampled is not None
    assert measured.own is not None
    variance, here = target.sampled[2], spread(at).astype(np.float32)
    noise, predicted, kept, count = (
        pooled(values.astype(np.float64)) for values in (measured.own, variance, measured.own * here, here)
    )
    share = variance * _over(noise, predicted)
    return replace(measured, variance=np.where(spread(at), np.maximum(share, _over(kept, count)), measured.variance))


def _over(some: Floats, all_of_it: Floats) -> Floats:
    """``some`` over ``all_of_it``; 0 over 0 is 0."""
    return np.divide(some, all_of_it, out=np.zeros_like(all_of_it), where=all_of_it > 0)
