"""judge: what is taken from the options and what from the files."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from typer.testing import CliRunner

from notabug.adapters import declared
from notabug.adapters.base import Declaration
from notabug.adapters.config import ConfigError
from notabug.adapters.declared import SRGB_SLOPE
from notabug.cli import app
from notabug.commands.judge import declare
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.picture import Picture, write_exr
from notabug.scenes_usd.srgb import decode_srgb


def picture(quantum: float, relative: bool = False) -> Picture:
    return Picture(np.zeros((1, 1, 3), np.float32), 3, quantum, relative, {})


def test_srgb_decoding() -> None:
    """IEC 61966-2-1: 0.5 decodes to 0.214041, 0.04045 to 0.0031308; the ends stay."""
    decoded = decode_srgb(np.array([0.0, 0.04045, 0.5, 1.0, -0.5]))
    assert decoded == pytest.approx([0.0, 0.0031308, 0.214041, 1.0, -0.214041], rel=1e-5)
    step = 1e-4
    assert (decode_srgb(np.array([1.0]))[0] - decode_srgb(np.array([1.0 - step]))[0]) / step == pytest.approx(
        SRGB_SLOPE, rel=1e-2
    )


def test_the_coarsest_file_sets_the_quantum() -> None:
    both = [picture(2.0**-24, True), picture(1 / 255)]
    found = declare(both, "box", None, "float64", srgb=False, noisy=None)
    assert (found.quantum, found.relative_quantum) == (1 / 255, False)
    assert (found.precision, found.filter, found.radius) == ("float64", "box", 0.5)
    assert found.noisy
    assert declare(both, "box", 2.5, "float32", srgb=True, noisy=False).quantum == pytest.approx(SRGB_SLOPE / 255)


def test_one_picture_is_not_noisy_unless_declared() -> None:
    assert not declare([picture(1.0)], "point", None, "float32", srgb=False, noisy=None).noisy
    assert declare([picture(1.0)], "point", None, "float32", srgb=False, noisy=True).noisy


@pytest.mark.parametrize(("words", "samples"), [([], 0), (["--samples", "16"], 16)])
def test_samples_are_taken_at_the_files_word(tmp_path: Path, words: list[str], samples: int) -> None:
    path = tmp_path / "picture.exr"
    write_exr(path, np.full((256, 256, 3), 0.1, np.float32))
    with mock.patch("notabug.commands.judge.judge_pictures", side_effect=SelectionError("enough seen")) as judged:
        CliRunner().invoke(app, ["judge", str(path), "--scene", "terminator/sphere", *words])
    assert judged.call_args.args[2].samples == samples


# --- declarations -------------------------------------------------------------------------------------------------


def test_what_is_not_said_of_a_picture_is_unknown() -> None:
    found = declare([picture(1.0)], "point", None, "float32", srgb=False, noisy=None)
    differ = {"interpolation", "depth", "ngon_split", "lobe", "normalised", "highlight", "silhouette", "coincident"}
    differ |= {"bounces", "bounces_count", "crossings", "epsilon", "shadows", "coordinates", "sphere_roots"}
    differ |= {"texture_filter", "opacity_shadow", "glass_shadow", "total_reflection", "glass_side", "gouraud_shadows"}
    assert {each for each in differ if found.says(each) != "unknown"} == set()
    assert found.resolves == "unknown"


@pytest.mark.parametrize(
    ("word", "field", "value"),
    [
        ("interpolation=gouraud", "interpolation", "gouraud"),
        ("depth=fixed16", "depth", "fixed16"),
        ("depth=", "depth", ""),
        ("ngon_split=13", "ngon_split", "13"),
        ("bounces=3", "bounces", 3),
        ("bounces=unknown", "bounces", -1),
        ("epsilon=1e-3", "epsilon", 1e-3),
        ("noisy=true", "noisy", True),
        ("filter=tent", "radius", 1.0),
        ("precision=float64", "hit_error", 8 * 2.0**-53),
        ("shadows=none", "shadows", "none"),
    ],
)
def test_everything_can_be_declared_of_a_picture(word: str, field: str, value: object) -> None:
    found = declare([picture(1.0)], "unknown", None, "float32", srgb=False, noisy=None, said=declared.said([word]))
    assert getattr(found, field) == value


@pytest.mark.parametrize(
    "word",
    [
        *("interpolation", "interpolation=cubic", "bounces=9", "bounces=2.5", "noisy=perhaps", "interpolatoin=flat"),
        *("epsilon=nan", "relative_quantum=yes", "epsilon=much"),
    ],
)
def test_a_declaration_that_cannot_be_is_refused(word: str) -> None:
    with pytest.raises(ConfigError, match="--declare"):
        declared.said([word])


@pytest.mark.parametrize("command", [["judge"], ["why", "--pixel", "1,1"]])
def test_declarations_reach_the_judge(tmp_path: Path, command: list[str]) -> None:
    path = tmp_path / "picture.exr"
    write_exr(path, np.full((256, 256, 3), 0.1, np.float32))
    words = ["--scene", "terminator/sphere", "--declare", "interpolation=flat", "--declare", "bounces=2"]
    where = "notabug.commands.judge.judge_pictures" if command == ["judge"] else "notabug.commands.why.explain_pixel"
    with mock.patch(where, side_effect=SelectionError("enough seen")) as judged:
        CliRunner().invoke(app, [command[0], str(path), *command[1:], *words])
    given = judged.call_args.args[2]
    assert (given.interpolation, given.bounces) == ("flat", 2)


def test_the_list_of_declarations_is_whole() -> None:
    rows = {each["key"]: each for each in declared.declarations()}
    derived = {"relative_quantum", "shared_exponent"}
    assert set(rows) == {each.name for each in fields(Declaration)} - derived
    assert all(each["values"] and each["meaning"] and each["default"] for each in rows.values())
    assert rows["interpolation"]["values"].split() == ["phong", "gouraud", "flat", "unknown"]
    page = (Path(__file__).parents[2] / "docs" / "your-renderer.md").read_text("utf-8")
    assert all(f"`{each}`" in page for each in rows)
