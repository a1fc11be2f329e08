"""A composed stage to a Scene: variants chosen in the session layer, prims walked in order, each sent to its reader."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path

from pxr import Tf, Usd, UsdGeom, UsdLux

from notabug.scenes_usd.card import read_card
from notabug.scenes_usd.errors import SceneError, SelectionError
from notabug.scenes_usd.fence import check_opened, layers_of
from notabug.scenes_usd.reader_camera import read_camera
from notabug.scenes_usd.reader_geometry import read_mesh, read_sphere
from notabug.scenes_usd.reader_light import read_distant, read_point
from notabug.scenes_usd.reader_shading import Materials
from notabug.scenes_usd.reader_texture import Textures
from notabug.scenes_usd.reader_values import fault, value
from notabug.scenes_usd.scene import Light, Mesh, Object, Scene
from notabug.scenes_usd.untrusted import is_trusted

_DRAWN_AS_NOTHING = ("", "Xform", "Scope", "Camera")  # and whatever is registered but not imageable


def read_stage(path: Path, scene_id: str, variants: Mapping[str, str]) -> Scene:
    """The scene in ``path`` under the choice ``variants``; sets left out keep the file's own selection."""
    try:
        return _read_stage(path, scene_id, variants)
    except Tf.ErrorException as error:
        raise SceneError("OpenUSD refuses it", where=str(path), got=" ".join(str(error).split())) from error
    except (TypeError, ValueError, OverflowError) as error:  # a float where the schema has an array, and the like
        raise SceneError(
            "a value is not of its schema's type", where=str(path), got=str(error), do="try usdchecker"
        ) from error


def _read_stage(path: Path, scene_id: str, variants: Mapping[str, str]) -> Scene:
    layers = [] if is_trusted(path) else list(layers_of(path))
    stage = _open(path)
    del layers  # kept until now, so that each is parsed once
    root = stage.GetDefaultPrim()
    if not root:
        raise SceneError("the stage has no default prim", where="/.defaultPrim", got=str(path), do="author defaultPrim")
    chosen = _choose(stage, root, variants)
    if not is_trusted(path):
        check_opened(stage, path)
    for error in stage.GetCompositionErrors():
        raise SceneError("the stage does not compose", where=str(error.rootSite.path), got=" ".join(str(error).split()))
    card = read_card(root.GetCustomData(), str(root.GetPath()))
    camera, width, height = read_camera(stage)

    textures = Textures(None if is_trusted(path) else path.parent)
    materials = Materials(textures)
    mesh = partial(_mesh, materials, textures)
    objects: list[Object] = []
    lights: list[Light] = []
    for prim in _visible(stage):
        if prim.IsA(UsdGeom.Mesh):
            found = mesh(prim)
            objects += [found] if found is not None else []
        elif prim.IsA(UsdGeom.Sphere):
            objects.append(read_sphere(prim, materials.bound_to(prim)))
        elif prim.IsA(UsdLux.SphereLight):
            lights.append(read_point(prim))
        elif prim.IsA(UsdLux.DistantLight):
            lights.append(read_distant(prim))
        elif _draws_something(prim):
            raise fault(
                prim,
                "",
                f"unsupported schema {prim.GetTypeName()}",
                expected="Mesh, Sphere, SphereLight, DistantLight, Camera, Xform or Scope",
                do="convert it, or make it invisible",
            )
    if not objects:
        raise SceneError("nothing to draw: no visible Mesh or Sphere", where=str(root.GetPath()))
    if not lights:
        raise SceneError("no visible light: every picture would be black", where=str(root.GetPath()))
    intent = _intent(stage, root, card.intent, objects, mesh)
    return Scene(
        id=scene_id,
        path=path,
        variants=chosen,
        card=card,
        camera=camera,
        width=width,
        height=height,
        objects=tuple(objects),
        lights=tuple(lights),
        materials=tuple(materials.found),
        textures=tuple(textures.found),
        intent=intent,
    )


def flattened(path: Path, variants: Mapping[str, str]) -> str:
    """The stage as one layer's text, with ``variants`` chosen and every reference resolved; assets by absolute path."""
    stage = _open(path)
    _choose(stage, stage.GetDefaultPrim(), variants)
    return str(stage.Flatten(False).ExportToString())


def _open(path: Path) -> Usd.Stage:
    """The stage, with a session layer of its own: the file is never written to."""
    try:
        return Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        reason = " ".join(str(error).split())
        raise SceneError("cannot be opened as a USD stage", where=str(path), got=reason, do="try usdchecker") from error


