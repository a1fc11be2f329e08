"""``python write_blender.py exports``, by a Python that has bpy: write exports/blender.usda as Blender exports it.

The folder has the textures, in ``textures``. The environment of ``notabug install cycles`` has bpy. Nothing of the
export is changed: this file makes a scene as an artist would, a floor with maps, a metal body, an area light, a camera,
and calls Blender's own exporter.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType

    from bpy.types import Material, Node, NodeTree


def main(folder: Path) -> None:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=8.0)
    floor = bpy.context.object
    floor.name = "Floor"
    floor.data.materials.append(mapped(bpy, folder))
    bpy.ops.mesh.primitive_cube_add(size=1.6, location=(0.2, 0.3, 0.8), rotation=(0.0, 0.0, 0.6))
    body = bpy.context.object
    body.name = "Body"
    body.modifiers.new("Bevel", "BEVEL").segments = 3
    body.data.materials.append(metal(bpy))
    bpy.ops.object.light_add(type="AREA", location=(1.6, -0.6, 3.6), rotation=(0.18, 0.4, 0.0))
    lamp = bpy.context.object.data
    lamp.shape, lamp.size, lamp.size_y, lamp.energy = "RECTANGLE", 1.4, 0.9, 260.0
    bpy.ops.object.light_add(type="SUN", location=(0.0, 0.0, 5.0), rotation=(-0.7, -0.5, 0.0))
    bpy.context.object.data.energy = 0.7
    bpy.ops.object.camera_add(location=(-2.2, -4.6, 3.2), rotation=(1.02, 0.0, -0.42))
    scene.camera = bpy.context.object
    scene.camera.data.lens = 42.0
    scene.render.resolution_x = scene.render.resolution_y = 512
    bpy.ops.wm.usd_export(filepath=str(folder / "blender.usda"), root_prim_path="/World")


def principled(bpy: ModuleType, name: str) -> tuple[Material, NodeTree, Node]:
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    surface, out = tree.nodes.new("ShaderNodeBsdfPrincipled"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(surface.outputs[0], out.inputs[0])
    return material, tree, surface


def metal(bpy: ModuleType) -> Material:
    material, _, surface = principled(bpy, "Metal")
    surface.inputs["Base Color"].default_value = (0.9, 0.62, 0.32, 1.0)
    surface.inputs["Metallic"].default_value = 1.0
    surface.inputs["Roughness"].default_value = 0.45
    return material


def mapped(bpy: ModuleType, folder: Path) -> Material:
    """A floor whose colour, roughness and normal are pictures."""
    material, tree, surface = principled(bpy, "Floor")
    for socket, name, space in (("Base Color", "colour", "sRGB"), ("Roughness", "roughness", "Non-Color")):
        tree.links.new(picture(bpy, tree, folder, name, space).outputs[0], surface.inputs[socket])
    turned = tree.nodes.new("ShaderNodeNormalMap")
    tree.links.new(picture(bpy, tree, folder, "normal", "Non-Color").outputs[0], turned.inputs["Color"])
    tree.links.new(turned.outputs[0], surface.inputs["Normal"])
    return material


def picture(bpy: ModuleType, tree: NodeTree, folder: Path, name: str, space: str) -> Node:
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(folder / "textures" / f"{name}.png"))
    node.image.colorspace_settings.name = space
    return node


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
