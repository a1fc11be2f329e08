"""A white square under one lamp, seen straight on: python scene.py [LOOKS [path]].

Prints the value of the pixel in the middle, and writes the picture as picture.npy, (h, w).
"""

import math
import sys

import mitsuba
import numpy as np

LOOKS = int(sys.argv[1]) if len(sys.argv) > 1 else 4
mitsuba.set_variant("scalar_rgb")
integrator = {"type": "direct", "emitter_samples": LOOKS, "bsdf_samples": 0}
if "path" in sys.argv:
    integrator = {"type": "path", "max_depth": 2}
scene = mitsuba.load_dict(
    {
        "type": "scene",
        "integrator": integrator,
        "sensor": {
            "type": "perspective",
            "fov": 90.0,
            "to_world": mitsuba.ScalarTransform4f().look_at([0, 0, 1], [0, 0, 0], [0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": 5,
                "height": 5,
                "pixel_format": "luminance",
                "rfilter": {"type": "box"},
            },
        },
        "square": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}},
        "lamp": {"type": "directional", "direction": [0, 0, -1], "irradiance": {"type": "rgb", "value": math.pi}},
    }
)
picture = np.array(mitsuba.render(scene, spp=16)).reshape(5, 5)
np.save("picture.npy", picture)
print(f"{integrator}: the square is {picture[2, 2]:.3f}; expected is 1.0")
