"""Workaround: a scene with and without a remedy, what the remedy must reduce, and where it fails."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import notabug.references.workarounds
from notabug.references.models.model import Edit, unchanged


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """One way to render a scene of the corpus.

    Attributes
    ----------
    scene : its id.
    variants : its choice; sets left out keep the scene's default.
    label : what is altered besides; "" where nothing is.
    edit : how the scene is changed before it is rendered. It is judged as if it had not been.
    declares : fields of the adapter's declaration that the alteration changes.
    adapters : renderer -> attributes of its adapter that are replaced; only these renderers have the setting. Empty:
        every renderer, as it is.
    """

    scene: str
    variants: Mapping[str, str] = field(default_factory=dict)
    label: str = ""
    edit: Edit = unchanged
    declares: Mapping[str, Any] = field(default_factory=dict)
    adapters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Workaround:
    """A remedy of one artifact.

    Attributes
    ----------
    name : as on the command line.
    artifact_class : the class of the paper's table that it serves.
    claim : what it does, in one sentence.
    cites : where it is described.
    reduces : names of the findings that it must reduce.
    before, after : the scene without the workaround and with it.
    caveat : its limit, in one sentence.
    limits : settings that show the caveat: each leaves, or brings, more than ``after`` does.
    """

    name: str
    artifact_class: str
    claim: str
    cites: str
    reduces: tuple[str, ...]
    before: Setting
    after: Setting
    caveat: str
    limits: tuple[Setting, ...] = ()

    @property
    def settings(self) -> tuple[Setting, ...]:
        return (self.before, self.after, *self.limits)


def workarounds() -> Iterator[Workaround]:
    """Every workaround: the files of this folder that define ``WORKAROUNDS``."""
    for module in pkgutil.iter_modules(notabug.references.workarounds.__path__):
        if module.name != "workaround":
            yield from importlib.import_module(f"notabug.references.workarounds.{module.name}").WORKAROUNDS
