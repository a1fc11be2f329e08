"""Bounces: a renderer follows mirror and refracted rays for so long, and what a longer path would bring is lost."""

from __future__ import annotations

from collections.abc import Iterator

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Scene

CONTRACT = 8  # bounces that a scene's description asks for: as many are no limitation
_CITES = "Whitted 1980, section 3; POV-Ray 3.7 documentation: max_trace_level, 5 by default"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with mirrors, glass or surfaces with opacity; those that end paths late come first."""
    bends = any(any(material.mirror) or any(material.transmission) for material in scene.materials)
    sheets = any(material.fades for material in scene.materials)
    for n in reversed(range(CONTRACT)):
        followed = f"at most {n} bounces are followed" if n > 1 else "one bounce is followed"
        if n == 0:
            followed = "no ray is followed that a mirror or glass sends on"
        if bends:
            yield _limit(n, followed, "reflections" if sheets else "")
        if sheets:
            yield _limit(n, f"{followed}, and passages through transparent surfaces count as bounces", "passages")


def _limit(n: int, claim: str, count: str) -> Model:
    """``count`` is what counts as a bounce, "" where that shows no difference."""
    return Model(
        name="bounce_limit",
        kind="limitation",
        claim=claim,
        cites=_CITES,
        options={"bounces": n, "counted_passages": count == "passages"},
        when=("bounces", f"{n}"),
        also=(("bounces_count", count),) if count else (),
    )
