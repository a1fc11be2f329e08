"""Commands that draw or take pictures and judge them: run, judge, why, calibrate, reduce."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from notabug.command_line.app import app
from notabug.command_line.examples import epilog
from notabug.command_line.options import (
    AS_AUTHORED,
    Baseline,
    Chosen,
    Declare,
    Encoding,
    FailOn,
    Filter,
    Json,
    Layer,
    Precision,
    Quiet,
    Renderer,
    Renderers,
    Samples,
    SceneOption,
    Scenes,
    Seeds,
    Variants,
    Verbose,
    choosing,
)

PANEL = "Judge a renderer"


@app.command(epilog=epilog("run"), rich_help_panel=PANEL)
@choosing
def run(
    scenes: Scenes = None,
    renderer: Renderers = None,
    chosen: Chosen = AS_AUTHORED,
    variants: Annotated[
        Variants, typer.Option(help="Default variants only, or each set varied in turn.")
    ] = Variants.default,
    out: Annotated[Path, typer.Option(help="Folder for pictures, run.json and report.html.")] = Path("notabug-out"),
    samples: Samples = 0,
    seeds: Seeds = 4,
    timeout: Annotated[float, typer.Option(min=1.0, help="Seconds for one renderer on one scene.")] = 600.0,
    require: Annotated[
        list[str] | None,
        typer.Option("--require", envvar="NOTABUG_REQUIRE", help="A renderer that must be installed (names or a,b)."),
    ] = None,
    resume: Annotated[
        bool, typer.Option(help="Keep finished results whose scene, renderer and code are the same.")
    ] = True,
    workarounds: Annotated[
        bool,
        typer.Option("--workarounds", help="Render with and without each workaround of the scenes, and compare."),
    ] = False,
    expect: Annotated[
        Path | None,
        typer.Option(help="What is accepted; default: notabug.expect.toml where it is there."),
    ] = None,
    fail_on: Annotated[FailOn, typer.Option(help="Fail on any bug, or on those an eye would see.")] = FailOn.any,
    jobs: Annotated[
        int,
        typer.Option("--jobs", "-j", min=0, envvar="NOTABUG_JOBS", help="Jobs at once; 0: as many as cores are idle."),
    ] = 0,
    executor: Annotated[str, typer.Option(metavar="dask://HOST:PORT", help="A Dask cluster for the jobs.")] = "",
    shard: Annotated[str, typer.Option(metavar="2/8", help="Only this share of the selection.")] = "",
    baseline: Baseline = None,
    quick: Annotated[bool, typer.Option("--quick", help="One scene of each class: a first look.")] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Render scenes and judge every picture."""
    from notabug.runs.workers import JOBS_PER_PROCESS, cores_here, prepare

    few = 0 < len(scenes or []) * (len(renderer or []) or 4) < 2 * JOBS_PER_PROCESS
    if jobs != 1 and not (few or executor or workarounds) and cores_here() > 1:
        # while this process loads what it needs itself; of the whole corpus many a picture shows a limitation, whose
        # perception needs what is slowest to load
        prepare(*(() if scenes else ("colour", "flip_evaluator")))
    from notabug.commands.run import Asked, command

    asked = Asked(
        scenes=scenes or [],
        renderers=renderer or [],
        variants=chosen.variants,
        view=chosen.view,
        every_variant=variants is Variants.all,
        out=out,
        samples=samples,
        seeds=seeds,
        timeout=timeout,
        require=[name for word in require or [] for name in word.replace(",", " ").split()],
        resume=resume,
        as_json=as_json,
        remedies=workarounds,
        expect=expect,
        fail_on=fail_on.value,
        jobs=jobs,
        executor=executor,
        shard=shard,
        baseline=baseline,
        few=quick,
        detail="quiet" if quiet else "verbose" if verbose else "normal",
    )
    raise typer.Exit(command(asked))


