"""A white sheet GAP above a grey one, and a sun that shines straight at both: python scene.py [GAP] [no-shadows].

Prints how many pixels are white, grey and black, and writes picture.npy, (128, 128), red, top row first.
"""

import math
import sys

import bpy
import numpy as np
from mathutils import Euler, Vector

SIDE = 128
words = [word for word in sys.argv[1:] if word != "no-shadows"]
GAP = float(words[0]) if words else 1e-6
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.max_bounces = 1, 0  # the first sample is the pixel's centre
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.cycles.pixel_filter_type = "BOX"
scene.render.resolution_x = scene.render.resolution_y = SIDE
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.view_settings.view_transform = "Raw"
scene.world = bpy.data.worlds.new("black")
scene.world.color = (0, 0, 0)
for node in scene.world.node_tree.nodes if scene.world.node_tree else ():
    if node.type == "BACKGROUND":
        node.inputs["Strength"].default_value = 0


def matt(shade):
    made = bpy.data.materials.new("matt")
    if made.node_tree is None:
        made.use_nodes = True
    made.node_tree.nodes.clear()
    out, lambert = (made.node_tree.nodes.new(name) for name in ("ShaderNodeOutputMaterial", "ShaderNodeBsdfDiffuse"))
    lambert.inputs["Color"].default_value = (shade, shade, shade, 1)
    made.node_tree.links.new(lambert.outputs[0], out.inputs[0])
    return made


# All is turned alike, so that no coordinate is round; the upper sheet's triangles are cut along the other diagonal.
turn = Euler((0.4, 0.3, 0.2)).to_matrix()
corners = [Vector((x, y, 0)) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
sheets = (("upper", GAP, 1.0, [(0, 1, 3), (1, 2, 3)]), ("lower", 0.0, 0.5, [(0, 1, 2), (0, 2, 3)]))
for name, height, shade, triangles in sheets:
    sheet = bpy.data.meshes.new(name)
    sheet.from_pydata([turn @ (corner + Vector((0, 0, height))) for corner in corners], [], triangles)
    sheet.materials.append(matt(shade))
    scene.collection.objects.link(bpy.data.objects.new(name, sheet))

sun = bpy.data.lights.new("sun", "SUN")
sun.energy, sun.angle, sun.use_shadow = math.pi, 0.0, "no-shadows" not in sys.argv
camera = bpy.data.cameras.new("camera")
camera.sensor_width, camera.lens = 36.0, 120.0  # the picture is 1.8 wide at a distance of 6
for name, thing in (("sun", sun), ("camera", camera)):  # both look along -z of the sheets
    place = bpy.data.objects.new(name, thing)
    place.matrix_world = turn.to_4x4()
    place.location = turn @ Vector((0, 0, 6))
    scene.collection.objects.link(place)
scene.camera = place

scene.render.filepath = bpy.app.tempdir + "frame.exr"
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load(scene.render.filepath)
image.colorspace_settings.name = "Non-Color"
pixels = np.empty(SIDE * SIDE * image.channels, np.float32)
image.pixels.foreach_get(pixels)
picture = pixels.reshape(SIDE, SIDE, image.channels)[::-1, :, 0]
np.save("picture.npy", picture)
seen = {
    name: np.argwhere(np.abs(picture - value) < 0.01) for name, value in (("white", 1.0), ("grey", 0.5), ("black", 0.0))
}
print(
    "DEFECT", {name: len(places) for name, places in seen.items()}, "of", picture.size, "pixels, the first black ones:"
)
print("DEFECT (column, row)", seen["black"][:5, ::-1].tolist())
