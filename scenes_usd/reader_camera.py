"""UsdRenderSettings and its camera to a pinhole and a picture size."""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd, UsdRender

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.reader_values import (
    ORTHOGONAL,
    blamed,
    check_plain,
    fault,
    number,
    read,
    same,
    shown,
    turns_over,
    value,
    vectors,
    world_matrix,
)
from notabug.scenes_usd.scene import Camera

DEFAULT_SIZE = (256, 256)
_MAX_SIDE = 1 << 14


def find_settings(stage: Usd.Stage) -> Usd.Prim:
    """The stage's render settings: the one its metadata names, or the only one there is."""
    named = UsdRender.Settings.GetStageRenderSettings(stage)
    if named:
        return named.GetPrim()
    found = [prim for prim in stage.Traverse() if prim.IsA(UsdRender.Settings)]
    if len(found) != 1:
        raise SceneError(
            "cannot tell which picture to draw",
            where="/.renderSettingsPrimPath",
            expected="the path of one RenderSettings prim",
            got=f"{len(found)} RenderSettings prims and no path",
            do='author renderSettingsPrimPath = "/Render/Settings" in the layer and its rel camera',
        )
    return found[0]


def read_camera(stage: Usd.Stage) -> tuple[Camera, int, int]:
    """The camera, width and height in pixels."""
    settings = find_settings(stage)
    width, height = _size(settings)
    prim = _camera_prim(stage, settings)
    projection = value(prim, "projection", "word")
    if projection != "perspective":
        raise fault(prim, "projection", "not supported", expected="perspective", got=str(projection))
    for name in ("horizontalApertureOffset", "verticalApertureOffset", "fStop"):
        found = number(prim, name, 0.0)
        if not same(found, 0.0):
            raise fault(prim, name, "not supported", expected="0", got=f"{found:g}")
    if len(vectors(prim, "clippingPlanes", 4)):
        raise fault(prim, "clippingPlanes", "not supported", expected="none")
    horizontal, vertical, focal = (
        _positive(prim, name) for name in ("horizontalAperture", "verticalAperture", "focalLength")
    )
    horizontal, vertical = _conform(settings, horizontal, vertical, width / height)
    near, far = _range(prim)

    matrix = world_matrix(prim)
    linear = matrix[:3, :3]
    scale = float(np.cbrt(abs(np.linalg.det(linear))))
    even = np.allclose(linear @ linear.T, scale * scale * np.eye(3), rtol=0, atol=ORTHOGONAL * scale * scale)
    if turns_over(linear) or not even:
        raise fault(
            prim,
            "xformOpOrder",
            "the camera is mirrored, sheared or scaled unevenly",
            expected="rotation and translation",
        )
    rigid = matrix
    if np.allclose(linear @ linear.T, np.eye(3), rtol=0, atol=1e-14):
        scale = 1.0  # a rotation already: keep its bits
    else:
        u, _, v = np.linalg.svd(linear)  # the nearest rotation, free of scale and rounding
        rigid = matrix.copy()
        rigid[:3, :3] = u @ v
    camera = Camera(
        path=str(prim.GetPath()),
        to_world=rigid,
        tan_x=horizontal / (2 * focal),
        tan_y=vertical / (2 * focal),
        near=near * scale,
        far=far * scale,
    )
    return camera, width, height


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
    """The resolution; 256 x 256 where none is authored."""
    authored = settings.GetAttribute("resolution").HasAuthoredValue()
    size = value(settings, "resolution", "numbers") if authored else DEFAULT_SIZE
    if len(size) != 2 or any(each != round(each) for each in size if math.isfinite(each)):
        raise fault(settings, "resolution", "not a size", expected="two whole numbers", got=shown(size))
    width, height = size
    if not (1 <= width <= _MAX_SIDE and 1 <= height <= _MAX_SIDE):
        got = f"({width:g}, {height:g})"
        raise fault(settings, "resolution", "out of range", expected=f"1 to {_MAX_SIDE}", got=got)
    ratio = number(settings, "pixelAspectRatio", 1.0)
    if not same(ratio, 1.0):
        raise fault(settings, "pixelAspectRatio", "only square pixels are supported", expected="1", got=f"{ratio:g}")
    window = read(settings, "dataWindowNDC", settings.GetAttribute("dataWindowNDC"))
    check_plain(settings, "dataWindowNDC", window, (0.0, 0.0, 1.0, 1.0), "crops are not supported")
    return int(width), int(height)


def _camera_prim(stage: Usd.Stage, settings: Usd.Prim) -> Usd.Prim:
    relationship = settings.GetRelationship("camera")
    with blamed(settings, "camera"):
        targets = relationship.GetForwardedTargets() if relationship else []
    if len(targets) != 1:
        raise fault(
            settings, "camera", f"{len(targets)} cameras", expected="one", do="author rel camera = </Scene/Camera>"
        )
    prim = stage.GetPrimAtPath(targets[0].GetPrimPath())
    if not prim or prim.GetTypeName() != "Camera":
        raise fault(settings, "camera", f"{targets[0]} is no camera", expected="the path of a Camera prim")
    return prim


def _conform(settings: Usd.Prim, horizontal: float, vertical: float, aspect: float) -> tuple[float, float]:
    """The aperture after the conform policy has given it the picture's aspect ratio (width over height)."""
    if abs(horizontal - vertical * aspect) <= 1e-6 * horizontal:  # apertures are stored in float32
        return vertical * aspect, vertical
    policy = value(settings, "aspectRatioConformPolicy", "word", "expandAperture")
    wide = horizontal > vertical * aspect
    if (
        policy == "adjustApertureWidth"
        or (policy == "expandAperture" and not wide)
        or (policy == "cropAperture" and wide)
    ):
        return vertical * aspect, vertical
    if policy in ("adjustApertureHeight", "expandAperture", "cropAperture"):
        return horizontal, horizontal / aspect
    raise fault(
        settings,
        "aspectRatioConformPolicy",
        "not supported for an aperture of another shape than the picture",
        expected="expandAperture, cropAperture, adjustApertureWidth or adjustApertureHeight",
        got=policy,
    )


def _positive(prim: Usd.Prim, name: str) -> float:
    found = number(prim, name, 1.0)
    if found <= 0.0:
        raise fault(prim, name, "out of range", expected="above 0", got=f"{found:g}")
    return found
