"""The ``check`` command: all that is read of a scene, approximated, not read, and out of the contract, at once."""

from __future__ import annotations

import json
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from rich.console import Console
from rich.text import Text

from notabug.commands.judge import one_variant
from notabug.exit_codes import ExitCode
from notabug.results.wording import counted
from notabug.runs.progress import console
from notabug.scenes_usd.errors import Asked, ManyFaultsError, NotabugError, SceneError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.reader import survey_scene
from notabug.scenes_usd.reader_stage import Survey
from notabug.scenes_usd.reading import DIRECT_ONLY, Remark
from notabug.scenes_usd.scene import Mesh, Scene
from notabug.scenes_usd.view import AS_IT_IS, View

_PATHS = 3  # that a line about many prims names
ORDER = ("out of the contract", "approximated", "not read")
_GLYPHS = {"out of the contract": ("✗", "bold red"), "approximated": ("≈", "yellow"), "not read": ("–", "dim")}


def command(*, source: str, variants: list[str], view: View, as_json: bool) -> ExitCode:
    """Print what a look at ``source`` tells; the exit code is that of a scene that cannot be judged where it cannot."""
    chosen = one_variant(variants)
    try:
        survey = survey_scene(source, chosen, view)
    except SceneError as error:  # it cannot even be opened
        survey = Survey(None, (Remark("out of the contract", error.where, error.what, error),))
    if as_json:
        print(json.dumps(as_document(source, survey), ensure_ascii=False))
    else:
        show(console(), source, survey, () if survey.scene is not None else faults_left(source, chosen, view))
    return ExitCode.OK if survey.scene is not None else ExitCode.USAGE


def faults_left(source: str, variants: dict[str, str], view: View) -> tuple[SceneError, ...]:
    """The faults of ``source`` that no adaptation mends."""
    try:
        take_scene(source, variants, replace(view, quick=True))
    except SceneError as error:
        return error.errors if isinstance(error, ManyFaultsError) else (error,)
    return ()


def by_path(survey: Survey) -> list[Remark]:
    """The remarks by prim path, the worst of a prim first; what is refused is not told as approximated too."""
    refused = {remark.where for remark in survey.remarks if remark.kind == ORDER[0] and remark.where != remark.path}
    left = [remark for remark in survey.remarks if remark.kind == ORDER[0] or remark.where not in refused]
    return sorted(left, key=lambda remark: (remark.path, ORDER.index(remark.kind), remark.where))


def as_document(source: str, survey: Survey) -> dict[str, object]:
    """What ``check --json`` prints."""
    return {
        "schema": "notabug-check/1",
        "scene": source,
        "judged": survey.scene is not None,
        "read": [] if survey.scene is None else what_is_read(survey.scene),
        "remarks": [_as_dict(each) for each in by_path(survey)],
    }


def _as_dict(remark: Remark) -> dict[str, object]:
    error = remark.error
    said = {"expected": error.expected, "got": error.got, "do": error.do} if error is not None else {}
    return {
        "kind": remark.kind,
        "path": remark.path,
        "where": remark.where,
        "what": remark.what,
        **{key: text for key, text in said.items() if text},
        "adapt": [f"{mend.path}.{mend.name}" for mend in remark.mends],
    }


def what_is_read(scene: Scene) -> list[dict[str, object]]:
    """Everything that is drawn or lights, by its path."""
    rows: list[dict[str, Any]] = [{"path": scene.camera.path, "as": "camera"}]
    rows += [{"path": light.path, "as": f"{light.kind} light"} for light in scene.lights]
    for shape in scene.objects:
        row: dict[str, Any] = {"path": shape.path, "as": "mesh" if isinstance(shape, Mesh) else "sphere"}
        if isinstance(shape, Mesh):
            row["faces"] = len(shape.counts)
        rows.append({**row, "material": scene.materials[shape.material].path})
    return rows


def show(out: Console, source: str, survey: Survey, left: tuple[SceneError, ...] = ()) -> None:
    """Print the survey: one line a remark, then what was read, in numbers, and what to do next.

    ``left`` are the faults that no adaptation mends.
    """
    for kind, line in lines(source, by_path(survey)):
        glyph, style = _GLYPHS[kind]
        out.print(Text(f"{glyph} {kind}: ", style=style).append(line, style="default not bold"), soft_wrap=True)
    kinds: Counter[str] = Counter(remark.kind for remark in by_path(survey))
    told = ", ".join(f"{kinds[kind]} {kind}" for kind in ORDER if kinds[kind]) or "nothing to remark"
    out.print(Text(f"{source}: {told}"), soft_wrap=True)
    if survey.scene is not None:
        scene = survey.scene
        faces = sum(len(mesh.counts) for mesh in scene.meshes)
        numbers = [counted(len(scene.objects), "object"), counted(faces, "face"), counted(len(scene.lights), "light")]
        numbers += [counted(len(scene.materials), "material"), counted(len(scene.textures), "texture")]
        out.print(
            f"read: {', '.join(numbers)}; {scene.width} x {scene.height} pixels from {scene.camera.path}", markup=False
        )
        out.print(f"next: notabug run {source}", markup=False, soft_wrap=True)
        return
    for line in next_steps(source, left, any(remark.mends for remark in survey.remarks)):
        out.print(line, markup=False, soft_wrap=True)


def next_steps(source: str, left: Sequence[SceneError], mends: bool) -> list[str]:
    """What to do with a scene that is out of the contract: ``left`` are the faults that no adaptation mends.

    ``mends`` says whether it mends any.
    """
    name = shlex.quote(source)
    if not left:
        do = f"notabug run {name} draws it adapted in memory; notabug adapt {name} --out own.usda writes that down"
        return [f"next: {do}"]
    if not mends:
        return []
    where = dict.fromkeys(
        f"  {error.where}: {error.what}{f', {error.got}' if error.got else ''}"
        for error in sorted(left, key=lambda error: error.where)
    )
    return [f"next: notabug adapt {name} --out own.usda mends all but {len(where)}, to be mended by hand:", *where]


def steps_after(errors: Sequence[SceneError]) -> list[str]:
    """The same for ``errors`` of a scene that a user named; nothing where they are of several scenes, or of none."""
    asked = {error.asked.source: error.asked for error in errors if error.asked is not None}
    if len(asked) != 1 or not any(error.mends for error in errors):
        return []
    (scene,) = asked.values()
    return next_steps(scene.source, faults_left(scene.source, dict(scene.variants), scene.view), mends=True)


def lines(source: str, told: Sequence[Remark]) -> list[tuple[str, str]]:
    """The kind and the line of each remark of ``source``; those of direct light only share the line of the first."""
    direct = [remark for remark in told if remark.what.startswith(DIRECT_ONLY)]
    found: list[tuple[str, str]] = []
    of_scene = Asked(source, {}, AS_IT_IS)
    for remark in told:
        if len(direct) < 2 or remark not in direct:
            found.append((remark.kind, of_scene.named(says(remark))))
        elif remark is direct[0]:
            paths = ", ".join(each.path for each in direct[:_PATHS])
            more = f" and {len(direct) - _PATHS} more (--json lists them)" if len(direct) > _PATHS else ""
            found.append((remark.kind, f"{DIRECT_ONLY}, of {len(direct)} lights and materials: {paths}{more}"))
    return found


def says(remark: Remark) -> str:
    """A remark in one line.

    >>> says(Remark("not read", "/Hair", "BasisCurves: nothing of it is drawn"))
    '/Hair: BasisCurves: nothing of it is drawn'
    """
    return str(remark.error) if isinstance(remark.error, NotabugError) else f"{remark.where}: {remark.what}"
