"""why: the pixel is checked before anything is computed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.picture import write_exr
from notabug.why import parse_pixel


@pytest.mark.parametrize("text", ["", "1", "1,", ",1", "a,b", "-1,2", "1,2,3", "1.5,2", "256,0", "0,128"])
def test_what_is_no_pixel_of_the_picture(text: str) -> None:
    with pytest.raises(SelectionError, match="--pixel"):
        parse_pixel(text, 256, 128)


def test_the_last_pixel() -> None:
    assert parse_pixel("255, 127", 256, 128) == (255, 127)


def test_a_wrong_pixel_is_a_usage_error(door: Any) -> None:
    write_exr(door.out.parent / "a.exr", np.zeros((4, 4, 3)))
    assert door("why", "a.exr", "--scene", "terminator/sphere", "--pixel", "4,0") == 2
    assert "below 4,4" in door.stderr
