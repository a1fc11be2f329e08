"""UsdRenderSettings and its camera to a pinhole and a picture size."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdRender

from notabug.scenes_usd.errors import SceneError, SelectionError
from notabug.scenes_usd.opinion import Opinion
from notabug.scenes_usd.reader_values import (
    ORTHOGONAL,
    blamed,
    check_plain,
    fault,
    number,
    opinion,
    read,
    same,
    shown,
    turns_over,
    value,
    vectors,
    where,
    world_matrix,
)
from notabug.scenes_usd.reading import note, recovered, refuse, view
from notabug.scenes_usd.scene import Camera, Floats

_TENTHS = 10.0  # apertures and focal lengths are in tenths of the scene's unit
DEFAULT_SIZE = (256, 256)
_MAX_SIDE = 1 << 14
_NARROWEST = 1e-2  # of a pixel's width over its height
_PAIRS = ((0, 1), (0, 2), (1, 2))  # of axes
_RIGHTED = "xformOp:transform:notabug"  # the one transform of a camera that `adapt` rights
_NEAR, _FAR = 1.0, 1e6  # the schema's clipping range: in the place of one that is refused


@dataclass(frozen=True, slots=True)
class Picture:
    """What of a picture the file says: a camera, or None where it has none, and the size in pixels."""

    camera: Camera | None
    width: int
    height: int


def read_picture(stage: Usd.Stage) -> Picture:
    """The camera and the size of the picture, with what nobody authored assumed and noted."""
    settings = find_settings(stage)
    prim = _chosen_camera(stage, settings)
    if settings is None:
        width, height = _assumed_size(prim)
        note("approximated", "/", f"no render settings: the picture is {width} x {height} pixels")
    else:
        width, height = recovered(lambda: _size(settings), DEFAULT_SIZE)
    camera = None if prim is None else read_camera(prim, settings, width, height)
    return Picture(camera, width, height)


def find_settings(stage: Usd.Stage) -> Usd.Prim | None:
    """The stage's render settings: those its metadata names, or the only ones there are; None where there are none."""
    named = UsdRender.Settings.GetStageRenderSettings(stage)
    if named:
        return named.GetPrim()
    found = [prim for prim in stage.Traverse() if prim.IsA(UsdRender.Settings)]
    if len(found) > 1:
        raise SceneError(
            "cannot tell which picture to draw",
            where="/.renderSettingsPrimPath",
            expected="the path of one RenderSettings prim",
            got=f"{len(found)} RenderSettings prims and no path",
            do='author renderSettingsPrimPath = "/Render/Settings" in the layer and its rel camera',
        )
    return found[0] if found else None


def cameras(stage: Usd.Stage) -> list[Usd.Prim]:
    """Every camera of the stage, inside instances too."""
    every = Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
    return [prim for prim in every if prim.IsA(UsdGeom.Camera)]


def _chosen_camera(stage: Usd.Stage, settings: Usd.Prim | None) -> Usd.Prim | None:
    """The camera that was asked for, or the settings', or the only one; None where the stage has none."""
    asked = view().camera
    if asked:
        prim = stage.GetPrimAtPath(asked) if Sdf.Path.IsValidPathString(asked) else None
        if not prim or not prim.IsA(UsdGeom.Camera):
            known = ", ".join(str(each.GetPath()) for each in cameras(stage)) or "none: the stage has no camera"
            raise SelectionError(f"no camera {asked!r}", where="--camera", expected=f"one of {known}")
        return prim
    relationship = settings.GetRelationship("camera") if settings is not None else None
    if settings is not None and relationship and relationship.HasAuthoredTargets():
        return _camera_of(stage, settings, relationship)
    found = cameras(stage)
    if len(found) > 1:
        where = f"{settings.GetPath()}.camera" if settings is not None else "/.renderSettingsPrimPath"
        raise SceneError(
            f"{len(found)} cameras",
            where=where,
            expected=f"one of {', '.join(str(each.GetPath()) for each in found)}",
            do="choose: notabug adapt SCENE --camera PATH --out own.usda",
        )
    if found:
        note("approximated", str(found[0].GetPath()), "nothing names a camera: this is the only one")
        return found[0]
    note("approximated", "/", "no camera: one is placed that sees everything")
    return None


def _camera_of(stage: Usd.Stage, settings: Usd.Prim, relationship: Usd.Relationship) -> Usd.Prim:
    with blamed(settings, "camera"):
        targets = relationship.GetForwardedTargets()
    if len(targets) != 1:
        raise fault(
            settings, "camera", f"{len(targets)} cameras", expected="one", do="author rel camera = </Scene/Camera>"
        )
    prim = stage.GetPrimAtPath(targets[0].GetPrimPath())
    if not prim or not prim.IsA(UsdGeom.Camera):
        raise fault(settings, "camera", f"{targets[0]} is no camera", expected="the path of a Camera prim")
    return prim


