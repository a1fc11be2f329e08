"""A composed stage to a Scene: variants chosen in the session layer, prims walked in order, each sent to its reader."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdGeom, UsdLux, UsdRender, Vt

from notabug.scenes_usd.card import OWN_CARD, read_card
from notabug.scenes_usd.diagnostics import silenced
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.fence import check_opened, layers_of
from notabug.scenes_usd.framing import camera_for
from notabug.scenes_usd.opinion import LEFT_OUT
from notabug.scenes_usd.reader_camera import Picture, find_settings, read_picture
from notabug.scenes_usd.reader_choice import check_frame, choose, open_stage
from notabug.scenes_usd.reader_light import read_light, with_size
from notabug.scenes_usd.reader_links import with_links
from notabug.scenes_usd.reader_objects import Drawing
from notabug.scenes_usd.reader_pixel import PixelGrid
from notabug.scenes_usd.reader_prims import LIGHTS, not_read, visible
from notabug.scenes_usd.reader_values import fault, opinion, value, where
from notabug.scenes_usd.reading import Remark, going_on, note, reading, recovered, refuse, remarks
from notabug.scenes_usd.reading import view as meant
from notabug.scenes_usd.scene import Light, Mesh, Scene
from notabug.scenes_usd.untrusted import is_trusted
from notabug.scenes_usd.view import View


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """All that one look at a stage tells: the ``scene``, or None where it is refused, and the ``remarks``."""

    scene: Scene | None
    remarks: tuple[Remark, ...]


def read_stage(path: Path, scene_id: str, variants: Mapping[str, str], view: View | None = None) -> Scene:
    """The scene in ``path`` under the choice ``variants``; sets left out keep the file's own selection.

    Raises SceneError, or ManyFaultsError with all of them, for what is out of the contract.
    """
    with reading(view) as found:
        scene = _guarded(path, scene_id, variants)
    found.end()
    assert scene is not None  # or there had been an error
    return scene


def survey_stage(path: Path, scene_id: str, variants: Mapping[str, str], view: View | None = None) -> Survey:
    """What is read of the scene in ``path``, approximated, and out of the contract; a fault is no exception here."""
    return _survey(path, scene_id, variants, view, None)


def survey_layer(over: Sdf.Layer, path: Path, scene_id: str, view: View) -> Survey:
    """The same of a layer ``over`` the scene in ``path``, in memory only, which says all that there is to choose."""
    return _survey(path, scene_id, {}, view, over)


def _survey(
    path: Path, scene_id: str, variants: Mapping[str, str], view: View | None, over: Sdf.Layer | None
) -> Survey:
    with reading(view) as found:
        scene = _guarded(path, scene_id, variants, over)
    return Survey(None if found.errors else scene, tuple(found.remarks.values()))


def _guarded(path: Path, scene_id: str, variants: Mapping[str, str], over: Sdf.Layer | None = None) -> Scene | None:
    """The scene, or None with its faults noted in the reading in hand."""
    try:
        with silenced(path):
            return _read_stage(path, scene_id, variants, over)
    except SceneError as error:
        refuse(error)
    except Tf.ErrorException as error:
        refuse(SceneError("OpenUSD refuses it", where=str(path), got=" ".join(str(error).split())))
    except (TypeError, ValueError, OverflowError) as error:  # a float where the schema has an array, and the like
        what = "a value is not of its schema's type"
        refuse(SceneError(what, where=str(path), got=str(error), do="try usdchecker"))
    return None


def _read_stage(path: Path, scene_id: str, variants: Mapping[str, str], over: Sdf.Layer | None) -> Scene:
    layers = [] if is_trusted(path) else list(layers_of(path))
    stage = open_stage(path) if over is None else Usd.Stage.Open(over)
    del layers  # kept until now, so that each is parsed once
    root = stage.GetDefaultPrim()
    if not root:
        note("approximated", "/", "no default prim: the whole stage is drawn, and has no variants")
        root = stage.GetPseudoRoot()
    chosen = choose(stage, root, variants)
    check_frame(stage, meant().time)
    if not is_trusted(path):
        check_opened(stage, path)
    for error in stage.GetCompositionErrors():
        refuse(SceneError("the stage does not compose", where=str(error.rootSite.path), got=_composing(error, path)))
    card = recovered(lambda: read_card(root.GetCustomData(), str(root.GetPath())), OWN_CARD)
    picture = recovered(lambda: read_picture(stage), Picture(None, 1, 1))
    grid = PixelGrid(picture.camera, picture.width, picture.height)
    drawing = Drawing(stage, None if is_trusted(path) else path.parent, grid)
    lights: list[tuple[Usd.Prim, Light]] = []
    left_out = _left_out(stage)
    for prim in visible(stage.GetPseudoRoot()):
        _look_at_ops(prim)
        if drawing.draws(prim):
            with going_on():
                drawing.add(prim)
        elif str(prim.GetTypeName()) in LIGHTS:
            with going_on():
                lights.append((prim, read_light(prim, drawing.textures.root)))
        else:
            with going_on():
                _pass_over(prim)
    objects = drawing.objects
    if not objects and not drawing.failed:
        refuse(SceneError("nothing to draw: no visible Mesh or solid", where=str(root.GetPath())))
    if not lights:
        do = "notabug adapt SCENE --out own.usda puts one beside the camera"
        refuse(SceneError("no visible light: every picture would be black", where=str(root.GetPath()), do=do))
    camera = picture.camera
    if camera is None and objects:
        camera = camera_for(objects, picture.width, picture.height, up=str(UsdGeom.GetStageUpAxis(stage)))
        grid = replace(grid, camera=camera)
    shining = [recovered(lambda: with_size(prim, light, objects, grid), light) for prim, light in lights]  # noqa: B023
    intent = recovered(lambda: _intent(stage, root, card.intent, drawing), None)
    drawn = list(zip((shape.path for shape in objects), drawing.owners, strict=True))
    drawn += [] if intent is None else [(intent.path, Sdf.Path(intent.path))]
    linked = [
        recovered(lambda: with_links(prim, light, drawn), light)  # noqa: B023
        for (prim, _), light in zip(lights, shining, strict=True)
    ]
    if camera is None:
        raise SceneError("no camera, and nothing to see", where=str(root.GetPath()))
    return Scene(
        id=scene_id,
        path=path,
        variants=chosen,
        card=card,
        camera=camera,
        width=picture.width,
        height=picture.height,
        objects=tuple(objects),
        lights=tuple(linked),
        materials=tuple(drawing.materials.found),
        textures=tuple(drawing.textures.found),
        intent=intent,
        notes=_lacks(),
        view=meant(),
        left_out=left_out,
    )


def _composing(error: object, path: Path) -> str:
    """What OpenUSD says of a thing that does not compose, by the names of files: a layer in memory is over ``path``."""
    return re.sub(r"@anon:[^@]*@", f"@{path}@", " ".join(str(error).split()))


def _look_at_ops(prim: Usd.Prim) -> None:
    """Note an op that the order of a transform names and the prim lacks: OpenUSD places the prim without it."""
    order = prim.GetAttribute("xformOpOrder")
    named = order.Get() if order and order.HasAuthoredValue() else None
    for op in named if isinstance(named, Vt.TokenArray) else ():
        name = str(op).removeprefix("!invert!")
        if name != "!resetXformStack!" and not prim.HasAttribute(name):
            note("approximated", where(prim, "xformOpOrder"), f"names {name}, which the prim lacks: placed without it")


def _left_out(stage: Usd.Stage) -> tuple[str, ...]:
    """The prims that a layer of ``notabug adapt`` leaves out, since they cannot be drawn; each is noted as not read."""
    found = []
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        because = prim.GetCustomDataByKey(LEFT_OUT)
        if isinstance(because, str) and value(prim, "visibility", "word") == UsdGeom.Tokens.invisible:
            note("not read", where(prim), f"left out by notabug adapt: {because}")
            found.append(str(prim.GetPath()))
    return tuple(found)


def _lacks() -> tuple[str, ...]:
    """One line about what of the stage was not read, for whoever wonders at a verdict."""
    lacking = [remark for remark in remarks() if remark.kind == "not read" and ".inputs:" not in remark.where]
    lacking = [remark for remark in lacking if not remark.what.startswith("PortalLight")]  # no picture lacks it
    if not lacking:
        return ()
    more = f" and {len(lacking) - 1} more (notabug check lists them)" if len(lacking) > 1 else ""
    return (f"not read of the scene: {lacking[0].where}, {lacking[0].what}{more}",)


def _pass_over(prim: Usd.Prim) -> None:
    """Note what is not read, and refuse a light of a kind that is none; a portal guides samples, and lights nothing."""
    if str(prim.GetTypeName()) == "PortalLight":
        note("not read", where(prim), "PortalLight: it guides samples of a dome, and lights nothing itself")
        return
    if prim.HasAPI(UsdLux.LightAPI):
        raise fault(
            prim,
            "",
            f"unsupported schema {prim.GetTypeName()}",
            expected=f"{' or '.join(LIGHTS)}",
            do="make it invisible",
            mends=opinion(prim, "visibility", "token", "invisible"),
        )
    what = not_read(prim)
    if what:
        note("not read", where(prim), what)


def says_its_picture(path: Path, variants: Mapping[str, str]) -> bool:
    """Whether the stage in ``path`` names a size and a camera, so that whoever opens it draws the same picture."""
    with silenced(path):
        stage = open_stage(path)
        root = stage.GetDefaultPrim()
        if root:
            choose(stage, root, variants)
        settings = find_settings(stage)
        return settings is not None and UsdRender.Settings(settings).GetCameraRel().HasAuthoredTargets()


def flattened(path: Path, variants: Mapping[str, str]) -> str:
    """The stage as one layer's text, with ``variants`` chosen and every reference resolved; assets by absolute path."""
    with silenced(path):
        stage = open_stage(path)
        root = stage.GetDefaultPrim()
        if root:
            choose(stage, root, variants)
        return str(stage.Flatten(False).ExportToString())


def _intent(stage: Usd.Stage, root: Usd.Prim, path: str, drawing: Drawing) -> Mesh | None:
    """The guide mesh that the card names, or None."""
    if not path:
        return None
    where_ = f"{root.GetPath()}.customData:notabug:intent"
    prim = stage.GetPrimAtPath(path) if Tf.IsValidIdentifier(path.split("/")[-1]) and path.startswith("/") else None
    if not prim or not prim.IsA(UsdGeom.Mesh):
        raise SceneError("the intent is no mesh", where=where_, expected="the path of a Mesh", got=repr(path))
    if UsdGeom.Imageable(prim).ComputePurpose() != UsdGeom.Tokens.guide:
        raise SceneError("the intent is drawn itself", where=where_, got=path, do='give it purpose = "guide"')
    parent = f"{prim.GetPath().GetParentPath()}/"
    if parent == "//" or not any(each.path.startswith(parent) for each in drawing.objects):
        raise SceneError(
            "the intent stands for nothing",
            where=where_,
            expected="drawn prims beside it under a common parent",
            got=path,
        )
    found = drawing.mesh(prim)
    if found is None:
        raise SceneError("no face of the intent has an area", where=where_, expected="a mesh to be seen", got=path)
    return found
