"""A white floor under a strip that shines, cut lengthwise into STRIPS and across into PIECES of each.

python scene.py STRIPS PIECES UNIT prints the mean radiance of the floor below its middle, which is the same however the
strip is cut and whatever the UNIT is that all lengths are told in; picture.npy, (32, 32), holds it in each pixel.
"""

import math
import sys

import bpy
import numpy as np
from mathutils import Euler, Vector

strips, pieces, unit = (int(word) for word in sys.argv[1:])
SIDE, LENGTH, WIDTH, HEIGHT, RADIANCE = 32, 3.0 * unit, 0.01 * unit, 2.0 * unit, 1000.0
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.max_bounces = 256, 0
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = scene.cycles.use_light_tree = False
scene.render.resolution_x = scene.render.resolution_y = SIDE
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.view_settings.view_transform = "Raw"


def material(kind, name, value):
    made = bpy.data.materials.new(kind)
    if made.node_tree is None:
        made.use_nodes = True
    made.node_tree.nodes.clear()
    out, shader = (made.node_tree.nodes.new(each) for each in ("ShaderNodeOutputMaterial", kind))
    shader.inputs[name].default_value = value
    made.node_tree.links.new(shader.outputs[0], out.inputs["Surface"])
    return made


turn = Euler((0.4, 0.3, 0.2)).to_matrix()  # all is turned alike, so that no coordinate is round


def sheet(name, points, faces, look):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([turn @ Vector(point) for point in points], [], faces)
    mesh.materials.append(look)
    scene.collection.objects.link(bpy.data.objects.new(name, mesh))


square = [(x * unit, y * unit, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
sheet("floor", square, [(0, 1, 2, 3)], material("ShaderNodeBsdfDiffuse", "Color", (1, 1, 1, 1)))
x, y = np.linspace(-LENGTH / 2, LENGTH / 2, pieces + 1), np.linspace(-WIDTH / 2, WIDTH / 2, strips + 1)
points = [(float(u), float(v), HEIGHT) for v in y for u in x]
faces = []
for row in range(strips):
    for column in range(pieces):
        first = row * (pieces + 1) + column
        faces.append((first, first + pieces + 1, first + pieces + 2, first + 1))  # faces down
sheet("light", points, faces, material("ShaderNodeEmission", "Strength", RADIANCE))

camera = bpy.data.cameras.new("camera")
camera.type, camera.ortho_scale = "ORTHO", 0.02 * unit
place = bpy.data.objects.new("camera", camera)
place.matrix_world = turn.to_4x4()
place.location = turn @ Vector((0, 0, unit))
scene.collection.objects.link(place)
scene.camera = place
scene.render.filepath = bpy.app.tempdir + "frame.exr"
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load(scene.render.filepath)
image.colorspace_settings.name = "Non-Color"
pixels = np.empty(SIDE * SIDE * image.channels, np.float32)
image.pixels.foreach_get(pixels)
found = pixels.reshape(SIDE, SIDE, image.channels)[::-1, :, 0]
np.save("picture.npy", np.full_like(found, found.mean()))  # the floor is as bright in all of its pixels
half = LENGTH / 2
along = half / (HEIGHT**2 + half**2) + math.atan(half / HEIGHT) / HEIGHT
expected = RADIANCE * WIDTH * along / math.pi
told = f"found {found.mean():.4f}, expected {expected:.4f}: {found.mean() / expected:.3f} of it"
print(f"DEFECT {strips} x {pieces} pieces, unit {unit}: {told}")