def _assumed_size(camera: Usd.Prim | None) -> tuple[int, int]:
    """The size of the picture that is at hand, else the default one with the shape of the camera's aperture."""
    at_hand = view().size
    if at_hand is not None:
        return at_hand
    width, height = DEFAULT_SIZE
    if camera is None:
        return width, height
    across, down = (number(camera, name, 1.0) for name in ("horizontalAperture", "verticalAperture"))
    if across > 0.0 and down > 0.0:
        height = round(min(max(width * down / across, 1), _MAX_SIDE))
    return width, height


def read_camera(prim: Usd.Prim, settings: Usd.Prim | None, width: int, height: int) -> Camera:
    """The pinhole at ``prim`` for a picture of ``width`` x ``height`` pixels."""
    projection = value(prim, "projection", "word")
    if projection not in ("perspective", "orthographic"):
        refuse(
            fault(
                prim,
                "projection",
                "not supported",
                expected="perspective or orthographic",
                got=str(projection),
                mends=opinion(prim, "projection", "token", "perspective"),
            )
        )
    if not same(number(prim, "fStop", 0.0), 0.0):
        note("approximated", where(prim, "fStop"), "depth of field is not modelled: everything is in focus")
    if len(recovered(lambda: vectors(prim, "clippingPlanes", 4), np.zeros((0, 4)))):
        planes = opinion(prim, "clippingPlanes", "float4[]", [])
        refuse(fault(prim, "clippingPlanes", "not supported", expected="none", mends=planes))
    parallel = projection == "orthographic"
    names = ("horizontalAperture", "verticalAperture", *(() if parallel else ("focalLength",)))
    horizontal, vertical, *lens = (recovered(partial(_positive, prim, name), 1.0) for name in names)
    horizontal, vertical = recovered(
        lambda: _conform(settings, horizontal, vertical, width / height * _pixel_aspect(settings)),
        (horizontal, vertical),
    )
    near, far = recovered(lambda: _range(prim), (_NEAR, _FAR))
    matrix = recovered(lambda: world_matrix(prim), np.eye(4))
    rigid, scale = recovered(lambda: _rigid(prim, matrix), (np.eye(4), 1.0))
    away = _TENTHS / scale if parallel else lens[0]  # what half an aperture is divided by for what is seen of the scene
    right, up = (recovered(partial(_offset, prim, name), 0.0) for name in ("horizontal", "vertical"))
    return Camera(
        path=str(prim.GetPath()),
        to_world=rigid,
        tan_x=horizontal / (2 * away),
        tan_y=vertical / (2 * away),
        near=near * scale,
        far=far * scale,
        shift_x=2.0 * right / horizontal,
        shift_y=2.0 * up / vertical,
        orthographic=parallel,
    )


def _rigid(prim: Usd.Prim, matrix: Floats) -> tuple[Floats, float]:
    """The camera's place without its scale, and the scale."""
    linear = matrix[:3, :3]
    scale = float(np.cbrt(abs(np.linalg.det(linear))))
    even = np.allclose(linear @ linear.T, scale * scale * np.eye(3), rtol=0, atol=ORTHOGONAL * scale * scale)
    if turns_over(linear) or not even:
        how = _unlike_a_rotation(linear)
        raise fault(
            prim,
            "xformOpOrder",
            "the camera is mirrored, sheared or scaled unevenly",
            expected="rotation and translation",
            got=how,
            mends=_righted(prim, matrix, scale, how),
        )
    if np.allclose(linear @ linear.T, np.eye(3), rtol=0, atol=1e-14):
        return matrix, 1.0  # a rotation already: keep its bits
    u, _, v = np.linalg.svd(linear)  # the nearest rotation, free of scale and rounding
    rigid = matrix.copy()
    rigid[:3, :3] = u @ v
    return rigid, scale


def _unlike_a_rotation(linear: Floats) -> str:
    """What the axes of a regular matrix (3, 3) are that no rotation has, in words."""
    lengths = np.linalg.norm(linear, axis=1)
    axes = linear / lengths[:, None]
    angles = {
        f"{'xyz'[a]} and {'xyz'[b]}": math.degrees(math.acos(np.clip(axes[a] @ axes[b], -1, 1))) for a, b in _PAIRS
    }
    skew, between = max((abs(angle - 90.0), pair) for pair, angle in angles.items())
    said = ["axes of a left hand"] if turns_over(linear) else []
    if skew > math.degrees(ORTHOGONAL):
        said.append(f"{angles[between]:.7g} degrees between {between}")
    if float(np.ptp(lengths)) > 0.5 * ORTHOGONAL * float(lengths.max()):
        said.append(f"axes {', '.join(f'{length:.7g}' for length in lengths)} long")
    return ", ".join(said)


