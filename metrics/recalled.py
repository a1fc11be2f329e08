"""Beside the steps of docs/judge.md: what a verdict names, made again at the strength that it has fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.causes import Cause, cause_called, without_border
from notabug.metrics.channels import largest
from notabug.metrics.quick import Predict, choices
from notabug.metrics.verdict import Finding
from notabug.references.models.camera import unlisted
from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Recalled:
    """What a finding names: a ``model``, or a ``cause`` in the whole picture, with the limitations ``beside`` it."""

    model: Model | None
    cause: Cause | None
    beside: tuple[Model, ...] = ()

    @property
    def name(self) -> str:
        if self.model is not None:
            return self.model.name
        return "" if self.cause is None else self.cause.name

    @property
    def kind(self) -> str:
        return "fault" if self.model is None else self.model.kind

    @property
    def claim(self) -> str:
        if self.model is not None:
            return self.model.claim
        return "" if self.cause is None else self.cause.message

    @property
    def chosen(self) -> tuple[Model, ...]:
        """The models by which a quick picture of it is drawn, a cause in the whole picture aside."""
        return (*(() if self.model is None else (self.model,)), *choices(self.beside))

    def admits(self, predicted: Predict, mean: Floats) -> Admissible:
        """What it admits of the picture ``mean`` (h, w, 3); limitations beside it that are no choice, all they may."""
        found = predicted(self.chosen)
        lo, hi = found.lo, found.hi
        for limitation in self.beside:
            if limitation not in self.chosen:
                for value in limitation.values():
                    other = predicted((*self.chosen, value))
                    lo, hi = np.minimum(lo, other.lo), np.maximum(hi, other.hi)
        found = replace(found, lo=lo, hi=hi)
        if self.cause is not None:
            return self.cause.under(found)
        if self.model is not None and self.model.moves:
            right, down = self.model.moves
            return without_border(found, mean, right, down)
        return found


def recalled(
    findings: Sequence[Finding], known: Sequence[Model], scene: Scene, predicted: Predict, mean: Floats
) -> Iterator[Recalled]:
    """What each of ``findings`` on the picture ``mean`` (h, w, 3) names: of a bug the fault at its own strength.

    ``known`` are the models of the ``scene``, and ``predicted`` says what they admit. A bug without a name is left out:
    none of them is what it names, and no cause in the whole picture.
    """
    models = [(finding, _model_of(finding, known, scene, predicted, mean)) for finding in findings]
    beside = tuple(model for finding, model in models if finding.kind != "bug" and model is not None)
    for finding, model in models:
        others = beside if finding.kind == "bug" else ()
        if model is not None:
            yield Recalled(model, None, others)
            continue
        cause = cause_called(finding.name, finding.strengths, mean) if finding.kind == "bug" else None
        if cause is not None:
            yield Recalled(None, cause, others)


def _model_of(finding: Finding, known: Sequence[Model], scene: Scene, predicted: Predict, mean: Floats) -> Model | None:
    """The one of ``known`` that ``finding`` names, at its strengths: the one that says the same."""
    found = []
    for model in (*known, *unlisted(scene)):
        if model.name != finding.name:
            continue
        if model.placed is not None:  # it lies where the picture is wrong
            to = predicted(())
            there = model.placed(largest(np.abs(residual(mean, to)) - to.tau) > 0)
            return there or model
        again = made_again(model, finding.strengths)
        if finding.message.startswith(again.claim):  # what is not declared, or looks alike, is said behind it
            found.append(again)
    return max(found, key=lambda model: len(model.claim), default=None)


def made_again(model: Model, strengths: tuple[float, ...]) -> Model:
    """``model`` at ``strengths``: one along its own axis, or as many as it has axes along all of them."""
    if len(strengths) == 1 and model.at is not None:
        return replace(model.at(strengths[0]), at=model.at, strength=strengths[0], neutral=model.neutral)
    if strengths and len(strengths) == model.axes and model.jointly is not None:
        return replace(model.jointly(np.array(strengths)), strengths=strengths)
    return model
