"""A white square, lit and seen straight on, drawn from both ends: python scene.py [ENGINE [point]].

Prints the mean of the pixels in the middle of the square, and writes it as picture.npy, (1, 1).
"""

import math
import os
import sys
import time

import numpy as np  # before pyluxcore: the other way round the process crashes
import pyluxcore

SIDE = 8
ENGINE = sys.argv[1] if len(sys.argv) > 1 else "BIDIRCPU"


def properties(values: dict) -> pyluxcore.Properties:
    made = pyluxcore.Properties()
    for name, value in values.items():
        made.Set(pyluxcore.Property(name, value if isinstance(value, list) else [value]))
    return made


light = {
    "scene.lights.sun.type": "sharpdistant",
    "scene.lights.sun.direction": [0.0, 0.0, -1.0],
    "scene.lights.sun.gain": [math.pi] * 3,
}
if "point" in sys.argv:  # so far away that it is a distant light to one part in 10,000
    light = {
        "scene.lights.sun.type": "point",
        "scene.lights.sun.position": [0.0, 0.0, 50.0],
        "scene.lights.sun.gain": [4.0 * math.pi * math.pi * 50.0**2] * 3,
        "scene.lights.sun.power": 0.0,
        "scene.lights.sun.efficency": 0.0,
    }
pyluxcore.Init(str)  # which is done with every line of its log, and nothing else
scene = pyluxcore.Scene()
corners = [(-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)]
scene.DefineMesh("square", corners, [(0, 1, 2), (0, 2, 3)], None, None, None, None)
scene.Parse(
    properties(
        {
            "scene.camera.type": "perspective",
            "scene.camera.lookat.orig": [0.0, 0.0, 1.0],
            "scene.camera.lookat.target": [0.0, 0.0, 0.0],
            "scene.camera.up": [0.0, 1.0, 0.0],
            "scene.camera.fieldofview": 90.0,  # the picture is 2 wide at the square's distance, which is 1
            "scene.camera.autofocus.enable": False,
            "scene.materials.white.type": "matte",
            "scene.materials.white.kd": [1.0, 1.0, 1.0],
            "scene.objects.square.shape": "square",
            "scene.objects.square.material": "white",
            "scene.lights.sun.color": [1.0, 1.0, 1.0],
        }
        | light
    )
)
settings = properties(
    {
        "renderengine.type": ENGINE,
        "sampler.type": "RANDOM",
        "path.pathdepth.total": 1,
        "path.maxdepth": 1,
        "light.maxdepth": 1,
        "film.width": SIDE,
        "film.height": SIDE,
        "film.filter.type": "NONE",
        "batch.haltspp": 2048,
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
square = film.reshape(SIDE, SIDE, 3)[2:6, 2:6, 0]
mean = square[1:3, 1:3].mean()  # of the four pixels in the middle, whichever row LuxCore begins with
np.save("picture.npy", np.array([[mean]]))
print(f"DEFECT {ENGINE}: the square is {mean:.3f}; expected is 1.0")
sys.stdout.flush()
os._exit(0)  # LuxCore may crash when Python takes it down
