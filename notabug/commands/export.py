"""The ``export`` command: scenes in other formats, one folder for each variant."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from notabug.adapters.export.formats import export
from notabug.adapters.spheres import with_meshes
from notabug.exit_codes import ExitCode
from notabug.runs.folders import scene_folder
from notabug.runs.own_folder import claim
from notabug.runs.progress import console
from notabug.runs.selection import choose, parse_variants
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.view import AS_IT_IS, View


def command(
    scenes: Sequence[str],
    variants: Sequence[str],
    every_variant: bool,
    kind: str,
    out: Path,
    as_json: bool = False,
    view: View = AS_IT_IS,
    meshes: bool = False,
) -> ExitCode:
    """Write the selection as ``kind`` below ``out`` and print what a renderer is to open, a line each.

    With ``meshes`` exact spheres become meshes, as for a renderer that declares ``spheres = "mesh"``.
    """
    claim(out, "export")
    written = []
    for choice in choose(scenes, parse_variants(variants), every_variant=every_variant, view=view):
        taken = take_scene(choice.source, choice.variants, choice.view)
        scene = with_meshes(taken.scene) if meshes else taken.scene
        if taken.told(choice.source):
            console(stderr=True).print(taken.told(choice.source), markup=False, soft_wrap=True)
        folder = scene_folder(out, choice.folder or choice.id, scene.variant)
        folder.mkdir(parents=True, exist_ok=True)
        path = export(scene, kind, folder)
        written.append({"scene": scene.id, "variant": scene.variant, "file": str(path)})
        if not as_json:
            console().print(str(path), markup=False, soft_wrap=True)
    if as_json:
        print(json.dumps({"exported": written}, ensure_ascii=False))
    return ExitCode.OK
