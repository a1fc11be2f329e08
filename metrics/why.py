"""Beside the steps of docs/judge.md: what each model predicts at one pixel, term by term, and which ones fit it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.adapters.spheres import as_given
from notabug.metrics.expected import expected
from notabug.metrics.image_checks import finite, invalid
from notabug.metrics.recalled import Recalled, recalled
from notabug.metrics.telling import doing
from notabug.metrics.verdict import Verdict
from notabug.references.models.model import Model, models
from notabug.references.predict import configured, preview_at
from notabug.references.tracer.probe import Probe, probe
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.scene import Scene

RGB = tuple[float, float, float]
LEAVES_LITTLE = 0.1  # of what is off, that the verdict's own name may leave and still be told first: a rough strength
ENOUGH = 5  # explanations that fit, where not all are asked for
KINDS = ("convention", "limitation", "fault")  # of explanations that fit, legitimate ones come first


@dataclass(frozen=True, slots=True)
class Prediction:
    """One model at one pixel: its value, the interval it admits, the tolerance, and whether the found value fits.

    ``alpha`` is where the found value lies between the reference (0) and this model (1); None where both are the same.
    ``probe`` tells the terms at the pixel's centre.
    """

    name: str
    kind: str
    claim: str
    value: RGB
    lo: RGB
    hi: RGB
    tolerance: float
    fits: bool
    alpha: float | None
    probe: Probe
    told: bool = False  # the verdict on the whole picture names it, and it is at the strength that the verdict fitted
    beside: tuple[str, ...] = ()  # limitations that the verdict finds beside it, and that are in its values


@dataclass(frozen=True, slots=True)
class PixelExplanation:
    """Every model's prediction for the pixel (x, y), the reference first."""

    x: int
    y: int
    found: RGB
    predictions: tuple[Prediction, ...]
    others: tuple[str, ...] = ()  # models that are farther off at the pixels' centres, and were not looked at closer
    idle: tuple[str, ...] = ()  # models that change nothing here
    bug: str = ""  # what the verdict on the whole picture says of its bug
    worst: tuple[int, ...] = ()  # the bug's worst pixel

    def as_dict(self) -> dict[str, object]:
        return {name: _finite(part) for name, part in asdict(self).items()}

    def ranked(self) -> tuple[Prediction, ...]:
        """The models that change something here, best first: those that fit, by how near their own value is.

        Many fit one pixel: those that the verdict on the whole picture names come first of them, its bug before what
        is beside it, even where its strength leaves a little. Of equally near ones the legitimate come before faults;
        what is alike in name and value is there once.
        """
        reference = self.predictions[0]
        acting = [each for each in self.predictions[1:] if each.probe != reference.probe or each.alpha is not None]
        little = LEAVES_LITTLE * _off(self.found, reference)
        once = {(each.name, each.value): each for each in reversed(acting)}.values()
        return tuple(
            sorted(
                once,
                key=lambda each: (
                    not (each.told and (each.fits or _off(self.found, each) < little)),
                    not each.fits,
                    each.told and each.kind != "fault",
                    _off(self.found, each),
                    self._from(each),
                    KINDS.index(each.kind),
                ),
            )
        )

    def _from(self, each: Prediction) -> float:
        """How far the found value is from the model's own, in whole steps of its tolerance."""
        return math.floor(math.dist(self.found, each.value) / max(each.tolerance, 1e-12))

    def as_text(self, most: int | None = None) -> str:
        """The reference with its terms, then the ``most`` best models, each with what it changes; None: all of them."""
        reference = self.predictions[0]
        ranked = self.ranked()
        first = ranked[:most]
        shown = (
            *first,
            *(each for each in ranked[len(first) :] if each.told),
        )  # what the verdict says is never left out
        lines = [f"pixel ({self.x}, {self.y}): found {_show(self.found)}", ""]
        lines += [_headline(self.found, reference), *_edge(reference), *_terms(reference.probe)]
        if reference.fits:
            lines.append("  nothing is wrong with this pixel")
            if self.bug:
                lines.append(f"  the verdict on the whole picture is a bug: {self.bug}")
            if self.worst and self.worst != (self.x, self.y):
                lines.append(f"  its worst pixel is another one: --pixel {self.worst[0]},{self.worst[1]}")
        for each in shown:
            lines += ["", f"{ranked.index(each) + 1}. {_headline(self.found, each)}", f"  {each.claim}"]
            if each.told:
                lines.append(f"  so says the verdict on the whole picture{_besides(each)}")
            if each.alpha is not None:
                part = f"{each.alpha:.0%} of" if 0.0 <= round(each.alpha, 2) <= 1.0 else f"{each.alpha:.3g} times"
                lines.append(f"  the picture shows {part} what this model changes here")
            lines += _edge(each)
            usual = set(_terms(reference.probe))
            lines += [line for line in _terms(each.probe) if line not in usual]
        closing = self._all(ranked) if most is None else self._left_out(ranked, shown)
        return "\n".join([*lines, "", closing] if closing else lines)

    def _idle(self, ranked: Sequence[Prediction]) -> list[str]:
        """The models that change nothing here, by name."""
        known = {each.name for each in ranked}
        return [*self.idle, *(each.name for each in self.predictions[1:] if each.name not in known)]

    def _all(self, ranked: Sequence[Prediction]) -> str:
        """The last line where every model is shown that changes something."""
        same = self._idle(ranked)
        return f"models of this scene that change nothing at this pixel: {', '.join(same)}" if same else ""

    def _left_out(self, ranked: Sequence[Prediction], shown: Sequence[Prediction]) -> str:
        """The last line where the best are shown: how many models there are besides, and how to see them."""
        left = [each for each in ranked if each not in shown]
        fitting = sum(each.fits for each in left)
        same = len(self._idle(ranked))
        parts = []
        if left:
            none = "it does not fit" if len(left) == 1 else "none of them fits"
            parts.append(f"{len(left)} that change this pixel ({f'{fitting} of them fit' if fitting else none})")
        if self.others:
            parts.append(f"{len(self.others)} that looked farther off, at the pixel's centre")
        if same:
            parts.append(f"{same} that change nothing here")
        if not parts:
            return ""
        *first, last = parts
        models = f"{', '.join(first)} and {last}" if first else last
        return f"not shown of this scene's models: {models}; --verbose shows them all"


