"""Requirements: what a scene needs and an adapter has not is refused by name, before a renderer is started."""

from __future__ import annotations

from notabug.adapters.base import Adapter, UnsupportedError
from notabug.adapters.registry import needs
from notabug.scenes_usd.scene import Scene

_SLIVER = 0.02  # a shadow in one subsample of 64, and of no pixel's centre, does not count


def check_supported(adapter: Adapter, scene: Scene) -> None:
    """Raise UnsupportedError, naming each missing capability, where ``adapter`` cannot draw ``scene``."""
    needed = needs(scene)
    if not needed - adapter.capabilities and "shadows" not in adapter.capabilities and shadows_fall(scene):
        needed |= {"shadows"}
    missing = sorted(needed - adapter.capabilities)
    if missing:
        raise UnsupportedError(
            f"scene {scene.id!r} needs {', '.join(missing)}",
            where=f"adapter {adapter.name!r}",
            do="choose another renderer for this scene; `notabug list renderers` says what each can do",
        )


def shadows_fall(scene: Scene) -> bool:
    """Whether the reference admits no picture of ``scene`` without shadows; those of a mesh's own facets do not count.

    A depth buffer alone draws no shadows, and is right wherever none can be seen: on one convex body, on coplanar
    sheets, under a light at the eye, at gaps far smaller than a pixel.
    """
    if not scene.lights or not scene.objects:
        return False
    from notabug.references.models.model import Model
    from notabug.references.predict import predict

    unshadowed = Model("no_shadow", "fault", "no surface casts a shadow", "", options={"shadows": "none"})
    shadowed, lit = predict(scene), predict(scene, (unshadowed,))
    brightest = float(shadowed.hi.max(initial=0.0))
    return any(
        bool(((each < shadowed.lo - slack * brightest) | (each > shadowed.hi + slack * brightest)).any())
        for each, slack in ((lit.point, 1e-6), (lit.mean, _SLIVER))
    )
