"""A Camera as a UsdGeomCamera: its prim, its place, and its lens."""

from __future__ import annotations

from pxr import Gf, Usd, UsdGeom

from notabug.scenes_usd.scene import Camera, Floats

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


def define_camera(stage: Usd.Stage, path: str, camera: Camera) -> None:
    """Define ``camera`` as a prim of ``stage`` at ``path``."""
    made = UsdGeom.Camera.Define(stage, path)
    made.CreateClippingRangeAttr(Gf.Vec2f(camera.near, camera.far))
    write_lens(made, camera)
    place(made, camera.to_world)


def place(prim: UsdGeom.Xformable, matrix: Floats) -> None:
    """Give ``prim`` the transform ``matrix`` (4, 4), for row vectors."""
    UsdGeom.Xformable(prim).AddTransformOp().Set(Gf.Matrix4d(*matrix.ravel().tolist()))