def explain_pixel(
    pixels: npt.NDArray[np.floating],
    scene: Scene,
    declaration: Declaration,
    x: int,
    y: int,
    *,
    closest: int | None = None,
    verdict: Verdict | None = None,
) -> PixelExplanation:
    """Compare the value of ``pixels`` (h, w, 3) at (x, y), y down, with every model of ``scene``.

    ``closest``: with so many models only, those that come nearest at the centres of the pixel and its neighbours, and
    with none where the pixel is right, until ENOUGH fit. A whole picture of each costs a second or so, a few centres
    cost nothing. A model whose edge only touches the pixel may be missed. What the ``verdict`` on the whole picture
    names is looked at first, at the strength that the verdict fitted, and is told first of those that fit.
    """
    scene = as_given(scene, declaration)
    wrong = invalid([np.nan_to_num(pixels)], scene.height, scene.width)
    if wrong is not None and wrong.name in ("wrong_size", "wrong_channels"):
        raise NotabugError(wrong.message, where="picture", do="give the picture of this scene")
    found = np.asarray(pixels[y, x], np.float64)
    made: list[Prediction] = []
    reference = Model("reference", "convention", "what the intended model gives", "")
    _, predicted = expected(scene, declaration).measure([np.where(finite(pixels), pixels, 0.0)])
    to = right_here = predicted(())
    right = bool((np.abs(found - np.clip(found, to.lo[y, x], to.hi[y, x])) <= to.tau[y, x]).all())
    known = [] if right and closest is not None else [each.under(declaration) for each in models(scene)]
    findings = () if verdict is None else verdict.findings
    told = list(recalled(findings, known, scene, predicted, pixels)) if known else []
    known = [each for each in known if not any(_same_fault(each, other) for other in told)]
    acting, others, idle = _sifted(scene, known, found, x, y, closest)
    first = Recalled(reference, None)
    for place, each in enumerate((first, *told, *(Recalled(model, None) for model in acting))):
        untold = place > len(told)
        if closest is not None and untold and sum(one.fits for one in made[1:]) >= ENOUGH:
            others += tuple(model.name for model in acting[place - 1 - len(told) :])
            break
        doing(f"predicts {each.name}")
        to = right_here if each is first else each.admits(predicted, pixels)
        value, lo, hi = (np.asarray(part[y, x], np.float64) for part in (to.value, to.lo, to.hi))
        tolerance = float(to.tau[y, x].max())
        alpha = None
        if made:
            span = value - np.array(made[0].value)
            if float(np.abs(span).max()) > tolerance:
                alpha = float((found - np.array(made[0].value)) @ span / (span @ span))
        off = np.abs(found - np.clip(found, lo, hi))
        drawn, options = configured(scene, () if each is first else each.chosen)
        made.append(
            Prediction(
                name=each.name,
                kind="reference" if each is first else each.kind,
                claim=each.claim,
                value=_rgb(value),
                lo=_rgb(lo),
                hi=_rgb(hi),
                tolerance=tolerance,
                fits=bool((off <= to.tau[y, x]).all()),
                alpha=alpha,
                probe=probe(drawn, options, x + 0.5, y + 0.5),
                told=each in told,
                beside=tuple(model.name for model in each.beside),
            )
        )
    bug = next((finding for finding in findings if finding.kind == "bug"), None)
    said = () if bug is None else (bug.message or bug.name.replace("_", " "), bug.worst)
    return PixelExplanation(x, y, _rgb(found), tuple(made), others, idle, *said)


