"""Every number that decides stands in metrics/policy/, says what it is, and is read."""

from __future__ import annotations

import re
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import pytest

from notabug.bench.verdict import numbers
from notabug.metrics.policy import POLICY, Policy, entries, flat, value_of, with_value
from notabug.metrics.policy.number import KINDS, number

STEPS = dict(
    re.findall(
        r"^\| \[(\d+)\]\(#[^)]*\) \|[^|]*\| ([^|]*) \|$",
        (Path(__file__).parents[2] / "docs/judge.md").read_text(),
        re.M,
    )
)


def test_no_number_that_decides_stands_elsewhere_in_metrics() -> None:
    assert numbers.stray() == {}, "move them to metrics/policy/"


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("LIMIT = 0.7\n", ["quick.LIMIT"]),
        ("A, B = 4, (0.1, 7)\n", ["quick.A", "quick.B"]),
        ("def near(x: float) -> bool:\n    return x < 0.07\n", ["quick: 0.07"]),
        ("class Near:\n    far: float = 12.0\n", ["quick: 12"]),
        ("def near(x: float) -> float:\n    return 0.5 * x + 1e-30\n", []),
        ("from notabug.metrics.policy import POLICY\nLIMIT = POLICY.quick.nearer\n", []),
        ("from notabug.metrics.policy import POLICY\nLIMIT = 0.7 * POLICY.quick.nearer\n", ["quick: 0.7"]),
    ],
)
def test_a_number_in_the_code_is_found(
    code: str, expected: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "quick.py").write_text(code)
    names: dict[str, object] = {}
    exec(code, names)  # what the module would hold
    monkeypatch.setattr(numbers, "FOLDER", tmp_path)
    monkeypatch.setattr(numbers.importlib, "import_module", lambda _: type("module", (), names))
    assert sorted(numbers.stray()) == expected


def test_every_number_is_read() -> None:
    assert numbers.unread() == []


def test_every_group_is_a_file_of_its_step() -> None:
    """``regression`` alone is of several files."""
    for group in fields(Policy):
        step = re.match(r"Step (\d+)", group.metadata["step"])
        if step is not None and group.name != "regression":
            assert f"`{group.name}.py`" in STEPS[step[1]], group.name


def test_every_number_says_what_it_is() -> None:
    for entry in entries():
        said = entry.said
        assert (said.unit and len(said.meaning) > 5) or said.decides == "nothing", entry
        assert re.split("[:;]", said.source)[0] in KINDS, entry
        assert said.source.split(":")[0] == "convention" or len(said.source) > 10, f"{entry.name}: from what?"


def test_a_number_without_a_source_is_refused() -> None:
    with pytest.raises(ValueError, match="a source begins with"):
        number(1.0, "pixels", "what it is", "I think so", "word")


def test_another_value_leaves_the_policy_as_it_is() -> None:
    other = with_value(POLICY, "admissible.edge", 0.3)
    assert (value_of(other, "admissible.edge"), value_of(POLICY, "admissible.edge")) == (0.3, 0.19)
    assert other.admissible.grid == POLICY.admissible.grid
    assert {name for name, value in flat(other).items() if flat().get(name) != value} == {"admissible.edge"}
    with pytest.raises(FrozenInstanceError):
        POLICY.admissible.edge = 0.3  # type: ignore[misc]


@pytest.mark.parametrize("name", ["admissible.gone", "nowhere.edge", "edge", ""])
def test_a_number_that_is_not_there_has_no_value(name: str) -> None:
    with pytest.raises((AttributeError, TypeError)):
        with_value(POLICY, name, 1.0)


def test_the_flat_form_holds_each_number_by_itself() -> None:
    values = flat()
    assert all(isinstance(value, int | float) for value in values.values())
    assert [values[f"likely.steps.{place}"] for place in range(2)] == list(POLICY.likely.steps)
    assert values["references.models.visibility.FLOAT.float32"] > values["references.models.visibility.FLOAT.float64"]
    assert len(values) > len(entries())
