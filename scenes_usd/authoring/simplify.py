"""``python -m notabug.scenes_usd.authoring.simplify``: decimate texture/simplified's relief with pymeshlab.

pymeshlab is GPL and optional, so it runs in a process of its own that shares nothing with notabug but numbers on its
standard input and output, and only here: its result is checked in, and the scene is written from that.
"""

from __future__ import annotations

import json
import subprocess
import sys

from notabug.scenes_usd.authoring.texture_simplified import FACES, MESHES, coordinates, relief
from notabug.scenes_usd.authoring.usda import number

PROGRAM = """
import json, sys
import numpy, pymeshlab
task = json.load(sys.stdin)
points = numpy.array(task["points"], float)
faces = numpy.array(task["faces"], numpy.int32)
uv = numpy.array(task["uv"], float)
meshes = pymeshlab.MeshSet(verbose=False)
same = dict(targetfacenum=task["target"], preserveboundary=True)
same["optimalplacement"] = False  # points stay where their uv are right; only what lies between them can go wrong
same["preservenormal"] = True  # a facet that is folded over would shadow those beneath it
if task["with_uv"]:
    meshes.add_mesh(pymeshlab.Mesh(points, faces, v_tex_coords_matrix=uv))
    meshes.compute_texcoord_transfer_vertex_to_wedge()
    meshes.meshing_decimation_quadric_edge_collapse_with_texture(extratcoordw=1.0, **same)
    found = meshes.current_mesh()
    corners, wedges = found.face_matrix().ravel(), found.wedge_tex_coord_matrix()
    uv = numpy.zeros((found.vertex_number(), 2))
    uv[corners] = wedges
    assert numpy.allclose(uv[corners], wedges, atol=1e-6), "a seam in uv that had none"
else:
    meshes.add_mesh(pymeshlab.Mesh(points, faces, v_tex_coords_matrix=uv))
    meshes.meshing_decimation_quadric_edge_collapse(**same)
    found = meshes.current_mesh()
    uv = found.vertex_tex_coord_matrix()
json.dump([found.vertex_matrix().tolist(), found.face_matrix().tolist(), uv.tolist()], sys.stdout)
"""
TITLE = "# texture/simplified {name}: {faces} of {all} triangles, by python -m notabug.scenes_usd.authoring.simplify\n"


def simplified(*, with_uv: bool) -> str:
    """The relief with FACES triangles as .obj text. Raises RuntimeError with what the process said where it fails."""
    points, faces = relief()
    uv = [coordinates(x, z) for x, _, z in points]
    task = {"points": points, "faces": faces, "uv": uv, "target": FACES, "with_uv": with_uv}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], input=json.dumps(task), capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "no message")
    corners, triangles, wedges = json.loads(done.stdout[done.stdout.index("[[") :])
    name = "with_uv" if with_uv else "without_uv"
    lines = [f"v {' '.join(number(x) for x in point)}" for point in corners]
    lines += [f"vt {' '.join(number(x) for x in wedge)}" for wedge in wedges]
    lines += ["f " + " ".join(f"{i + 1}/{i + 1}" for i in triangle) for triangle in triangles]
    return TITLE.format(name=name, faces=len(triangles), all=len(faces)) + "\n".join(lines) + "\n"


def main() -> int:
    """0: both meshes written; 1: pymeshlab could not be used, the ones that are checked in stay."""
    for name in ("with_uv", "without_uv"):
        path = MESHES / f"simplified_{name}.obj"
        try:
            text = simplified(with_uv=name == "with_uv")
        except RuntimeError as error:
            sys.stderr.write(f"{path.name}: kept as it is; {error}; pip install 'notabug[mesh]' for pymeshlab\n")
            return 1
        path.parent.mkdir(parents=True, exist_ok=True)
        changed = not path.is_file() or path.read_text(encoding="ascii") != text
        path.write_text(text, encoding="ascii")
        sys.stdout.write(f"{path.name}: {'written' if changed else 'identical'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
