"""judge: what is taken from the options and what from the files."""

from __future__ import annotations

from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from typer.testing import CliRunner

from notabug.adapters.declared import SRGB_SLOPE, decode_srgb
from notabug.cli import app
from notabug.judging import declare
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.picture import Picture, write_exr


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
    with mock.patch("notabug.judging.judge_pictures", side_effect=SelectionError("enough seen")) as judged:
        CliRunner().invoke(app, ["judge", str(path), "--scene", "terminator/sphere", *words])
    assert judged.call_args.args[2].samples == samples
