"""What an error says in the place of a name that does not exist."""

from __future__ import annotations

import pytest

from notabug.adapters.config import ConfigError, Table
from notabug.adapters.registry import adapter
from notabug.runs.selection import choose
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.nearest import instead_of
from notabug.scenes_usd.reader import read_scene

MANY = ("acne", "mirror", "phong", "separation", "terminator", "texture", "visibility")


@pytest.mark.parametrize(
    ("word", "known", "expected", "do"),
    [
        ("terminater", MANY, "", "did you mean 'terminator'?"),
        ("Phong", MANY, "", "did you mean 'phong'?"),
        ("mirorr", ("mirror", "acne"), "one of mirror, acne", "did you mean 'mirror'?"),
        ("kitchen", MANY, f"one of {', '.join(MANY)}", ""),
        ("kitchen", (*MANY, *MANY), f"one of {', '.join(MANY)}", ""),
        ("", (), "", ""),
    ],
)
def test_a_slip_is_told_by_the_name_that_was_meant(word: str, known: tuple[str, ...], expected: str, do: str) -> None:
    assert instead_of(word, known) == (expected, do)


def test_an_error_on_a_slip_fits_a_line_or_two_wherever_a_name_is_given() -> None:
    def message(error: type[Exception], act: object) -> str:
        assert callable(act)
        with pytest.raises(error) as raised:
            act()
        return str(raised.value)

    told = {
        "terminator/sphere": message(SelectionError, lambda: choose(["terminater/sphere"], {})),
        "visibility": message(SelectionError, lambda: choose(["visiblity"], {})),
        "texture/uneven_quad": message(SelectionError, lambda: read_scene("texture/uneven_quat")),
        "povray": message(SelectionError, lambda: adapter("povrai")),
        "silhouette": message(
            ConfigError,
            lambda: Table({"silouette": "flip"}, "renderers.a", None).check_keys([*MANY, "silhouette"]),  # type: ignore[arg-type]
        ),
    }
    for meant, said in told.items():
        assert f"did you mean {meant!r}?" in said
        assert len(said) < 160, said
