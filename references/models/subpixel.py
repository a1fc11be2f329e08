"""The grid within a pixel on which rasterisers put the corners of triangles before they fill them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from notabug.references.models.model import Edit, Model
from notabug.scenes_usd.scene import Scene

BITS = (4, 5, 6)  # OpenGL and Vulkan ask for 4 at least, Direct3D for 8; what more than 6 do no picture shows
_CORNERS = ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0))
# Of bilinear textures the brightest and darkest may lie where the kink between two texels meets the square's border.
_AROUND = tuple(
    (x, y) for x in (-1.0, -0.5, 0.0, 0.5, 1.0) for y in (-1.0, -0.5, 0.0, 0.5, 1.0) if max(abs(x), abs(y)) == 1.0
)


def models(scene: Scene) -> Iterator[Model]:
    """Models of any scene with a mesh: of a renderer that declares so few bits.

    A corner goes to the nearest point of the grid, so it moves by half a step at most along each axis of the picture;
    what lies between corners moves by a mean of their moves. So a pixel takes a value that the picture has within half
    a step, whatever the corners are, also those that clipping makes. Where nothing has a kink, that value lies between
    those at the corners of this square. Textures have kinks between their texels: of them the sides of the square are
    looked at in quarters.
    """
    if next(scene.meshes, None) is None:
        return
    places = _AROUND if scene.textures else _CORNERS
    for bits in BITS:
        half = 0.5 / 2**bits
        first, *others = (_moved(half * x, half * y) for x, y in places)
        yield Model(
            name="subpixel_grid",
            kind="limitation",
            rule="hull",
            claim=f"corners of triangles are put on a grid of {2**bits} x {2**bits} points in each pixel",
            cites="Vulkan 1.3, VkPhysicalDeviceLimits: subPixelPrecisionBits; OpenGL 4.6, SUBPIXEL_BITS",
            edit=first,
            edits=tuple(others),
            when=("subpixel_bits", str(bits)),
            strict=True,
        )


def _moved(right: float, down: float) -> Edit:
    """An edit that moves the picture by pixels."""

    def edit(scene: Scene) -> Scene:
        x, y = 2.0 * right / scene.width, 2.0 * down / scene.height
        camera = scene.camera
        return replace(scene, camera=replace(camera, shift_x=camera.shift_x - x, shift_y=camera.shift_y + y))

    return edit
