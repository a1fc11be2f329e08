"""What options of the command line may say, and the options that several commands share."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from notabug.command_line import completing
from notabug.scenes_usd.view import AS_IT_IS, View, view_of


class Filter(StrEnum):
    """The reconstruction filter of a picture."""

    point = "point"
    box = "box"
    tent = "tent"
    gaussian = "gaussian"
    unknown = "unknown"


class Precision(StrEnum):
    """The arithmetic of a renderer's intersections."""

    float32 = "float32"
    float64 = "float64"


class Encoding(StrEnum):
    """How a picture's numbers stand for light."""

    linear = "linear"
    srgb = "srgb"


class Variants(StrEnum):
    """Which variants a run takes where ``--variant`` names none."""

    default = "default"
    all = "all"


class Topic(StrEnum):
    """What ``notabug list`` lists."""

    scenes = "scenes"
    renderers = "renderers"
    models = "models"
    variants = "variants"
    workarounds = "workarounds"
    declarations = "declarations"
    policy = "policy"


class Bench(StrEnum):
    """What ``notabug bench`` measures."""

    speed = "speed"
    verdict = "verdict"
    efficiency = "efficiency"
    stability = "stability"
    metamorphic = "metamorphic"
    generality = "generality"
    faults = "faults"


class BenchPart(StrEnum):
    """What ``notabug bench generality`` or ``bench faults`` looks at; scenes are a part of both."""

    scenes = "scenes"
    features = "features"
    meshes = "meshes"
    faults = "faults"
    limitations = "limitations"
    exports = "exports"
    misdeeds = "misdeeds"
    kills = "kills"
    disks = "disks"
    pictures = "pictures"
    configurations = "configurations"
    expectations = "expectations"
    records = "records"


class FailOn(StrEnum):
    """Which bugs fail a run."""

    any = "any"
    visible = "visible"


class Page(StrEnum):
    """What ``notabug report`` draws."""

    html = "html"
    junit = "junit"
    github = "github"
    markdown = "markdown"
    sarif = "sarif"


class Format(StrEnum):
    """What ``notabug export`` writes."""

    json = "json"
    usd = "usd"
    obj = "obj"
    gltf = "gltf"
    pbrt = "pbrt"
    povray = "povray"
    mitsuba = "mitsuba"


class Deed(StrEnum):
    """What ``notabug references`` does."""

    build = "build"
    verify = "verify"


Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on standard output and nothing else there.")
]
Variant = Annotated[
    list[str] | None,
    typer.Option(
        "--variant",
        metavar="SET=NAME",
        help="A variant of the default prim; of another prim /Prim{SET=NAME}. Again for more; SET=all takes each.",
    ),
]
SceneOption = Annotated[
    str,
    typer.Option("--scene", metavar="ID|USD", autocompletion=completing.scenes, help="The scene: an id or a USD file."),
]
Declare = Annotated[
    list[str] | None,
    typer.Option(
        "--declare",
        metavar="KEY=VALUE",
        help="What the renderer does where renderers differ; again for more. `notabug list declarations` has all keys.",
    ),
]
Layer = Annotated[
    str, typer.Option(metavar="NAME", help="The layer or part that is the picture, where a file has several.")
]
Renderers = Annotated[
    list[str] | None,
    typer.Option(
        "--renderer",
        "-r",
        autocompletion=completing.renderers,
        help="A renderer; again for more. Default: all that are found.",
    ),
]
Renderer = Annotated[str, typer.Option("--renderer", "-r", autocompletion=completing.renderers, help="The renderer.")]
Scenes = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[SCENE]...", autocompletion=completing.scenes, help="Ids, classes, globs or USD files; default: all."
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say only what fails, and the count of verdicts.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Say everything, also what is usually left out.")]
Baseline = Annotated[
    Path | None,
    typer.Option("--baseline", metavar="RUN", help="The folder of an earlier run: the report says what has changed."),
]
Samples = Annotated[int, typer.Option("--samples", min=0, help="Samples per pixel; 0: the renderer's default.")]
Seeds = Annotated[int, typer.Option("--seeds", min=1, max=64, help="Independent pictures of a noisy renderer.")]


@dataclass(frozen=True, slots=True)
class Chosen:
    """Which picture of a scene is meant: its variants, and camera, frame and purposes."""

    variants: list[str] = field(default_factory=list)
    view: View = AS_IT_IS


AS_AUTHORED = Chosen()


def chosen_by(
    variant: Variant = None,
    camera: Annotated[
        str, typer.Option("--camera", metavar="PATH", help="The camera, by its path; default: the scene's own.")
    ] = "",
    time: Annotated[
        float | None, typer.Option("--time", metavar="CODE", help="The frame of an animated scene.")
    ] = None,
    purpose: Annotated[
        list[str] | None,
        typer.Option(
            "--purpose", help="What is drawn beside default: render, proxy, guide; again for more. Default: render."
        ),
    ] = None,
) -> Chosen:
    """The picture that the options say, which are those of every command that takes a scene."""
    return Chosen(variant or [], view_of(camera, time, purpose or []))


def choosing(function: Callable[..., None]) -> Callable[..., None]:
    """``function`` as a command with the options of ``chosen_by`` in the place of its parameter ``chosen``."""
    given = inspect.signature(function, eval_str=True)
    options = inspect.signature(chosen_by, eval_str=True).parameters

    @functools.wraps(function)
    def command(**words: object) -> None:
        said = {name: words.pop(name) for name in options}
        function(**words, chosen=chosen_by(**said))  # type: ignore[arg-type]

    parameters: list[inspect.Parameter] = []
    for name, parameter in given.parameters.items():
        parameters += options.values() if name == "chosen" else [parameter]
    command.__signature__ = given.replace(parameters=parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return command
