"""Commands about this machine and about notabug itself: doctor, install, bench."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from notabug.command_line.app import app
from notabug.command_line.examples import epilog
from notabug.command_line.options import (
    Bench,
    BenchPart,
    Json,
    Renderers,
)

PANEL = "This machine"


@app.command(epilog=epilog("doctor"), rich_help_panel=PANEL)
def doctor(as_json: Json = False) -> None:
    """Say what is installed, what is missing, and how to get it."""
    from notabug.commands.doctor import command

    raise typer.Exit(command(as_json))


@app.command(epilog=epilog("install"), rich_help_panel=PANEL)
def install(
    name: Annotated[str, typer.Argument(help="The renderer; without one, what can be installed is listed.")] = "",
    python: Annotated[str, typer.Option(help="The interpreter for it; default: one of the version it needs.")] = "",
    remove: Annotated[bool, typer.Option("--remove", help="Remove its environment instead.")] = False,
    as_json: Json = False,
) -> None:
    """Install a renderer into an environment of its own below the cache, and nothing anywhere else."""
    from notabug.commands.install import command

    raise typer.Exit(command(name, python, remove=remove, as_json=as_json))


@app.command(epilog=epilog("bench"), short_help="Measure notabug itself, and renderers.", rich_help_panel=PANEL)
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
    side: Annotated[
        int,
        typer.Option(min=0, help="Pixels along the longer side of each picture (generality); 0: as drawn, 48 to 96."),
    ] = 0,
    workers: Annotated[
        int, typer.Option(min=0, help="Processes that judge at the same time (generality); 0: one for each core.")
    ] = 0,
    reduce: Annotated[bool, typer.Option(help="Shrink the scene of each bug (generality).")] = False,
    as_json: Json = False,
) -> None:
    """Measure what notabug costs (speed), how well it judges (verdict), whether it is right on scenes outside the
    corpus (generality), and of renderers: error over time (efficiency), where they break (stability), and which
    relations between pictures they break (metamorphic). Whether what is promised under attack and failure holds: a
    renderer's misdeeds, runs that are killed, disks that fill, damaged files (faults)."""
    if what is not Bench.speed:  # which writes no files
        from notabug.runs.own_folder import claim

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
            side=side,
            workers=workers,
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
