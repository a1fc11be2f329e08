"""The command line. Only typer is imported here: what a command needs is imported when it runs, so help is instant."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Annotated

import typer

from notabug import __version__
from notabug.exit_codes import ExitCode, exit_code
from notabug.options import (
    Bench,
    BenchPart,
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
    Renderers,
    Samples,
    SceneOption,
    Seeds,
    Topic,
    Variant,
    Variants,
)
from notabug.scenes_usd.errors import NotabugError

app = typer.Typer(
    name="notabug",
    help="Is it a rendering bug, or really not? Renders canonical scenes and says of every picture whether it is "
    "correct, shows an expected limitation, or a genuine bug.",
    epilog="Exit codes: 0 nothing worse than accepted, 1 bug, 2 usage, 3 renderer error, 4 missing reference, 5 "
    "nothing selected, 70 a defect of notabug.",
    no_args_is_help=True,
    add_completion=False,
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


@app.command()
def run(
    scenes: Annotated[
        list[str] | None, typer.Argument(metavar="[SCENE]...", help="Ids, classes, globs or USD files; default: all.")
    ] = None,
    renderer: Renderers = None,
    variant: Variant = None,
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
    )
    raise typer.Exit(code)


@app.command()
def judge(
    images: Annotated[list[Path], typer.Argument(metavar="IMAGE...", help="Pictures; several are independent seeds.")],
    scene: SceneOption,
    variant: Variant = None,
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
    as_json: Json = False,
) -> None:
    """Judge pictures made anywhere."""
    from notabug.judging import command

    code = command(
        images=images,
        source=scene,
        variants=variant or [],
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
    )
    raise typer.Exit(code)


@app.command()
def why(
    image: Annotated[Path, typer.Argument(metavar="IMAGE", help="The picture.")],
    scene: SceneOption,
    pixel: Annotated[str, typer.Option("--pixel", metavar="X,Y", help="The pixel, from 0, y down.")],
    variant: Variant = None,
    filter: Annotated[Filter, typer.Option(help="The renderer's pixel filter.")] = Filter.unknown,  # noqa: A002
    precision: Annotated[Precision, typer.Option(help="Arithmetic of the intersections.")] = Precision.float32,
    encoding: Annotated[Encoding, typer.Option(help="What the picture's numbers are.")] = Encoding.linear,
    declare: Declare = None,
    layer: Layer = "",
    as_json: Json = False,
) -> None:
    """Say what each model predicts at one pixel, and which one fits."""
    from notabug.why import command

    code = command(
        image=image,
        source=scene,
        variants=variant or [],
        pixel=pixel,
        filter_name=filter.value,
        precision=precision.value,
        srgb=encoding is Encoding.srgb,
        as_json=as_json,
        declare_words=declare or [],
        layer=layer,
    )
    raise typer.Exit(code)


@app.command()
def references(
    deed: Annotated[Deed, typer.Argument(help="Write the references, or check that they are there and right.")],
    scenes: Annotated[list[str] | None, typer.Argument(metavar="[SCENE]...", help="Default: all.")] = None,
    variant: Variant = None,
    deep: Annotated[
        bool,
        typer.Option("--deep", help="Verify a part of each picture with 64 x 64 samples, and tell the worst error."),
    ] = False,
) -> None:
    """Build or verify the corpus of reference pictures."""
    from notabug.corpus import command

    raise typer.Exit(command(deed.value, scenes or [], variant or [], deep))


@app.command()
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


@app.command()
def export(
    to: Annotated[Format, typer.Option("--to", help="The format.")],
    scenes: Annotated[list[str] | None, typer.Argument(metavar="[SCENE]...", help="Default: all.")] = None,
    variant: Variant = None,
    variants: Annotated[
        Variants, typer.Option(help="Default variants only, or each set varied in turn.")
    ] = Variants.default,
    out: Annotated[Path, typer.Option(help="Folder for class/scene/variant/.")] = Path("notabug-scenes"),
) -> None:
    """Write scenes for renderers that read no USD, with scene.json beside each."""
    from notabug.exporting import command

    raise typer.Exit(command(scenes or [], variant or [], variants is Variants.all, to.value, out))


@app.command("list")
def list_(
    topic: Annotated[Topic, typer.Argument(help="What to list.")] = Topic.scenes,
    as_json: Json = False,
) -> None:
    """List scenes, renderers, models, variants or workarounds."""
    from notabug.listing import command

    raise typer.Exit(command(topic.value, as_json))


@app.command()
def doctor(as_json: Json = False) -> None:
    """Say what is installed, what is missing, and how to get it."""
    from notabug.doctor import command

    raise typer.Exit(command(as_json))


@app.command()
def bench(
    what: Annotated[Bench, typer.Argument(help="What to measure.")] = Bench.speed,
    quick: Annotated[bool, typer.Option("--quick", help="A small sample (not of speed).")] = False,
    out: Annotated[Path, typer.Option(help="Folder for JSON, plots and bench.html.")] = Path("notabug-bench"),
    renderer: Renderers = None,
    resume: Annotated[bool, typer.Option(help="Keep what was measured with the same code.")] = True,
    scenes: Annotated[int, typer.Option(min=0, help="Random scenes (generality); 0: 400, of a sample 20.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Of the random scenes (generality).")] = 0,
    part: Annotated[
        list[BenchPart] | None,
        typer.Option("--part", help="Of generality; again for more. Default: scenes."),
    ] = None,
    names: Annotated[bool, typer.Option(help="Look for the fault behind each bug (generality): half a minute.")] = True,
    reduce: Annotated[bool, typer.Option(help="Shrink the scene of each bug (generality).")] = False,
    as_json: Json = False,
) -> None:
    """Measure what notabug costs (speed), how well it judges (verdict), whether it is right on scenes outside the
    corpus (generality), and of renderers: error over time (efficiency), where they break (stability), and which
    relations between pictures they break (metamorphic)."""
    if what is Bench.generality:
        from notabug.bench.generality.command import command as generality

        code = generality(
            parts=[each.value for each in part or [BenchPart.scenes]],
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
    if what is Bench.verdict:
        from notabug.bench.verdict.command import command as verdict

        raise typer.Exit(verdict(quick=quick, as_json=as_json, out=out))
    if what in (Bench.efficiency, Bench.stability, Bench.metamorphic):
        from notabug.bench.measuring import command as measuring

        code = measuring(what.value, quick=quick, out=out, renderers=renderer or [], resume=resume, as_json=as_json)
        raise typer.Exit(code)
    from notabug.bench.command import command

    raise typer.Exit(command(as_json))


@app.command()
def reduce(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="An id or a USD file on which the renderer has a bug.")],
    renderer: Annotated[str, typer.Option("--renderer", "-r", help="The renderer.")],
    variant: Variant = None,
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
) -> None:
    """Shrink a scene while a renderer's bug on it stays, and write what a bug report needs."""
    from notabug.reducing import command

    raise typer.Exit(
        command(
            scene=scene,
            renderer=renderer,
            variants=variant or [],
            settings=settings or [],
            out=out,
            samples=samples,
            seeds=seeds,
            any_name=any_name,
        )
    )


