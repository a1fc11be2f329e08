"""UsdLux's light linking: which objects a light lights, and which cast its shadows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pxr import Sdf, Usd, UsdLux

from notabug.scenes_usd.reader_values import blamed, fault
from notabug.scenes_usd.reading import refuse
from notabug.scenes_usd.scene import Light

_PARTS = ("includes", "excludes")


def with_links(prim: Usd.Prim, light: Light, drawn: Sequence[tuple[str, Sdf.Path]]) -> Light:
    """``light`` with what the collections lightLink and shadowLink of ``prim`` leave out of what is ``drawn``.

    Each of ``drawn`` is an object's path, and that of the prim which it is made of. What a point instancer places is
    linked as the instancer, and the subsets of a mesh as the mesh.
    """
    api = UsdLux.LightAPI(prim)
    unlit = _left_out(prim, "lightLink", api.GetLightLinkCollectionAPI(), drawn)
    return replace(
        light, unlit=unlit, unshadowing=_left_out(prim, "shadowLink", api.GetShadowLinkCollectionAPI(), drawn)
    )


def _left_out(
    prim: Usd.Prim, name: str, collection: Usd.CollectionAPI, drawn: Sequence[tuple[str, Sdf.Path]]
) -> tuple[str, ...]:
    """The paths of the objects that are not members of ``collection``; none where nobody authored it."""
    begin = f"collection:{name}:"
    expression = prim.GetAttribute(f"{begin}membershipExpression")
    if expression and expression.HasAuthoredValue() and not collection.IsInRelationshipsMode():
        refuse(
            fault(
                prim,
                f"{begin}membershipExpression",
                "patterns of light linking are not supported",
                expected="includes and excludes",
                do="author includes and excludes in its place",
            )
        )
        return ()
    authored = [prim.GetRelationship(begin + part).HasAuthoredTargets() for part in _PARTS]
    whole = prim.GetAttribute(f"{begin}includeRoot")
    if not any(authored) and not (whole and whole.HasAuthoredValue()):
        return ()
    with blamed(prim, f"{begin}includes"):
        query = collection.ComputeMembershipQuery()
        return tuple(path for path, owner in drawn if not query.IsPathIncluded(owner))