def _choose(stage: Usd.Stage, root: Usd.Prim, variants: Mapping[str, str]) -> dict[str, str]:
    """Select ``variants`` on ``root``; the full selection, defaults included. A choice may bring further sets."""
    stage.SetEditTarget(Usd.EditTarget(stage.GetSessionLayer()))
    sets = root.GetVariantSets()
    waiting = dict(variants)
    while ready := [name for name in waiting if name in sets.GetNames()]:
        for name in ready:
            wanted, known = waiting.pop(name), sets.GetVariantSet(name).GetVariantNames()
            if wanted not in known:
                raise SelectionError(
                    f"no variant {wanted!r} in the set {name!r}",
                    where=str(root.GetPath()),
                    expected=f"one of {', '.join(known)}",
                )
            sets.SetSelection(name, wanted)
    for name in waiting:
        known = sets.GetNames()
        raise SelectionError(
            f"no variant set {name!r}",
            where=str(root.GetPath()),
            expected=f"one of {', '.join(known)}" if known else "none: the scene has no variant sets",
        )
    chosen = {name: str(sets.GetVariantSelection(name)) for name in sorted(sets.GetNames())}
    for name, selection in chosen.items():
        if selection not in sets.GetVariantSet(name).GetVariantNames():
            known = ", ".join(sets.GetVariantSet(name).GetVariantNames())
            raise SceneError(
                f"the variant set {name!r} has no default",
                where=f"{root.GetPath()}.variants",
                expected=f"one of {known}",
                got=repr(selection),
                do="author a selection in the file",
            )
    return chosen


def _visible(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Active prims in stage order, inside instances too; without invisible subtrees, guides and proxies."""
    prims = iter(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()))
    for prim in prims:
        imageable = UsdGeom.Imageable(prim)
        if imageable:
            if value(prim, "visibility", "word") == UsdGeom.Tokens.invisible:
                prims.PruneChildren()
                continue
            if imageable.ComputePurpose() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
                continue
        yield prim


def _draws_something(prim: Usd.Prim) -> bool:
    """Whether a renderer could draw or light with ``prim``, which is no supported type."""
    if prim.GetTypeName() in _DRAWN_AS_NOTHING:
        return False
    registered = bool(Usd.SchemaRegistry.GetTypeFromName(str(prim.GetTypeName())))
    return not registered or prim.IsA(UsdGeom.Imageable) or prim.IsA(UsdGeom.Subset) or prim.HasAPI(UsdLux.LightAPI)


def _mesh(materials: Materials, textures: Textures, prim: Usd.Prim) -> Mesh | None:
    """The mesh at ``prim``, or None where no face of it has an area."""
    mesh = read_mesh(prim, materials.bound_to(prim))
    if mesh is None:
        return None
    texture = materials.found[mesh.material].texture
    if texture >= 0 and mesh.uv is None:
        raise fault(
            prim,
            "primvars:st",
            f"no texture coordinates for {textures.found[texture].path.name}",
            expected="texCoord2f[]",
        )
    return mesh


def _intent(
    stage: Usd.Stage, root: Usd.Prim, path: str, objects: list[Object], mesh: Callable[[Usd.Prim], Mesh | None]
) -> Mesh | None:
    """The guide mesh that the card names, as ``mesh`` reads it, or None."""
    if not path:
        return None
    where = f"{root.GetPath()}.customData:notabug:intent"
    prim = stage.GetPrimAtPath(path) if Tf.IsValidIdentifier(path.split("/")[-1]) and path.startswith("/") else None
    if not prim or not prim.IsA(UsdGeom.Mesh):
        raise SceneError("the intent is no mesh", where=where, expected="the path of a Mesh", got=repr(path))
    if UsdGeom.Imageable(prim).ComputePurpose() != UsdGeom.Tokens.guide:
        raise SceneError("the intent is drawn itself", where=where, got=path, do='give it purpose = "guide"')
    parent = f"{prim.GetPath().GetParentPath()}/"
    if parent == "//" or not any(each.path.startswith(parent) for each in objects):
        raise SceneError(
            "the intent stands for nothing",
            where=where,
            expected="drawn prims beside it under a common parent",
            got=path,
        )
    found = mesh(prim)
    if found is None:
        raise SceneError("no face of the intent has an area", where=where, expected="a mesh to be seen", got=path)
    return found
