"""Result and the run's record: what ``run.json`` (schema 1) holds. Every report is drawn from it.

``load`` is the door for records from disk: what it gives has every key of DEFAULTS, and each value its type.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from notabug.metrics.policy import flat
from notabug.metrics.verdict import GLYPH, Verdict, VerdictSaid
from notabug.results.document import GateSaid, JobsSaid, RendererSaid, ResultSaid, RunDocument, ToolSaid
from notabug.results.expectation import State, Statement
from notabug.results.shape import FILE, FLAG, NAME, NUMBER, TEXT, WHOLE, Fields, Many, Value, check, read_document
from notabug.results.shape import RecordError as RecordError
from notabug.scenes_usd.errors import FileError, NotabugError

SCHEMA = 1


@dataclass(frozen=True, slots=True)
class Result:
    """The verdict on one scene, variant and renderer, and where its pictures are (paths relative to the run)."""

    scene: str
    variant: str
    renderer: str
    renderer_version: str
    verdict: Verdict
    samples: int = 0
    seeds: int = 0
    seconds: dict[str, float] = field(default_factory=lambda: {"render": 0.0, "judge": 0.0})
    image: str = ""
    images: dict[str, str] = field(default_factory=dict)  # nearest, reference; where not empty: limitation_map, bug_map
    size: tuple[int, int] = (0, 0)  # width, height
    command: str = ""  # reproduces this result
    renderer_command: tuple[str, ...] = ()
    expected: str = ""  # what an accepted entry or the scene's table states: a word, or "limitation: name + name"
    claim: str = ""
    state: State = ""  # how the result compares with what is expected
    because: str = ""  # why a team has accepted it
    fails: bool = False  # a gate goes red for it
    channels: tuple[str, ...] = ()  # of the picture's file that were judged
    notes: tuple[str, ...] = ()  # what reading them took: a window, an orientation, alpha
    log: str = ""  # what the renderer printed, where it failed
    lights: tuple[str, ...] = ()  # the types of the scene's lights, each once
    under: str = ""  # where a whole run tells it: the one type of light under which the renderer shows this bug

    @property
    def worst(self) -> tuple[int, int] | None:
        """The worst pixel (x, y) of what decides the verdict; None where nothing deviates, or a record does not say."""
        decisive = [each for each in self.verdict.findings if each.kind == self.verdict.word and len(each.worst) == 2]
        if not decisive:
            return None
        x, y = max(decisive, key=lambda finding: finding.area_px).worst
        return x, y

    @property
    def surprising(self) -> bool:
        """The result is not the one that is expected, better or worse."""
        left = self.state in ("grew", "improved", "expired", "models changed")
        return left or (bool(self.expected) and not Statement.parse(self.expected).fits(self))

    def as_dict(self) -> ResultSaid:
        """As in ``run.json``: the verdict's parts lie beside the others, numbers that are not finite become null."""
        verdict = self.verdict.as_dict()
        plain = {
            "scene": self.scene,
            "variant": self.variant,
            "renderer": self.renderer,
            "renderer_version": self.renderer_version,
            "verdict": verdict["word"],
            **{name: part for name, part in verdict.items() if name != "word"},
            "samples": self.samples,
            "seeds": self.seeds,
            "seconds": self.seconds,
            "image": self.image,
            "images": self.images,
            "size": list(self.size),
            "command": self.command,
            "renderer_command": list(self.renderer_command),
            "expected": self.expected,
            "claim": self.claim,
            "state": self.state,
            "because": self.because,
            "fails": self.fails,
            "channels": list(self.channels),
            "notes": list(self.notes),
            "log": self.log,
            "lights": list(self.lights),
            "under": self.under,
        }
        return cast(ResultSaid, json_ready(plain))

    @classmethod
    def from_dict(cls, data: object) -> Result:
        """The result that ``data``, as in ``run.json``, holds; raises RecordError where it holds none."""
        try:
            check(data, RESULT, "a result")
            said = cast(ResultSaid, data)
            check(said["seconds"], Many(NUMBER, named=True), "a result: seconds")
            return cls._from_dict(said)
        except TypeError as error:  # a key that no finding or leg has
            raise RecordError("not a result of a run", got=str(error), do="run again with --no-resume") from error

    @classmethod
    def _from_dict(cls, data: ResultSaid) -> Result:
        verdict: VerdictSaid = {
            "word": data["verdict"],
            "findings": [_numbers(dict(finding), {"area_px", "jnd", "z"}) for finding in data["findings"]],
            "legs": {name: _numbers(dict(leg), set(leg)) for name, leg in data["legs"].items()},
            "triggers": data["triggers"],
            "message": data["message"],
            "numbers": _numbers(dict(data["numbers"]), set(data["numbers"])),
        }
        return cls(
            scene=data["scene"],
            variant=data["variant"],
            renderer=data["renderer"],
            renderer_version=data["renderer_version"],
            verdict=Verdict.from_dict(verdict),
            samples=data["samples"],
            seeds=data["seeds"],
            seconds=dict(data["seconds"]),
            image=data["image"],
            images=dict(data["images"]),
            size=(data["size"][0], data["size"][1]),
            command=data["command"],
            renderer_command=tuple(data["renderer_command"]),
            expected=data["expected"],
            claim=data["claim"],
            state=data.get("state", ""),
            because=data.get("because", ""),
            fails=data.get("fails", False),
            channels=tuple(data.get("channels", ())),
            notes=tuple(data.get("notes", ())),
            log=data.get("log", ""),
            lights=tuple(data.get("lights", ())),
            under=data.get("under", ""),
        )


