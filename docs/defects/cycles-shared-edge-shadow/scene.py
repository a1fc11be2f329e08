"""One white square under a sun that shines straight down, seen from above: python scene.py [no-shadows].

Prints every pixel of the square that is black, and writes picture.npy, (256, 256), red, top row first.
"""

import math
import sys

import bpy
import numpy as np

SIDE = 256
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

square = bpy.data.meshes.new("square")
corners = [(0, 0.75, 0), (0.25, 0.75, 0), (0.25, 1, 0), (0, 1, 0)]
square.from_pydata(corners, [], [(0, 1, 2), (0, 2, 3)])
white = bpy.data.materials.new("white")
if white.node_tree is None:
    white.use_nodes = True
white.node_tree.nodes.clear()
out, lambert = (white.node_tree.nodes.new(name) for name in ("ShaderNodeOutputMaterial", "ShaderNodeBsdfDiffuse"))
lambert.inputs["Color"].default_value = (1, 1, 1, 1)
white.node_tree.links.new(lambert.outputs[0], out.inputs[0])
square.materials.append(white)
scene.collection.objects.link(bpy.data.objects.new("square", square))

sun = bpy.data.lights.new("sun", "SUN")
sun.energy, sun.angle, sun.use_shadow = math.pi, 0.0, "no-shadows" not in sys.argv
scene.collection.objects.link(bpy.data.objects.new("sun", sun))  # it shines along -z
camera = bpy.data.cameras.new("camera")
camera.sensor_width, camera.lens = 36.0, 60.0  # the picture is 2.4 wide at a distance of 4
place = bpy.data.objects.new("camera", camera)
place.location = (0, 0, 4)
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
x, y = np.meshgrid(*(np.arange(SIDE) + 0.5,) * 2)
x, y = 1.2 * (x / 128 - 1), 1.2 * (1 - y / 128)
inside = (x > 0) & (x < 0.25) & (y > 0.75) & (y < 1)
black = np.argwhere(inside & (picture < 0.5))
print(f"DEFECT {len(black)} of {inside.sum()} pixels are black: {[(int(c), int(r)) for r, c in black]}", picture.max())
