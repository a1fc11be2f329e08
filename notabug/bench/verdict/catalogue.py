"""The labelled faults and limitations of the benchmark: one line each.

A fault is an edit of the scene (most are the models of ``references.models`` at a strength of its own), or of the
picture; its strengths are fixed here, before anything is tuned.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from notabug.bench.verdict.image_formation import SUBSAMPLES
from notabug.bench.verdict.scene_setup import STAGES
from notabug.metrics.causes import encoded
from notabug.references.models.model import Model, models
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
Film = Callable[[Floats, float], Floats]


@lru_cache(maxsize=128)
def models_of(scene: Scene) -> tuple[Model, ...]:
    """Every model of ``scene``: each fault looks for its own."""
    return tuple(models(scene))


@dataclass(frozen=True, slots=True)
class Fault:
    """A labelled fault.

    ``group`` is its class, ``strengths`` from weak to strong, ``stage`` the name of an edit of the scene that both the
    picture and its reference get, without which the fault could not show. ``lens`` acts on subsamples (h s, w s, 3),
    ``film`` on the finished picture. ``names`` are the right names of the finding. ``only`` keeps one model of several
    with that name, by a part of its claim.
    """

    name: str
    group: str
    strengths: tuple[float, ...] = (1.0,)
    stage: str = ""
    lens: Film | None = None
    film: Film | None = None
    names: frozenset[str] = frozenset()
    only: str = ""

    @property
    def right(self) -> frozenset[str]:
        return self.names or frozenset({self.name})

    def applies(self, scene: Scene) -> bool:
        """Whether the fault can be switched on in ``scene`` (already staged)."""
        return bool(self.lens or self.film or self._models(scene))

    def _models(self, scene: Scene) -> list[Model]:
        names = self.right | {self.name}
        found = (each for each in models_of(scene) if each.kind == "fault" and each.name in names)
        return [each for each in found if self.only in each.claim]

    def model(self, scene: Scene, strength: float, draw: int) -> Model | None:
        """The fault's model, at ``strength`` where it comes in strengths; which of several, ``draw`` says."""
        found = self._models(scene)
        if not found or self.lens or self.film:
            return None
        model = found[draw % len(found)]
        return model if model.at is None else replace(model.at(strength), at=model.at)


@dataclass(frozen=True, slots=True)
class Limitation:
    """A labelled limitation: the model of that name, ``share`` of it (1: all of it) where its rule is partial."""

    name: str
    group: str
    share: float = 1.0
    conditions: Mapping[str, Any] = field(default_factory=dict)


def _shifted(sub: Floats, pixels: float) -> Floats:
    """Moved right and down by ``pixels``, between subsamples linearly; the border is repeated."""
    whole, rest = divmod(pixels * SUBSAMPLES, 1.0)
    size = int(whole) + 1
    wide = np.pad(sub, ((size, 0), (size, 0), (0, 0)), mode="edge")
    h, w = sub.shape[:2]

    def cut(by: int) -> Floats:
        return wide[size - by : size - by + h, size - by : size - by + w]

    return np.asarray((1.0 - rest) * cut(int(whole)) + (rest * cut(int(whole) + 1) if rest else 0.0))


def _wrong_pixels(picture: Floats, count: float) -> Floats:
    """``count`` scattered pixels among those that see something, the same in all seeds, at half their value."""
    result = picture.copy()
    bright = ndimage.uniform_filter(picture.sum(axis=2), 5).ravel()
    number = int.from_bytes(hashlib.blake2b(str(picture.shape).encode(), digest_size=4).digest(), "big")
    order = np.random.default_rng(number).permutation(bright.size)
    chosen = order[bright[order] > 0.05 * bright.max()][: int(count)]
    result.reshape(-1, 3)[chosen] *= 0.5
    return result


