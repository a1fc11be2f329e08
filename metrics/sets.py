"""Step 6 of docs/judge.md, what explains it: the models that may, and the sets of them that are tried."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from notabug.adapters.base import Declaration
from notabug.metrics.quick import choices
from notabug.references.models.model import Model


def habits(models: Sequence[Model]) -> tuple[Model, ...]:
    """Those of ``models`` that are choices whose feature has one value: a renderer has all of them at once."""
    features = [model.when[0] for model in models if model.when]
    return tuple(model for model in choices(models) if model.when and features.count(model.when[0]) == 1)


def candidates(models: Sequence[Model], together: tuple[Model, ...], size: int) -> Iterator[tuple[Model, ...]]:
    """Sets of ``size`` of ``models``; two values of one feature (a quad's diagonals) exclude each other.

    The models ``together`` count as one, which beside others is the likeliest.
    """
    single: list[tuple[Model, ...]] = [(model,) for model in models]
    block = [together] if len(together) > 1 else []
    for some in combinations(single + block if size < 2 else block + single, size):
        chosen = tuple(model for unit in some for model in unit)
        features = [model.when[0] for model in chosen if model.when]
        if len(set(features)) == len(features):
            yield chosen


def admitted(models: Sequence[Model], declaration: Declaration) -> tuple[Model, ...]:
    """The limitations and conventions that ``declaration`` leaves open; ``unknown`` features leave all open.

    What a declaration makes the same, an epsilon that two of them suppose otherwise, is tried once.
    """
    found: dict[object, Model] = {}
    for model in models:
        if model.kind != "fault" and model.open_to(declaration):
            said = model.under(declaration)
            switches = repr((said.options, said.others))
            found.setdefault((said.name, said.edit, said.edits, said.when, said.also, switches), said)
    return tuple(found.values())


def stated_conventions(models: Sequence[Model], declaration: Declaration) -> tuple[Model, ...]:
    """Those of ``models`` that are conventions and that ``declaration`` says the renderer has."""
    return tuple(
        model
        for model in choices(models)
        if model.kind == "convention"
        and model.conditions
        and all(declaration.says(field) == value for field, value in model.conditions)
    )
