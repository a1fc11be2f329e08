"""A layer over a team's own scene that takes it into the contract. Nothing of the scene itself is edited.

The layer is a scene of its own: who renders it draws what it says, so a verdict on it holds for any renderer. It says
which picture is meant (render settings, camera, frame, variants, purposes), carries a card, and overrules what the
contract cannot say with what comes nearest: a point in the place of a lamp, a Lambertian in the place of MaterialX.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade

from notabug.scenes_usd.card import OWN_CARD
from notabug.scenes_usd.diagnostics import silenced
from notabug.scenes_usd.errors import SceneError, SelectionError
from notabug.scenes_usd.framing import LIT, direction
from notabug.scenes_usd.layer_values import says_already, shown_value, typed
from notabug.scenes_usd.lens import define_camera, place
from notabug.scenes_usd.opinion import BLOCKED, LEFT_OUT, Opinion
from notabug.scenes_usd.reader import scene_id
from notabug.scenes_usd.reader_camera import DEFAULT_SIZE, cameras
from notabug.scenes_usd.reader_choice import check_frame, choose, frames, open_stage
from notabug.scenes_usd.reader_inputs import PREVIEW
from notabug.scenes_usd.reader_shading import GREY
from notabug.scenes_usd.reader_stage import Survey, survey_layer, survey_stage
from notabug.scenes_usd.reading import Remark, reading
from notabug.scenes_usd.view import AS_IT_IS, DRAWN, View, prim_and_set

Mends = Literal["picture", "scene"]
GREY_BECAUSE = "grey: "  # begins the reason why a material is a grey one
LEFT_OUT_BECAUSE = "left out: "  # begins the reason why a prim is not drawn
_PASSES = 5  # a value that is put right may show the next one that is not
_STAGE_METADATA = (  # of the root layer alone: those of a sublayer say nothing
    "upAxis",
    "metersPerUnit",
    "kilogramsPerUnit",
    "timeCodesPerSecond",
    "framesPerSecond",
    "startTimeCode",
    "endTimeCode",
    "defaultPrim",
    "renderSettingsPrimPath",
    "colorConfiguration",
    "colorManagementSystem",
)


@dataclass(frozen=True, slots=True, eq=False)
class Adapted:
    """What came of it: a line for each opinion of the layer, and what a look at the layer tells."""

    says: tuple[str, ...]
    survey: Survey


def adapt(
    path: Path, out: Path, variants: Mapping[str, str], view: View, size: tuple[int, int] | None = None
) -> Adapted:
    """Write the layer ``out`` over the scene at ``path``, for the picture that ``variants`` and ``view`` mean.

    ``out`` is in the scene's folder or in one above it. What is not said is chosen: the first camera, or one that sees
    everything; the first frame of an animation. Raises SceneError where the scene cannot be opened, or OpenUSD refuses
    to have something said of it.
    """
    with _told(path):
        layer, _ = _made(path, variants, view, size, "scene")
        layer.write(out)
        held = Sdf.Layer.Find(str(out))
        if held is not None:
            held.Reload(True)
        return Adapted(tuple(layer.said), survey_stage(out, scene_id(out), {}))


def adapt_in_memory(path: Path, variants: Mapping[str, str], view: View, mends: Mends) -> Adapted:
    """What ``adapt`` would write over the scene at ``path``, and what a look at it tells; no file is written.

    ``mends`` is ``picture`` where only what tells which picture is meant may be said, ``scene`` where also what cannot
    be drawn is overruled.
    """
    with _told(path):
        layer, survey = _made(path, variants, view, view.size, mends)
        return Adapted(tuple(layer.said), layer.look(AS_IT_IS) if survey.scene is not None else survey)


def flattened_over(path: Path, variants: Mapping[str, str], view: View, mends: Mends) -> str:
    """The same as one layer's text, with every reference resolved; assets by absolute path."""
    with _told(path):
        layer, _ = _made(path, variants, view, view.size, mends)
        return layer.flat()


@contextlib.contextmanager
def _told(path: Path) -> Iterator[None]:
    """What OpenUSD refuses inside is told as a fault of the scene at ``path``."""
    try:
        with silenced(path):
            yield
    except Tf.ErrorException as error:
        got = " ".join(str(error).split())
        raise SceneError("OpenUSD refuses it", where=str(path), got=got, do="try usdchecker") from error
    except (TypeError, ValueError) as error:
        what = "a value is not of its schema's type"
        raise SceneError(what, where=str(path), got=str(error), do="try usdchecker") from error


