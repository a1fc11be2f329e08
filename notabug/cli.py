"""The command line. Only typer is imported here: what a command needs is imported when it runs, so help is instant."""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from notabug import __version__
from notabug.ending import Stopped, exit_state, report_defect, signals_as_exceptions
from notabug.examples import epilog
from notabug.exit_codes import ExitCode, exit_code
from notabug.options import (
    Baseline,
    Bench,
    BenchPart,
    CameraOption,
    Declare,
    Deed,
    Encoding,
    FailOn,
    Filter,
    Format,
    Json,
    Layer,
    Page,
    Precision,
    PurposeOption,
    Quiet,
    Renderer,
    Renderers,
    Samples,
    SceneOption,
    Scenes,
    Seeds,
    TimeOption,
    Topic,
    Variant,
    Variants,
    Verbose,
)
from notabug.scenes_usd.errors import FileError, NotabugError, is_of_files
from notabug.scenes_usd.view import view_of

app = typer.Typer(
    name="notabug",
    help="Is it a rendering bug, or really not? Renders canonical scenes and says of every picture whether it is "
    "correct, shows an expected limitation, or a genuine bug.",
    epilog="Exit codes: 0 nothing worse than accepted, 1 bug, 2 usage, 3 renderer error, 4 missing reference, 5 "
    "nothing selected, 70 a defect of notabug, 130 or 143 stopped by a signal.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"notabug {__version__}")
        raise typer.Exit


@app.callback()
def _notabug(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    del version


@app.command(epilog=epilog("run"))
def run(
    scenes: Scenes = None,
    renderer: Renderers = None,
    variant: Variant = None,
    camera: CameraOption = "",
    time: TimeOption = None,
    purpose: PurposeOption = None,
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
    from notabug.crew import JOBS_PER_PROCESS, cores_here, prepare

    few = 0 < len(scenes or []) * (len(renderer or []) or 4) < 2 * JOBS_PER_PROCESS
    if jobs != 1 and not (few or executor or workarounds) and cores_here() > 1:
        # while this process loads what it needs itself; of the whole corpus many a picture shows a limitation, whose
        # perception needs what is slowest to load
        prepare(*(() if scenes else ("colour", "flip_evaluator")))
    from notabug.running import command

    code = command(
        scenes=scenes or [],
        renderers=renderer or [],
        variants=variant or [],
        view=view_of(camera, time, purpose or []),
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
    raise typer.Exit(code)


@app.command(epilog=epilog("judge"))
def judge(
    images: Annotated[list[Path], typer.Argument(metavar="IMAGE...", help="Pictures; several are independent seeds.")],
    scene: SceneOption,
    variant: Variant = None,
    camera: CameraOption = "",
    time: TimeOption = None,
    purpose: PurposeOption = None,
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
    from notabug.judging import command

    code = command(
        images=images,
        source=scene,
        variants=variant or [],
        view=view_of(camera, time, purpose or []),
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


@app.command(epilog=epilog("check"))
def check(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A USD file, or an id.")],
    variant: Variant = None,
    camera: CameraOption = "",
    time: TimeOption = None,
    purpose: PurposeOption = None,
    as_json: Json = False,
) -> None:
    """Say what of a scene is read, what is approximated, what is not read and what is out of the contract."""
    from notabug.checking import command

    view = view_of(camera, time, purpose or [])
    raise typer.Exit(command(source=scene, variants=variant or [], view=view, as_json=as_json))


@app.command(epilog=epilog("adapt"))
def adapt(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A USD file.")],
    out: Annotated[Path, typer.Option(help="The layer to write, beside the scene or above it.")],
    variant: Variant = None,
    camera: CameraOption = "",
    time: TimeOption = None,
    purpose: PurposeOption = None,
    size: Annotated[str, typer.Option(metavar="WxH", help="Pixels; default: the scene's own, else 256 across.")] = "",
    as_json: Json = False,
) -> None:
    """Write a layer over a scene that makes it judgeable; the scene itself stays as it is."""
    from notabug.adapting import command

    view = view_of(camera, time, purpose or [])
    raise typer.Exit(command(source=scene, out=out, variants=variant or [], view=view, size=size, as_json=as_json))


@app.command(epilog=epilog("why"))
def why(
    image: Annotated[Path, typer.Argument(metavar="IMAGE", help="The picture.")],
    scene: SceneOption = "",
    pixel: Annotated[
        str,
        typer.Option(
            "--pixel", metavar="X,Y", help="The pixel, from 0, y down. Default: the worst one of a picture of a run."
        ),
    ] = "",
    variant: Variant = None,
    camera: CameraOption = "",
    time: TimeOption = None,
    purpose: PurposeOption = None,
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
    from notabug.why import command

    code = command(
        image=image,
        source=scene,
        variants=variant or [],
        view=view_of(camera, time, purpose or []),
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


@app.command(epilog=epilog("references"))
def references(
    deed: Annotated[Deed, typer.Argument(help="Write the references, or check that they are there and right.")],
    scenes: Scenes = None,
    variant: Variant = None,
    deep: Annotated[
        bool,
        typer.Option("--deep", help="Verify a part of each picture with 64 x 64 samples, and tell the worst error."),
    ] = False,
    as_json: Json = False,
) -> None:
    """Build or verify the corpus of reference pictures."""
    from notabug.corpus import command

    raise typer.Exit(command(deed.value, scenes or [], variant or [], deep, as_json))


@app.command(epilog=epilog("calibrate"))
def calibrate(
    renderer: Renderers = None,
    samples: Samples = 0,
    timeout: Annotated[float, typer.Option(min=1.0, help="Seconds for one card.")] = 600.0,
    fresh: Annotated[bool, typer.Option("--fresh", help="Draw the card again, whatever is remembered.")] = False,
    as_json: Json = False,
) -> None:
    """Draw a test card and say what stands between a renderer and being judged."""
    from notabug.calibrating import command

    raise typer.Exit(command(renderer or [], samples, timeout, fresh, as_json))


@app.command(epilog=epilog("export"))
def export(
    to: Annotated[Format, typer.Option("--to", help="The format.")],
    scenes: Scenes = None,
    variant: Variant = None,
    camera: CameraOption = "",
    time: TimeOption = None,
    purpose: PurposeOption = None,
    variants: Annotated[
        Variants, typer.Option(help="Default variants only, or each set varied in turn.")
    ] = Variants.default,
    out: Annotated[Path, typer.Option(help="Folder for class/scene/variant/.")] = Path("notabug-scenes"),
    as_json: Json = False,
) -> None:
    """Write scenes for renderers that read no USD, with scene.json beside each."""
    from notabug.exporting import command

    view = view_of(camera, time, purpose or [])
    raise typer.Exit(command(scenes or [], variant or [], variants is Variants.all, to.value, out, as_json, view))


@app.command("list", epilog=epilog("list"))
def list_(
    topic: Annotated[Topic, typer.Argument(help="What to list.")] = Topic.scenes,
    as_json: Json = False,
) -> None:
    """List scenes, renderers, models, variants or workarounds."""
    from notabug.listing import command

    raise typer.Exit(command(topic.value, as_json))


@app.command(epilog=epilog("doctor"))
def doctor(as_json: Json = False) -> None:
    """Say what is installed, what is missing, and how to get it."""
    from notabug.doctor import command

    raise typer.Exit(command(as_json))


@app.command(epilog=epilog("install"))
def install(
    name: Annotated[str, typer.Argument(help="The renderer; without one, what can be installed is listed.")] = "",
    python: Annotated[str, typer.Option(help="The interpreter for it; default: one of the version it needs.")] = "",
    remove: Annotated[bool, typer.Option("--remove", help="Remove its environment instead.")] = False,
    as_json: Json = False,
) -> None:
    """Install a renderer into an environment of its own below the cache, and nothing anywhere else."""
    from notabug.installing import command

    raise typer.Exit(command(name, python, remove=remove, as_json=as_json))


@app.command(epilog=epilog("bench"))
def bench(
    what: Annotated[Bench, typer.Argument(help="What to measure.")] = Bench.speed,
    quick: Annotated[bool, typer.Option("--quick", help="A small sample (not of speed).")] = False,
    out: Annotated[Path, typer.Option(help="Folder for JSON, plots and bench.html.")] = Path("notabug-bench"),
    renderer: Renderers = None,
    resume: Annotated[bool, typer.Option(help="Keep what was measured with the same code.")] = True,
    scenes: Annotated[int, typer.Option(min=0, help="Random scenes (generality); 0: 400, of a sample 20.")] = 0,
    seed: Annotated[
        int, typer.Option(min=0, help="Of the random scenes (generality), or of what is damaged (faults).")
    ] = 0,
    part: Annotated[
        list[BenchPart] | None,
        typer.Option("--part", help="Of generality (default: scenes) or of faults (all); again for more."),
    ] = None,
    names: Annotated[bool, typer.Option(help="Look for the fault behind each bug (generality): half a minute.")] = True,
    reduce: Annotated[bool, typer.Option(help="Shrink the scene of each bug (generality).")] = False,
    as_json: Json = False,
) -> None:
    """Measure what notabug costs (speed), how well it judges (verdict), whether it is right on scenes outside the
    corpus (generality), and of renderers: error over time (efficiency), where they break (stability), and which
    relations between pictures they break (metamorphic). Whether what is promised under attack and failure holds: a
    renderer's misdeeds, runs that are killed, disks that fill, damaged files (faults)."""
    if what is not Bench.speed:  # which writes no files
        from notabug.own_folder import claim

        claim(out, "bench")
    parts = [each.value for each in part or []]
    if what is Bench.generality:
        from notabug.bench.generality.command import command as generality
        from notabug.bench.generality.jobs import as_parts

        code = generality(
            parts=as_parts(parts or ["scenes"]),
            scenes=scenes,
            seed=seed,
            renderers=renderer or [],
            quick=quick,
            naming=names,
            reducing=reduce,
            resume=resume,
            as_json=as_json,
            out=out,
        )
        raise typer.Exit(code)
    if what is Bench.faults:
        from notabug.bench.faults import command as faults

        raise typer.Exit(faults(parts=parts, quick=quick, seed=seed, out=out, resume=resume, as_json=as_json))
    if what is Bench.verdict:
        from notabug.bench.verdict.command import command as verdict

        raise typer.Exit(verdict(quick=quick, as_json=as_json, out=out))
    if what in (Bench.efficiency, Bench.stability, Bench.metamorphic):
        from notabug.bench.measuring import command as measuring

        code = measuring(what.value, quick=quick, out=out, renderers=renderer or [], resume=resume, as_json=as_json)
        raise typer.Exit(code)
    from notabug.bench.command import command

    raise typer.Exit(command(as_json))


@app.command(epilog=epilog("reduce"))
def reduce(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="An id or a USD file on which the renderer has a bug.")],
    renderer: Renderer,
    variant: Variant = None,
    camera: CameraOption = "",
    time: TimeOption = None,
    purpose: PurposeOption = None,
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
    from notabug.reducing import command

    raise typer.Exit(
        command(
            scene=scene,
            renderer=renderer,
            variants=variant or [],
            view=view_of(camera, time, purpose or []),
            settings=settings or [],
            out=out,
            samples=samples,
            seeds=seeds,
            any_name=any_name,
            as_json=as_json,
        )
    )


@app.command(epilog=epilog("accept"))
def accept(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene of the last run.")],
    renderer: Renderer,
    because: Annotated[str, typer.Option(help="Why: a sentence for whoever reads the file next.")],
    variant: Variant = None,
    camera: CameraOption = "",
    time: TimeOption = None,
    purpose: PurposeOption = None,
    link: Annotated[str, typer.Option(help="Where it is discussed.")] = "",
    expires: Annotated[str, typer.Option(metavar="YYYY-MM-DD", help="From when on it is not accepted.")] = "",
    band: Annotated[float, typer.Option(min=0.0, max=1.0, help="Share by which area and jnd may differ.")] = 0.1,
    run: Annotated[Path, typer.Option("--run", help="The folder of the run.")] = Path("notabug-out"),
    expect: Annotated[Path, typer.Option(help="The file to write.")] = Path("notabug.expect.toml"),
    as_json: Json = False,
) -> None:
    """Accept one result of the last run: write it to notabug.expect.toml, for review."""
    from notabug.accepting import command

    raise typer.Exit(
        command(
            scene=scene,
            renderer=renderer,
            variants=variant or [],
            view=view_of(camera, time, purpose or []),
            because=because,
            link=link,
            expires=expires,
            band=band,
            out=run,
            path=expect,
            as_json=as_json,
        )
    )


@app.command(epilog=epilog("merge"))
def merge(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folders of runs, such as shards.")],
    out: Annotated[Path, typer.Option(help="The folder to make.")],
    partial: Annotated[
        bool, typer.Option("--partial", help="Also where a shard, the end of a run or a picture is missing.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Make one run of several, pictures and all."""
    from notabug.merging import command

    raise typer.Exit(command(folders, out, partial, as_json))


@app.command(epilog=epilog("diff"))
def diff(
    before: Annotated[Path, typer.Argument(metavar="RUN_A", help="The folder of a run.")],
    after: Annotated[Path, typer.Argument(metavar="RUN_B", help="The folder of a later one.")],
    as_json: Json = False,
) -> None:
    """Say what changed from one run to another, worst first."""
    from notabug.comparing import command

    raise typer.Exit(command(before, after, as_json))


@app.command(epilog=epilog("report"))
def report(
    folder: Annotated[Path, typer.Argument(help="The folder of a run.")] = Path("notabug-out"),
    white: Annotated[float, typer.Option(min=1e-6, help="The radiance that is shown as white.")] = 1.0,
    to: Annotated[Page, typer.Option(help="The page, or text for a build server on standard output.")] = Page.html,
    baseline: Baseline = None,
    single_file: Annotated[
        bool, typer.Option("--single-file", help="One page that holds its pictures, to be sent or attached.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Draw report.html again from run.json and the pictures next to it, or write it for a build server."""
    if to is Page.html:
        from notabug.report.page import draw

        page = draw(folder, white, baseline=baseline, single_file=single_file)
        typer.echo(json.dumps({"report": str(page)}) if as_json else page)
    else:
        from notabug.report.builds import command

        raise typer.Exit(command(folder, to.value))


@app.command(epilog=epilog("gallery"))
def gallery(
    runs: Annotated[
        list[Path] | None, typer.Argument(metavar="[RUN]...", help="Folders of runs, oldest first; default: none.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the site.")] = Path("notabug-gallery"),
    variants: Annotated[
        Variants, typer.Option(help="Default variants of the corpus, or all. Those of the runs are always there.")
    ] = Variants.default,
    scene: Annotated[
        list[str] | None, typer.Option("--scene", help="Only these scenes: an id or a glob; again for more.")
    ] = None,
    models: Annotated[bool, typer.Option(help="Pictures of the limitations and the terms of each pixel.")] = True,
    step: Annotated[int, typer.Option(min=1, help="Terms are kept for every STEP-th pixel.")] = 4,
    bench: Annotated[Path | None, typer.Option(help="A folder of SVG plots that join the site.")] = None,
    white: Annotated[float, typer.Option(min=1e-6, help="The radiance that small pictures show as white.")] = 1.0,
    as_json: Json = False,
) -> None:
    """Build a site to browse the corpus and runs, down to the float pixel."""
    from notabug.gallery.command import command

    every = variants is Variants.all
    code = command(
        runs or [],
        out,
        every_variant=every,
        with_models=models,
        step=step,
        bench=bench,
        white=white,
        only=scene or [],
        as_json=as_json,
    )
    raise typer.Exit(code)


def main() -> None:
    """The program: an error that a user can act on is one line on standard error and an exit code, never a trace."""
    for stream in (sys.stdout, sys.stderr):  # a terminal that lacks a glyph gets a question mark, not a trace
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        with signals_as_exceptions():
            code = app(standalone_mode=False)  # by itself typer ends with 1, a renderer's bug, where output is closed
            sys.stdout.flush()
        if code == exit_state(KeyboardInterrupt()):  # which typer has caught
            raise KeyboardInterrupt
    except BrokenPipeError:  # the reader of our output went away
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # or Python complains of it at its end
        sys.exit(ExitCode.OK)
    except (KeyboardInterrupt, typer.Abort, Stopped) as error:
        with contextlib.suppress(OSError):
            sys.stderr.write("notabug: stopped\n")
        sys.exit(exit_state(error))
    except Exception as error:
        sys.exit(_told(error))
    sys.exit(code or ExitCode.OK)


def _told(error: Exception) -> int:
    """Say what ``error`` is in one line; the exit code."""
    if hasattr(error, "exit_code") and hasattr(error, "show"):  # typer's own, of words that it does not understand
        from typer.rich_utils import rich_format_error

        rich_format_error(cast(Any, error))
        return int(error.exit_code)
    if is_of_files(error):
        assert isinstance(error, OSError)
        error = FileError.of(error)
    if not isinstance(error, NotabugError):
        return report_defect(error)
    from rich.text import Text

    from notabug.progress import console

    out = console(stderr=True)
    parts = getattr(error, "errors", (error,))  # of a scene that breaks the contract in many ways each
    for part in parts:
        line = Text("notabug: ", style="bold red").append(" ".join(str(part).split()), style="default not bold")
        out.print(line, soft_wrap=True)
    mended = sum(bool(getattr(part, "mends", ())) for part in parts)
    if mended:
        all_of = "all of it" if mended == len(parts) else f"{mended} of {len(parts)}"
        out.print(f"notabug adapt SCENE --out own.usda mends {all_of}, in a layer over the scene", soft_wrap=True)
    return exit_code(error)


if __name__ == "__main__":
    main()
