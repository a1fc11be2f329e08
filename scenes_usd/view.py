"""View: which picture of a stage is meant, beside its variants, and how both are written down and read again."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from notabug.scenes_usd.errors import SelectionError

PURPOSES = ("default", "render", "proxy", "guide")
DRAWN = frozenset({"default", "render"})  # without a word about purposes
_OF_PRIM = re.compile(r"(?P<prim>/[^{}=]+)\{(?P<set>[^{}=]+)=(?P<name>[^{}]+)\}")


@dataclass(frozen=True, slots=True)
class View:
    """Which picture of a stage is meant: ``camera`` by its path, the frame ``time``, the ``purposes`` that are drawn.

    Without them: the camera of the render settings or the only one, values that do not change, render and default.
    """

    camera: str = ""
    time: float | None = None
    purposes: frozenset[str] = DRAWN
    quick: bool = False  # surfaces are refined once only: for who asks whether a scene can be read
    size: tuple[int, int] | None = None  # pixels across and down where the stage says nothing of them

    @property
    def words(self) -> tuple[str, ...]:
        """The options of the command line that ask for it; none where nothing is asked for.

        >>> View(camera="/World/Side", time=12.0).words
        ('--camera=/World/Side', '--time=12')
        """
        found = [f"--camera={self.camera}"] if self.camera else []
        found += [] if self.time is None else [f"--time={_number(self.time)}"]
        if self.purposes != DRAWN:
            found += [f"--purpose={word}" for word in PURPOSES[1:] if word in self.purposes] or ["--purpose=default"]
        return tuple(found)


AS_IT_IS = View()  # the scene's own picture


def _number(value: float) -> str:
    """``value`` in the fewest digits that give it back."""
    return str(int(value)) if value == int(value) else repr(value)


def as_text(variants: Mapping[str, str], view: View | None = None) -> str:
    """A choice as it is told and kept: variants in alphabetical order, then the options of a view, joined by commas.

    >>> as_text({"/World/Car{paint}": "red", "lod": "high"}, View(time=3.0))
    '/World/Car{paint=red},lod=high,--time=3'
    """
    words = [variant_word(key, name) for key, name in sorted(variants.items())]
    return ",".join([*words, *(view.words if view is not None else ())])


def from_text(text: str) -> tuple[dict[str, str], View]:
    """The variants and the view that ``as_text`` wrote down.

    >>> from_text("/World/Car{paint=red},lod=high,--time=3") == (
    ...     {"/World/Car{paint}": "red", "lod": "high"}, View(time=3.0)
    ... )
    True
    """
    words = [word for word in text.split(",") if word]
    options = [word[2:].partition("=") for word in words if word.startswith("--")]
    variants = dict(read_variant_word(word) for word in words if not word.startswith("--"))
    said = {key: value for key, _, value in options}
    purposes = [value for key, _, value in options if key == "purpose"]
    try:
        time = float(said["time"]) if "time" in said else None
    except ValueError:
        raise SelectionError("not a time code", where="--time", expected="a number", got=said["time"]) from None
    return variants, view_of(said.get("camera", ""), time, purposes)


def options_for(text: str) -> Iterator[str]:
    """The words of a command line that ask for the choice that ``as_text`` wrote down, each option's two apart."""
    for word in filter(None, text.split(",")):
        key, _, value = word.partition("=")
        yield from (key, value) if word.startswith("--") else ("--variant", word)


def variant_word(key: str, name: str) -> str:
    """The variant ``name`` of a set: ``set=name``, or ``/Prim{set=name}`` for the key ``/Prim{set}``."""
    return f"{key[:-1]}={name}}}" if key.startswith("/") else f"{key}={name}"


def read_variant_word(word: str) -> tuple[str, str]:
    """The key and the name that ``variant_word`` wrote; raises SelectionError where there are none."""
    found = _OF_PRIM.fullmatch(word)
    if found is not None:
        return f"{found['prim']}{{{found['set']}}}", found["name"]
    key, _, name = word.partition("=")
    if not (key and name) or word.startswith("/") or set("{}") & set(word):
        expected = "SET=NAME of the default prim, or /Prim{SET=NAME}"
        raise SelectionError("not a variant", where="--variant", expected=expected, got=repr(word))
    return key, name


def prim_and_set(key: str) -> tuple[str, str]:
    """The path of the prim, "" for the default prim, and the set that a key of a choice names.

    >>> prim_and_set("/World/Car{paint}"), prim_and_set("lod")
    (('/World/Car', 'paint'), ('', 'lod'))
    """
    if not key.startswith("/"):
        return "", key
    path, _, name = key[:-1].partition("{")
    return path, name


def view_of(camera: str, time: float | None, purposes: Iterable[str]) -> View:
    """What the options ``--camera``, ``--time`` and ``--purpose`` ask for."""
    wanted = tuple(purposes)
    for word in wanted:
        if word not in PURPOSES:
            raise SelectionError(f"no purpose {word!r}", where="--purpose", expected=f"one of {', '.join(PURPOSES)}")
    if time is not None and not abs(time) < float("inf"):
        raise SelectionError("not a time code", where="--time", expected="a number", got=str(time))
    return View(camera=camera, time=time, purposes=frozenset({"default", *wanted}) if wanted else DRAWN)