def _same_fault(model: Model, told: Recalled) -> bool:
    """Whether ``model`` is what the verdict has ``told`` already, or that at a strength which nobody has fitted."""
    if told.model is not None and (model.name, model.claim) == (told.model.name, told.model.claim):
        return True
    return told.kind == "fault" and model.name == told.name and (model.at is not None or model.placed is not None)


def _sifted(
    scene: Scene,
    all_models: list[Model],
    found: npt.NDArray[np.float64],
    x: int,
    y: int,
    closest: int | None,
) -> tuple[list[Model], tuple[str, ...], tuple[str, ...]]:
    """The ``closest`` models, nearest first, the names of those farther off, and of those that change nothing here."""
    if closest is None:
        return all_models, (), ()
    rows = range(max(0, y - 1), min(scene.height, y + 2))
    columns = range(max(0, x - 1), min(scene.width, x + 2))
    at = np.array([row * scene.width + column for row in rows for column in columns], np.intp)
    own = int(np.flatnonzero(at == y * scene.width + x)[0])
    right = preview_at(scene, (), at)
    seen = probe(*configured(scene, ()), x + 0.5, y + 0.5)
    distances: dict[int, tuple[float, float]] = {}  # at the pixel's centre, and from all that it may hold of edges
    idle = []
    for place, model in enumerate(all_models):
        drawn = preview_at(scene, (model,), at)
        if np.array_equal(drawn, right) and probe(*configured(scene, (model,)), x + 0.5, y + 0.5) == seen:
            idle.append(model.name)
            continue
        # where an edge crosses the pixel it holds some of what its neighbours show: the found value may lie between
        between = float(np.abs(found - np.clip(found, drawn.min(axis=0), drawn.max(axis=0))).max())
        distances[place] = (float(np.abs(found - drawn[own]).max()), between)
    by_centre = sorted(distances, key=lambda place: distances[place])
    by_edge = sorted(distances, key=lambda place: distances[place][::-1])
    taken = list(dict.fromkeys(place for pair in zip(by_centre, by_edge, strict=True) for place in pair))[:closest]
    others = tuple(all_models[place].name for place in by_centre if place not in taken)
    return [all_models[place] for place in taken], others, tuple(idle)


def _headline(found: RGB, each: Prediction) -> str:
    verdict = "fits" if each.fits else f"off by {_off(found, each):.3g} (tolerance {each.tolerance:.2g})"
    kind = "" if each.kind == each.name else f" ({each.kind})"
    return f"{each.name}{kind}: {_show(each.value)}  {verdict}"


def _besides(each: Prediction) -> str:
    return f", beside {', '.join(each.beside)}" if each.beside else ""


def _edge(each: Prediction) -> list[str]:
    return [f"  edge: anything from {_show(each.lo)} to {_show(each.hi)} is admitted"] if each.lo != each.hi else []


def _terms(seen: Probe) -> list[str]:
    if not seen.path:
        return ["  the ray meets nothing: background"]
    lines = [
        f"  sees {seen.path} at {_show(seen.position)}, depth {seen.depth:.6g},"
        f" uv ({seen.uv[0]:.5f}, {seen.uv[1]:.5f})",
        f"  N' {_show(seen.normal)}, facet N {_show(seen.facet_normal)}, N'.V {seen.view_cosine:.5f},"
        f" albedo {_show(seen.albedo)}",
    ]
    for light in seen.lights:
        lines.append(
            f"  {light.path}: N'.L {light.cosine:.5f}, N.L {light.geometric_cosine:.5f},"
            f" d {light.distance:.6g}, E {_show(light.irradiance)}"
        )
        shadow = "no light arrives: N'.L <= 0"
        if light.cosine > 0:
            shadow = "shadow ray free"
            if light.blocker:
                what = "forgiven (facet self-shadow)" if light.spared else f"light let through {light.share:g}"
                shadow = f"shadow ray meets {light.blocker} at {light.blocked_at:.6g}: {what}"
        lines.append(f"    {shadow}; diffuse {_show(light.diffuse)}, highlight {_show(light.specular)}")
    return lines


def _off(found: RGB, prediction: Prediction) -> float:
    value = np.array(found)
    return float(np.abs(value - np.clip(value, prediction.lo, prediction.hi)).max())


def _show(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{each:.5g}" for each in values) + ")"


def _rgb(values: npt.NDArray[np.float64]) -> RGB:
    r, g, b = (float(each) for each in values)
    return r, g, b


def _finite(value: object) -> object:
    """``value`` with infinities and NaN as None, for JSON."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
