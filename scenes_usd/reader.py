"""From a corpus id or a USD file to a Scene. Importing this module does not import OpenUSD; reading does."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from notabug.scenes_usd.errors import SceneError, SelectionError
from notabug.scenes_usd.fence import SUFFIXES as SUFFIXES
from notabug.scenes_usd.look import Look
from notabug.scenes_usd.nearest import SEE_SCENES, instead_of
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.untrusted import check_looks, problems

if TYPE_CHECKING:
    from notabug.scenes_usd.reader_stage import Survey
    from notabug.scenes_usd.view import View

CORPUS = Path(__file__).resolve().parent


def read_scene(source: str | Path, variants: Mapping[str, str] | None = None, view: View | None = None) -> Scene:
    """The scene ``source`` under the choice ``variants`` (variant set -> variant; sets left out keep their default).

    A key is the name of a set of the default prim, or ``/Prim{set}``; ``view`` says which picture of the stage.

    ``source`` is a corpus id such as ``terminator/sphere`` or the path of a .usda, .usdc, .usd or .usdz file that
    follows the contract. Lengths are the stage's own units: metersPerUnit is not applied. Materials and textures come
    in the order of their first use by an object, objects and lights in the order of the stage.

    Raises SelectionError for a scene, variant set or variant that does not exist, and SceneError, which names the prim
    and the attribute, for everything in the file that the contract cannot say.
    """
    path = find(source, variants, view)
    return _read(path, variants or {}, view)


def survey_scene(source: str | Path, variants: Mapping[str, str] | None = None, view: View | None = None) -> Survey:
    """All that a look at ``source`` tells, as ``read_scene`` takes it: what is read, approximated, and refused.

    Raises SceneError only where the file cannot be opened at all.
    """
    from notabug.scenes_usd.reader_stage import survey_stage

    path = find(source, variants, view)
    return survey_stage(path, scene_id(path), variants or {}, view)


def find(source: str | Path, variants: Mapping[str, str] | None = None, view: View | None = None) -> Path:
    """The file of a corpus id or a path; raises SceneError where reading it under that choice would harm."""
    path = Path(source)
    if path.suffix in SUFFIXES:
        if not path.is_file():
            raise SceneError("no such file", where=str(source), do="check the path")
        check_looks([Look.at(path.resolve(), variants, view)])
        return path.resolve()
    corpus = CORPUS / f"{source}.usda"
    if isinstance(source, str) and len(path.parts) == 2 and ".." not in path.parts and corpus.is_file():
        return corpus
    known = (f"{each.parent.name}/{each.stem}" for each in sorted(CORPUS.glob("*/*.usda")))
    expected, meant = instead_of(str(source), known, more=f"the path of a {', '.join(SUFFIXES)} file", see=SEE_SCENES)
    raise SelectionError(f"no scene called {str(source)!r}", expected=expected, do=meant)


Asked = tuple[str, tuple[tuple[str, str], ...]]
"""A source, and variants that are chosen."""


def look_through(asked: Iterable[Asked]) -> dict[Asked, SceneError]:
    """Have the scenes of ``asked`` that are files checked together: one by one it takes a process for each.

    What is wrong with those that reading would harm.
    """
    looks = {
        (source, variants): Look.at(Path(source).resolve(), dict(variants))
        for source, variants in asked
        if source.endswith(SUFFIXES) and Path(source).is_file()
    }
    wrong = problems(looks.values())
    return {each: wrong[look] for each, look in looks.items() if look in wrong}


def scene_id(path: Path) -> str:
    """``<class>/<scene>`` inside the corpus, else the file's stem. ``path`` is resolved."""
    return f"{path.parent.name}/{path.stem}" if path.parent.parent == CORPUS else path.stem


def _read(path: Path, variants: Mapping[str, str], view: View | None) -> Scene:
    from notabug.scenes_usd.reader_stage import read_stage

    return read_stage(path, scene_id(path), variants, view)
