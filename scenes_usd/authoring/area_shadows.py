"""What all scenes of area shadows have: the size of their pictures, and a light that is as bright at every size."""

from __future__ import annotations

from notabug.scenes_usd.authoring.stage import Row, placed
from notabug.scenes_usd.authoring.usda import indent, number

SIZE = (64, 64)  # small, since every pixel asks each light from 55 directions a sample
CITES = (
    "Cook, Porter and Carpenter 1984, Distributed ray tracing; Nishita and Nakamae 1983, Half-tone representation of "
    "3-D objects illuminated by area sources; POV-Ray 3.7 documentation, area_light"
)


def area_light(kind: str, place: Row, turn: Row, power: float, lines: str = "") -> str:
    """/Scene/Lamp, a ``kind`` of light, turned by ``turn`` and moved to ``place``.

    Its radiance times its area is ``power``; ``lines`` say how large it is.
    """
    size = indent(f"{lines}\n") if lines else ""
    return (
        f'def {kind}Light "Lamp"\n{{\n'
        f"    float inputs:intensity = {number(power)}\n"
        "    bool inputs:normalize = 1\n"
        f"{size}"
        f"{indent(placed(place, turn))}"
        "}"
    )
