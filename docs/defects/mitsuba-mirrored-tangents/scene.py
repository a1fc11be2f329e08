"""A white square with a normal map under one lamp, seen straight on: python scene.py [plain].

Its texture coordinates are mirrored along s, or with `plain` are not. Prints the value of the pixel in the middle, and
writes the picture as picture.npy, (h, w).
"""

import math
import sys

import mitsuba
import numpy as np

mitsuba.set_variant("scalar_rgb")
mirrored = "plain" not in sys.argv
says = (0.0, 0.6, 0.8)  # the map, everywhere: towards growing t
normals = {"type": "rgb", "value": [(x + 1.0) / 2.0 for x in says]}
properties = mitsuba.Properties()
properties["bsdf"] = mitsuba.load_dict(
    {
        "type": "normalmap",
        "normalmap": normals,
        "use_shadowing_function": False,
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}},
    }
)
square = mitsuba.Mesh("square", 4, 2, has_vertex_texcoords=True, props=properties)
parameters = mitsuba.traverse(square)
parameters["vertex_positions"] = [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]
parameters["faces"] = [0, 1, 2, 0, 2, 3]
parameters["vertex_texcoords"] = [1, 0, 0, 0, 0, 1, 1, 1] if mirrored else [0, 0, 1, 0, 1, 1, 0, 1]
parameters.update()
towards = [0.0, -math.sqrt(0.5), -math.sqrt(0.5)]
scene = mitsuba.load_dict(
    {
        "type": "scene",
        "integrator": {"type": "direct"},
        "sensor": {
            "type": "perspective",
            "fov": 60.0,
            "to_world": mitsuba.ScalarTransform4f().look_at([0, 0, 1], [0, 0, 0], [0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": 5,
                "height": 5,
                "pixel_format": "luminance",
                "rfilter": {"type": "box"},
            },
        },
        "square": square,
        "lamp": {"type": "directional", "direction": towards, "irradiance": {"type": "rgb", "value": math.pi}},
    }
)
picture = np.array(mitsuba.render(scene, spp=16)).reshape(5, 5)
np.save("picture.npy", picture)
print(f"coordinates {'mirrored' if mirrored else 'plain'}: the square is {picture[2, 2]:.4f}; expected is .9899")
