"""The catalogue: which scenes the corpus has, found by looking, and what verdict each renderer is known to get."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Literal, get_args

from notabug.scenes_usd.card import CLASSES, OWN_CARD, read_card
from notabug.scenes_usd.errors import SceneError, SelectionError
from notabug.scenes_usd.fence import check_inside
from notabug.scenes_usd.nearest import instead_of
from notabug.scenes_usd.reader import CORPUS, scene_id
from notabug.scenes_usd.scene import Card, Scene
from notabug.scenes_usd.untrusted import is_trusted

PREVIEW = "preview"
"""The folder of the small scenes for each feature of UsdPreviewSurface and UsdLux, which only their word selects."""

Word = Literal["pass", "limitation", "bug", "inconclusive", "unsupported", "error"]
"""What is said of a picture: a verdict, or that there is none. Every other list of words is made of this one."""
VERDICTS: tuple[Word, ...] = get_args(Word)


@dataclass(frozen=True, slots=True)
class Entry:
    """One scene of the corpus, as its file says without composing it.

    ``variants`` maps each variant set to its variants in the file's order, ``defaults`` to the authored selection.
    """

    id: str
    path: Path
    card: Card
    variants: Mapping[str, tuple[str, ...]]
    defaults: Mapping[str, str]

    @property
    def artifact_class(self) -> str:
        return self.card.artifact_class

    @property
    def claim(self) -> str:
        return self.card.claim


@cache
def scenes() -> tuple[Entry, ...]:
    """Every ``<class>/<scene>.usda`` of the corpus, by class in the order of the paper's table, then by name."""
    files = sorted(path for name in CLASSES for path in (CORPUS / name).glob("*.usda"))
    found = [read_entry(path) for path in files]
    for each in found:
        if each.artifact_class not in CLASSES:
            raise SceneError("a scene of the corpus without a card", where=str(each.path))
    return tuple(sorted(found, key=lambda each: (CLASSES.index(each.artifact_class), each.id)))


@cache
def preview_scenes() -> tuple[str, ...]:
    """The ids of the scenes of the preview surface's features, in the order of their names."""
    return tuple(f"{PREVIEW}/{path.stem}" for path in sorted((CORPUS / PREVIEW).glob("*.usda")))


def entry(scene: str) -> Entry:
    """The entry with the id ``scene``; raises SelectionError listing the ids there are."""
    for each in scenes():
        if each.id == scene:
            return each
    expected, meant = instead_of(scene, (each.id for each in scenes()))
    raise SelectionError(f"no scene called {scene!r}", expected=expected, do=meant)


def read_entry(path: Path) -> Entry:
    """The entry of the scene file ``path``: reads the layer, not what it refers to."""
    from pxr import Sdf, Tf

    try:
        layer = Sdf.Layer.FindOrOpen(str(path))
    except Tf.ErrorException as error:
        raise SceneError("cannot be read as USD", where=str(path), got=" ".join(str(error).split())) from error
    root = layer.GetPrimAtPath(layer.defaultPrim) if layer and layer.defaultPrim else None
    if not root:  # a team's own scene: what it is composed of may still name variants
        return Entry(scene_id(path), path, OWN_CARD, MappingProxyType({}), MappingProxyType({}))
    variants = {str(name): tuple(map(str, spec.variants.keys())) for name, spec in root.variantSets.items()}
    defaults = {str(name): str(chosen) for name, chosen in root.variantSelections.items()}
    card = read_card(dict(root.customData), str(root.path))
    return Entry(scene_id(path), path, card, MappingProxyType(variants), MappingProxyType(defaults))


def expected(scene: Scene) -> dict[str, str]:
    """Renderer -> verdict from ``<scene>.expected.toml`` beside the scene's file; empty where there is no such file.

    A verdict is ``pass``, or ``limitation: name + name``, or another word of VERDICTS. The renderer ``*`` stands for
    every one that is not named. Tables apply from the general to the special: ``[variant."*"]``, then those whose
    ``set=name`` pairs (joined by commas) are all chosen, fewer pairs first, so a later one replaces an earlier one.
    """
    path = scene.path.with_suffix(".expected.toml")
    if scene.view.words or not path.is_file():  # the table is of the scene's own picture
        return {}
    if not is_trusted(scene.path):
        check_inside(path, scene.path.parent, where=str(path))
    found: dict[str, str] = {}
    for choice, verdicts in read_expected(path).items():
        if all(scene.variants.get(key) == name for key, name in choice):
            found |= verdicts
    return found


Choice = tuple[tuple[str, str], ...]


def read_expected(path: Path) -> dict[Choice, dict[str, str]]:
    """The tables of an ``.expected.toml``, general ones first. Raises SceneError naming the file and the key."""
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise SceneError("not valid TOML", where=str(path), got=str(error)) from error
    if set(document) - {"variant"}:
        raise SceneError("unknown key", where=str(path), expected="variant", got=", ".join(sorted(document)))
    tables: dict[Choice, dict[str, str]] = {}
    for key, verdicts in _table(document.get("variant", {}), f"{path}: variant").items():
        choice = _choice(key, f'{path}: variant."{key}"')
        tables[choice] = _verdicts(verdicts, f'{path}: variant."{key}"')
    return dict(sorted(tables.items(), key=lambda each: len(each[0])))


def _choice(key: str, where: str) -> Choice:
    if key == "*":
        return ()
    pairs = [part.partition("=") for part in key.split(",")]
    if not all(name and chosen for name, _, chosen in pairs):
        raise SceneError("not a choice of variants", where=where, expected='"*" or "set=name,set=name"')
    return tuple(sorted((name.strip(), chosen.strip()) for name, _, chosen in pairs))


def _verdicts(table: object, where: str) -> dict[str, str]:
    said: dict[str, str] = {}
    for renderer, verdict in _table(table, where).items():
        word, _, names = verdict.partition(":") if isinstance(verdict, str) else ("", "", "")
        said[renderer] = str(verdict)
        if word not in VERDICTS or (word == "limitation") != bool(names.strip()):
            expected = f'one of {", ".join(VERDICTS)}, a limitation with its name: "limitation: facet_self_shadow"'
            raise SceneError("not a verdict", where=f"{where}.{renderer}", expected=expected, got=repr(verdict))
    return said


def _table(found: object, where: str) -> dict[str, object]:
    if not isinstance(found, dict):
        raise SceneError("not a table", where=where, got=repr(found))
    return found
