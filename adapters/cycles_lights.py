"""Lights as Cycles' lamps, its world, and meshes that shine, for the process that Cycles runs in.

Lamps are seen by no ray of the camera and block no light. A light whose radiance depends on the direction it shines in
(a beam) or on where it is seen from (``fresnel``: weighted by Schlick's transition, see ``cycles_surfaces.py``) has a
shader of its own: at a lamp ``Incoming`` points to what is lit, and ``Ray Length`` says how far off that is.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    import numpy.typing as npt
    from bpy.types import ID, Collection, Image, Light, Object, World

    from notabug.adapters.cycles_nodes import Graph, Value
    from notabug.adapters.job_types import Arrays, BeamSaid, CameraSaid, Job, LightSaid

_FAR = 1e4  # of a sun that stands as a ball, in sizes of the scene
_ROUND = 64  # flat strips that a cylinder is made of: seen from any side they are within 4e-4 of its width
# Cycles loses light of slivers: see docs/defects/cycles-sliver-lights. Of strips 3,700 times as long as wide a seventh
# was lost, of ones 10,000 times two fifths, of ones 16 times nothing.
_SLENDER = 16  # times its width that a piece of a strip may be long
_PIECES = 1024  # the most pieces of a strip
_MAP_ACROSS = 2048  # texels across what a dome's directions are chosen by


class Lights:
    """Makes the lights of a job, one at a time.

    ``reach`` is a ball, (x, y, z, radius), that holds the scene and its camera; ``image`` makes a picture Blender's.
    """

    def __init__(
        self,
        bpy: ModuleType,
        nodes: ModuleType,
        job: Job,
        arrays: Arrays,
        reach: tuple[float, float, float, float],
        image: Callable[[npt.NDArray[np.float32]], Image],
    ) -> None:
        self.bpy, self.nodes, self.job, self.arrays, self.image = bpy, nodes, job, arrays, image
        self.reach = np.array(reach)
        self.scene = bpy.context.scene

    def lit(self, index: int, *, fresnel: bool, bodies: dict[str, list[Object]]) -> list[ID]:
        """Put up the light ``index`` alone, weighted by Schlick's transition if ``fresnel``; what ``put_out`` takes."""
        said = self.job["lights"][index]
        if said["kind"] == "dome" and not fresnel:
            return [self._world(said)]
        body = self._body(said, fresnel=fresnel)
        self.scene.collection.objects.link(body)
        body.visible_camera = False
        for what, names in (("receiver", said.get("unlit")), ("blocker", said.get("unshadowing"))):
            if names:
                setattr(body.light_linking, f"{what}_collection", self._others(names, bodies))
        return [body]

    def put_out(self, lit: list[ID]) -> None:
        for thing in lit:
            if isinstance(thing, self.bpy.types.World):
                self.scene.world = None
                self.bpy.data.worlds.remove(thing)
            else:
                self.bpy.data.objects.remove(thing)

    def _others(self, names: list[str], bodies: dict[str, list[Object]]) -> Collection:
        """A collection that says: all but the objects of these paths."""
        collection = self.bpy.data.collections.new("all but these")
        for body in (body for name in names for body in bodies.get(name, [])):
            collection.objects.link(body)
        for member in collection.collection_objects:
            member.light_linking.link_state = "EXCLUDE"
        return collection

    def _body(self, said: LightSaid, *, fresnel: bool) -> Object:
        if said["kind"] in ("cylinder", "dome"):
            return self._mesh(said, fresnel=fresnel)
        from mathutils import Matrix

        colour, most = _colour(said)
        place = np.eye(4)
        kind = {"point": "POINT", "sphere": "POINT", "rect": "AREA", "disk": "AREA"}.get(said["kind"], "SUN")
        far = fresnel and said["kind"] == "sun"
        lamp = self.bpy.data.lights.new("light", "POINT" if far else kind)
        lamp.color = colour
        lamp.cycles.use_multiple_importance_sampling = said["kind"] not in ("point", "distant")
        if far:
            self._far_ball(lamp, said, most, place)
        elif kind == "POINT":
            self._ball(lamp, said, most, place)
        elif kind == "AREA":
            self._area(lamp, said, most, place)
        else:
            lamp.angle = 2.0 * said.get("half_angle", 0.0)
            # Cycles divides a sun's energy by pi times the square of the tangent of half its angle
            flat = math.pi * math.sin(said.get("half_angle", 0.0)) ** 2
            lamp.energy = most * (flat if said["kind"] == "sun" else 1.0)
            place[:3, :3] = _frame(-np.array(said["place"]))
        if fresnel or "beam" in said:
            graph = self.nodes.Graph(lamp)
            emission = graph.node("Emission")
            graph.put(self._weight(graph, said, fresnel=fresnel), emission.inputs["Color"])
            graph.put(emission.outputs[0], graph.node("OutputLight").inputs[0])
        body = self.bpy.data.objects.new("light", lamp)
        body.matrix_world = Matrix(place.tolist())
        return body

    def _ball(self, lamp: Light, said: LightSaid, most: float, place: npt.NDArray[np.float64]) -> None:
        """A lamp sends its energy over 4 pi, and one with a radius is a ball of that radius."""
        radius = float(np.linalg.norm(said["axes"][0])) if said["kind"] == "sphere" else 0.0
        lamp.use_soft_falloff = False
        lamp.shadow_soft_size = radius
        lamp.energy = most * 4.0 * math.pi * (math.pi * radius**2 if radius else 1.0)
        place[:3, 3] = said["position"] if said["kind"] == "sphere" else said["place"]

    def _far_ball(self, lamp: Light, said: LightSaid, most: float, place: npt.NDArray[np.float64]) -> None:
        distance = _FAR * self.reach[3]
        radius = distance * math.sin(said["half_angle"])
        lamp.use_soft_falloff = False
        lamp.shadow_soft_size = radius
        lamp.energy = most * 4.0 * math.pi**2 * radius**2
        place[:3, 3] = self.reach[:3] - distance * np.array(said["place"])

    def _area(self, lamp: Light, said: LightSaid, most: float, place: npt.NDArray[np.float64]) -> None:
        """An area lamp shines to its own -z; its energy is the flux of a Lambertian emitter."""
        x, y, _ = np.array(said["axes"])
        lamp.shape = "RECTANGLE" if said["kind"] == "rect" else "ELLIPSE"
        lamp.size, lamp.size_y = 2.0 * float(np.linalg.norm(x)), 2.0 * float(np.linalg.norm(y))
        lamp.spread = math.pi
        lamp.energy = most * math.pi * lamp.size * lamp.size_y * (1.0 if said["kind"] == "rect" else math.pi / 4.0)
        along, away = x / np.linalg.norm(x), -np.array(said["side"])
        place[:3, 0], place[:3, 1], place[:3, 2], place[:3, 3] = along, np.cross(away, along), away, said["position"]

    def _mesh(self, said: LightSaid, *, fresnel: bool) -> Object:
        """A cylinder, or a dome as the inside of a ball round the scene, as a mesh that shines from its front."""
        mesh = self.bpy.data.meshes.new("light")
        if said["kind"] == "cylinder":
            points, faces = _cylinder(np.array(said["axes"]), np.array(said["position"]))
        else:
            points, faces = _ball_inside(self.reach[:3], 2.0 * self.reach[3])
        mesh.from_pydata(points.tolist(), [], faces.tolist())
        look = self.bpy.data.materials.new("light")
        graph = self.nodes.Graph(look)
        look.cycles.emission_sampling = "FRONT"
        front = graph.number("SUBTRACT", self.nodes.ONE, graph.of_node("NewGeometry", "Backfacing"))
        emission = graph.node("Emission")
        weight = graph.times(front, self._weight(graph, said, fresnel=fresnel))
        graph.put(graph.times(self._radiance(graph, said), weight), emission.inputs["Color"])
        graph.put(emission.outputs[0], graph.node("OutputMaterial").inputs["Surface"])
        mesh.materials.append(look)
        mesh.update()
        body = self.bpy.data.objects.new("light", mesh)
        body.visible_shadow = False
        return body

    def _radiance(self, graph: Graph, said: LightSaid) -> Value:
        r, g, b = said["intensity"]
        if "sky" not in said:
            return r, g, b
        return graph.times((r, g, b), self._sky(graph, said))

    def _world(self, said: LightSaid) -> World:
        """A dome as Cycles' own world."""
        world = self.bpy.data.worlds.new("dome")
        graph = self.nodes.Graph(world)
        background = graph.node("Background")
        if "sky" in said:
            world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", _MAP_ACROSS
        graph.put(self._radiance(graph, said), background.inputs["Color"])
        graph.put(background.outputs[0], graph.node("OutputWorld").inputs["Surface"])
        world.cycles_visibility.camera = False
        self.scene.world = world
        return world

    def _sky(self, graph: Graph, said: LightSaid) -> Value:
        """The map's colour where it is looked at: its upper row at +y, its middle at +z, a quarter from the left +x."""
        direction = graph.times(_shone(graph), (-1.0, -1.0, -1.0))
        x, y, z = (graph.vector("DOT_PRODUCT", direction, tuple(axis)) for axis in said["axes"])
        turn = graph.number("ARCTAN2", x, z)
        u = graph.number("MULTIPLY_ADD", turn, (-0.5 / math.pi,) * 3, (0.5,) * 3)
        height = graph.number("ARCSINE", graph.number("MINIMUM", graph.number("MAXIMUM", y, (-1.0,) * 3), (1.0,) * 3))
        pixels = self.arrays[said["sky"]]
        rows = len(pixels)
        # its first and last row once more, so that what lies beyond the poles is not the other pole's
        padded = np.concatenate([pixels[:1], pixels, pixels[-1:]])
        scale = rows / (rows + 2.0)
        v = graph.number("MULTIPLY_ADD", height, (scale / math.pi,) * 3, (0.5,) * 3)
        node, place = graph.node("TexImage"), graph.node("CombineXYZ")
        graph.put(u, place.inputs[0])
        graph.put(v, place.inputs[1])
        graph.put(place.outputs[0], node.inputs[0])
        node.image = self.image(padded)
        node.interpolation, node.extension = "Linear", "REPEAT"
        colour: Value = node.outputs[0]
        return colour

    def _weight(self, graph: Graph, said: LightSaid, *, fresnel: bool) -> Value:
        found: Value = self.nodes.ONE
        shone = _shone(graph)
        if "beam" in said:
            found = _beam(graph, said["beam"], shone, said["direction"])
        if fresnel:
            L = graph.times(shone, (-1.0, -1.0, -1.0))
            found = graph.times(found, graph.schlick(self._view(graph, shone), L))
        return found

    def _view(self, graph: Graph, shone: Value) -> Value:
        """The unit vector to the camera from what a light shines on along ``shone``."""
        camera: CameraSaid = self.job["camera"]
        x, y, z = camera["to_world"][2][:3]
        if camera.get("orthographic"):
            return x, y, z
        position = graph.of_node("NewGeometry", "Position")
        there = graph.add(position, graph.times(shone, graph.of_node("LightPath", "Ray Length")))
        x, y, z = camera["to_world"][3][:3]
        return graph.unit(graph.less((x, y, z), there))


