"""Which pictures are drawn: scenes, faults, strengths, conditions and seeds, and the side of the split each is on.

The split is by scene and seed and fixed by hash: of each scene's seeds (each sees and lights it a little differently)
half are for tuning and half for evaluation, so every class is on both sides and no picture is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Literal

from notabug.bench.verdict.catalogue import FAULTS, LIMITATIONS, Fault, Limitation, models_of, staged
from notabug.bench.verdict.image_formation import BY_NAME, CONDITIONS
from notabug.scenes_usd.catalogue import scenes
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

Place = tuple[str, tuple[tuple[str, str], ...]]  # a scene and its variants
Side = Literal["tuning", "evaluation"]
Label = Literal["clean", "limitation", "bug"]

SEEDS = tuple(range(1, 9))  # jitters of a scene: see stage.jittered
EXTRA = (  # variants beside the default ones, where other limitations show
    ("terminator/sphere", {"tessellation": "8x4"}),
    ("texture/uneven_quad", {"split": "split02"}),
    ("texture/uneven_quad", {"split": "grid4"}),
    ("acne/sphere", {"camera_distance": "1e3"}),
    ("acne/mirror", {"camera_distance": "1e3"}),
    ("acne/sphere", {"camera_distance": "1e5"}),
    ("acne/sphere", {"camera_distance": "1e6"}),
    ("phong/lobes", {"lobe": "blinn"}),
    ("phong/floor_lobes", {"lobe": "blinn"}),
    ("visibility/near_clip", {"near": ".001"}),
)
NAMED = ("box", "16 samples")  # a bug is named under one of these: naming costs ten times the verdict
MIXED = ("acne", "coincident_surfaces")  # each sample takes one of several values: judged by single samples
MUST = (("light_gain", 1.01), ("exponent", 1.1), ("pixel_shift", 0.25), ("wrong_pixels", 50.0))


@dataclass(frozen=True, slots=True)
class Size:
    """How much of the design is drawn."""

    name: str
    side: int  # pixels
    scenes: int  # for each fault and strength, on each side
    conditions: int  # of a picture with a fault or a limitation
    every_strength: bool  # of a fault, or the middle one
    clean_conditions: int
    clean_seeds: int
    clean_repeats: int  # noise seeds of a noisy condition; one less for every other seed of a scene
    sides: tuple[Side, ...]


# The other side is ``groups(replace(FULL, sides=("tuning",)))``: nothing may be chosen by what this one says.
FULL = Size("full", 128, 2, 4, True, len(CONDITIONS), 4, 3, ("evaluation",))
QUICK = Size("quick", 64, 1, 2, False, 6, 1, 1, ("evaluation",))


@dataclass(frozen=True, slots=True)
class Group:
    """Pictures of one labelled drawing of one scene: they share their subsamples."""

    label: Label
    name: str
    kind: str  # class of the fault or limitation
    strength: float
    scene: str
    variants: tuple[tuple[str, str], ...]
    seed: int
    side: Side
    conditions: tuple[str, ...]
    pixels: int
    repeats: int = 1

    def key(self) -> str:
        return hashlib.blake2b(repr(asdict(self)).encode(), digest_size=12).hexdigest()

    def draw(self, what: str = "") -> int:
        """A number fixed by the group, for choices."""
        return number(self.label, self.name, self.strength, self.scene, self.variants, self.seed, what)

    def as_dict(self) -> dict[str, object]:
        return {**asdict(self), "variants": dict(self.variants)}

    def setting(self) -> tuple[str, tuple[tuple[str, str], ...], int]:
        """The scene as it is seen and lit: groups that share it share what has to be drawn and predicted for it."""
        return self.scene, self.variants, self.seed


def number(*parts: object) -> int:
    """A number fixed by ``parts``."""
    return int.from_bytes(hashlib.blake2b(repr(parts).encode(), digest_size=6).digest(), "big")


def seeds_of(scene: str, side: Side) -> tuple[int, ...]:
    """The seeds of a scene that are on ``side``: four of eight, by hash."""
    order = sorted(SEEDS, key=lambda seed: number("split", scene, seed))
    half = len(order) // 2
    return tuple(order[:half] if side == "tuning" else order[half:])


def corpus() -> list[Place]:
    """Every scene of the design: (id, variants)."""
    return [(scene.id, ()) for scene in scenes()] + [(name, tuple(sorted(of.items()))) for name, of in EXTRA]


def groups(size: Size) -> list[Group]:
    """The whole design, setting by setting, in an order that makes any beginning of it a fair sample."""
    drawn = {place: read_scene(place[0], dict(place[1])) for place in corpus()}
    found = [*_clean(size, drawn), *_limited(size, drawn), *_faulty(size, drawn)]
    return sorted(found, key=lambda each: (number("order", each.setting()), number("order", each.key())))


def _clean(size: Size, drawn: Mapping[Place, Scene]) -> Iterator[Group]:
    for scene, variants in drawn:
        for side in size.sides:
            for place, seed in enumerate(seeds_of(scene, side)[: max(1, size.clean_seeds // len(size.sides))]):
                names = _chosen(size.clean_conditions, scene, variants, seed)
                repeats = max(1, size.clean_repeats - place % 2)
                yield Group("clean", "", "clean", 0.0, scene, variants, seed, side, names, size.side, repeats)


def _chosen(count: int, *parts: object) -> tuple[str, ...]:
    """The ``count`` conditions of a group: those of ``NAMED`` always, and others by hash."""
    others = [condition.name for condition in CONDITIONS if condition.name not in NAMED]
    others.sort(key=lambda name: number("condition", *parts, name))
    return (*NAMED, *others[: count - len(NAMED)])


def _limited(size: Size, drawn: Mapping[Place, Scene]) -> Iterator[Group]:
    for each in LIMITATIONS:
        fit = [place for place, scene in drawn.items() if limits(each, scene)]
        fit.sort(key=lambda place, each=each: number("place", each.name, place))  # type: ignore[misc]
        for scene, variants in fit[: 2 * size.scenes + 1]:
            for side in size.sides:
                for seed in seeds_of(scene, side)[: 1 if size.name == "quick" else 3]:
                    conditions = _chosen(size.conditions, each.name, scene, seed)
                    if each.name in MIXED:
                        conditions = tuple("point" if name == "16 samples" else name for name in conditions)
                    yield Group(
                        "limitation", each.name, each.group, each.share, scene, variants, seed, side, conditions,
                        size.side,
                    )  # fmt: skip


def limits(limitation: Limitation, scene: Scene) -> bool:
    """Whether the scene holds what the limitation acts on."""
    found = [each for each in models_of(scene) if each.kind == "limitation" and each.name == limitation.name]
    if limitation.name == "acne":  # near cameras have none, and from afar it is everywhere, so no picture can tell
        return "camera_distance=1e3" in scene.variant and scene.id != "acne/grazing_plane"
    if limitation.name == "coincident_surfaces":
        return scene.id.startswith("visibility/coincident") and bool(found)
    # colours are interpolated over smooth meshes, unless a renderer declares more: this bench's do not
    return any(("gouraud_meshes", "all") not in each.also for each in found)


def _faulty(size: Size, drawn: Mapping[Place, Scene]) -> Iterator[Group]:
    for fault in FAULTS:
        fit = [place for place, scene in drawn.items() if _can(fault, scene)]
        middle = len(fault.strengths) // 2
        for strength in fault.strengths if size.every_strength else fault.strengths[middle : middle + 1]:
            fit.sort(key=lambda place, strength=strength: number("place", fault.name, strength, place))  # type: ignore[misc]
            chosen = fit if (fault.name, strength) in MUST and size.name != "quick" else fit[: size.scenes]
            for scene, variants in chosen:
                for side in size.sides:
                    seeds = seeds_of(scene, side)
                    seed = seeds[number("seed", fault.name, strength, scene) % (1 if size.name == "quick" else 2)]
                    conditions = _chosen(size.conditions, fault.name, strength, scene, seed)
                    if chosen is fit:
                        conditions = ("16 samples",)
                    yield Group(
                        "bug", fault.name, fault.group, strength, scene, variants, seed, side, conditions, size.side
                    )


def _can(fault: Fault, scene: Scene) -> bool:
    stands = not scene.variant.startswith("camera_distance=1e") or "camera" not in fault.group  # far cameras: float32
    return stands and fault.applies(staged(scene, fault.stage))


def samples(condition: str) -> int:
    """Samples a pixel of one seed."""
    return BY_NAME[condition].samples or 1
