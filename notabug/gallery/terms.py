"""terms: what the reference computes at a grid of pixels, for the viewer to show beside their values."""

from __future__ import annotations

import math
from typing import Any

from notabug.references.predict import configured
from notabug.references.tracer.flatten import flatten
from notabug.references.tracer.probe import probe
from notabug.scenes_usd.scene import Scene


def terms(scene: Scene, step: int) -> dict[str, object]:
    """The tracer's terms at the centres of every ``step``-th pixel of ``scene``, row by row.

    Each point is ``[object, face, depth, normal, facet normal, N'.V, u, v, albedo, lights]`` or 0 for the background;
    each light ``[light, N'.L, N.L, distance, blocker, share, forgiven]``, objects, lights and blockers as indices of
    ``names``.
    """
    drawn, options = configured(scene, ())
    flat = flatten(drawn)
    names: dict[str, int] = {"": 0}
    columns, rows = (range(step // 2, length, step) for length in (scene.width, scene.height))
    points: list[Any] = []
    for y in rows:
        for x in columns:
            seen = probe(drawn, options, x + 0.5, y + 0.5, flat)
            if not seen.path:
                points.append(0)
                continue
            lights = [
                [
                    names.setdefault(light.path, len(names)),
                    *_short(light.cosine, light.geometric_cosine, light.distance),
                    names.setdefault(light.blocker, len(names)),
                    *_short(light.share),
                    int(light.spared),
                ]
                for light in seen.lights
            ]
            points.append(
                [
                    names.setdefault(seen.path, len(names)),
                    seen.face,
                    *_short(seen.depth),
                    _short(*seen.normal),
                    _short(*seen.facet_normal),
                    *_short(seen.view_cosine, *seen.uv),
                    _short(*seen.albedo),
                    lights,
                ]
            )
    return {"step": step, "columns": len(columns), "names": list(names), "points": points}


def _short(*values: float) -> list[float | None]:
    return [float(f"{value:.5g}") if math.isfinite(value) else None for value in values]