def _shone(graph: Graph) -> Value:
    """The direction that a light shines in, at the light."""
    return graph.of_node("NewGeometry", "Incoming")


def _beam(graph: Graph, beam: BeamSaid, shone: Value, axis: list[float]) -> Value:
    """What a beam leaves of a light along ``shone``: see ``Shaping`` in scenes_usd/scene.py."""
    cosine = graph.vector("DOT_PRODUCT", shone, (axis[0], axis[1], axis[2]))
    angle = graph.number("ARCCOSINE", graph.number("MINIMUM", graph.number("MAXIMUM", cosine, (-1.0,) * 3), (1.0,) * 3))
    cone = math.radians(beam["cone"])
    inner = (1.0 - beam["softness"]) * cone
    if inner < cone:
        ramp = graph.node("MapRange")
        ramp.interpolation_type = "SMOOTHSTEP"
        graph.put(angle, ramp.inputs["Value"])
        for name, limit in (("From Min", inner), ("From Max", cone), ("To Min", 1.0), ("To Max", 0.0)):
            ramp.inputs[name].default_value = limit
        inside: Value = ramp.outputs[0]
    else:
        inside = graph.number("LESS_THAN", angle, (cone,) * 3)
    if not beam["focus"]:
        return inside
    share = graph.number("POWER", graph.number("ABSOLUTE", cosine), (beam["focus"],) * 3)
    r, g, b = beam["tint"]
    return graph.times(inside, graph.mixed((r, g, b), (1.0, 1.0, 1.0), share))


