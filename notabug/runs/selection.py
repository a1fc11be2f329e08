"""What to run: scenes by id, class, glob or USD file, and variants by set, become a list of choices."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path

from notabug.adapters.base import Adapter
from notabug.scenes_usd import catalogue
from notabug.scenes_usd.errors import NotabugError, SceneError, SelectionError
from notabug.scenes_usd.nearest import SEE_SCENES, instead_of, near
from notabug.scenes_usd.reader import SUFFIXES, find, look_through, scene_id
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.view import AS_IT_IS, View, as_text, read_variant_word, variant_word

ALL = "all"


OWN_FOLDER = "own/"  # of the results of scenes from outside the corpus


class NothingSelectedError(NotabugError):
    """A selection that is well formed and empty."""


def unaltered(adapter: Adapter, scene: Scene) -> Adapter:
    """The alteration that alters nothing."""
    del scene
    return adapter


@dataclass(frozen=True, slots=True)
class Choice:
    """One scene with the variants and the view that were asked for; sets left out keep the scene's default.

    ``source`` is what was asked for (an id or a path), ``folder`` where the results of a scene from outside the corpus
    go: two files of one name must not share a folder. ``label`` names what ``alter`` makes of an adapter, "" nothing;
    ``only`` names the renderers that the choice is for, all where it is empty. ``refused`` says why the scene is not
    read at all, ``scene`` is the scene where it has been read.
    """

    source: str
    id: str
    variants: Mapping[str, str] = field(default_factory=dict)
    folder: str = ""
    view: View = AS_IT_IS
    label: str = ""
    alter: Callable[[Adapter, Scene], Adapter] = unaltered
    only: frozenset[str] = frozenset()
    refused: str = ""
    scene: Scene | None = field(default=None, compare=False, repr=False)

    @property
    def variant(self) -> str:
        return as_text(self.variants, self.view)


def parse_variants(words: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """``SET=NAME`` and ``/Prim{SET=NAME}`` words; a set that is named again collects its names, so does ``SET=A,B``."""
    wanted: dict[str, tuple[str, ...]] = {}
    for word in words:
        name, values = read_variant_word(word)
        wanted[name] = (*wanted.get(name, ()), *(each for each in values.split(",") if each))
    return wanted


def choose(
    scenes: Sequence[str],
    wanted: Mapping[str, Sequence[str]],
    *,
    every_variant: bool = False,
    view: View = AS_IT_IS,
) -> list[Choice]:
    """The choices for ``scenes`` (all when empty) under the variants ``wanted``, each in the ``view``.

    A scene without a wanted set keeps its default; a set that no selected scene has is a SelectionError.
    ``every_variant`` varies one set at a time about the default, so that a scene costs the sum of its sets' sizes, not
    the product.
    """
    sources = list(dict.fromkeys(source for word in scenes or ["*"] for source in _sources(word)))
    if not sources:
        raise NothingSelectedError("no scene matches", got=" ".join(scenes), do="see `notabug list scenes`")
    wrong = {source: error for (source, _), error in look_through((source, ()) for source in sources).items()}
    refused = [_refused(source, wrong[source]) for source in sources if source in wrong]
    sources = [source for source in sources if source not in wrong]
    if not sources:
        raise next(iter(wrong.values()))  # there is nothing else to go on with
    if not (wanted or every_variant):
        return [replace(_choice(source, find(source), {}), view=view) for source in sources] + refused
    entries: dict[str, catalogue.Entry] = {}
    for source in sources:
        try:
            entries[source] = catalogue.read_entry(find(source))
        except SceneError as error:
            if len(sources) == 1 or not Path(source).is_file():
                raise
            refused.append(_refused(source, error))
    sets = {source: _sets(entry, wanted) for source, entry in entries.items()}
    choices: dict[tuple[str, frozenset[tuple[str, str]]], Choice] = {}
    for source, entry in entries.items():
        here = {name: values for name, values in wanted.items() if name in sets[source]}
        for variants in _combinations(sets[source], here, every_variant):
            full = frozenset({**entry.defaults, **variants}.items())  # a default that is named is no other choice
            choices.setdefault((source, full), replace(_choice(source, entry.path, variants), view=view))
    _refuse(list(sets.values()), wanted)
    return [*_without_harm(list(choices.values())), *refused]


def _without_harm(choices: Sequence[Choice]) -> list[Choice]:
    """``choices``, those refused that would harm whoever reads them: their variants may hold more than the default."""
    asked = [(choice.source, tuple(sorted(choice.variants.items()))) for choice in choices]
    wrong = look_through(asked)
    return [
        replace(choice, refused=str(wrong[look])) if look in wrong else choice
        for choice, look in zip(choices, asked, strict=True)
    ]


def _refused(source: str, error: SceneError) -> Choice:
    """The choice of a scene that cannot be read: its results say why, and the others go on."""
    return replace(_choice(source, Path(source).resolve(), {}), refused=str(error))


QUICK = (
    "acne/sphere",
    "terminator/sphere",
    "phong/interpolation",
    "separation/cutoff",
    "mirror/corner",
    "visibility/coincident_planes",
    "texture/uneven_quad",
    "shadow_map/box",
    "normal_maps/bumps",
    "texture_space/seam",
    "area_shadows/penumbra",
)
"""The scene of each class that shows its artifact best and is drawn soon."""


def quick(choices: Sequence[Choice]) -> list[Choice]:
    """One choice a class: that of QUICK where it is among ``choices``, else the class's first; own scenes all."""
    found: dict[str, Choice] = {}
    for choice in choices:
        group = choice.id.partition("/")[0] if "/" in choice.id else choice.source
        if group not in found or (choice.id in QUICK and found[group].id not in QUICK):
            found[group] = choice
    return [choice for group, choice in found.items() if group != "calibration" or len(found) == 1]


