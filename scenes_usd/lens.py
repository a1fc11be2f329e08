"""The lens of a Camera as the attributes of a UsdGeomCamera."""

from __future__ import annotations

from pxr import UsdGeom

from notabug.scenes_usd.scene import Camera

APERTURE = 20.0  # tenths of the scene's unit across, in perspective
_TENTHS = 10.0


def write_lens(made: UsdGeom.Camera, camera: Camera) -> None:
    """Say projection, apertures, their offsets and focal length of ``camera`` on the prim ``made``."""
    across = 2.0 * _TENTHS * camera.tan_x if camera.orthographic else APERTURE
    down = across * camera.tan_y / camera.tan_x
    tokens = UsdGeom.Tokens
    made.CreateProjectionAttr(tokens.orthographic if camera.orthographic else tokens.perspective)
    made.CreateHorizontalApertureAttr(across)
    made.CreateVerticalApertureAttr(down)
    if not camera.orthographic:
        made.CreateFocalLengthAttr(APERTURE / (2.0 * camera.tan_x))
    if camera.shift_x or camera.shift_y:
        made.CreateHorizontalApertureOffsetAttr(camera.shift_x * across / 2.0)
        made.CreateVerticalApertureOffsetAttr(camera.shift_y * down / 2.0)
