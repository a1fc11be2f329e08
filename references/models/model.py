"""Model: one way a picture can legitimately, or wrongly, come out; a configuration of the in-house renderer."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from types import ModuleType
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

import notabug.references.models
from notabug.scenes_usd.scene import Material, Mesh, Scene

Edit = Callable[[Scene], Scene]
Shows = Literal["anything", "chance", "stripes", "crossing", "dots", "dots_everywhere", "wide"]
UNSAID = "unknown"
"""What a declaration says of a feature that it says nothing of."""
OF_SHADOWS = frozenset({"shadows", "acne", "start", "shadow_rays", "transparent_shadows", "shadow_map", "shadow_lift"})
"""Switches that change nothing, or cannot be meant, where a renderer has no shadows."""
OF_RAYS = frozenset({"acne", "start", "epsilon", "shadow_rays", "retroreflection", "unreversed", "lost_reflection"})
"""Switches of faults that only a renderer can have that follows rays from one surface to the next."""


Rule = Literal["choice", "partial", "set", "hull", "any"]
"""What a model admits of its picture: see step 6 of docs/judge.md."""


class Declared(Protocol):
    """What an adapter declares, as models ask for it."""

    def says(self, feature: str) -> str: ...


def unchanged(scene: Scene) -> Scene:
    """The edit that edits nothing."""
    return scene


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """A limitation, a convention or a fault, as it acts on one scene.

    Attributes
    ----------
    name : what a finding is called.
    kind : ``limitation`` (a legitimate approximation), ``convention`` (a choice where renderers legitimately differ),
        ``fault`` (a coding error).
    rule : what a limitation admits: ``choice`` all or nothing for a whole object, ``partial`` any value between
        reference and limited picture, ``set`` a mixture of listed values, ``hull`` any between the least and the most
        of the listed values. Faults are ``choice``, ``set``, or ``any``:
        whatever it is that a picture shows where the model differs from the reference.
    claim : what happens, in one sentence.
    cites : where it is described.
    edit : how the scene is changed before it is rendered; sees ``Scene.intent`` still in place.
    options : switches of the tracer (fields of ``Options``).
    others : switches of further values that a sample may take under the rule ``set``, besides ``options``.
    edits : edits of further values that bound what the rule ``hull`` admits, besides ``edit``.
    shows : what a picture must show of it besides, or it explains nothing: values that mix by ``chance``, so that one
        nearly everywhere is not it; ``stripes``, half of which are not its own; a ``crossing`` of surfaces; ``dots``
        that change from pixel to pixel, or ``dots_everywhere``; a ``wide`` part of where it acts; or ``anything``.
    sure : switches under which a ``crossing`` acts only where nothing but chance decides. A picture that shows next to
        nothing of that does not show it; beyond, where a resolution is but a bound, it may be as rare as it likes.
    declared : options that are taken from an adapter's declaration, where it states them: from the field of the same
        name, or ``option=field``.
    drawn : switches by which the in-house renderer draws a fault, where they are not ``options``.
    at : the same fault at another strength, for faults that come in all strengths; ``strength`` is this model's, and
        0 (or 1, where ``neutral`` is 1: a factor) would be no fault.
    strengths : of a model that ``jointly`` made, its strength along each axis; of one that ``at`` made the number that
        it was made of, where ``strength`` is not that.
    jointly : the same fault along several axes at once, ``axes`` of them, by its strength (axes,) along each; models of
        single axes share it. Of a model that it made, ``axes`` are those along which it is off.
    local : a fault that may hit some parts of the scene and spare others, so that a picture of it takes this model's
        value at some pixels and the reference's at the others.
    read : a fault in what the renderer reads, whose limitations then act on the wrong number: an exponent's, by which
        highlights are normalised.
    darkened : an edit that takes the light from the part of the scene that this fault says is gone, and nothing else:
        it changes the pixels in which that is seen. None: it says so of no part.
    placed : the fault of those parts of the scene, single faces, that lie where a picture is wrong (h, w), or None
        where it can be none. Such a model edits the likeliest part itself.
    rare : a fault that is told after others that look alike.
    looks_like : the name of a cause in the whole picture that shows the very same in some scenes: both are then told.
    if_black : words that are added to the claim of a fault that takes something away, where that leaves only black.
    number : the number of a verdict that the strength of this fault is, such as ``gain``.
    moves : by how many pixels, to the right and down, it moves the whole picture. At the border it brings in what no
        reference shows.
    when : (field, value) of an adapter's declaration without which the model is not considered; None: always. Of
        models of one field a picture shows one at most.
    also : further such pairs, all of which must hold.
    strict : an unknown field does not let it in: the value must be declared.
    needs : fields, numbers, that an adapter must declare to be more than 0.
    """

    name: str
    kind: Literal["limitation", "convention", "fault"]
    claim: str
    cites: str
    rule: Rule = "choice"
    edit: Edit = unchanged
    options: Mapping[str, Any] = field(default_factory=dict)
    others: tuple[Mapping[str, Any], ...] = ()
    edits: tuple[Edit, ...] = ()
    when: tuple[str, str] | None = None
    also: tuple[tuple[str, str], ...] = ()
    strict: bool = False
    needs: tuple[str, ...] = ()
    shows: Shows = "anything"
    sure: Mapping[str, Any] | None = None
    declared: tuple[str, ...] = ()
    drawn: Mapping[str, Any] | None = None
    at: Callable[[float], Model] | None = None
    strength: float = 0.0
    neutral: float = 0.0
    strengths: tuple[float, ...] = ()
    jointly: Callable[[npt.NDArray[np.float64]], Model] | None = None
    axes: int = 0
    local: bool = False
    darkened: Edit | None = None
    read: bool = False
    placed: Callable[[npt.NDArray[np.bool_]], Model | None] | None = None
    rare: bool = False
    looks_like: str = ""
    if_black: str = ""
    number: str = ""
    moves: tuple[float, ...] = ()

    def open_to(self, declaration: Declared) -> bool:
        """Whether ``declaration`` leaves this model open: a fault where the renderer can have it at all."""
        if declaration.says("shadows") == "none" and not OF_SHADOWS.isdisjoint(self.options):
            return self.options.get("shadows") == "none" and self.kind != "fault"
        if any(declaration.says(field) == UNSAID or not float(declaration.says(field)) for field in self.needs):
            return False
        open_to = () if self.strict else (UNSAID,)
        return all(declaration.says(field) in (value, *open_to) for field, value in self.conditions)

    @property
    def of_rays(self) -> bool:
        """Whether only a renderer can have it that follows rays from one surface to the next."""
        return not OF_RAYS.isdisjoint(self.options)

    @property
    def made_of(self) -> tuple[float, ...]:
        """The numbers of which ``jointly`` or ``at`` makes this model again; none where it has no strength."""
        return self.strengths or ((self.strength,) if self.strength != self.neutral else ())

    @property
    def conditions(self) -> tuple[tuple[str, str], ...]:
        """Every (field, value) that a declaration must leave open."""
        return (*((self.when,) if self.when else ()), *self.also)

    def hangs_on(self, declaration: Declared) -> tuple[str, ...]:
        """``field=value`` of what this model takes for granted and ``declaration`` says nothing of."""
        if self.strict:
            return ()
        return tuple(f"{name}={value}" for name, value in self.conditions if declaration.says(name) == UNSAID)

    def under(self, declaration: Declared) -> Model:
        """This model with what ``declaration`` states: its numbers, and that there are shadows or none.

        A value that a sample may take without shadows is none of a renderer that casts them.
        """
        stated: dict[str, Any] = {}
        for each in self.declared:
            option, _, name = each.partition("=")
            if declaration.says(name or option) != UNSAID:
                stated[option] = getattr(declaration, name or option)
        if declaration.says("shadows") == "none" and self.kind != "fault":
            stated["shadows"] = "none"
        others = tuple({**other, **stated} for other in self.others)
        if declaration.says("shadows") == "cast" and self.kind != "fault":
            others = tuple({key: x for key, x in other.items() if (key, x) != ("shadows", "none")} for other in others)
        if others == self.others and not stated:
            return self
        return replace(self, options={**self.options, **stated}, others=others)

    def as_drawn(self) -> Model:
        """This model as the in-house renderer draws it."""
        return self if self.drawn is None else replace(self, options=self.drawn)

    def values(self) -> tuple[Model, ...]:
        """One model for each value that a sample may take under the rule ``set``, or that bounds a ``hull``."""
        more = [(self.edit, options) for options in self.others] + [(edit, self.options) for edit in self.edits]
        return (
            self,
            *(
                replace(self, name=f"{self.name}#{index}", edit=edit, options=options, others=(), edits=())
                for index, (edit, options) in enumerate(more, 2)
            ),
        )


def excluded_by(model: Model, beside: tuple[Model, ...]) -> bool:
    """Whether ``model`` is another value of a feature that one of ``beside`` has."""
    return model.when is not None and any(each.when is not None and each.when[0] == model.when[0] for each in beside)


def in_strengths(at: Callable[[float], Model], strength: float, neutral: float = 0.0) -> Model:
    """The fault that ``at`` makes, at ``strength``; it can be made at others."""
    return replace(at(strength), at=at, strength=strength, neutral=neutral)


def edit_meshes(scene: Scene, edit: Callable[[Mesh], Mesh]) -> Scene:
    """The scene with ``edit`` applied to every mesh, the intent's too."""
    return replace(
        scene,
        objects=tuple(edit(shape) if isinstance(shape, Mesh) else shape for shape in scene.objects),
        intent=None if scene.intent is None else edit(scene.intent),
    )


def edit_materials(scene: Scene, edit: Callable[[Material], Material]) -> Scene:
    """The scene with ``edit`` applied to every material."""
    return replace(scene, materials=tuple(edit(material) for material in scene.materials))


def models(scene: Scene) -> Iterator[Model]:
    """Every model that can act on ``scene``, from its content: the files of this folder that define ``models``."""
    for module in load():
        yield from module.models(scene)


@cache
def load() -> tuple[ModuleType, ...]:
    """The files of this folder that define ``models``, imported."""
    found = pkgutil.iter_modules(notabug.references.models.__path__)
    names = [each.name for each in found if each.name != "model"]
    return tuple(importlib.import_module(f"notabug.references.models.{name}") for name in names)
