"""Which channels of a file are the picture."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from notabug.scenes_usd.picture_layers import choose, layers_of


class Part:
    """A part's header."""

    def __init__(self, name: str, channels: str) -> None:
        self.name, self.channelnames = name, channels.split()

    def getattribute(self, name: str) -> str | None:
        assert name == "oiio:subimagename"
        return self.name or None


@pytest.mark.parametrize(
    ("parts", "wanted", "label", "colours"),
    [
        ([("", "R G B")], "", "", (0, 1, 2)),
        ([("", "A B G R")], "", "", (3, 2, 1)),
        ([("", "B G R Z")], "", "", (2, 1, 0)),
        ([("", "Y")], "", "", (0,)),
        ([("", "Y A")], "", "", (0,)),
        ([("", "A.R A.G A.B R G B")], "", "", (3, 4, 5)),
        ([("", "V.Combined.R V.Combined.G V.Combined.B V.Depth.Z")], "", "V.Combined", (0, 1, 2)),
        ([("", "D.R D.G D.B BEAUTY.r BEAUTY.g BEAUTY.b")], "", "BEAUTY", (3, 4, 5)),
        ([("", "D.R D.G D.B E.R E.G E.B")], "E", "E", (3, 4, 5)),
        ([("", "D.R D.G D.B E.R E.G E.B")], "e", "E", (3, 4, 5)),
        ([("z", "Z"), ("rgba", "R G B A")], "", "rgba", (0, 1, 2)),
        ([("", "Z"), ("", "R G B")], "", "part1", (0, 1, 2)),
        ([("albedo", "R G B"), ("beauty", "R G B")], "", "beauty", (0, 1, 2)),
        ([("albedo", "R G B"), ("beauty", "beauty.R beauty.G beauty.B")], "", "beauty.beauty", (0, 1, 2)),
        ([("albedo", "R G B"), ("main", "R G B")], "main", "main", (0, 1, 2)),
        ([("N", "N.X N.Y N.Z"), ("C", "C.R C.G C.B")], "", "C.C", (0, 1, 2)),
    ],
)
def test_the_picture(parts: Sequence[tuple[str, str]], wanted: str, label: str, colours: tuple[int, ...]) -> None:
    found = choose(layers_of([Part(*each) for each in parts]), wanted)
    assert found is not None
    assert (found.label, found.colours) == (label, colours)


@pytest.mark.parametrize(
    ("parts", "wanted"),
    [
        ([("", "Z")], ""),
        ([("", "A")], ""),
        ([("", "depth")], ""),
        ([("", "X Y Z")], ""),
        ([("", "Y RY BY")], ""),
        ([("", "R G")], ""),
        ([("", "N.X N.Y N.Z")], "N"),
        ([("", "D.R D.G D.B E.R E.G E.B")], ""),
        ([("", "A.Combined.R A.Combined.G A.Combined.B B.Combined.R B.Combined.G B.Combined.B")], ""),
        ([("left", "R G B"), ("right", "R G B")], ""),
        ([("albedo", "R G B"), ("main", "R G B")], "other"),
        ([("", "R G B")], "beauty"),
    ],
)
def test_no_picture_or_more_than_one(parts: Sequence[tuple[str, str]], wanted: str) -> None:
    assert choose(layers_of([Part(*each) for each in parts]), wanted) is None
