"""What of surfaces is known before any is refined: the schemes there are, and how near to them faces must be."""

from __future__ import annotations

from typing import Literal, get_args

Scheme = Literal["catmullClark", "loop", "bilinear"]
SCHEMES: tuple[Scheme, ...] = get_args(Scheme)
TOLERANCE = 0.1  # pixels between the faces that are drawn and the surface that they stand for
