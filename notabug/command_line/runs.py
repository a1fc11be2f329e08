"""Commands about finished runs: report, diff, accept, merge, gallery."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from notabug.command_line.app import app
from notabug.command_line.examples import epilog
from notabug.command_line.options import (
    AS_AUTHORED,
    Baseline,
    Chosen,
    Json,
    Page,
    Renderer,
    Variants,
    choosing,
)

PANEL = "Go on from a run"


@app.command(epilog=epilog("report"), rich_help_panel=PANEL)
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


@app.command(epilog=epilog("diff"), rich_help_panel=PANEL)
def diff(
    before: Annotated[Path, typer.Argument(metavar="RUN_A", help="The folder of a run.")],
    after: Annotated[Path, typer.Argument(metavar="RUN_B", help="The folder of a later one.")],
    as_json: Json = False,
) -> None:
    """Say what changed from one run to another, worst first."""
    from notabug.commands.diff import command

    raise typer.Exit(command(before, after, as_json))


@app.command(epilog=epilog("accept"), rich_help_panel=PANEL)
@choosing
def accept(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene of the last run.")],
    renderer: Renderer,
    because: Annotated[str, typer.Option(help="Why: a sentence for whoever reads the file next.")],
    chosen: Chosen = AS_AUTHORED,
    link: Annotated[str, typer.Option(help="Where it is discussed.")] = "",
    expires: Annotated[str, typer.Option(metavar="YYYY-MM-DD", help="From when on it is not accepted.")] = "",
    band: Annotated[float, typer.Option(min=0.0, max=1.0, help="Share by which area and jnd may differ.")] = 0.1,
    run: Annotated[Path, typer.Option("--run", help="The folder of the run.")] = Path("notabug-out"),
    expect: Annotated[Path, typer.Option(help="The file to write.")] = Path("notabug.expect.toml"),
    as_json: Json = False,
) -> None:
    """Accept one result of the last run: write it to notabug.expect.toml, for review."""
    from notabug.commands.accept import command

    raise typer.Exit(
        command(
            scene=scene,
            renderer=renderer,
            variants=chosen.variants,
            view=chosen.view,
            because=because,
            link=link,
            expires=expires,
            band=band,
            out=run,
            path=expect,
            as_json=as_json,
        )
    )


@app.command(epilog=epilog("merge"), rich_help_panel=PANEL)
def merge(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folders of runs, such as shards.")],
    out: Annotated[Path, typer.Option(help="The folder to make.")],
    partial: Annotated[
        bool, typer.Option("--partial", help="Also where a shard, the end of a run or a picture is missing.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Make one run of several, pictures and all."""
    from notabug.commands.merge import command

    raise typer.Exit(command(folders, out, partial, as_json))


@app.command(epilog=epilog("gallery"), rich_help_panel=PANEL)
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