_NUMBER = Value("number", none=True)  # null where it is not finite
_BOX = Many(NUMBER, length=4)
_LEG = Fields({}, dict.fromkeys(("pixels", "flip", "flip_max", "itp"), _NUMBER))
_FINDING = Fields(
    {
        "kind": Value("text", words=frozenset({"limitation", "convention", "bug"})),
        "name": TEXT,
        "area_px": _NUMBER,
        "region": _BOX,
        "jnd": _NUMBER,
        "z": _NUMBER,
        "message": TEXT,
    },
    {"visible": FLAG, "regions": Many(_BOX), "worst": Many(WHOLE), "strengths": Many(NUMBER)},
)
RESULT = Fields(
    {
        **dict.fromkeys(("scene", "variant", "renderer"), NAME),
        **dict.fromkeys(("renderer_version", "message", "command", "expected", "claim"), TEXT),
        "verdict": Value("text", words=frozenset(GLYPH)),
        "findings": Many(_FINDING),
        "legs": Fields({"limitation": _LEG, "bug": _LEG}),
        "triggers": Many(TEXT),
        "numbers": Many(_NUMBER, named=True),
        "samples": WHOLE,
        "seeds": WHOLE,
        "seconds": Fields({"render": NUMBER, "judge": NUMBER}),
        "image": FILE,
        "images": Many(FILE, named=True),
        "size": Many(NUMBER, length=2),
        "renderer_command": Many(TEXT),
    },
    {
        **dict.fromkeys(("state", "because", "under"), TEXT),
        **dict.fromkeys(("channels", "notes", "lights"), Many(TEXT)),
        "fails": FLAG,
        "log": FILE,
    },
)
_TOOL = dict.fromkeys(("name", "version", "models", "code", "python", "platform"), TEXT)
_JOBS = {"executor": TEXT, "at_once": WHOLE, "threads": WHOLE, "shard": TEXT}
_UNUSED = Fields(dict.fromkeys(("renderer", "scene", "variant"), NAME))
RUN = Fields(
    {"schema": WHOLE, "results": Many(RESULT)},
    {
        "tool": Fields({}, {**_TOOL, "libraries": Many(TEXT, named=True)}),
        "command": Many(TEXT),
        "finished": FLAG,
        "partial": FLAG,
        "seconds": Many(NUMBER, named=True),
        "jobs": Fields({}, {**_JOBS, "merged": Many(Fields({}, _JOBS))}),
        "gate": Fields({}, {"file": TEXT, "fail_on": TEXT, "models": TEXT, "unused": Many(_UNUSED)}),
        "renderers": Many(Fields({}, {"version": TEXT, "where": TEXT, "missing": TEXT}), named=True),
        "calibration": Many(RESULT),
        "policy": Many(NUMBER, named=True),
    },
)
DEFAULTS: dict[str, Any] = {
    "tool": {**dict.fromkeys(_TOOL, ""), "libraries": {}},
    "command": [],
    "finished": False,
    "seconds": {"total": 0.0, "render": 0.0, "outside": 0.0},
    "jobs": {"shard": ""},
    "gate": {"file": "", "fail_on": "any", "models": "", "unused": []},
    "renderers": {},
    "calibration": [],
    "policy": {},
}


def run_document(
    *,
    tool: ToolSaid,
    command: Sequence[str],
    seconds: dict[str, float],
    renderers: dict[str, RendererSaid],
    results: Sequence[Result],
    calibration: Sequence[Result] = (),
    finished: bool = True,
    jobs: JobsSaid | None = None,
    gate: GateSaid | None = None,
    policy: dict[str, float] | None = None,
) -> RunDocument:
    """``run.json``, whoever writes it: a run, shards that are merged, or a picture that is judged.

    It keeps the numbers of the judge's ``policy``, all of them: a hash would say that two runs were judged by other
    numbers, but not by which, and values that differ from the default say nothing once the default has changed.
    """
    plain: RunDocument = {
        "schema": SCHEMA,
        "tool": tool,
        "command": list(command),
        "finished": finished,
        "seconds": seconds,
        "jobs": jobs or {"shard": ""},
        "gate": gate or {"file": "", "fail_on": "any", "models": "", "unused": []},
        "renderers": renderers,
        "calibration": [result.as_dict() for result in calibration],
        "policy": flat() if policy is None else policy,
        "results": [result.as_dict() for result in results],
    }
    return plain


def load(out: Path) -> RunDocument:
    """``run.json`` of the folder ``out``; raises NotabugError where it is not there or is no run's record."""
    path = out / "run.json"
    try:
        document = read_document(path, Fields({}))
        if document.get("schema") != SCHEMA:
            got = ascii(document.get("schema"))[:60]
            raise RecordError("not a run's record", where=str(path), expected=f"schema {SCHEMA}", got=got)
        check(document, RUN, str(path))
    except (FileNotFoundError, NotADirectoryError):
        raise NotabugError(
            "there is no run here",
            where=str(out),
            expected="a folder with a run.json, as `notabug run` and `notabug judge --out` write it",
            do="check the path",
        ) from None
    except OSError as error:
        raise FileError.of(error, where=str(path)) from None
    for key, value in DEFAULTS.items():
        there: Any = document.get(key, value)
        document[key] = {**value, **there} if isinstance(value, dict) else there
    return cast(RunDocument, document)


def json_ready(value: object) -> object:
    """``value`` in JSON's own types: numpy scalars as numbers, tuples as lists, NaN and infinities as null."""
    if isinstance(value, dict):
        return {str(key): json_ready(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_ready(each) for each in value]
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _numbers(data: dict[str, Any], keys: set[str]) -> dict[str, Any]:
    return {key: math.nan if value is None and key in keys else value for key, value in data.items()}
