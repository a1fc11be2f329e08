"""Workarounds of visibility inconsistency."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from notabug.references.models.model import Edit
from notabug.references.workarounds.workaround import Setting, Workaround
from notabug.scenes_usd.scene import Mesh, Scene

_PAPER = "Woo, Pearce and Ouellette 1996, visibility inconsistency"
_FIGHT = ("coincident_surfaces",)
_PLANES = "visibility/coincident_planes"


def raised(path: str, by: float) -> Edit:
    """An edit that moves every mesh below the prim ``path`` by ``by`` along its own y axis, in world units."""

    def one(mesh: Mesh) -> Mesh:
        up = mesh.to_world[1, :3] / np.linalg.norm(mesh.to_world[1, :3])
        return replace(mesh, points=np.ascontiguousarray(mesh.points + by * up))

    def edit(scene: Scene) -> Scene:
        objects = (one(x) if isinstance(x, Mesh) and x.path.startswith(path) else x for x in scene.objects)
        return replace(scene, objects=tuple(objects))

    return edit


def near_plane(at: float) -> Edit:
    """An edit that puts the near plane at the distance ``at``."""
    return lambda scene: replace(scene, camera=replace(scene.camera, near=at))


WORKAROUNDS = (
    Workaround(
        name="raised_surfaces",
        artifact_class="visibility",
        claim="the surface that should win is raised above the other by a gap that every renderer resolves",
        cites=_PAPER,
        reduces=_FIGHT,
        before=Setting(_PLANES, {"gap": "0"}),
        after=Setting(_PLANES, {"gap": "1e-3"}),
        caveat="a gap below the renderer's resolution helps nothing, and a wide one is seen",
        limits=(
            Setting(_PLANES, {"gap": "1e-6"}),
            Setting(_PLANES, {"gap": "0"}, "raised by .1", raised("/Scene/Sheets/First", 0.1)),
        ),
    ),
    Workaround(
        name="same_triangles",
        artifact_class="visibility",
        claim="coincident surfaces are cut into the same triangles, so that their depths round alike and one wins",
        cites=_PAPER,
        reduces=_FIGHT,
        before=Setting(_PLANES, {"triangulation": "other"}),
        after=Setting(_PLANES, {"triangulation": "same"}),
        caveat="the same triangles under another transform have other vertices, and round otherwise",
        limits=(Setting("visibility/coincident_spheres", {"transform": "turned"}),),
    ),
    Workaround(
        name="consistent_winner",
        artifact_class="visibility",
        claim="of surfaces at one distance, up to rounding, the first in the scene wins everywhere",
        cites=_PAPER,
        reduces=_FIGHT,
        before=Setting(_PLANES, {}, "nearest wins", adapters={"inhouse": {"precision": "float32"}}),
        after=Setting(_PLANES, {}, "first wins", adapters={"inhouse": {"precision": "float32", "ties": "first"}}),
        caveat="surfaces that lie less than the rule's reach apart are taken for one too",
    ),
    Workaround(
        name="near_plane",
        artifact_class="visibility",
        claim="a near plane further from the eye leaves a depth buffer more steps for what lies behind it",
        cites=_PAPER,
        reduces=_FIGHT,
        before=Setting("visibility/near_clip", {"near": ".0001"}),
        after=Setting("visibility/near_clip", {"near": "1"}),
        caveat="what lies in front of the near plane is cut away",
        limits=(Setting("visibility/near_clip", {"near": "1"}, "near plane at 5.4", near_plane(5.4)),),
    ),
)