@app.command()
def accept(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene of the last run.")],
    renderer: Annotated[str, typer.Option("--renderer", "-r", help="The renderer.")],
    because: Annotated[str, typer.Option(help="Why: a sentence for whoever reads the file next.")],
    variant: Variant = None,
    link: Annotated[str, typer.Option(help="Where it is discussed.")] = "",
    expires: Annotated[str, typer.Option(metavar="YYYY-MM-DD", help="From when on it is not accepted.")] = "",
    band: Annotated[float, typer.Option(min=0.0, max=1.0, help="Share by which area and jnd may differ.")] = 0.1,
    run: Annotated[Path, typer.Option("--run", help="The folder of the run.")] = Path("notabug-out"),
    expect: Annotated[Path, typer.Option(help="The file to write.")] = Path("notabug.expect.toml"),
) -> None:
    """Accept one result of the last run: write it to notabug.expect.toml, for review."""
    from notabug.accepting import command

    raise typer.Exit(
        command(
            scene=scene,
            renderer=renderer,
            variants=variant or [],
            because=because,
            link=link,
            expires=expires,
            band=band,
            out=run,
            path=expect,
        )
    )


@app.command()
def merge(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folders of runs, such as shards.")],
    out: Annotated[Path, typer.Option(help="The folder to make.")],
) -> None:
    """Make one run of several, pictures and all."""
    from notabug.merging import command

    raise typer.Exit(command(folders, out))


@app.command()
def diff(
    before: Annotated[Path, typer.Argument(metavar="RUN_A", help="The folder of a run.")],
    after: Annotated[Path, typer.Argument(metavar="RUN_B", help="The folder of a later one.")],
    as_json: Json = False,
) -> None:
    """Say what changed from one run to another, worst first."""
    from notabug.comparing import command

    raise typer.Exit(command(before, after, as_json))


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(help="The folder of a run.")] = Path("notabug-out"),
    white: Annotated[float, typer.Option(min=1e-6, help="The radiance that is shown as white.")] = 1.0,
    to: Annotated[Page, typer.Option(help="The page, or text for a build server on standard output.")] = Page.html,
) -> None:
    """Draw report.html again from run.json and the pictures next to it, or write it for a build server."""
    if to is Page.html:
        from notabug.report.page import draw

        typer.echo(draw(folder, white))
    else:
        from notabug.report.builds import command

        raise typer.Exit(command(folder, to.value))


@app.command()
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
) -> None:
    """Build a site to browse the corpus and runs, down to the float pixel."""
    from notabug.gallery.command import command

    every = variants is Variants.all
    code = command(
        runs or [], out, every_variant=every, with_models=models, step=step, bench=bench, white=white, only=scene or []
    )
    raise typer.Exit(code)


def main() -> None:
    """The program: an error that a user can act on is one line on standard error and an exit code, never a trace."""
    for stream in (sys.stdout, sys.stderr):  # a terminal that lacks a glyph gets a question mark, not a trace
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        app()
    except NotabugError as error:
        from rich.console import Console
        from rich.text import Text

        line = Text("notabug: ", style="bold red").append(" ".join(str(error).split()), style="default not bold")
        Console(stderr=True, soft_wrap=True).print(line)
        sys.exit(exit_code(error))
    except BrokenPipeError:  # the reader of our output went away
        sys.stderr.close()
        sys.exit(ExitCode.OK)
    except Exception as error:  # exit code 1, Python's own for any error, would tell of a renderer's bug
        sys.stderr.write(f"notabug: internal error: {type(error).__name__}: {error}; {_saved_trace()}\n")
        sys.exit(ExitCode.INTERNAL)


def _saved_trace() -> str:
    """Where the trace of the error in hand was saved; the trace itself where nothing can be written."""
    import tempfile
    import traceback

    try:
        with tempfile.NamedTemporaryFile("w", prefix="notabug-", suffix=".log", delete=False, encoding="utf-8") as log:
            log.write(f"{sys.argv}\n{traceback.format_exc()}")
            return f"please report it with the trace in {log.name}"
    except OSError:
        return f"please report it\n{traceback.format_exc()}"


if __name__ == "__main__":
    main()
