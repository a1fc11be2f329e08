"""Result and the run's record: what ``run.json`` (schema 1) holds. Every report is drawn from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from notabug.expectation import State, Statement
from notabug.metrics.verdict import GLYPH, Verdict
from notabug.scenes_usd.errors import NotabugError

SCHEMA = 1


class RecordError(NotabugError):
    """A record that no run has written."""


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

    @property
    def surprising(self) -> bool:
        """The result is not the one that is expected, better or worse."""
        left = self.state in ("grew", "improved", "expired", "models changed")
        return left or (bool(self.expected) and not Statement.parse(self.expected).fits(self))

    def as_dict(self) -> dict[str, Any]:
        """As in ``run.json``: the verdict's parts lie beside the others, numbers that are not finite become null."""
        verdict = self.verdict.as_dict()
        word = verdict.pop("word")
        plain = {
            "scene": self.scene,
            "variant": self.variant,
            "renderer": self.renderer,
            "renderer_version": self.renderer_version,
            "verdict": word,
            **verdict,
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
        }
        document: dict[str, Any] = json_ready(plain)
        return document

    @classmethod
    def from_dict(cls, data: Any) -> Result:
        """The result that ``data``, as in ``run.json``, holds; raises RecordError where it holds none."""
        try:
            _check_types(data)
            return cls._from_dict(data)
        except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
            got = f"{type(error).__name__}: {error}"
            raise RecordError("not a result of a run", got=got, do="run again with --no-resume") from error

    @classmethod
    def _from_dict(cls, data: dict[str, Any]) -> Result:
        parts = {key: data[key] for key in ("findings", "legs", "triggers", "message", "numbers")}
        parts["findings"] = [_numbers(each, {"area_px", "jnd", "z"}) for each in parts["findings"]]
        parts["legs"] = {name: _numbers(each, set(each)) for name, each in parts["legs"].items()}
        parts["numbers"] = _numbers(parts["numbers"], set(parts["numbers"]))
        return cls(
            scene=data["scene"],
            variant=data["variant"],
            renderer=data["renderer"],
            renderer_version=data["renderer_version"],
            verdict=Verdict.from_dict({"word": data["verdict"], **parts}),
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
        )


_TEXTS = ("scene", "variant", "renderer", "renderer_version", "verdict", "message", "image", "command", "expected")


def _check_types(data: Any) -> None:
    """Raise TypeError or ValueError where what would be drawn, added up or opened is of another type."""
    for key in (*_TEXTS, "claim"):
        if not isinstance(data[key], str):
            raise TypeError(f"{key} is no text")
    if not all(isinstance(data.get(key, ""), str) for key in ("state", "because", "log")):
        raise TypeError("state, because or log is no text")
    if not isinstance(data.get("fails", False), bool):
        raise TypeError("fails is neither true nor false")
    if data["verdict"] not in GLYPH:
        raise ValueError(f"unknown verdict {data['verdict']!r}")
    for key in ("samples", "seeds"):
        if not isinstance(data[key], int):
            raise TypeError(f"{key} is no whole number")
    read = (*data.get("channels", ()), *data.get("notes", ()))
    if not all(
        isinstance(each, str)
        for each in (*data["images"].values(), *data["renderer_command"], *data["triggers"], *read)
    ):
        raise TypeError("a picture's path or a word of the command or the triggers is no text")
    numbers = [*data["seconds"].values(), *data["size"], *data["numbers"].values()]
    for leg in data["legs"].values():
        numbers += leg.values()
    for each in data["findings"]:
        numbers += [each["area_px"], each["jnd"], each["z"], *each["region"]]
        if not isinstance(each["name"], str) or not isinstance(each["message"], str):
            raise TypeError("a finding's name or message is no text")
    if not all(each is None or isinstance(each, int | float) for each in numbers):
        raise TypeError("a number is none")
    if not {"render", "judge"} <= data["seconds"].keys() or not {"limitation", "bug"} <= data["legs"].keys():
        raise ValueError("seconds or legs are missing")


def json_ready(value: Any) -> Any:
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
