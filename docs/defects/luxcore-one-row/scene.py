"""A white square in the middle of the picture, lit and seen straight on: python scene.py [orthographic].

Prints which rows and columns are white, and writes picture.npy, (8, 8), red, top row first.
"""

import math
import os
import sys
import time

import numpy as np  # before pyluxcore: the other way round the process crashes
import pyluxcore

SIDE = 8


def properties(values: dict) -> pyluxcore.Properties:
    made = pyluxcore.Properties()
    for name, value in values.items():
        made.Set(pyluxcore.Property(name, value if isinstance(value, list) else [value]))
    return made


pyluxcore.Init(str)  # which is done with every line of its log, and nothing else
scene = pyluxcore.Scene()
corners = [(-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)]
scene.DefineMesh("square", corners, [(0, 1, 2), (0, 2, 3)], None, None, None, None)
scene.Parse(
    properties(
        {
            "scene.camera.type": "orthographic" if "orthographic" in sys.argv else "perspective",
            "scene.camera.lookat.orig": [0.0, 0.0, 1.0],
            "scene.camera.lookat.target": [0.0, 0.0, 0.0],
            "scene.camera.up": [0.0, 1.0, 0.0],
            "scene.camera.fieldofview": 90.0,  # the picture is 2 wide at the square's distance, which is 1
            "scene.camera.autofocus.enable": False,
            "scene.materials.white.type": "matte",
            "scene.materials.white.kd": [1.0, 1.0, 1.0],
            "scene.objects.square.shape": "square",
            "scene.objects.square.material": "white",
            "scene.lights.sun.type": "sharpdistant",
            "scene.lights.sun.direction": [0.0, 0.0, -1.0],
            "scene.lights.sun.color": [1.0, 1.0, 1.0],
            "scene.lights.sun.gain": [math.pi] * 3,
        }
    )
)
settings = properties(
    {
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
rows, columns = (np.flatnonzero(picture.max(axis=axis) > 0.5).tolist() for axis in (1, 0))
print(f"DEFECT white are the rows {rows} and the columns {columns}; expected are [2, 3, 4, 5] for both")
sys.stdout.flush()
os._exit(0)  # LuxCore may crash when Python takes it down