def _made(
    path: Path, variants: Mapping[str, str], view: View, size: tuple[int, int] | None, mends: Mends
) -> tuple[_Layer, Survey]:
    """The layer, and what a quick look at it tells."""
    layer = _Layer(path, variants)
    layer.say_variants(variants)
    layer.say_purposes(view)
    layer.say_camera(view, size)
    if view.time is not None:
        layer.freeze(view.time)
    plain = View(quick=True)
    survey = layer.look(plain)
    for _ in range(_PASSES):
        if not layer.mend(survey, mends):
            break
        survey = layer.look(plain)
    layer.place_camera(survey)
    return layer, survey


class _Layer:
    """The layer in the making; ``said`` has a line for each of its opinions."""

    def __init__(self, path: Path, variants: Mapping[str, str]) -> None:
        self.said: list[str] = []
        self._path = path
        open_stage(path)  # says so where it cannot be
        self._layer = Sdf.Layer.CreateAnonymous(".usda")
        self._layer.subLayerPaths.append(str(path))
        below = Sdf.Layer.FindOrOpen(str(path))
        for key in _STAGE_METADATA:
            if not below.pseudoRoot.HasInfo(key):
                continue
            with contextlib.suppress(TypeError):  # a value of another type is one that nobody reads
                self._layer.pseudoRoot.SetInfo(key, below.pseudoRoot.GetInfo(key))
        self._stage = Usd.Stage.Open(self._layer)
        root = self._stage.GetDefaultPrim()
        if root:
            with reading():
                choose(self._stage, root, variants)  # whether there are such
            self._stage.GetSessionLayer().Clear()
        self._stage.SetEditTarget(Usd.EditTarget(self._layer))
        if not root:
            root = UsdGeom.Scope.Define(self._stage, self._free("/notabug")).GetPrim()
            self._stage.SetDefaultPrim(root)
            self._say(str(root.GetPath()), "the default prim, which the stage lacks")
        self._root = root
        if "notabug" not in root.GetCustomData():
            card = {"class": OWN_CARD.artifact_class, "claim": OWN_CARD.claim}
            root.SetCustomDataByKey("notabug", card)
            self._say(f"{root.GetPath()}.customData:notabug", "a card: a scene of your own")

    def _say(self, where: str, what: str, because: str = "") -> None:
        """Say an opinion once; where several faults ask for the same one, with the reasons of all."""
        head = f"{where}: {what}"
        line = f"{head} ({because})" if because else head
        same = next((place for place, other in enumerate(self.said) if because and other.startswith(f"{head} (")), None)
        if same is None:
            self.said += [line] if line not in self.said else []
        elif because not in (reasons := self.said[same][len(head) + 2 : -1]).split("; "):
            self.said[same] = f"{head} ({reasons}; {because.removeprefix(GREY_BECAUSE)})"

    def _free(self, path: str) -> str:
        """``path``, with a number where the stage already has such a prim."""
        number, made = 1, path
        while self._stage.GetPrimAtPath(made):
            number, made = number + 1, f"{path}_{number}"
        return made

    def write(self, out: Path) -> None:
        """Write the layer to ``out``, with the scene's path relative to it."""
        copy = Sdf.Layer.CreateAnonymous(".usda")
        copy.TransferContent(self._layer)
        copy.subLayerPaths[0] = f"./{Path(os.path.relpath(self._path, out.parent)).as_posix()}"
        copy.comment = f"Made by notabug adapt from {self._path.name}"
        out.parent.mkdir(parents=True, exist_ok=True)
        if not copy.Export(str(out)):
            raise SceneError("cannot be written", where=str(out))

    def look(self, view: View) -> Survey:
        """Look at the layer as any scene is looked at."""
        return survey_layer(self._layer, self._path, scene_id(self._path), view)

    def flat(self) -> str:
        """The layer and all that is below it as one layer's text."""
        return str(self._stage.Flatten(False).ExportToString())

    def say_variants(self, variants: Mapping[str, str]) -> None:
        """Select the ``variants``, and the first one of a set that selects none."""
        sets = self._root.GetVariantSets()
        for key, chosen in variants.items():
            path, name = prim_and_set(key)
            prim = self._stage.GetPrimAtPath(path) if path else self._root
            prim.GetVariantSets().SetSelection(name, chosen)
            self._say(f"{prim.GetPath()}.variants", f"{name} = {chosen}")
        for name in sets.GetNames():
            known = sets.GetVariantSet(name).GetVariantNames()
            if known and sets.GetVariantSelection(name) not in known:
                sets.SetSelection(name, known[0])
                self._say(f"{self._root.GetPath()}.variants", f"{name} = {known[0]}, the first: nothing selects one")

    def say_purposes(self, view: View) -> None:
        """Give prims whose purpose is asked for the default one, and the others that of a guide."""
        if view.purposes == DRAWN:
            return
        for prim in self._stage.Traverse():
            attribute = UsdGeom.Imageable(prim).GetPurposeAttr() if prim.IsA(UsdGeom.Imageable) else None
            if attribute and attribute.HasAuthoredValue():
                wanted = "default" if attribute.Get() in view.purposes else "guide"
                if attribute.Get() != wanted:
                    self._say(f"{prim.GetPath()}.purpose", f"{wanted}, was {attribute.Get()}")
                    attribute.Set(wanted)

    def say_camera(self, view: View, size: tuple[int, int] | None) -> None:
        """Render settings with the camera that is asked for, or their own, or the first one there is."""
        named = UsdRender.Settings.GetStageRenderSettings(self._stage)
        found = [prim for prim in self._stage.Traverse() if prim.IsA(UsdRender.Settings)]
        prim = named.GetPrim() if named else found[0] if found else None
        known = cameras(self._stage)
        if view.camera and view.camera not in [str(each.GetPath()) for each in known]:
            expected = ", ".join(str(each.GetPath()) for each in known) or "none: the stage has no camera"
            raise SelectionError(f"no camera {view.camera!r}", where="--camera", expected=f"one of {expected}")
        fresh = prim is None
        if prim is None:
            prim = UsdRender.Settings.Define(self._stage, self._free("/Render/Settings")).GetPrim()
        settings = UsdRender.Settings(prim)
        if not named:
            self._stage.SetMetadata("renderSettingsPrimPath", str(prim.GetPath()))
            self._say("/.renderSettingsPrimPath", f"{prim.GetPath()}{' (new)' if fresh else ''}")
        targets = settings.GetCameraRel().GetForwardedTargets()
        chosen = view.camera or (str(targets[0]) if targets else str(known[0].GetPath()) if known else "")
        if chosen and (not targets or str(targets[0]) != chosen):
            settings.CreateCameraRel().SetTargets([Sdf.Path(chosen)])
            others = f", the first of {len(known)}: --camera chooses" if len(known) > 1 and not view.camera else ""
            self._say(f"{prim.GetPath()}.camera", f"{chosen}{others}")
        self._settings = settings
        if size is not None or fresh:
            width, height = size or _size_for(self._stage.GetPrimAtPath(chosen) if chosen else None)
            settings.CreateResolutionAttr(Gf.Vec2i(width, height))
            self._say(f"{prim.GetPath()}.resolution", f"{width} x {height}")

    def freeze(self, time: float) -> None:
        """Every animated value as it is at ``time``."""
        check_frame(self._stage, time)
        count = 0
        for prim in self._stage.Traverse():
            for attribute in prim.GetAuthoredAttributes():
                if attribute.ValueMightBeTimeVarying():
                    now = attribute.Get(time)
                    attribute.Block() if now is None else attribute.Set(now)
                    count += 1
        if count:
            self._say("/", f"{count} animated value{'s' * (count != 1)} as at time code {time:g}")

    def mend(self, survey: Survey, mends: Mends) -> bool:
        """Overrule what ``survey`` refuses; whether anything was said."""
        before = len(self.said)
        refused = [remark for remark in survey.remarks if remark.error is not None]
        if any("animated" in remark.what for remark in refused):
            known = frames(self._stage) or (0.0, 0.0)
            self.freeze(self._stage.GetStartTimeCode() if self._stage.HasAuthoredTimeCodeRange() else known[0])
        for remark in refused if mends == "scene" else ():
            if remark.what.startswith(_NO_LIGHT):
                self._light()
                continue
            if "animated" in remark.what:
                continue
            for opinion in remark.mends or self._last_resort(remark):
                self._apply(opinion)
        return len(self.said) > before

    def _last_resort(self, remark: Remark) -> Iterator[Opinion]:
        """For a fault that no value mends: a grey material, or the prim left out."""
        attribute = remark.where.removeprefix(remark.path).removeprefix(".")
        because = f"{LEFT_OUT_BECAUSE}{attribute}{': ' * bool(attribute)}{remark.what}"
        prim = self._stage.GetPrimAtPath(remark.path) if Sdf.Path.IsValidPathString(remark.path) else None
        while prim and not prim.IsPseudoRoot():
            if prim.IsA(UsdShade.Material):
                said = f"{GREY_BECAUSE}{attribute}{': ' * bool(attribute)}{remark.what}"
                yield Opinion(str(prim.GetPath()), "outputs:surface", "preview", GREY, said)
                return
            if prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer) or prim.HasAPI(UsdLux.LightAPI):
                yield Opinion(str(prim.GetPath()), "visibility", "token", "invisible", because)
                return
            prim = prim.GetParent()

    def _apply(self, opinion: Opinion) -> None:
        prim = self._prim(opinion.path)
        if prim is None or says_already(self._layer, opinion):
            return
        where, because = f"{opinion.path}.{opinion.name}", f" ({opinion.because})" if opinion.because else ""
        if opinion.type == "preview" and isinstance(opinion.value, tuple):
            red, green, blue = (float(part) for part in opinion.value)
            self._paint(UsdShade.Material(prim), (red, green, blue))
            self._say(where, f"{PREVIEW} {shown_value(opinion.value)}", opinion.because)
        elif opinion.type == "rel":
            relationship = prim.GetRelationship(opinion.name) or prim.CreateRelationship(opinion.name, False)
            relationship.SetTargets([])
            self._say(where, f"no targets{because}")
        elif opinion.type == BLOCKED:
            prim.GetAttribute(opinion.name).Block()
            self._say(where, f"none{because}")
        else:
            kind = Sdf.ValueTypeNames.Find(opinion.type)
            attribute = prim.GetAttribute(opinion.name) or prim.CreateAttribute(opinion.name, kind, False)
            was = attribute.Get(Usd.TimeCode.EarliestTime())
            if attribute.HasAuthoredConnections():
                attribute.SetConnections([])
            attribute.Set(typed(opinion.type, opinion.value))
            if opinion.because.startswith(LEFT_OUT_BECAUSE):
                prim.SetCustomDataByKey(LEFT_OUT, opinion.because.removeprefix(LEFT_OUT_BECAUSE))
            old = "" if was is None else f", was {shown_value(was)}"
            self._say(where, f"{shown_value(opinion.value)}{old}{because}")

    def _prim(self, path: str) -> Usd.Prim | None:
        """The prim at ``path``, whose instance becomes one of its own where it is shared."""
        for _ in range(_PASSES):
            prim = self._stage.GetPrimAtPath(path)
            if not prim or not prim.IsInstanceProxy():
                return prim or None
            owner = prim
            while owner.IsInstanceProxy():  # the outermost instance is a prim of its own
                owner = owner.GetParent()
            owner.SetInstanceable(False)
            self._say(str(owner.GetPath()), "not instanceable: a value inside is overruled")
        return None

    def _paint(self, material: UsdShade.Material, colour: tuple[float, float, float]) -> None:
        shader = UsdShade.Shader.Define(self._stage, material.GetPath().AppendChild("NotabugSurface"))
        shader.CreateIdAttr(PREVIEW)
        types = Sdf.ValueTypeNames
        shader.CreateInput("diffuseColor", types.Color3f).Set(Gf.Vec3f(*colour))
        shader.CreateInput("useSpecularWorkflow", types.Int).Set(1)
        shader.CreateInput("specularColor", types.Color3f).Set(Gf.Vec3f(0.0))
        material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", types.Token))

    def _light(self) -> None:
        """A distant light from above, over the camera's shoulder."""
        path = self._free("/notabug_light")
        up = str(UsdGeom.GetStageUpAxis(self._stage))
        targets = self._settings.GetCameraRel().GetForwardedTargets()
        camera = self._stage.GetPrimAtPath(targets[0]) if targets else None
        towards = direction(_AZIMUTH + 40.0, _ELEVATION + 25.0, up)
        if camera:
            matrix = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(camera), np.float64)
            x, y, z = (row / np.linalg.norm(row) for row in matrix[:3, :3])
            towards = 0.6 * x + 0.6 * y + z
            towards /= np.linalg.norm(towards)
        made = UsdLux.DistantLight.Define(self._stage, path)
        made.CreateAngleAttr(0.0)
        made.CreateIntensityAttr(LIT)
        x = np.cross(np.eye(3)[np.abs(towards).argmin()], towards)
        x /= np.linalg.norm(x)
        placed = np.eye(4)
        placed[:3, :3] = x, np.cross(towards, x), towards
        place(made, placed)
        self._say(path, "a distant light: the scene has none that is read")

    def place_camera(self, survey: Survey) -> None:
        """The camera that the reader placed for want of one, as a prim of the layer."""
        if survey.scene is None or self._settings.GetCameraRel().GetForwardedTargets():
            return
        camera = survey.scene.camera
        path = self._free("/notabug_camera")
        define_camera(self._stage, path, camera)
        self._settings.CreateCameraRel().SetTargets([Sdf.Path(path)])
        self._say(path, "a camera that sees everything: the stage has none")


_NO_LIGHT = "no visible light"
_AZIMUTH, _ELEVATION = 30.0, 25.0  # of the camera that is placed


def _size_for(camera: Usd.Prim | None) -> tuple[int, int]:
    """The default size with the shape of the camera's aperture."""
    width, height = DEFAULT_SIZE
    if camera:
        lens = UsdGeom.Camera(camera)
        across, down = lens.GetHorizontalApertureAttr().Get(), lens.GetVerticalApertureAttr().Get()
        if across and down and across > 0.0 and down > 0.0:
            height = max(1, round(width * down / across))
    return width, height
