"""A white wall, lit and seen straight on from far away: python scene.py [DISTANCE [EPSILON]].

Prints how many pixels are black, and writes picture.npy, (32, 32), red, top row first.
"""

import math
import os
import sys
import time

import numpy as np  # before pyluxcore: the other way round the process crashes
import pyluxcore

SIDE = 32
DISTANCE = float(sys.argv[1]) if len(sys.argv) > 1 else 1e5
EPSILON = {"scene.epsilon.min": float(sys.argv[2])} if len(sys.argv) > 2 else {}


def properties(values: dict) -> pyluxcore.Properties:
    made = pyluxcore.Properties()
    for name, value in values.items():
        made.Set(pyluxcore.Property(name, value if isinstance(value, list) else [value]))
    return made


pyluxcore.Init(str)  # which is done with every line of its log, and nothing else
scene = pyluxcore.Scene()
corners = [(-9.0, -9.0, -1.6), (9.0, -9.0, -1.6), (9.0, 9.0, -1.6), (-9.0, 9.0, -1.6)]
scene.DefineMesh("wall", corners, [(0, 1, 2), (0, 2, 3)], None, None, None, None)
scene.Parse(
    properties(
        EPSILON
        | {
            "scene.camera.type": "perspective",
            "scene.camera.lookat.orig": [0.0, 0.0, DISTANCE],
            "scene.camera.lookat.target": [0.0, 0.0, 0.0],
            "scene.camera.up": [0.0, 1.0, 0.0],
            "scene.camera.fieldofview": 2.0 * math.degrees(math.atan(1.2 / DISTANCE)),  # 2.4 wide
            "scene.camera.autofocus.enable": False,
            "scene.materials.white.type": "matte",
            "scene.materials.white.kd": [1.0, 1.0, 1.0],
            "scene.objects.wall.shape": "wall",
            "scene.objects.wall.material": "white",
            "scene.lights.sun.type": "sharpdistant",
            "scene.lights.sun.direction": [0.0, 0.0, -1.0],
            "scene.lights.sun.color": [1.0, 1.0, 1.0],
            "scene.lights.sun.gain": [math.pi] * 3,
        }
    )
)
settings = properties(
    EPSILON
    | {
        "renderengine.type": "PATHCPU",
        "sampler.type": "RANDOM",
        "path.pathdepth.total": 1,
        "film.width": SIDE,
        "film.height": SIDE,
        "film.filter.type": "NONE",
        "batch.haltspp": 16,
        "film.outputs.0.type": "RGB",
        "film.outputs.0.filename": "rgb.exr",
    }
)
session = pyluxcore.RenderSession(pyluxcore.RenderConfig(settings, scene))
session.Start()
while not session.HasDone():
    session.UpdateStats()
    time.sleep(0.01)
session.Stop()
film = np.zeros(SIDE * SIDE * 3, np.float32)
session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, film, 0)
picture = film.reshape(SIDE, SIDE, 3)[::-1, :, 0]  # the film's first row is the lowest
np.save("picture.npy", picture)
print(f"DEFECT {(picture < 0.5).sum()} of {picture.size} pixels are black, the brightest is {picture.max():.3f}")
sys.stdout.flush()
os._exit(0)  # LuxCore may crash when Python takes it down
