"""The shape of ``run.json`` as types: what ``load`` of record.py gives, once it has been checked at the door."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from notabug.results.expectation import State
from notabug.scenes_usd.catalogue import Word


class FindingSaid(TypedDict):
    kind: str
    name: str
    area_px: float | None  # a number that is not finite is null
    region: list[float]
    jnd: float | None
    z: float | None
    message: str
    visible: NotRequired[bool]
    regions: NotRequired[list[list[float]]]


class ResultSaid(TypedDict):
    """One entry of ``results`` or ``calibration``."""

    scene: str
    variant: str
    renderer: str
    renderer_version: str
    verdict: Word
    findings: list[FindingSaid]
    legs: dict[str, dict[str, float | None]]
    triggers: list[str]
    message: str
    numbers: dict[str, float | None]
    samples: int
    seeds: int
    seconds: dict[str, float]
    image: str
    images: dict[str, str]
    size: list[int]
    command: str
    renderer_command: list[str]
    expected: str
    claim: str
    state: NotRequired[State]
    because: NotRequired[str]
    fails: NotRequired[bool]
    channels: NotRequired[list[str]]
    notes: NotRequired[list[str]]
    log: NotRequired[str]
    lights: NotRequired[list[str]]
    under: NotRequired[str]


class ToolSaid(TypedDict):
    name: str
    version: str
    models: str
    code: str
    python: str
    platform: str
    libraries: dict[str, str]


class JobsSaid(TypedDict, total=False):
    executor: str
    at_once: int
    threads: int
    shard: str
    merged: list[JobsSaid]


class UnusedSaid(TypedDict):
    renderer: str
    scene: str
    variant: str


class GateSaid(TypedDict):
    file: str
    fail_on: str
    models: str
    unused: list[UnusedSaid]


class RendererSaid(TypedDict, total=False):
    version: str
    where: str
    missing: str


class RunDocument(TypedDict):
    schema: int
    tool: ToolSaid
    command: list[str]
    finished: bool
    partial: NotRequired[bool]
    seconds: dict[str, float]
    jobs: JobsSaid
    gate: GateSaid
    renderers: dict[str, RendererSaid]
    calibration: list[ResultSaid]
    policy: dict[str, float]
    results: list[ResultSaid]
