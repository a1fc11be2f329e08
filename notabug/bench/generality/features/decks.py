"""Which features of an export a random scene has, dealt from decks of twenty cards as in the bench's other scenes."""

from __future__ import annotations

from dataclasses import dataclass, fields

from notabug.bench.generality.decks import dealt

DECKS: dict[str, dict[str, int]] = {
    "geometry": {
        "mesh": 5,
        "catmullClark": 4,
        "creased": 2,
        "loop": 1,
        "bilinear": 1,
        "subsets": 2,
        "instancer": 1,
        "instances": 1,
        "solid": 3,
    },
    "surface": {"dielectric": 5, "metal": 3, "part_metal": 2, "specular": 3, "clearcoat": 3, "emission": 2, "plain": 2},
    "maps": {"none": 5, "diffuse": 4, "roughness": 3, "packed": 4, "emission": 2, "all": 2},
    "normal_map": {"none": 13, "plain": 4, "weak": 3},
    "transform2d": {"no": 14, "yes": 6},
    "wrap": {"repeat": 8, "clamp": 4, "mirror": 4, "black": 4},
    "network": {"direct": 12, "node_graph": 4, "interface": 4},
    "light": {"sphere": 4, "rect": 4, "disk": 2, "cylinder": 2, "sun": 3, "dome": 2, "sky": 2, "point": 1},
    "second_light": {"none": 10, "point": 3, "distant": 3, "rect": 2, "dome": 2},
    "strength": {"intensity": 8, "exposure": 6, "temperature": 3, "colour": 3},
    "normalised": {"no": 10, "yes": 10},
    "light_scale": {"no": 14, "even": 3, "uneven": 3},
    "projection": {"perspective": 14, "orthographic": 3, "offset": 3},
    "binding": {"material": 18, "displayColor": 2},
    "coordinates": {"st": 8, "UVMap": 8, "map1": 4},
    "transform": {"rigid": 8, "uneven": 6, "mirror": 6},
    "floor": {"plain": 8, "glossy": 6, "textured": 3, "none": 3},
    "objects": {"1": 10, "2": 8, "3": 2},
    "stage": {"metres": 10, "centimetres": 6, "z_up": 4},
    "settings": {"none": 14, "authored": 6},
    "opacity": {"none": 15, "cutout": 4, "channel": 1},
}


@dataclass(frozen=True, slots=True)
class Features:
    """What a scene holds: a card of each deck."""

    geometry: str
    surface: str
    maps: str
    normal_map: str
    transform2d: str
    wrap: str
    network: str
    light: str
    second_light: str
    strength: str
    normalised: str
    light_scale: str
    projection: str
    binding: str
    coordinates: str
    transform: str
    floor: str
    objects: str
    stage: str
    settings: str
    opacity: str

    def words(self) -> str:
        """The features in one line, for tables."""
        return " ".join(f"{each.name}={getattr(self, each.name)}" for each in fields(self))


def features(seed: int, index: int) -> Features:
    """The features of scene ``index`` of ``seed``."""
    return Features(**dealt(DECKS, seed, index))
