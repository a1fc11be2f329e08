"""Faults of POV-Ray's scene text: what an exporter or a renderer may get wrong, written without our models.

Each fault edits the text that the adapter wrote. It returns the text unchanged where the scene has nothing for it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from notabug.scenes_usd.scene import Scene

Edit = Callable[[str], str]

_NUMBER = r"[-+0-9.e]+"
_TRIPLE = rf"<({_NUMBER}),({_NUMBER}),({_NUMBER})>"


@dataclass(frozen=True, slots=True)
class TextFault:
    """``edit`` makes the fault; a finding with one of the names ``right`` has found it.

    In a scene that it does not ``suit`` the same edit of the text would be another fault.
    """

    edit: Edit
    right: tuple[str, ...]
    suits: Callable[[Scene], bool] = lambda _: True


def _scaled(text: str, pattern: str, *factors: float) -> str:
    """``text`` with the numbers in the groups of ``pattern`` multiplied by ``factors`` wherever it matches."""

    def one(found: re.Match[str]) -> str:
        whole, start = found.group(0), found.start()
        for group in range(len(found.groups()), 0, -1):
            value = float(found.group(group)) * factors[(group - 1) % len(factors)]
            a, b = found.start(group) - start, found.end(group) - start
            whole = f"{whole[:a]}{value:.17g}{whole[b:]}"
        return whole

    return re.sub(pattern, one, text)


def _without(text: str, pattern: str, keep: int = 0) -> str:
    """``text`` without what ``pattern`` matches first, where more than ``keep`` of it are there."""
    found = list(re.finditer(pattern, text))
    if len(found) <= keep:
        return text
    return text[: found[0].start()] + text[found[0].end() :]


def _vectors(text: str, name: str, change: Callable[[list[list[float]]], list[list[float]]]) -> str:
    """``text`` with the rows of every list ``name { n, <..>,<..> }`` changed."""

    def one(found: re.Match[str]) -> str:
        rows = [[float(x) for x in row.split(",")] for row in re.findall(r"<([^>]*)>", found.group(1))]
        written = ",".join(f"<{','.join(f'{x:.17g}' for x in row)}>" for row in change(rows))
        return f"{name} {{ {len(rows)}, {written} }}"

    return re.sub(rf"{name} \{{ \d+, ([^}}]*)\}}", one, text)


def _fewer_triangles(text: str) -> str:
    """Every fifth triangle is lost, and a small mesh's last one."""

    def one(found: re.Match[str]) -> str:
        lists = dict(re.findall(r"(face_indices|normal_indices|uv_indices) \{ \d+, ([^}]*)\}", found.group(0)))
        whole = found.group(0)
        for name, rows in lists.items():
            every = re.findall(r"<[^>]*>", rows)
            left = [row for k, row in enumerate(every) if k % 5 != 4] if len(every) > 5 else every[:-1]
            if not left:
                return found.group(0)
            whole = re.sub(rf"{name} \{{ \d+, [^}}]*\}}", f"{name} {{ {len(left)}, {','.join(left)} }}", whole)
        return whole

    return re.sub(r"mesh2 \{.*", one, text)


def _without_object(text: str) -> str:
    lines = text.split("\n")
    at = [k for k, line in enumerate(lines) if line.startswith(("mesh2", "sphere"))]
    if len(at) < 2:
        return text
    del lines[at[0]]
    return "\n".join(lines)


def _exchanged_looks(text: str) -> str:
    looks = re.findall(r"texture \{ pigment \{ rgbt [^}]*\} finish \{ ambient 0 diffuse [-+0-9.e]+ \} \}", text)
    if len(set(looks)) < 2:
        return text
    a, b = sorted(set(looks))[:2]
    return text.replace(a, "\0").replace(b, a).replace("\0", b)


def _no_shadow(text: str, count: int = 0) -> str:
    """The first ``count`` objects, or all, cast no shadow. (The light of a ``shadowless`` source has no highlights.)"""
    return re.sub(r"((?:mesh2|sphere) \{[^\n]*)\}(\n|$)", r"\1 no_shadow }\2", text, count=count)


def _is_unclamped(scene: Scene) -> bool:
    """Whether the uv in POV-Ray's text are the scene's: a clamped texture is written larger, and its uv with it."""
    return all("clamp" not in (texture.wrap_s, texture.wrap_t) for texture in scene.textures)


def _camera(text: str, name: str, factors: tuple[float, float, float]) -> str:
    return _scaled(text, rf"camera [^\n]*{name} {_TRIPLE}", *factors)


