"""What a child script is told: the shapes of ``job.json``. Child scripts import this for type checkers only."""

from __future__ import annotations

from typing import Any, NotRequired, TypedDict

import numpy.typing as npt

Arrays = dict[str, npt.NDArray[Any]]
"""Arrays by their names in the job, of floats or of whole numbers."""
PlugIn = dict[str, object]
"""One of Mitsuba's plug-ins, as its ``load_dict`` takes it."""


class CameraBeside(TypedDict, total=False):
    """What a camera has that is orthographic, or whose axis is not in the picture's middle."""

    orthographic: bool
    shift_x: float
    shift_y: float


class CameraSaid(CameraBeside):
    to_world: list[list[float]]
    tan_x: float
    tan_y: float
    near: float
    far: float


class BeamSaid(TypedDict):
    """The fields of ``Shaping`` in scenes_usd/scene.py."""

    cone: float
    softness: float
    focus: float
    tint: list[float]


class LightSaid(TypedDict):
    """A light; what only some renderers can draw is left out of a plain point or distant light."""

    kind: str
    place: list[float]  # of a point light its position, of any other its direction
    intensity: list[float]
    position: NotRequired[list[float]]
    direction: NotRequired[list[float]]
    axes: NotRequired[list[list[float]]]  # of its shape: see ``Emitter`` in scenes_usd/scene.py
    half_angle: NotRequired[float]
    side: NotRequired[list[float]]  # of a rectangle or disk the normal of the side that shines
    sky: NotRequired[str]  # the name of an array, a dome's picture
    diffuse: NotRequired[float]
    specular: NotRequired[float]
    unlit: NotRequired[list[str]]
    unshadowing: NotRequired[list[str]]
    beam: NotRequired[BeamSaid]


class Look(TypedDict):
    """What every job says of a material."""

    diffuse: list[float]
    texture: int
    specular: list[float]
    exponent: float
    lobe: str
    cosine_weighted: bool
    mirror: list[float]
    transmission: list[float]
    ior: float
    opacity: float


class Clear(TypedDict):
    """Of a material with a map of opacity: the texture, and what it says at least where the surface is whole, or 0."""

    opacity_map: NotRequired[int]
    least_opacity: NotRequired[float]


class MaterialSaid(Look, Clear):
    preview: NotRequired[dict[str, object]]


class TextureSaid(TypedDict):
    pixels: str  # the name of an array
    wrap: tuple[str, str]


class ShapeSaid(TypedDict):
    """A sphere has ``radius`` and ``to_world``; a mesh has the names of the arrays of its parts."""

    kind: str
    path: str
    material: int
    radius: NotRequired[float]
    to_world: NotRequired[list[list[float]]]
    points: NotRequired[str]
    counts: NotRequired[str]
    corners: NotRequired[str]
    triangles: NotRequired[str]
    normals: NotRequired[str]
    uv: NotRequired[str]


class Job(TypedDict):
    """A scene, and the settings of the renderer that draws it."""

    width: int
    height: int
    camera: CameraSaid
    lights: list[LightSaid]
    materials: list[MaterialSaid]
    textures: list[TextureSaid]
    objects: list[ShapeSaid]
    samples: NotRequired[int]
    seeds: NotRequired[list[int]]
    threads: NotRequired[int]
    grid: NotRequired[int]
    depth: NotRequired[str]
    interpolation: NotRequired[str]
    local_viewer: NotRequired[bool]
    unit: NotRequired[float]
    shadow_map: NotRequired[dict[str, float]]
    bounces: NotRequired[int]
    raised: NotRequired[float]
    terminator_offset: NotRequired[float]
    bump_correction: NotRequired[bool]
    on_a_light: NotRequired[int]


class GlLight(TypedDict):
    distant: bool
    place: list[float]
    power: list[float]


class GlTexture(TypedDict):
    pixels: str
    wrap: list[int]  # of u and v: 0 repeats, 1 is clamped, 2 is mirrored, 3 ends in black


class GlShape(TypedDict):
    vertices: str  # the name of an array (3 t, 8)
    gouraud: bool
    diffuse: list[float]
    texture: int
    specular: list[float]
    exponent: float
    lobe: int
    opacity: float


class GlJob(TypedDict):
    """What the child of the adapter ``opengl`` is told."""

    width: int
    height: int
    grid: int
    depth: str
    eye: list[float]
    view: list[list[float]]
    projection: list[list[float]]
    transparent: bool
    lights: list[GlLight]
    textures: dict[str, GlTexture]
    objects: list[GlShape]


class MitsubaPreview(TypedDict):
    """The fields of ``Preview`` in scenes_usd/scene.py that Mitsuba's child and Cycles' read."""

    specular_workflow: bool
    metallic: float
    roughness: float
    ior: float
    clearcoat: float
    clearcoat_roughness: float
    specular: list[float]
    metallic_map: int
    roughness_map: int
    emission: list[float]
    emission_map: int
    normal_map: int


class MitsubaLook(Look, Clear):
    scripted: bool
    preview: MitsubaPreview | None


class MitsubaTexture(TypedDict):
    pixels: str  # the name of an array
    wrap: str
    filter: NotRequired[str]


class MitsubaCamera(TypedDict):
    lens: PlugIn
    to_world: list[list[float]]
    near: float
    far: float


class MitsubaShape(TypedDict):
    """A sphere has ``centre`` and ``radius``; a mesh the names of its arrays."""

    kind: str
    look: str
    centre: NotRequired[list[float]]
    radius: NotRequired[float]
    points: NotRequired[str]
    normals: NotRequired[str]
    uv: NotRequired[str]


class MitsubaJob(TypedDict):
    """What the child of the adapter ``mitsuba`` is told."""

    width: int
    height: int
    samples: int
    seeds: list[int]
    threads: int
    integrator: str
    max_depth: int
    glows: bool  # a surface emits light
    normal_maps: dict[str, bool]  # settings of ``normalmap``
    looks: dict[str, MitsubaLook]
    camera: MitsubaCamera
    lights: list[PlugIn]
    textures: dict[str, MitsubaTexture]
    objects: list[MitsubaShape]
