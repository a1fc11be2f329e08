"""A white floor with a lamp right above it, seen from above: python scene.py [HEIGHT].

The lamp is as bright as makes the floor below it 1.0. Writes picture.npy, (8, 8), red, top row first.
"""

import math
import os
import sys

import numpy as np
import pygfx

SIDE = 8
HEIGHT = float(sys.argv[1]) if len(sys.argv) > 1 else 0.05

film = pygfx.Texture(dim=2, size=(SIDE, SIDE, 1), format="rgba8unorm")
renderer = pygfx.WgpuRenderer(film, pixel_ratio=1, ppaa="none")
scene = pygfx.Scene()
black = pygfx.Texture(np.zeros((1, 1, 4), np.float32), dim=2, colorspace="physical")
floor = pygfx.Geometry(
    positions=np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32),
    normals=np.array([(0, 0, 1)] * 4, np.float32),
    texcoords=np.zeros((4, 2), np.float32),
    indices=np.array([(0, 1, 2), (0, 2, 3)], np.int32),
)
white = pygfx.MeshPhongMaterial(color=(1, 1, 1), specular_map=pygfx.TextureMap(black))  # no highlight
scene.add(pygfx.Mesh(floor, white))
lamp = pygfx.PointLight((1, 1, 1), math.pi * HEIGHT**2, decay=2)
lamp.local.position = (0, 0, HEIGHT)
scene.add(lamp)
camera = pygfx.PerspectiveCamera(1, 1, depth_range=(0.5, 2))  # of one degree: the picture is .017 wide
camera.local.position = (0, 0, 1)
camera.look_at((0, 0, 0))
renderer.render(scene, camera)
shown = renderer.snapshot()[..., 0] / 255.0  # sRGB in 8 bits
picture = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
np.save("picture.npy", picture)
print(f"DEFECT the floor is {picture[4, 4]:.4f}; expected is 1.0")
sys.stdout.flush()
os._exit(0)  # taking the device down may crash