def _colour(said: LightSaid) -> tuple[list[float], float]:
    """The light's colour, whose greatest channel is 1, and that channel's intensity."""
    most = max(said["intensity"])
    return ([channel / most for channel in said["intensity"]] if most > 0.0 else [0.0] * 3), most


def _frame(z: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """A rotation (3, 3), column vectors, whose third axis is ``z``."""
    x = np.cross((0.0, 1.0, 0.0) if abs(z[1]) < 0.9 else (1.0, 0.0, 0.0), z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _cylinder(
    axes: npt.NDArray[np.float64], centre: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """The side of the unit cylinder along x under ``axes``: points, and quadrilaterals that face outward."""
    turn = np.arange(_ROUND) * (2.0 * math.pi / _ROUND)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1) * (math.pi / _ROUND / math.sin(math.pi / _ROUND))
    length = 2.0 * np.linalg.norm(axes[0])
    width = 2.0 * math.pi / _ROUND * min(np.linalg.norm(axes[1]), np.linalg.norm(axes[2]))
    pieces = min(_PIECES, math.ceil(length / (_SLENDER * width)))
    places = np.linspace(-1.0, 1.0, pieces + 1)
    rings = [np.column_stack([np.full(_ROUND, x), ring]) for x in places]
    one, after = np.arange(_ROUND), (np.arange(_ROUND) + 1) % _ROUND
    strip = np.stack([one, after, after + _ROUND, one + _ROUND], axis=1)
    faces = (np.arange(pieces)[:, None, None] * _ROUND + strip).reshape(-1, 4)
    if np.linalg.det(axes) < 0.0:
        faces = faces[:, ::-1]
    return np.concatenate(rings) @ axes + centre, faces


def _ball_inside(
    centre: npt.NDArray[np.float64], radius: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """An octahedron that holds the ball, facing inward: which directions it covers, not its shape, is what counts."""
    points = centre + radius * math.sqrt(3.0) * np.concatenate([np.eye(3), -np.eye(3)])
    faces = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    outward = [np.linalg.det(points[list(face)] - centre) > 0.0 for face in faces]
    return points, np.array([face[::-1] if out else face for face, out in zip(faces, outward, strict=True)])
