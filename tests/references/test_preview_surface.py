"""UsdPreviewSurface against its formula in mpmath, against closed forms, and what its faults are called."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Material, Preview, Texture

mpf = mpmath.mpf
ALBEDO = (0.8, 0.5, 0.1)
EYE, LIGHT = (0.8, -1.2, 1.5), (-0.9, 0.7, 1.3)
SURFACES = {
    "dielectric": Preview(roughness=0.4),
    "smooth dielectric": Preview(roughness=0.1, ior=1.8),
    "metal": Preview(metallic=1.0, roughness=0.3),
    "half metal": Preview(metallic=0.5, roughness=0.6, ior=1.33),
    "specular": Preview(specular_workflow=True, specular=(0.3, 0.6, 0.9), roughness=0.5, metallic=1.0),
    "specular, black": Preview(specular_workflow=True, roughness=0.7),
    "clearcoat": Preview(roughness=0.8, clearcoat=0.6, clearcoat_roughness=0.25, ior=1.7),
    "emission": Preview(roughness=1.0, emission=(0.5, 0.0, 2.0)),
    "correlated": Preview(metallic=1.0, roughness=0.9, masking="correlated"),
    "schlick": Preview(metallic=1.0, roughness=0.9, masking="schlick"),
}


def formula(surface: Preview, albedo: Any, N: Any, L: Any, V: Any) -> Any:
    """The radiance (3,) of unit irradiance from ``L``, each part as it is first written down where it is from."""
    n, to, v = (mpmath.matrix([mpf(float(x)) for x in each]) for each in (N, L, V))
    n, to, v = (each / mpmath.norm(each) for each in (n, to, v))
    h = (to + v) / mpmath.norm(to + v)

    def dot(a: Any, b: Any) -> Any:
        return sum(x * y for x, y in zip(a, b, strict=True))

    nl, nv, nh, vh = dot(n, to), dot(n, v), dot(n, h), dot(v, h)

    def fresnel(f0: Any, f90: Any) -> Any:  # Schlick 1994
        return f0 + (f90 - f0) * (1 - vh) ** 5

    def one_sided(x: Any, alpha: Any) -> Any:  # Walter et al. 2007, equation 34
        return 2 / (1 + mpmath.sqrt(1 + alpha**2 * (1 - x**2) / x**2))

    def smith(x: Any, alpha: Any) -> Any:  # Heitz 2014, equation 72
        return (mpmath.sqrt(1 + alpha**2 * (1 - x**2) / x**2) - 1) / 2

    def lobe(roughness: float) -> Any:
        alpha = mpf(roughness) ** 2
        tangent = (1 - nh**2) / nh**2
        d = alpha**2 / (mpmath.pi * nh**4 * (alpha**2 + tangent) ** 2)  # Walter et al. 2007, equation 33
        if surface.masking == "separable":
            g = one_sided(nl, alpha) * one_sided(nv, alpha)
        elif surface.masking == "correlated":  # Heitz 2014, equation 99
            g = 1 / (1 + smith(nl, alpha) + smith(nv, alpha))
        else:  # previewSurface.glslfx
            k = alpha / 2
            g = nl / (nl * (1 - k) + k) * nv / (nv * (1 - k) + k)
        return d * g / (4 * nl * nv)

    from_ior = ((1 - mpf(surface.ior)) / (1 + mpf(surface.ior))) ** 2
    found = []
    for channel in range(3):
        colour = mpf(albedo[channel])
        if surface.specular_workflow:
            f0, f90, diffuse = mpf(surface.specular[channel]), mpf(1), colour
        else:  # "In between, we interpolate": previewSurface.glslfx
            m = mpf(surface.metallic)
            f90 = 1 + (colour - 1) * m
            f0 = from_ior * f90 + (f90 - from_ior * f90) * m
            diffuse = colour * (1 - m)
        f = fresnel(f0, f90)
        value = diffuse / mpmath.pi * (1 - f) + f * lobe(surface.roughness)
        value += surface.clearcoat * fresnel(from_ior, mpf(1)) * lobe(surface.clearcoat_roughness)
        found.append(float(value * nl + mpf(surface.emission[channel])))
    return np.array(found)


def floor(make: Any, surface: Preview, albedo: Any = ALBEDO, size: int = 4, **more: Any) -> Any:
    material = Material("/Preview", albedo, preview=surface)
    return make.scene(
        [make.rectangle(size=2.0, uv=[(0, 0), (1, 0), (1, 1), (0, 1)])],
        more.pop("lights", [make.point(LIGHT, 7.0)]),
        make.camera(EYE, (0.0, 0.0, 0.0), tangent=0.3),
        materials=[material],
        size=size,
        **more,
    )


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize(("dtype", "within"), [("float64", 1e-13), ("float32", 2e-5)])
def test_every_lobe_is_its_formula(name: str, dtype: Any, within: float, make: Any, rays: Any) -> None:
    scene = floor(make, SURFACES[name])
    drawn = trace_picture(scene, Options(), dtype=dtype)
    eye, along = rays(scene)
    with mpmath.workdps(30):
        for y, x in itertools.product(range(scene.height), range(scene.width)):
            at = eye - along[y, x] * eye[2] / along[y, x, 2]
            to = np.array(LIGHT) - at
            expected = formula(SURFACES[name], ALBEDO, (0, 0, 1), to, eye - at)
            emitted = np.array(SURFACES[name].emission)
            expected = emitted + (expected - emitted) * 7.0 / (to @ to)
            assert drawn[y, x] == pytest.approx(expected, rel=within), (y, x)


def hemisphere(steps: int) -> tuple[Any, Any]:
    """Unit directions (n, 3) above the plane and the solid angles (n,) they stand for: Gauss-Legendre in the cosine."""
    cosine, weight = np.polynomial.legendre.leggauss(steps)
    cosine, weight = (cosine + 1) / 2, weight / 2
    turn = (np.arange(2 * steps) + 0.5) * math.pi / steps
    sine = np.sqrt(1 - cosine**2)
    directions = np.stack(
        [np.outer(sine, np.cos(turn)), np.outer(sine, np.sin(turn)), np.outer(cosine, np.ones_like(turn))], axis=2
    )
    return directions.reshape(-1, 3), np.repeat(weight, 2 * steps) * math.pi / steps


def reflected(make: Any, surface: Preview, albedo: Any, weigh: Any = lambda directions: 1.0) -> Any:
    """The radiance (3,) at the middle under light from everywhere, as a sum over distant lights."""
    directions, solid_angle = hemisphere(48)
    irradiances = solid_angle * weigh(directions)
    lights = [make.distant(d, e) for d, e in zip((-directions).tolist(), irradiances.tolist(), strict=True)]
    return trace_picture(floor(make, surface, albedo, size=1, lights=lights), Options(shadows="none"))[0, 0]


@pytest.mark.parametrize("roughness", [0.3, 0.45])
def test_what_facets_are_seen_adds_up_to_one(roughness: float, make: Any) -> None:
    """The weak furnace (Heitz 2014, equation 80): without the masking of light all of it comes back.

    Some goes below the horizon, where no light of the scene is: that part of the lobe is added up here.
    """
    alpha = roughness**2

    def unmasked(directions: Any) -> Any:
        z = directions[:, 2]
        return (1 + np.sqrt(1 + alpha**2 * (1 - z**2) / z**2)) / 2

    white = reflected(make, Preview(metallic=1.0, roughness=roughness), (1.0, 1.0, 1.0), unmasked)
    below, solid_angle = hemisphere(200)  # the halfway vector jumps where the light is straight behind
    view = np.array(EYE) / np.linalg.norm(EYE)
    h = view + below * (1, 1, -1)
    nh = h[:, 2] / np.linalg.norm(h, axis=1)
    d = alpha**2 / (math.pi * (nh**2 * (alpha**2 - 1) + 1) ** 2)
    g = 2 / (1 + math.sqrt(1 + alpha**2 * (1 - view[2] ** 2) / view[2] ** 2))
    lost = (d * g / (4 * view[2]) * (nh > 0) * solid_angle).sum()
    assert white == pytest.approx(1.0 - lost, abs=1e-4)


@pytest.mark.parametrize("masking", ["separable", "correlated"])
@pytest.mark.parametrize("roughness", [0.3, 1.0])
def test_no_metal_sends_more_than_it_gets(roughness: float, masking: Any, make: Any) -> None:
    """What light that a facet loses to another one brings is left out, as everywhere with one bounce.

    Of a white dielectric the formula sends 1.0006 at roughness 0.3: its diffuse part is no balance of its highlights.
    """
    white = reflected(make, Preview(metallic=1.0, roughness=roughness, masking=masking), (1.0, 1.0, 1.0))
    assert 0.3 < white[0] <= 1.0 + 1e-6


def test_a_perfect_mirror_sends_nothing_of_a_point(make: Any) -> None:
    assert not trace_picture(floor(make, Preview(metallic=1.0, roughness=0.0)), Options()).any()


def test_scenes_without_it_do_not_change_by_a_bit(make: Any) -> None:
    """A material of another object takes the code for it, and the floor is what it was."""
    plain = floor(make, Preview(), size=16)
    lambert = replace(plain, materials=(Material("/Grey", ALBEDO),))
    behind = make.sphere((0.0, 0.0, -9.0), 0.1, 1)
    both = replace(lambert, objects=(*lambert.objects, behind), materials=(*lambert.materials, *plain.materials))
    for dtype in ("float64", "float32"):
        drawn = [trace_picture(scene, Options(), dtype=dtype) for scene in (lambert, both)]
        assert np.array_equal(*drawn)
    assert lambert.digest() == replace(lambert, materials=(replace(lambert.materials[0], preview=None),)).digest()
    assert lambert.digest() != plain.digest()


# --- maps -----------------------------------------------------------------------------------------------------------

SLOPE = (0.3, -0.2, 0.9)  # what a map says of a normal, along dP/du, dP/dv and N


def texture(values: Any) -> Texture:
    return Texture(Path("map.exr"), np.asarray(values, float).reshape(1, 1, 3))


@pytest.mark.parametrize(
    ("uv", "along", "across"),
    [
        ([(0, 0), (1, 0), (1, 1), (0, 1)], (1, 0, 0), (0, 1, 0)),
        ([(1, 0), (0, 0), (0, 1), (1, 1)], (-1, 0, 0), (0, 1, 0)),  # mirrored: u runs to the left
        ([(0, 0), (0, 1), (1, 1), (1, 0)], (0, 1, 0), (1, 0, 0)),  # mirrored: u and v exchanged
        ([(0, 0), (0, -2), (2, -2), (2, 0)], (0, 1, 0), (-1, 0, 0)),  # turned, and twice as fine
    ],
)
@pytest.mark.parametrize("below", [False, True])
def test_a_normal_map_turns_the_normal_in_the_frame_of_the_coordinates(
    uv: Any, along: Any, across: Any, below: bool, make: Any, rays: Any
) -> None:
    """Seen from behind, the whole mapped normal is turned round: what is a bump from the front is a dent."""
    turn = -1.0 if below else 1.0
    surface = Preview(roughness=0.6, normal_map=0)
    scene = floor(make, surface, textures=[texture(SLOPE)], lights=[make.point(np.array(LIGHT) * (1, 1, turn), 7.0)])
    scene = replace(
        scene,
        objects=(make.rectangle(size=2.0, uv=uv),),
        camera=make.camera(np.array(EYE) * (1, 1, turn), (0.0, 0.0, 0.0), tangent=0.3),
    )
    drawn = trace_picture(scene, Options())
    normal = turn * (SLOPE[0] * np.array(along) + SLOPE[1] * np.array(across) + SLOPE[2] * np.array((0, 0, 1)))
    eye, towards = rays(scene)
    with mpmath.workdps(30):
        for y, x in [(0, 0), (1, 2), (3, 3)]:
            at = eye - towards[y, x] * eye[2] / towards[y, x, 2]
            to = np.array(scene.lights[0].position) - at
            expected = formula(surface, ALBEDO, normal, to, eye - at) * 7.0 / (to @ to)
            assert drawn[y, x] == pytest.approx(expected, rel=1e-12), (y, x)
    from_behind = normal * (turn, turn, 1.0)  # by a renderer that turns N alone
    other = trace_picture(scene, Options(bumps_behind=True))
    at = eye - towards[1, 2] * eye[2] / towards[1, 2, 2]
    to = np.array(scene.lights[0].position) - at
    with mpmath.workdps(30):
        expected = formula(surface, ALBEDO, from_behind, to, eye - at) * 7.0 / (to @ to)
    assert other[1, 2] == pytest.approx(expected, rel=1e-12)


def test_a_map_that_says_up_changes_nothing_but_rounding(make: Any) -> None:
    plain = floor(make, Preview(), size=8)
    mapped = floor(make, Preview(normal_map=0), size=8, textures=[texture((0, 0, 1))])
    assert trace_picture(mapped, Options()) == pytest.approx(trace_picture(plain, Options()), rel=1e-14)


def test_a_map_of_no_direction_is_not_looked_at(make: Any) -> None:
    plain = trace_picture(floor(make, Preview(), size=4), Options())
    for values, uv in (((0, 0, 0), [(0, 0), (1, 0), (1, 1), (0, 1)]), (SLOPE, [(0, 0)] * 4)):
        scene = floor(make, Preview(normal_map=0), size=4, textures=[texture(values)])
        drawn = trace_picture(replace(scene, objects=(make.rectangle(size=2.0, uv=uv),)), Options())
        assert np.array_equal(drawn, plain)


def test_numbers_come_from_their_maps(make: Any) -> None:
    said = Preview(metallic=0.5, roughness=0.6, emission=(0.1, 0.2, 0.3))
    maps = [texture((0.5, 0.5, 0.5)), texture((0.6, 0.6, 0.6)), texture((0.1, 0.2, 0.3))]
    mapped = Preview(metallic=0.0, roughness=1.0, metallic_map=0, roughness_map=1, emission_map=2)
    drawn = trace_picture(floor(make, mapped, textures=maps), Options())
    assert drawn == pytest.approx(trace_picture(floor(make, said), Options()), rel=1e-13), "but for the texels' weights"
