"""Step 3 of docs/judge.md, what is admitted: what pictures of one scene are held against, for all who ask.

The judge, `notabug why` and the benches all ask here, so that none calls a pixel wrong which another admits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import Admissible, admissible, reckonable, suspected
from notabug.metrics.image_checks import finite
from notabug.metrics.leeway import leeway
from notabug.metrics.noise import Measured, measure
from notabug.metrics.policy import POLICY
from notabug.metrics.predictions import Predictions
from notabug.references.predict import centre_error, predict
from notabug.references.tracer.envelope import Envelope
from notabug.references.tracer.precision import RELATIVE
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """The reference of a ``scene``, before any picture is looked at.

    ``admitted`` is what its ``envelope`` admits of a renderer with that ``declaration``. ``unsure`` (h, w, 3) is by how
    much the envelope's values at centres may be off, or None where only by rounding.
    """

    scene: Scene
    declaration: Declaration
    tolerance: float
    envelope: Envelope
    unsure: Floats | None
    admitted: Admissible

    def measure(self, pictures: Sequence[Floats]) -> tuple[Measured, Predictions]:
        """What the seeds ``pictures``, each (h, w, 3), agree on, and what models predict for pictures such as they are.

        Pictures that are brighter at the edges of shadows than the reference admits are allowed a renderer's epsilon.
        """
        declared = self.declaration
        samples = declared.samples if declared.filter in ("point", "box") else 0
        measured = measure(pictures, self.admitted.edge, samples)
        admitted, lit = self.admitted, None
        if suspected(measured, self.envelope, admitted, declared):
            lit = leeway(self.scene, self.envelope)
            admitted = admissible(self.envelope, declared, self.tolerance, leeway=lit, unsure=self.unsure)
        predicted = Predictions(self.scene, self.envelope, admitted, declared, self.tolerance, lit, self.unsure)
        return measured, predicted


def expected(scene: Scene, declaration: Declaration, tolerance: float = RELATIVE) -> Expected:
    """What a picture of ``scene`` is held against. Raises NotabugError where the reference is not finite."""
    envelope = predict(scene, ())
    if not reckonable(envelope):
        raise _no_reference(scene, envelope)
    unsure = centre_error(scene, envelope) if declaration.filter == "point" else None
    admitted = admissible(envelope, declaration, tolerance, unsure=unsure)
    return Expected(scene, declaration, tolerance, envelope, unsure, admitted)


def _no_reference(scene: Scene, envelope: Envelope) -> NotabugError:
    sound = np.logical_and.reduce([finite(part).all(axis=2) for part in (envelope.point, envelope.lo, envelope.hi)])
    y, x = (int(place) for place in np.argwhere(~sound)[0])
    return NotabugError(
        f"the reference is not finite in {int((~sound).sum())} pixels, so no picture can be held against it",
        where=f"{scene.id} {scene.variant}".rstrip() + f", pixel ({x}, {y})",
        expected=f"values up to {POLICY.image_checks.largest:g}",
        do="look there for faces without area, lights at a surface, or huge intensities and exponents; if the scene is"
        " sound, report it as a fault of notabug",
    )