def _righted(prim: Usd.Prim, matrix: Floats, scale: float, how: str) -> tuple[Opinion, ...]:
    """The opinions that give the camera the nearest rotation, whatever its parents do, and its mean scale."""
    upright = matrix.copy()
    if turns_over(matrix[:3, :3]):
        upright[0, :3] *= -1.0  # it looks where it looked, with the same side up
    u, _, v = np.linalg.svd(upright[:3, :3])
    upright[:3, :3] = scale * (u @ v)
    value = tuple(upright.ravel().tolist())
    return (
        *opinion(prim, _RIGHTED, "matrix4d", value, f"the nearest rotation: {how}"),
        *opinion(prim, "xformOpOrder", "token[]", ("!resetXformStack!", _RIGHTED)),
    )


def _range(prim: Usd.Prim) -> tuple[float, float]:
    """The near and the far plane."""
    found = value(prim, "clippingRange", "numbers")
    if found is None or len(found) != 2:
        raise fault(prim, "clippingRange", "not a range", expected="two numbers", got=shown(found))
    near, far = found
    if not (math.isfinite(far) and 0.0 < near < far):
        raise fault(prim, "clippingRange", "out of range", expected="0 < near < far", got=f"({near:g}, {far:g})")
    return near, far


def _size(settings: Usd.Prim) -> tuple[int, int]:
    """The resolution; where none is authored that of the picture at hand, else 256 x 256."""
    authored = settings.GetAttribute("resolution").HasAuthoredValue()
    size = value(settings, "resolution", "numbers") if authored else view().size or DEFAULT_SIZE
    if len(size) != 2 or any(each != round(each) for each in size if math.isfinite(each)):
        raise fault(settings, "resolution", "not a size", expected="two whole numbers", got=shown(size))
    width, height = size
    if not (1 <= width <= _MAX_SIDE and 1 <= height <= _MAX_SIDE):
        got = f"({width:g}, {height:g})"
        raise fault(settings, "resolution", "out of range", expected=f"1 to {_MAX_SIDE}", got=got)
    window = read(settings, "dataWindowNDC", settings.GetAttribute("dataWindowNDC"))
    check_plain(settings, "dataWindowNDC", window, (0.0, 0.0, 1.0, 1.0), "crops are not supported")
    return int(width), int(height)


def _pixel_aspect(settings: Usd.Prim | None) -> float:
    """The width of a pixel over its height."""
    if settings is None:
        return 1.0
    ratio = number(settings, "pixelAspectRatio", 1.0)
    if not _NARROWEST <= ratio <= 1.0 / _NARROWEST:
        expected = f"{_NARROWEST:g} to {1.0 / _NARROWEST:g}"
        raise fault(settings, "pixelAspectRatio", "out of range", expected=expected, got=f"{ratio:g}")
    return 1.0 if same(ratio, 1.0) else ratio


def _conform(settings: Usd.Prim | None, horizontal: float, vertical: float, aspect: float) -> tuple[float, float]:
    """The aperture after the conform policy has given it the picture's aspect ratio (width over height)."""
    if abs(horizontal - vertical * aspect) <= 1e-6 * horizontal:  # apertures are stored in float32
        return vertical * aspect, vertical
    policy = "expandAperture"
    if settings is not None:
        policy = value(settings, "aspectRatioConformPolicy", "word", policy)
    wide = horizontal > vertical * aspect
    if (
        policy == "adjustApertureWidth"
        or (policy == "expandAperture" and not wide)
        or (policy == "cropAperture" and wide)
    ):
        return vertical * aspect, vertical
    if policy in ("adjustApertureHeight", "expandAperture", "cropAperture"):
        return horizontal, horizontal / aspect
    if policy == "adjustPixelAspectRatio":
        return horizontal, vertical  # the pixels take the aperture's shape
    assert settings is not None  # without settings the policy is the schema's
    raise fault(
        settings,
        "aspectRatioConformPolicy",
        "not supported for an aperture of another shape than the picture",
        expected="expandAperture, cropAperture, adjustApertureWidth, adjustApertureHeight or adjustPixelAspectRatio",
        got=policy,
    )


def _offset(prim: Usd.Prim, name: str) -> float:
    """By how much the picture's middle lies beside the axis, in the aperture's unit; the schema's own is none."""
    found = number(prim, f"{name}ApertureOffset", 0.0)
    return 0.0 if same(found, 0.0) else found


def _positive(prim: Usd.Prim, name: str) -> float:
    found = number(prim, name, 1.0)
    if found <= 0.0:
        raise fault(prim, name, "out of range", expected="above 0", got=f"{found:g}")
    return found