def _dead_tile(picture: Floats, size: float) -> Floats:
    """A black square of ``size`` pixels at the brightest place."""
    result, n = picture.copy(), int(size)
    brightest = int(picture.sum(axis=2).argmax())
    y = min(brightest // picture.shape[1], picture.shape[0] - n)
    x = min(brightest % picture.shape[1], picture.shape[1] - n)
    result[y : y + n, x : x + n] = 0.0
    return result


FAULTS = (
    # geometry
    Fault("flat_normals", "geometry"),
    Fault("normals_not_normalised", "geometry"),
    Fault("normals_by_matrix", "geometry", stage="squashed"),
    Fault("normals_flipped", "geometry"),
    Fault("normals_swapped", "geometry"),
    Fault("normals_up_axis", "geometry"),
    Fault("normals_negated", "geometry"),
    Fault("normals_lost", "geometry"),
    Fault("normals_of_first_corner", "geometry"),
    Fault("geometry_mirrored", "geometry"),
    Fault("object_missing", "geometry"),
    Fault("materials_exchanged", "geometry"),
    # intersection and shadows
    Fault("no_shadow", "intersection"),
    Fault("shadow_ray_unbounded", "intersection", stage="ceiling"),
    Fault("shadow_ray_culled", "intersection"),
    # reflection models
    Fault("exponent", "reflection", (1.05, 1.1, 1.3, 2.0)),
    Fault("reflection_of_unnormalised_light", "reflection", stage="near_light"),
    Fault("halfway_not_normalised", "reflection"),
    Fault("cutoff_missing", "reflection"),
    Fault("specular_missing", "reflection"),
    Fault("specular_gain", "reflection", (1.02, 1.1, 0.5, 2.0), names=frozenset({"specular_gain", "specular_twice"})),
    Fault("diffuse_missing", "reflection"),
    Fault("specular_tinted", "reflection"),
    Fault("normalisation_precedence", "reflection"),
    Fault("lobe_exchanged", "reflection"),
    Fault("albedo", "reflection", (1.01, 1.05, 1.5)),
    # mirrors, glass, opacity
    Fault("mirror_reversed", "mirrors"),
    Fault("primary_view_vector", "mirrors"),
    Fault("mirrored_highlight_lost", "mirrors"),
    Fault("mirror_gain", "mirrors", (1.02, 1.1)),
    Fault("ior", "refraction", (1.005, 1.02, 1.1)),
    Fault("ior_inverted", "refraction"),
    Fault("total_reflection_lost", "refraction"),
    Fault("opacity_inverted", "refraction"),
    Fault("opacity_ignored", "refraction"),
    # textures
    Fault("affine_uv", "texture"),
    Fault("swapped_uv", "texture"),
    Fault("flipped_v", "texture"),
    Fault("shifted_uv", "texture", (0.1, 0.5, 1.0)),
    Fault("texture_decoded", "texture"),
    Fault("texture_encoded", "texture"),
    Fault("texture_channels_swapped", "texture", names=frozenset({"texture_channels_swapped", "channels_swapped"})),
    Fault("texture_wrap", "texture", stage="tiled"),
    # normal maps
    Fault("tangent_handedness", "normal maps"),
    Fault("normal_map_in_world_space", "normal maps"),
    Fault("normal_map_as_srgb", "normal maps"),
    Fault("normal_unscaled", "normal maps"),
    Fault("normal_green_flipped", "normal maps"),
    Fault("normal_red_flipped", "normal maps"),
    Fault("normal_map_ignored", "normal maps"),
    Fault("mapped_normal_not_normalised", "normal maps"),
    Fault("negative_uv", "texture"),
    Fault("border_filter_lost", "texture"),
    Fault("seam_welded", "texture"),
    # opacity from a map
    Fault("opacity_decoded", "cutouts"),
    Fault("opacity_encoded", "cutouts"),
    Fault("opacity_of_red", "cutouts"),
    Fault("colour_times_alpha", "cutouts"),
    Fault("opacity_threshold_ignored", "cutouts"),
    Fault("cutout_shadow_whole", "cutouts"),
    # camera
    Fault("field_of_view", "camera", (1.002, 1.01, 1.1)),
    Fault("field_of_view_axis", "camera", stage="wide"),
    Fault("aspect", "camera", (1.002, 1.01, 1.333)),
    Fault("camera_moved", "camera", (0.002, 0.01, 0.1), only="its z"),
    Fault("pixel_shift", "camera", (0.1, 0.25, 0.5, 1.0), lens=_shifted),
    Fault("upside_down", "camera", film=lambda a, _: a[::-1]),
    Fault("mirrored", "camera", film=lambda a, _: a[:, ::-1]),
    # film
    Fault("srgb_encoded", "film", film=lambda a, _: encoded(a)),
    Fault("gamma", "film", (1.02, 1.1, 2.2), film=lambda a, s: np.power(np.maximum(a, 0.0), s)),
    Fault("clamped", "film", (0.9, 0.7, 0.4), film=lambda a, s: np.minimum(a, s * np.percentile(a, 99))),
    Fault("channels_swapped", "film", film=lambda a, _: a[..., ::-1]),
    Fault("wrong_pixels", "film", (12.0, 50.0, 200.0), film=_wrong_pixels, names=frozenset({"unexplained"})),
    Fault("dead_tile", "film", (4.0, 16.0), film=_dead_tile, names=frozenset({"unexplained"})),
    # lights
    Fault("light_gain", "light", (1.005, 1.01, 1.05, 2.0)),
    Fault("light_colour", "light", (1.01, 1.05)),
    Fault("light_moved", "light", (0.01, 0.05, 0.3)),
    Fault("light_up_axis", "light"),
    Fault("light_missing", "light", stage="two_lights"),
    Fault("falloff_linear", "light"),
    Fault("falloff_none", "light"),
)

LIMITATIONS = (
    Limitation("facet_self_shadow", "terminator"),
    Limitation("facet_self_shadow", "terminator", share=0.5),
    Limitation("quad_split_02", "texture"),
    Limitation("quad_split_13", "texture"),
    Limitation("coarse_uv", "texture"),
    Limitation("lobe_phong", "phong"),
    Limitation("lobe_blinn", "phong"),
    Limitation("lobe_phong_matched", "phong"),
    Limitation("lobe_blinn_matched", "phong"),
    Limitation("lobe_normalised_n2", "phong"),
    Limitation("lobe_normalised_n8", "phong"),
    Limitation("highlight_cosine", "separation"),
    Limitation("mapped_normal_black", "normal maps"),
    Limitation("bump_light_leak", "normal maps"),
    Limitation("bump_terminator_softened", "normal maps"),
    Limitation("acne", "acne"),
    Limitation("coincident_surfaces", "visibility"),
)


def staged(scene: Scene, name: str) -> Scene:
    """``scene`` on the stage of a fault."""
    return STAGES[name](scene) if name else scene