def part(choices: Sequence[Choice], shard: str) -> list[Choice]:
    """The share ``"2/8"`` of ``choices``, by a hash of each: the same on every machine, whatever else is selected."""
    if not shard:
        return list(choices)
    number, slash, of = shard.partition("/")
    if not (slash and number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
        raise SelectionError("not a shard", where="--shard", expected="2/8: the second of eight", got=repr(shard))
    return [each for each in choices if _hash(each) % int(of) == int(number) - 1]


def _hash(choice: Choice) -> int:
    text = "\0".join((choice.source, choice.variant, choice.label))
    digest = hashlib.blake2b(text.encode("utf-8", "surrogateescape"), digest_size=8).digest()
    return int.from_bytes(digest, "big")


def _sources(word: str) -> list[str]:
    """The sources that one SCENE argument stands for."""
    if word.endswith(SUFFIXES):
        return [word]
    ids = [each.id for each in catalogue.scenes()]
    if word.partition("/")[0] == catalogue.PREVIEW:
        ids = list(catalogue.preview_scenes())
    if word in ids:
        return [word]
    if any(each.partition("/")[0] == word for each in ids):
        return [each for each in ids if each.partition("/")[0] == word]
    if any(mark in word for mark in "*?["):
        return [each for each in ids if fnmatchcase(each, word)]
    known = dict.fromkeys([*(each.partition("/")[0] for each in ids), *ids])
    classes = dict.fromkeys(each.partition("/")[0] for each in ids)
    within = [each for each in ids if each.partition("/")[0] == word.partition("/")[0]]
    # nobody finds a name in a list of all scenes
    few = known if near(word, known) else dict.fromkeys(within or classes)
    expected, meant = instead_of(word, few, more=f"a glob, or a {'/'.join(SUFFIXES)} file", see=SEE_SCENES)
    raise SelectionError(f"no scene or class called {word!r}", expected=expected, do=meant)


def _sets(entry: catalogue.Entry, wanted: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
    """Variant set -> its variants.

    A file from outside the corpus may bring sets by composition, which its own layer does not show: there a wanted
    name is passed on, and reading the scene says whether it exists; for all of a set the stage is asked.
    """
    sets = dict(entry.variants)
    if "/" not in entry.id:
        for name, values in wanted.items():
            if name in sets:
                continue
            if ALL not in values:
                sets[name] = tuple(values)
            elif known := _known(entry.path, name):
                sets[name] = known
    return sets


def _known(path: Path, key: str) -> tuple[str, ...]:
    from notabug.scenes_usd.reader_choice import known_variants

    return known_variants(path, key)


def _combinations(
    sets: Mapping[str, Sequence[str]], wanted: Mapping[str, Sequence[str]], every_variant: bool
) -> list[dict[str, str]]:
    named = {
        name: tuple(sets[name])
        if ALL in values and ALL not in sets[name]
        else tuple(v for v in values if v in sets[name])
        for name, values in wanted.items()
    }
    named = {name: values for name, values in named.items() if values}
    picked = [dict(zip(named, values, strict=True)) for values in product(*named.values())]
    if not every_variant:
        return picked
    return [
        base | {name: value} for base in picked for name in sets if name not in named for value in sets[name]
    ] or picked


def _choice(source: str, path: Path, variants: Mapping[str, str]) -> Choice:
    name = scene_id(path)
    if "/" in name:
        return Choice(name, name, variants)
    tag = hashlib.blake2b(str(path).encode("utf-8", "surrogateescape"), digest_size=3).hexdigest()
    return Choice(str(Path(source)), name, variants, folder=f"{OWN_FOLDER}{name}-{tag}")


def _refuse(sets: Sequence[Mapping[str, Sequence[str]]], wanted: Mapping[str, Sequence[str]]) -> None:
    """Raise SelectionError for a wanted set or variant that none of the scenes' ``sets`` has."""
    names = sorted({name for each in sets for name in each})
    for name in sorted(wanted.keys() - set(names)):
        raise SelectionError(f"no selected scene has the variant set {name!r}", expected=f"one of {', '.join(names)}")
    for name, values in wanted.items():
        known = list(dict.fromkeys(value for each in sets for value in each.get(name, ())))
        for value in sorted(set(values) - {ALL, *known}):
            raise SelectionError(
                f"no selected scene has {variant_word(name, value)}", expected=f"one of {', '.join(known)} or {ALL}"
            )
