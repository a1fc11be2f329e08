"""Prims that are drawn to objects: each mesh by its materials, each instance of a point instancer by its place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.opinion import Opinion
from notabug.scenes_usd.reader_geometry import Bools, Part, Shape, place, read_shape, read_sphere
from notabug.scenes_usd.reader_pixel import PixelGrid
from notabug.scenes_usd.reader_prims import visible
from notabug.scenes_usd.reader_shading import GREY, Materials
from notabug.scenes_usd.reader_solids import SOLIDS
from notabug.scenes_usd.reader_texture import Coordinates, Textures
from notabug.scenes_usd.reader_values import (
    SINGULAR,
    TIME,
    blamed,
    fault,
    integers,
    opinion,
    vectors,
    where,
    world_matrix,
)
from notabug.scenes_usd.reading import frame, going_on, note, refuse
from notabug.scenes_usd.scene import Floats, Ints, Mesh, Object

MOST_INSTANCES = 1 << 14  # of a stage: each is an object of its own
MOST_FACES = 1 << 22  # of all instances and refined surfaces
_DEEPEST = 8  # instancers within instancers
_LOOKED_AT = 32  # instances by which a shared shape is refined: the nearest


class Drawing:
    """The objects of a stage, as they are found. Files of textures must be below ``root``, unless it is None."""

    def __init__(self, stage: Usd.Stage, root: Path | None, grid: PixelGrid) -> None:
        self.textures = Textures(root)
        self.materials = Materials(self.textures)
        self.objects: list[Object] = []
        self.owners: list[Sdf.Path] = []  # of each object the prim that it is made of: a mesh, or the outer instancer
        self.failed = False  # whether something that would be drawn is refused
        self._stage = stage
        self._grid = grid
        self._instances = self._faces = 0

    def draws(self, prim: Usd.Prim) -> bool:
        """Whether objects are made of ``prim``."""
        if prim.IsA(UsdGeom.Mesh) or prim.IsA(UsdGeom.Sphere) or prim.IsA(UsdGeom.PointInstancer):
            return True
        return str(prim.GetTypeName()) in SOLIDS

    def add(self, prim: Usd.Prim) -> None:
        """Add the objects of ``prim``."""
        try:
            self._add(prim, [_Place(str(prim.GetPath()), world_matrix(prim))], 0)
        except SceneError:
            self.failed = True
            raise
        finally:
            self.owners += [prim.GetPath()] * (len(self.objects) - len(self.owners))

    def mesh(self, prim: Usd.Prim) -> Mesh | None:
        """The mesh at ``prim``, which is not drawn itself, as one."""
        matrix = world_matrix(prim)
        parts = [self._whole(prim)]
        made = place(self._shape(prim, parts, [matrix]), parts[0], matrix)
        return None if made is None else self._textured(prim, made, parts[0])

    def _add(self, prim: Usd.Prim, places: Sequence[_Place], depth: int) -> None:
        """Add ``prim`` at each of ``places``."""
        if prim.IsA(UsdGeom.PointInstancer):
            self._instanced(prim, places, depth)
            return
        if prim.IsA(UsdGeom.Sphere):
            material = self.materials.bound_to(prim)
            self._check_unmapped(prim, material)
            self.objects += [read_sphere(prim, material, at.matrix, at.path) for at in places]
            return
        if not self.draws(prim):
            return
        parts = self._parts(prim)
        shape = self._shape(prim, parts, [at.matrix for at in places])
        if depth or shape.parent is not None:  # more faces than the file itself holds
            self._faces += len(shape.counts) * len(places)
        if self._faces > MOST_FACES:
            what = "too many faces in all instances and refined surfaces"
            raise fault(prim, "", what, expected=f"at most {MOST_FACES}", do="draw a smaller picture, or less of it")
        for at in places:
            for part in parts:
                made = place(shape, part.moved(str(prim.GetPath()), at.path), at.matrix)
                if made is not None:
                    self.objects.append(self._textured(prim, made, part))

    def _shape(self, prim: Usd.Prim, parts: Sequence[Part], matrices: Sequence[Floats]) -> Shape:
        names = {part.coordinates.name: None for part in parts}
        return read_shape(prim, list(names), self._pixel(matrices))

    def _pixel(self, matrices: Sequence[Floats]) -> Callable[[Floats], Floats]:
        """The local size of a pixel where the nearest of the instances at ``matrices`` is."""
        camera = self._grid.camera
        if len(matrices) > _LOOKED_AT and camera is not None:
            away = [float(np.linalg.norm(matrix[3, :3] - camera.to_world[3, :3])) for matrix in matrices]
            matrices = [matrices[index] for index in np.argsort(away)[:_LOOKED_AT]]
        grids = [self._grid.within(matrix) for matrix in matrices[:_LOOKED_AT]]
        return lambda places: np.min([grid(places) for grid in grids], axis=0)

    def _textured(self, prim: Usd.Prim, made: Mesh, part: Part) -> Mesh:
        textures = self.materials.found[made.material].textures
        if textures and made.uv is None:
            raise fault(
                prim,
                f"primvars:{part.coordinates.name}",
                f"no texture coordinates for {self.textures.found[min(textures)].path.name}",
                expected="texCoord2f[]",
            )
        return made

    def _check_unmapped(self, prim: Usd.Prim, index: int) -> None:
        """Refuse maps of roughness, opacity and the like on a sphere, which has no coordinates to look them up at."""
        material = self.materials.found[index]
        if (material.preview is None and material.opacity_map < 0) or not material.textures:
            return
        refuse(
            fault(
                prim,
                "material:binding",
                f"{material.path} has maps, and a sphere has no texture coordinates",
                expected="a material of constants",
                do="bind one, or make the sphere a mesh with primvars:st",
                mends=(Opinion(material.path, "outputs:surface", "preview", GREY, "a Lambertian in its place"),),
            )
        )

    def _whole(self, prim: Usd.Prim) -> Part:
        material = self.materials.bound_to(prim)
        return Part(str(prim.GetPath()), material, self.materials.coordinates[material])

    def _parts(self, prim: Usd.Prim) -> list[Part]:
        """The parts of a mesh by material: those of its subsets, in their order, and what these leave."""
        subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets() if prim.IsA(UsdGeom.Mesh) else []
        if not subsets:
            return self._coloured(prim) or [self._whole(prim)]
        faces = len(integers(prim, "faceVertexCounts"))
        left: Bools = np.ones(faces, np.bool_)
        parts = []
        for subset in subsets:
            owner = subset.GetPrim()
            if str(subset.GetElementTypeAttr().Get()) != "face":
                continue
            with going_on():
                chosen = _faces_of(owner, faces) & left
                left = left & ~chosen
                material = self.materials.bound_to(owner)
                path = f"{prim.GetPath()}_{owner.GetName()}"
                parts.append(Part(path, material, self.materials.coordinates[material], chosen))
        if left.any():
            material = self.materials.bound_to(prim)
            parts.insert(0, Part(str(prim.GetPath()), material, self.materials.coordinates[material], left))
        return parts

    def _coloured(self, prim: Usd.Prim) -> list[Part]:
        """The parts of a mesh without material whose displayColor says a colour for each face; none elsewhere."""
        faces = self.materials.face_colours(prim) if prim.IsA(UsdGeom.Mesh) else None
        if faces is None:
            return []
        found, which = faces
        opacity = self.materials.display_opacity(prim)
        parts = []
        for number, (r, g, b) in enumerate(found.tolist()):
            material = self.materials.coloured(f"{prim.GetPath()}_{number}", (r, g, b), opacity)
            parts.append(Part(f"{prim.GetPath()}_{number}", material, Coordinates(), which == number))
        return parts

    def _instanced(self, prim: Usd.Prim, places: Sequence[_Place], depth: int) -> None:
        """Add every instance of the point instancer ``prim`` at each of ``places``."""
        if depth == _DEEPEST:
            raise fault(prim, "prototypes", "instancers nested too deep", expected=f"at most {_DEEPEST}")
        with blamed(prim, "prototypes"):
            targets = UsdGeom.PointInstancer(prim).GetPrototypesRel().GetForwardedTargets()
        which, matrices, kept = _instances_of(prim, len(targets))
        self._instances += len(which) * len(places)
        if self._instances > MOST_INSTANCES:
            drop = opinion(prim, "visibility", "token", "invisible")
            raise fault(prim, "protoIndices", "too many instances", expected=f"at most {MOST_INSTANCES}", mends=drop)
        for number, target in enumerate(targets):
            root = self._stage.GetPrimAtPath(target)
            mine = np.flatnonzero(which == number)
            if not root or not len(mine):
                continue
            base = np.linalg.inv(world_matrix(root))
            for part in visible(root):
                if not self.draws(part):
                    if part.HasAPI("LightAPI"):
                        note("not read", where(part), "a light that a point instancer places")
                    continue
                with going_on():
                    inner = world_matrix(part) @ base
                    below = str(part.GetPath())[len(str(root.GetPath())) :].replace("/", "_")
                    at = [
                        _Place(
                            f"{outer.path}_{root.GetName()}_{kept[index]}{below}",
                            inner @ matrices[index] @ outer.matrix,
                        )
                        for outer in places
                        for index in mine
                    ]
                    self._add(part, at, depth + 1)


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """One place of a prim: the ``path`` that its object has, and its matrix to world space."""

    path: str
    matrix: Floats


def _faces_of(subset: Usd.Prim, faces: int) -> Bools:
    """The faces (f,) of a subset."""
    found = integers(subset, "indices")
    outside = np.flatnonzero((found < 0) | (found >= faces))
    if outside.size:
        got = str(found[outside[0]])
        raise fault(subset, "indices", f"element {outside[0]} is out of range", expected=f"0 to {faces - 1}", got=got)
    chosen = np.zeros(faces, np.bool_)
    chosen[found] = True
    return chosen


def _instances_of(prim: Usd.Prim, prototypes: int) -> tuple[Ints, list[Floats], list[int]]:
    """Of each instance that is shown: its prototype's number, its matrix to the instancer, and its own number."""
    code = frame()
    time = TIME if code is None else Usd.TimeCode(code)
    which = integers(prim, "protoIndices")
    positions = vectors(prim, "positions", 3)
    if len(positions) != len(which):
        expected, got = f"{len(which)}, as of protoIndices", str(len(positions))
        raise fault(prim, "positions", "not as many as instances", expected=expected, got=got)
    if len(which) and (which.min() < 0 or which.max() >= prototypes):
        expected, got = f"0 to {prototypes - 1}", f"{which.min()} to {which.max()}"
        raise fault(prim, "protoIndices", "out of range", expected=expected, got=got)
    instancer = UsdGeom.PointInstancer(prim)
    with blamed(prim, "protoIndices"):
        found = instancer.ComputeInstanceTransformsAtTime(
            time, time, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
        mask = list(instancer.ComputeMaskAtTime(time))
    if len(found) != len(which):
        raise fault(prim, "orientations", "the instances have no transforms", do="try usdchecker")
    matrices = [np.array(matrix, np.float64) for matrix in found]
    if not all(np.isfinite(matrix).all() for matrix in matrices):
        raise SceneError("a transform is not finite", where=where(prim, "positions"))
    flat = {index for index, matrix in enumerate(matrices) if _has_no_volume(matrix)}
    if flat:  # exporters hide an instance by the scale 0
        note("not read", where(prim, "scales"), f"{len(flat)} instances without a size")
    shown = [index for index in range(len(which)) if (not mask or mask[index]) and index not in flat]
    return which[shown], [matrices[index] for index in shown], shown


def _has_no_volume(matrix: Floats) -> bool:
    """Whether ``matrix`` brings everything into a plane, a line or a point."""
    lengths = np.linalg.norm(matrix[:3, :3], axis=1)
    return bool(lengths.min() <= 0.0 or abs(np.linalg.det(matrix[:3, :3] / lengths[:, None])) < SINGULAR)
