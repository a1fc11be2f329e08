"""A ray tracer that is started once and then draws picture after picture: see docs/your-renderer.md, "A server".

As tiny.c, which is called for each picture, it draws meshes under point and distant lights, with shadows.
"""

import json
import os
import sys
from pathlib import Path

answers = os.fdopen(os.dup(1), "w", buffering=1)  # nothing but answers goes to standard output:
os.dup2(2, 1)  # what libraries print there goes to the log

import numpy as np  # noqa: E402 - stands for what takes long to start


def nearest(o, d, c, e1, e2):  # Moller and Trumbore 1997: distance, triangle and weights of the nearest hit of each ray
    across, moment = np.cross(e1, e2), np.cross(o, d)
    with np.errstate(all="ignore"):
        inverse = -1 / (d @ across.T)
        u = (moment @ e2.T - d @ np.cross(e2, c).T) * inverse
        v = (-moment @ e1.T - d @ np.cross(c, e1).T) * inverse
        t = (o @ across.T - (c * across).sum(axis=1)) * inverse
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6), t, np.inf)
    k, row = t.argmin(axis=1), np.arange(len(t))
    return t[row, k], k, u[row, k], v[row, k]


def draw(scene_path, image_path):
    scene = json.loads(Path(scene_path).read_text("utf-8"))
    corners, normals, colours = [], [], []
    for mesh in scene["objects"]:
        index, points = np.array(mesh["triangles"]), np.array(mesh["points"])
        three = points[np.array(mesh["corners"])[index]]
        flat = np.repeat(np.cross(three[:, 1] - three[:, 0], three[:, 2] - three[:, 0])[:, None], 3, axis=1)
        corners.append(three)
        normals.append(np.array(mesh["normals"])[index] if mesh.get("normals") else flat)
        colours.append(np.tile(scene["materials"][mesh["material"]]["diffuse"], (len(index), 1)))
    corner, normal, colour = (np.concatenate(part) for part in (corners, normals, colours))
    triangles = corner[:, 0], corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    camera, width, height = scene["camera"], scene["width"], scene["height"]
    right, up, back = (np.array(camera[axis]) for axis in ("right", "up", "back"))
    a = (2 * (np.arange(width) + 0.5) / width - 1) * camera["tan_x"]
    picture = np.zeros((height, width, 3), "<f4")
    for y in range(height):
        b = (1 - 2 * (y + 0.5) / height) * camera["tan_y"]
        rays, eye = a[:, None] * right + b * up - back, np.tile(camera["position"], (width, 1))
        t, k, u, v = nearest(eye, rays, *triangles)
        seen = np.isfinite(t)
        t, k, u, v, rays, eye = t[seen], k[seen], u[seen], v[seen], rays[seen], eye[seen]
        place = eye + t[:, None] * rays
        weights = np.stack([1 - u - v, u, v], axis=1)
        n = np.einsum("rc,rci->ri", weights, normal[k])
        n *= np.where(np.einsum("ri,ri->r", n, rays) > 0, -1, 1)[:, None] / np.linalg.norm(n, axis=1)[:, None]
        light_sum = np.zeros_like(place)
        for light in scene["lights"]:
            if light["kind"] == "point":
                to_light = np.array(light["position"]) - place
                far = np.linalg.norm(to_light, axis=1)
                power = np.array(light["intensity"]) / far[:, None] ** 2
            else:
                to_light = np.tile(-np.array(light["direction"]), (len(place), 1))
                far, power = np.full(len(place), np.inf), np.array([light["irradiance"]])
            to_light /= np.linalg.norm(to_light, axis=1)[:, None]
            cosine = np.einsum("ri,ri->r", n, to_light)
            cosine[nearest(place, to_light, *triangles)[0] < far] = 0
            light_sum += np.maximum(cosine, 0)[:, None] * power
        picture[y, seen] = colour[k] * light_sum / np.pi
    Path(image_path).write_bytes(f"PF\n{width} {height}\n-1.0\n".encode() + picture[::-1].tobytes())


print(json.dumps({"notabug_server": 1}), file=answers)
for line in sys.stdin:
    job = json.loads(line)
    try:
        draw(job["scene"], job["image"])
        answer = {"job": job["job"], "ok": True}
    except Exception as error:
        answer = {"job": job["job"], "error": f"{type(error).__name__}: {error}"}
    print(json.dumps(answer), file=answers)
