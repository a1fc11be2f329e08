"""run.json and result.json of unknown making: a result, or a clear error; hostile names stay inside the run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from notabug.metrics.verdict import Finding, Leg, Verdict
from notabug.record import RecordError, Result
from notabug.report.page import draw
from notabug.scenes_usd.errors import NotabugError

FINDING = Finding("bug", "flat_normals", 4.0, (0, 0, 2, 2), message="why")
GOOD = Result(
    "a/b", "s=1", "grey", "1", Verdict("bug", (FINDING,), {"limitation": Leg(), "bug": Leg(3, 0.1)})
).as_dict()
VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-9, 9)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=4,
)


def damaged(data: st.DataObject) -> dict[str, Any]:
    """A good result with one to three of its values, at any depth, replaced or lost."""
    document: dict[str, Any] = json.loads(json.dumps(GOOD))
    for _ in range(data.draw(st.integers(1, 3))):
        place: Any = document
        while True:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            key = data.draw(st.sampled_from(keys))
            if isinstance(place[key], dict | list) and place[key] and data.draw(st.booleans()):
                place = place[key]
                continue
            if isinstance(place, dict) and data.draw(st.booleans()) and len(place) > 1:
                del place[key]
            else:
                place[key] = data.draw(VALUES)
            break
    return document


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_a_damaged_result_is_a_result_or_a_clear_error(data: st.DataObject) -> None:
    document = damaged(data)
    try:
        back = Result.from_dict(document)
    except RecordError:
        return
    json.dumps(back.as_dict(), allow_nan=False)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_run_is_drawn_or_refused(data: st.DataObject, tmp_path: Path) -> None:
    document = {"schema": 1, "tool": {}, "command": [], "seconds": {}, "renderers": {}, "calibration": []}
    document["results"] = [GOOD, damaged(data)]
    (tmp_path / "run.json").write_text(json.dumps(document))
    try:
        draw(tmp_path)
    except NotabugError:
        return
    assert "<script>alert" not in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize("name", ['a"b', "<script>alert(1)</script>", "..usda", "new\nline", "$(touch x)", "-r"])
def test_a_scene_of_any_name_is_run_inside_the_folder(door: Any, tmp_path: Path, name: str) -> None:
    from notabug.scenes_usd.reader import find

    folder = tmp_path / "scenes"
    folder.mkdir()
    path = folder / f"{name.replace('/', '_')}.usda"
    path.write_text(find("calibration/plain_card").read_text())
    assert door.run(str(path)) == 0
    assert {each.name for each in tmp_path.iterdir()} <= {"scenes", "out"}
    assert {each.name for each in folder.iterdir()} == {path.name}
    page = (door.out / "report.html").read_text()
    assert "<script>alert" not in page
    (result,) = json.loads((door.out / "run.json").read_text())["results"]
    assert result["scene"] == path.stem
