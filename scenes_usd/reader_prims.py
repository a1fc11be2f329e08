"""Which prims of a stage are looked at, and what is said of those that nothing is read of."""

from __future__ import annotations

from collections.abc import Iterator

from pxr import Usd, UsdGeom, UsdShade, UsdSkel

from notabug.scenes_usd.reader_values import value
from notabug.scenes_usd.reading import view

LIGHTS = ("SphereLight", "DistantLight", "RectLight", "DiskLight", "CylinderLight", "DomeLight", "DomeLight_1")
_DRAWN_AS_NOTHING = ("", "Xform", "Scope", "Camera", "SkelRoot")  # and whatever is registered but not imageable
_FIELDS = ("OpenVDBAsset", "Field3DAsset")  # of a volume, of which it is said that nothing is drawn


def visible(root: Usd.Prim) -> Iterator[Usd.Prim]:
    """Active prims below ``root`` in stage order, inside instances too.

    Without invisible subtrees, without prims of purposes that are not drawn, and without what is below a point
    instancer, which places it where it wants.
    """
    purposes = view().purposes
    prims = iter(Usd.PrimRange(root, Usd.TraverseInstanceProxies()))
    for prim in prims:
        imageable = UsdGeom.Imageable(prim)
        if imageable:
            if value(prim, "visibility", "word") == UsdGeom.Tokens.invisible:
                prims.PruneChildren()
                continue
            if prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
            if str(imageable.ComputePurpose()) not in purposes:
                continue
        yield prim


def not_read(prim: Usd.Prim) -> str:
    """What a picture lacks since nothing is read of ``prim``, in words; "" where it lacks nothing."""
    kind = str(prim.GetTypeName())
    if kind in _DRAWN_AS_NOTHING or kind in _FIELDS or prim.IsA(UsdGeom.Subset):
        return ""
    if not Usd.SchemaRegistry.GetTypeFromName(kind):
        return f"{kind}: a type that OpenUSD does not know"
    if prim.IsA(UsdSkel.Skeleton):
        return "Skeleton: what it moves is drawn at rest"
    if prim.IsA(UsdGeom.Imageable) and not prim.IsA(UsdShade.NodeGraph):
        return f"{kind}: nothing of it is drawn"
    return ""
