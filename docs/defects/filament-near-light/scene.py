"""A white floor with a lamp right above it, seen from above: python scene.py [HEIGHT].

The lamp is as bright as makes the floor below it .5. Writes picture.npy, (9, 9), red, top row first.
"""

import math
import os
import sys

import filly
import numpy as np

SIDE = 9
HEIGHT = float(sys.argv[1]) if len(sys.argv) > 1 else 0.005

renderer = filly.Renderer()
scene = renderer.create_scene()
scene.encoding = "linear"  # neither tone mapping nor antialiasing: filly has none unless asked
scene.load("scene.gltf")  # a square of 2 x 2 in the plane z = 0, white and matt
scene.add_point_light(position=(0, 0, HEIGHT), intensity=0.5 * math.pi * HEIGHT**2, range=1000.0)
camera = renderer.create_camera()
camera.exposure = math.log2(1 / 1.2)  # at which the picture is the luminance
place = np.eye(4, dtype=np.float32)
place[2, 3] = 1.0
camera.transform = place
# .0001 x HEIGHT wide: what is seen is right below the lamp
camera.set_perspective(fov_y_deg=math.degrees(2e-4 * HEIGHT), aspect=1, near=0.5, far=1000)
scene.camera = camera
target = renderer.create_render_target(width=SIDE, height=SIDE)
renderer.render(scene, target)
picture = np.asarray(target.read())[..., 0] / 255.0
np.save("picture.npy", picture)
print(f"DEFECT the floor is {picture[4, 4]:.4f}; expected is 0.5")
sys.stdout.flush()
os._exit(0)  # taking the device down may crash
