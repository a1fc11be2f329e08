"""A white floor with a lamp 3 above it, seen from above: python scene.py [DISTANCE], of the eye from the floor.

The lamp is as bright as makes the floor below it .5. Writes picture.npy, (9, 9), red, top row first.
"""

import math
import os
import sys

import filly
import numpy as np

SIDE = 9
DISTANCE = float(sys.argv[1]) if len(sys.argv) > 1 else 128.0

renderer = filly.Renderer()
scene = renderer.create_scene()
scene.encoding = "linear"  # neither tone mapping nor antialiasing: filly has none unless asked
scene.load("scene.gltf")  # a square of 2 x 2 in the plane z = 0, white and matt
scene.add_point_light(position=(0, 0, 3), intensity=0.5 * math.pi * 3**2, range=1000.0)
camera = renderer.create_camera()
camera.exposure = math.log2(1 / 1.2)  # at which the picture is the luminance
place = np.eye(4, dtype=np.float32)
place[2, 3] = DISTANCE
camera.transform = place
camera.set_perspective(fov_y_deg=math.degrees(2 * math.atan(0.1 / DISTANCE)), aspect=1, near=1, far=1000)
scene.camera = camera
target = renderer.create_render_target(width=SIDE, height=SIDE)
renderer.render(scene, target)
picture = np.asarray(target.read())[..., 0] / 255.0
np.save("picture.npy", picture)
print(f"DEFECT the floor is {picture[4, 4]:.4f}; expected is 0.5")
sys.stdout.flush()
os._exit(0)  # taking the device down may crash
