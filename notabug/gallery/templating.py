"""templating: the one set of templates from which the gallery and a run's report are drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from notabug import __version__
from notabug.metrics.verdict import GLYPH
from notabug.results.wording import STYLE, number, readable

if TYPE_CHECKING:
    import jinja2

    from notabug.references.models.model import Rule

RULES: dict[Rule, str] = {
    "choice": "I = R or I = M, whole",
    "partial": "I = R + α (M − R), 0 ≤ α ≤ 1 in each pixel",
    "set": "each sample takes R or one of M₁, M₂ …",
    "hull": "I lies between the least and the greatest of R, M₁, M₂ … in each channel",
    "any": "I is anything where it acts",
}


def environment() -> jinja2.Environment:
    """Templates that escape whatever they are given; those of the report extend the gallery's."""
    import jinja2

    made = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [jinja2.PackageLoader("notabug.gallery", "templates"), jinja2.PackageLoader("notabug", "report")]
        ),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {"number": number, "readable": readable}
    made.globals |= {"glyphs": GLYPH, "words": list(STYLE), "rules": RULES, "version": __version__}
    return made