def _moved_camera(text: str) -> str:
    """The camera stands a fiftieth of its distance from the origin to one side."""
    found = re.search(rf"camera [^\n]*location {_TRIPLE}[^\n]*right {_TRIPLE}", text)
    if found is None:
        return text
    place, right = [float(x) for x in found.groups()[:3]], [float(x) for x in found.groups()[3:]]
    far = sum(x * x for x in place) ** 0.5 / max(sum(x * x for x in right) ** 0.5, 1e-30)
    moved = ",".join(f"{p + 0.02 * far * r:.17g}" for p, r in zip(place, right, strict=True))
    return re.sub(rf"location {_TRIPLE}", f"location <{moved}>", text, count=1)


def _normals(change: Callable[[list[float]], list[float]]) -> Edit:
    return lambda text: _vectors(text, "normal_vectors", lambda rows: [change(row) for row in rows])


def _uv(change: Callable[[list[float]], list[float]]) -> Edit:
    return lambda text: _vectors(text, "uv_vectors", lambda rows: [change(row) for row in rows])


def _flat(text: str) -> str:
    return re.sub(r"normal_(vectors|indices) \{[^}]*\}", "", text)


LIGHT = r"light_source \{ [^\n]*\n"
MOVED = ("light_moved", "light_up_axis")
MISSING = ("face_missing", "object_missing", "cracks")  # triangles
SEEN_ELSEWHERE = ("camera_moved", "pixel_shift", "field_of_view", "aspect")

POVRAY_FAULTS: Mapping[str, TextFault] = {
    "light brighter": TextFault(
        lambda text: _scaled(text, rf"light_source \{{ <[^>]*> rgb {_TRIPLE}", 1.25, 1.25, 1.25), ("light_gain",)
    ),
    "light redder": TextFault(
        lambda text: _scaled(text, rf"light_source \{{ <[^>]*> rgb {_TRIPLE}", 1.25, 1.0, 1.0), ("light_colour",)
    ),
    "light moved": TextFault(
        lambda text: _scaled(text, rf"light_source \{{ {_TRIPLE} rgb <[^>]*> fade", 1.15, 1.0, 0.85), MOVED
    ),
    "light missing": TextFault(lambda text: _without(text, LIGHT, 1), ("light_missing", "light_gain")),
    "lights without shadows": TextFault(_no_shadow, ("no_shadow",)),
    "object without shadow": TextFault(
        lambda text: _no_shadow(text, 1), ("no_shadow", "shadow_ray_culled", "epsilon_too_large")
    ),
    "camera moved": TextFault(_moved_camera, SEEN_ELSEWHERE),
    "field of view": TextFault(
        lambda text: _camera(_camera(text, "right", (1.03,) * 3), "up", (1.03,) * 3), ("field_of_view",)
    ),
    "aspect": TextFault(lambda text: _camera(text, "up", (1.04,) * 3), ("aspect", "field_of_view")),
    "triangles missing": TextFault(_fewer_triangles, MISSING),
    "object missing": TextFault(_without_object, ("object_missing",)),
    "materials exchanged": TextFault(_exchanged_looks, ("materials_exchanged", "albedo")),
    "normals swapped": TextFault(_normals(lambda n: [n[0], n[2], n[1]]), ("normals_up_axis",)),
    "normals left out": TextFault(_flat, ("flat_normals", "normals_lost")),
    "u and v swapped": TextFault(_uv(lambda uv: [uv[1], uv[0]]), ("swapped_uv",), _is_unclamped),
    "v downwards": TextFault(_uv(lambda uv: [uv[0], 1.0 - uv[1]]), ("flipped_v",), _is_unclamped),
    "texture decoded": TextFault(
        lambda text: text.replace("gamma 1.0 interpolate", "gamma 2.2 interpolate"),
        ("texture_decoded", "texture_decoded_by_power"),
    ),
    "exponent": TextFault(
        lambda text: _scaled(_scaled(text, rf"phong_size ({_NUMBER})", 1.6), rf"roughness ({_NUMBER})", 1 / 1.6),
        ("exponent",),
    ),
    "highlight lost": TextFault(
        lambda text: re.sub(rf" (phong|specular) {_NUMBER} (phong_size|roughness) {_NUMBER}", "", text),
        ("specular_missing",),
    ),
    "mirror brighter": TextFault(
        lambda text: _scaled(text, rf"reflection \{{ rgb {_TRIPLE}", 1.3, 1.3, 1.3), ("mirror_gain",)
    ),
    "glass denser": TextFault(lambda text: _scaled(text, rf"ior ({_NUMBER})", 1.1), ("ior",)),
    "opacity ignored": TextFault(
        lambda text: re.sub(rf"(rgbt <{_NUMBER},{_NUMBER},{_NUMBER},){_NUMBER}>", r"\g<1>0>", text),
        ("opacity_ignored",),
    ),
}
