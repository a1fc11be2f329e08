"""``python docs/limitations.py RUN...``: write limitations.md, which limitation appears on which renderer."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from notabug.commands.listing import list_models
from notabug.results.record import load
from notabug.results.wording import number, readable

OURS = ("inhouse", "shadowmap", "zbuffer")

# Which renderer could show a limitation that none here does, and why none does.
ELSEWHERE = {
    "acne": "no renderer here starts its rays without an epsilon that suits its precision",
    "quad_split_13": "all renderers here cut quads from the first corner to the third, or keep them whole",
    "quad_split_shorter": "as above; glTF exporters choose the shorter diagonal",
    "lobe_phong": "VTK has Phong's lobe only; POV-Ray has both lobes, and Mitsuba and OpenGL get ours",
    "lobe_blinn": "three.js and pygfx have Blinn's lobe only; POV-Ray has both lobes, Mitsuba and OpenGL get ours",
    "lobe_phong_matched": "an exporter to VTK that converts Blinn's exponent; here both lobes are there",
    "lobe_blinn_matched": "an exporter to three.js that converts Phong's exponent; here both lobes are there",
    "lobe_normalised_n2": "Mitsuba 0.6 normalises Phong's lobe so; POV-Ray and the shaders here do not normalise",
    "lobe_normalised_n8": "three.js normalises Blinn's lobe about so; POV-Ray and the shaders here do not normalise",
    "highlight_cosine": "pygfx and three.js weight highlights by N.L; others here do not, or get the scene's rule",
    "gouraud_interpolation": "OpenGL's fixed pipeline interpolates colours, as Panda3D does without shaders",
    "gouraud_pixel_shadows": "a shadow map over colours lit at corners, as games had; no renderer here has both",
    "gouraud_unshadowed": "OpenGL's fixed pipeline, which has no shadows; all renderers here interpolate normals",
    "lobe_normalised_n2over8": "pygfx and three.js normalise Blinn's lobe so, by an implicit geometry term of 1/4",
    "subpixel_grid": "SwiftShader, which draws for browsers without a graphics card, has a grid of 1/16 pixel",
    "bounce_limit": "POV-Ray follows five by default, game engines one; every adapter here asks for eight",
    "unshadowed": "OpenGL draws no shadows; its adapter refuses scenes where some fall",
    "crossed_once": "POV-Ray and Mitsuba, on transparent sheets in one place",
    "float32_coordinates": "every renderer, in scenes that lie far from the origin",
    "shadow_map_acne": "three.js without a bias, where it is asked for shadow maps (docs/renderers/threejs.md)",
    "shadow_map_steps": "three.js, as above; every renderer with shadow maps, pygfx and Filament among them",
    "shadow_map_detached": "three.js with a large bias, as above",
    "mapped_normal_black": "Mitsuba before 3.7.1, and pbrt-v4; Mitsuba turns such normals since",
    "bump_light_leak": "three.js and Filament, which have no such maps here yet",
    "bump_terminator_softened": "Mitsuba and Cycles by default; their adapters ask for none of it",
    "texel_weights": "samplers of graphics hardware; OpenGL's adapter here filters in its shader",
    "border_not_filtered": "shaders that repeat a tile of an atlas; every renderer here filters across the border",
    "decoded_after_filter": "old OpenGL and shaders that decode by themselves; adapters here hand over linear texels",
    "welded_seam": "formats with one coordinate a point, as of games; adapters here split points at seams",
    "light_leak": "renderers whose shadow rays have one bias for all scenes; none here has",
    "flat_interpolation": "VTK draws flat facets when asked to; here normals are exported to every renderer",
}

HEAD = """# Which limitation appears on which renderer

From the verdicts on {results} pictures of {renderers}; `python docs/limitations.py RUN...` wrote it. A limitation
counts where the judge names it: how many pictures, and the largest area in pixels with its place.

| limitation | scenes it can act on | renderers of others | in-house |
|---|---|---|---|
"""


def page(results: Iterable[dict[str, Any]]) -> str:
    """The page as Markdown, from the results of runs."""
    judged = [each for each in results if each["verdict"] in ("pass", "limitation", "bug", "inconclusive")]
    renderers = ", ".join(sorted({each["renderer"] for each in judged}))
    lines = []
    for model in list_models():
        if model["kind"] != "limitation":
            continue
        shown = _shown(model["model"], judged)
        real = [text for name, text in shown.items() if name not in OURS]
        own = [text for name, text in shown.items() if name in OURS]
        seen = "; ".join(real) or f"none. {ELSEWHERE.get(model['model'], 'not explained')}"
        scenes = list(dict.fromkeys(model["scenes"]))
        where = ", ".join(scenes) if len(scenes) < 5 else f"{len(scenes)} scenes"
        lines.append(f"| {readable(model['model'])} | {where} | {seen} | {'; '.join(own)} |")
    return HEAD.format(results=len(judged), renderers=renderers) + "\n".join(lines) + "\n"


def _shown(limitation: str, results: Iterable[dict[str, Any]]) -> dict[str, str]:
    """By renderer: how many pictures show it, and the largest."""
    found: dict[str, list[tuple[float, str]]] = {}
    for each in results:
        for finding in each["findings"]:
            if finding["name"] == limitation and each["verdict"] != "bug":
                place = f"`{each['scene']}` {each['variant']}".rstrip()
                place += " (inconclusive)" if each["verdict"] == "inconclusive" else ""
                found.setdefault(each["renderer"], []).append((finding["area_px"] or 0.0, place))
    texts = {}
    for renderer, places in sorted(found.items()):
        area, place = max(places)
        texts[renderer] = f"{renderer} {len(places)}, {number(round(area))} px in {place}"
    return texts


if __name__ == "__main__":
    runs = [load(Path(each))["results"] for each in sys.argv[1:]]
    merged = {(each["scene"], each["variant"], each["renderer"]): each for run in runs for each in run}
    Path(__file__).with_name("limitations.md").write_text(page(merged.values()), encoding="utf-8")