@app.command(epilog=epilog("judge"), rich_help_panel=PANEL)
@choosing
def judge(
    images: Annotated[list[Path], typer.Argument(metavar="IMAGE...", help="Pictures; several are independent seeds.")],
    scene: SceneOption,
    chosen: Chosen = AS_AUTHORED,
    filter: Annotated[Filter, typer.Option(help="The renderer's pixel filter.")] = Filter.unknown,  # noqa: A002
    radius: Annotated[float | None, typer.Option(min=0.0, help="The filter's radius in pixels.")] = None,
    precision: Annotated[
        Precision, typer.Option(help="Arithmetic of the renderer's intersections.")
    ] = Precision.float32,
    encoding: Annotated[Encoding, typer.Option(help="What the pictures' numbers are.")] = Encoding.linear,
    noisy: Annotated[
        bool | None,
        typer.Option("--noisy/--deterministic", help="Would another seed differ? Default: if several are given."),
    ] = None,
    samples: Annotated[
        int,
        typer.Option(min=0, help="Samples per pixel of each picture, where known: from 16 on edges are judged closer."),
    ] = 0,
    declare: Declare = None,
    layer: Layer = "",
    out: Annotated[Path | None, typer.Option(help="Also write maps, run.json and report.html here.")] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Judge pictures made anywhere."""
    from notabug.commands.judge import command

    code = command(
        images=images,
        source=scene,
        variants=chosen.variants,
        view=chosen.view,
        filter_name=filter.value,
        radius=radius,
        precision=precision.value,
        srgb=encoding is Encoding.srgb,
        noisy=noisy,
        samples=samples,
        out=out,
        as_json=as_json,
        declare_words=declare or [],
        layer=layer,
        quiet=quiet,
    )
    raise typer.Exit(code)


@app.command(epilog=epilog("why"), rich_help_panel=PANEL)
@choosing
def why(
    image: Annotated[Path, typer.Argument(metavar="IMAGE", help="The picture.")],
    scene: SceneOption = "",
    pixel: Annotated[
        str,
        typer.Option(
            "--pixel", metavar="X,Y", help="The pixel, from 0, y down. Default: the worst one of a picture of a run."
        ),
    ] = "",
    chosen: Chosen = AS_AUTHORED,
    filter: Annotated[Filter, typer.Option(help="The renderer's pixel filter.")] = Filter.unknown,  # noqa: A002
    precision: Annotated[Precision, typer.Option(help="Arithmetic of the intersections.")] = Precision.float32,
    encoding: Annotated[Encoding, typer.Option(help="What the picture's numbers are.")] = Encoding.linear,
    declare: Declare = None,
    layer: Layer = "",
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Say what each model predicts at one pixel, and which ones fit, best first.

    Of a picture that lies in a run's folder, scene, variant and what its renderer declares are taken from the run.
    """
    from notabug.commands.why import command

    code = command(
        image=image,
        source=scene,
        variants=chosen.variants,
        view=chosen.view,
        pixel=pixel,
        filter_name=filter.value,
        precision=precision.value,
        srgb=encoding is Encoding.srgb,
        as_json=as_json,
        declare_words=declare or [],
        layer=layer,
        every=verbose,
    )
    raise typer.Exit(code)


@app.command(epilog=epilog("calibrate"), rich_help_panel=PANEL)
def calibrate(
    renderer: Renderers = None,
    samples: Samples = 0,
    timeout: Annotated[float, typer.Option(min=1.0, help="Seconds for one card.")] = 600.0,
    fresh: Annotated[bool, typer.Option("--fresh", help="Draw the card again, whatever is remembered.")] = False,
    as_json: Json = False,
) -> None:
    """Draw a test card and say what stands between a renderer and being judged."""
    from notabug.commands.calibrate import command

    raise typer.Exit(command(renderer or [], samples, timeout, fresh, as_json))


@app.command(epilog=epilog("reduce"), rich_help_panel=PANEL)
@choosing
def reduce(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="An id or a USD file on which the renderer has a bug.")],
    renderer: Renderer,
    chosen: Chosen = AS_AUTHORED,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="An attribute of the adapter, such as variant=scalar_rgb."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the minimal scene and its README.")] = Path("notabug-reduced"),
    samples: Samples = 0,
    seeds: Seeds = 4,
    any_name: Annotated[
        bool, typer.Option("--any-name", help="Go on while there is any bug, whatever its name.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Shrink a scene while a renderer's bug on it stays, and write what a bug report needs."""
    from notabug.commands.reduce import command

    raise typer.Exit(
        command(
            scene=scene,
            renderer=renderer,
            variants=chosen.variants,
            view=chosen.view,
            settings=settings or [],
            out=out,
            samples=samples,
            seeds=seeds,
            any_name=any_name,
            as_json=as_json,
        )
    )
