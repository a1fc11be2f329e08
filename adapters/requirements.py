"""Requirements: what a scene needs and an adapter has not is refused by name, before a renderer is started."""

from __future__ import annotations

from notabug.adapters.base import Adapter, Apart, UnsupportedError
from notabug.adapters.registry import needs
from notabug.scenes_usd.scene import Scene

_SLIVER = 0.02  # a shadow in one subsample of 64, and of no pixel's centre, does not count


def check_supported(adapter: Adapter, scene: Scene) -> None:
    """Raise UnsupportedError, naming each missing capability, where ``adapter`` cannot draw ``scene``.

    Where it has each, those that it does not have together.
    """
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
    joined = [apart for apart in not_together(adapter) if _are_joined(apart, needed, scene)]
    if joined:
        whys = "; ".join(dict.fromkeys(apart.why for apart in joined if apart.why))
        raise UnsupportedError(
            f"scene {scene.id!r} needs {', '.join(map(str, joined))}",
            where=f"adapter {adapter.name!r}",
            do=f"{f'{whys}; ' if whys else ''}choose another renderer for this scene",
        )


def not_together(adapter: Adapter) -> tuple[Apart, ...]:
    """Which of its capabilities ``adapter`` does not have together; a plug-in need not say."""
    found: tuple[Apart, ...] = getattr(adapter, "not_together", ())
    return found


def _are_joined(apart: Apart, needed: frozenset[str], scene: Scene) -> bool:
    """Whether ``scene`` has all of ``apart``; whether shadows fall is looked at last, since that takes a picture."""
    rest = apart.words - needed
    return not rest or (rest == {"shadows"} and shadows_fall(scene))


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
