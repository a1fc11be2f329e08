"""The choice of one picture of a stage: variants selected in the session layer, and the frame that is asked for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from pxr import Sdf, Tf, Usd

from notabug.scenes_usd.diagnostics import silenced
from notabug.scenes_usd.errors import SceneError, SelectionError
from notabug.scenes_usd.reading import refuse
from notabug.scenes_usd.view import prim_and_set, variant_word

_LISTED = 12  # names that a message lists at most


def open_stage(path: Path) -> Usd.Stage:
    """The stage, with a session layer of its own: the file is never written to."""
    try:
        with silenced(path):
            return Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        reason = what_usd_says(str(error), path)
        raise SceneError("cannot be opened as a USD stage", where=str(path), got=reason, do="try usdchecker") from error


def what_usd_says(text: str, path: Path) -> str:
    """The comments of OpenUSD's errors, without the places in OpenUSD's own source that they come from."""
    plain = " ".join(text.split())
    comments = re.split(r"\s*Error in '[^']*' at line \d+ in file \S+ : ", plain)
    kept = [comment.strip("' ") for comment in comments if comment.strip("' ")]
    if len(kept) > 1:  # the first says what is wrong, the last that therefore the layer was not opened
        kept = [each for each in kept if not each.startswith("Failed to open layer")] or kept
    return re.sub(rf"{re.escape(str(path))}:(\d+):(\d+):", r"line \1, column \2:", "; ".join(kept))


def choose(stage: Usd.Stage, root: Usd.Prim, variants: Mapping[str, str]) -> dict[str, str]:
    """Select ``variants``, of ``root`` or of the prims that their keys name; the full selection, defaults included.

    A choice may bring further sets and prims.
    """
    stage.SetEditTarget(Usd.EditTarget(stage.GetSessionLayer()))
    waiting = dict(variants)
    while ready := [key for key in waiting if _has_set(stage, root, key)]:
        for key in ready:
            prim, name = _holder(stage, root, key), prim_and_set(key)[1]
            wanted, known = waiting.pop(key), prim.GetVariantSet(name).GetVariantNames()
            if wanted not in known:
                raise SelectionError(
                    f"no variant {wanted!r} in the set {name!r}",
                    where=str(prim.GetPath()),
                    expected=f"one of {', '.join(known)}",
                )
            prim.GetVariantSets().SetSelection(name, wanted)
    for key in waiting:
        raise _no_such_set(stage, root, key)
    sets = root.GetVariantSets()
    chosen = {name: str(sets.GetVariantSelection(name)) for name in sorted(sets.GetNames())}
    for name, selection in chosen.items():
        if selection not in sets.GetVariantSet(name).GetVariantNames():
            known = ", ".join(sets.GetVariantSet(name).GetVariantNames())
            refuse(
                SceneError(
                    f"the variant set {name!r} has no default",
                    where=f"{root.GetPath()}.variants",
                    expected=f"one of {known}",
                    got=repr(selection),
                    do="author a selection in the file",
                )
            )
    return chosen | {key: name for key, name in variants.items() if prim_and_set(key)[0]}


def known_variants(path: Path, key: str) -> tuple[str, ...]:
    """The variants of the set that ``key`` names on the stage in ``path``, as it stands; none where it has no such."""
    stage = open_stage(path)
    root = stage.GetDefaultPrim() or stage.GetPseudoRoot()
    with silenced(path):  # a stage may compose more when it is asked
        if not _has_set(stage, root, key):
            return ()
        return tuple(map(str, _holder(stage, root, key).GetVariantSet(prim_and_set(key)[1]).GetVariantNames()))


def _holder(stage: Usd.Stage, root: Usd.Prim, key: str) -> Usd.Prim:
    """The prim whose set ``key`` names; an invalid one where there is none that can be asked."""
    path, _ = prim_and_set(key)
    if not path:
        return root
    return stage.GetPrimAtPath(path) if Sdf.Path.IsValidPathString(path) else Usd.Prim()


def _has_set(stage: Usd.Stage, root: Usd.Prim, key: str) -> bool:
    prim = _holder(stage, root, key)
    known = bool(prim) and prim_and_set(key)[1] in prim.GetVariantSets().GetNames()
    if known and prim.IsInstanceProxy():
        raise SelectionError(
            "a prim inside of an instance has the variants of every instance",
            where=variant_word(key, "..."),
            expected="a prim that is none, or is the instance itself",
            do="take instanceable off in a layer over the scene",
        )
    return known


def _no_such_set(stage: Usd.Stage, root: Usd.Prim, key: str) -> SelectionError:
    """What is wrong with a key that names no set, and which keys there are."""
    path, name = prim_and_set(key)
    known = [variant_word(each, names) for each, names in _sets(stage, root)]
    more = [f"and {len(known) - _LISTED} more"] if len(known) > _LISTED else []
    prim = _holder(stage, root, key)
    return SelectionError(
        f"no variant set {name!r}" if prim else f"no prim {path!r}",
        where=str(prim.GetPath()) if prim else "--variant",
        expected=f"one of {', '.join(known[:_LISTED] + more)}" if known else "none: the scene has no variant sets",
    )


def _sets(stage: Usd.Stage, root: Usd.Prim) -> Iterator[tuple[str, str]]:
    """The key of each variant set of the stage, with its variants in one word."""
    for prim in [root, *(each for each in stage.Traverse() if each != root and each.HasVariantSets())]:
        for name in prim.GetVariantSets().GetNames():
            key = name if prim == root else f"{prim.GetPath()}{{{name}}}"
            yield key, "|".join(prim.GetVariantSet(name).GetVariantNames())


def check_frame(stage: Usd.Stage, time: float | None) -> None:
    """Raise SelectionError where ``time``, the frame that is asked for, is none of an animated stage's frames."""
    known = None if time is None else frames(stage)
    if time is not None and known is not None and not known[0] <= time <= known[1]:
        expected = f"{known[0]:g} to {known[1]:g}" if known[0] < known[1] else f"{known[0]:g}"
        raise SelectionError("no such frame", where="--time", expected=expected, got=f"{time:g}")


def frames(stage: Usd.Stage) -> tuple[float, float] | None:
    """The first and the last frame of the stage, by its range and by its samples; None where nothing is animated."""
    found = [stage.GetStartTimeCode(), stage.GetEndTimeCode()] if stage.HasAuthoredTimeCodeRange() else []
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        for attribute in prim.GetAuthoredAttributes():
            if attribute.GetNumTimeSamples():
                times = attribute.GetTimeSamples()
                found += [times[0], times[-1]]
    return (min(found), max(found)) if found else None
