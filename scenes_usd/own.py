"""A team's own scene as a command takes it: read as it is, else adapted in memory as ``adapt`` would adapt it.

What may be adapted depends on who draws. An adapter draws what it is given, so all of it may be. A picture that was
drawn elsewhere shows the file as it is: then only which picture is meant may be chosen, never another light or material
in the place of what the file has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from notabug.scenes_usd.errors import Asked, ManyFaultsError, SceneError
from notabug.scenes_usd.fence import OutsideError
from notabug.scenes_usd.reader import CORPUS, find, read_scene
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.view import AS_IT_IS, View

if TYPE_CHECKING:
    from notabug.scenes_usd.adapted import Mends

_TOLD = 3  # opinions that a line quotes
_FORMAL = ("customData:notabug", "renderSettingsPrimPath", "resolution")  # which tell least of what is drawn


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """A scene, and a line for each opinion by which it was adapted; none where it is read as it is."""

    scene: Scene
    says: tuple[str, ...] = ()

    def told(self, source: str) -> str:
        """A line that says how it was adapted, and one that says what is left out; "" where there is neither."""
        lines = []
        if self.says:
            all_of_it = f"notabug check {source} lists all, notabug adapt {source} --out own.usda writes it down"
            lines.append(f"{source}: {summary(self.says)}; {all_of_it}")
        if self.scene.left_out:
            count = len(self.scene.left_out)
            paths = ", ".join(self.scene.left_out[:_TOLD]) + (f" and {count - _TOLD} more" if count > _TOLD else "")
            what = "object cannot be drawn and is" if count == 1 else "objects cannot be drawn and are"
            lines.append(f"{source}: {count} {what} left out of the picture: {paths}; notabug check {source} says why")
        return "\n".join(lines)


def summary(says: tuple[str, ...]) -> str:
    """What was adapted, in a few words.

    >>> summary(("/A.customData:notabug: a card", "/A.camera: /Cam", "/B: a light", "/D: grey"))
    'adapted in memory: /A.camera: /Cam; /B: a light; /D: grey and 1 more'
    """
    first = sorted(says, key=lambda line: any(f".{name}: " in line for name in _FORMAL))
    more = f" and {len(says) - _TOLD} more" if len(says) > _TOLD else ""
    return f"adapted in memory: {'; '.join(first[:_TOLD])}{more}"


def take_scene(
    source: str | Path, variants: Mapping[str, str] | None = None, view: View | None = None, mends: Mends = "scene"
) -> Taken:
    """The scene ``source`` as ``read_scene`` gives it; a team's own that is out of the contract is adapted in memory.

    Raises SceneError, or ManyFaultsError, for what no adaptation mends, or none that ``mends`` admits.
    """
    try:
        return _taken(source, variants, view, mends)
    except SceneError as error:
        asked = Asked(str(source), dict(variants or {}), view or AS_IT_IS)
        for part in (error, *(error.errors if isinstance(error, ManyFaultsError) else ())):
            part.asked = asked
        raise


def _taken(source: str | Path, variants: Mapping[str, str] | None, view: View | None, mends: Mends) -> Taken:
    try:
        return Taken(read_scene(source, variants, view))
    except OutsideError:
        raise
    except SceneError as error:
        path = find(source, variants, view)  # raises once more where reading it would harm
        if path.is_relative_to(CORPUS):
            raise
        refused = error
    from notabug.scenes_usd.adapted import adapt_in_memory

    made = adapt_in_memory(path, variants or {}, view or AS_IT_IS, mends)
    scene = made.survey.scene
    if scene is None:
        left = tuple(remark.error for remark in made.survey.remarks if remark.error is not None)
        if not left:
            raise refused
        faults = _with_causes(refused, left)
        raise ManyFaultsError(faults) if len(faults) > 1 else faults[0]
    chosen = {**scene.variants, **(variants or {})}
    notes = (summary(made.says), *scene.notes)
    return Taken(replace(scene, variants=chosen, view=view or AS_IT_IS, adapted=mends, notes=notes), made.says)


def _with_causes(refused: SceneError, left: tuple[SceneError, ...]) -> tuple[SceneError, ...]:
    """The faults ``left`` after adapting; where one of them is new, after those for which things were left out.

    A scene all of whose meshes are broken has nothing to draw without them: that alone would say nothing of the meshes.
    """
    original = refused.errors if isinstance(refused, ManyFaultsError) else (refused,)
    known, still = ({(error.where, error.what) for error in errors} for errors in (original, left))
    if still <= known:
        return left
    return (*(each for each in original if not each.mends and (each.where, each.what) not in still), *left)


def as_usd(scene: Scene) -> str:
    """``scene`` as the text of one layer that says all that was chosen and overruled when it was read."""
    from notabug.scenes_usd.adapted import flattened_over
    from notabug.scenes_usd.reader_stage import flattened, says_its_picture

    as_it_is = not (scene.adapted or scene.view.words)
    if scene.path.is_relative_to(CORPUS) and as_it_is:
        return flattened(scene.path, scene.variants)
    if as_it_is and says_its_picture(scene.path, scene.variants):
        return flattened(scene.path, scene.variants)
    view = replace(scene.view, size=(scene.width, scene.height))
    return flattened_over(scene.path, scene.variants, view, scene.adapted or "picture")
