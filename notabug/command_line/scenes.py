"""Commands about scenes: check, adapt, export, list, references."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from notabug.command_line.app import app
from notabug.command_line.examples import epilog
from notabug.command_line.options import (
    AS_AUTHORED,
    Chosen,
    Deed,
    Format,
    Json,
    Scenes,
    Topic,
    Variant,
    Variants,
    choosing,
)

PANEL = "Scenes"


@app.command(epilog=epilog("check"), rich_help_panel=PANEL)
@choosing
def check(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A USD file, or an id.")],
    chosen: Chosen = AS_AUTHORED,
    as_json: Json = False,
) -> None:
    """Say what of a scene is read, what is approximated, what is not read and what is out of the contract."""
    from notabug.commands.check import command

    raise typer.Exit(command(source=scene, variants=chosen.variants, view=chosen.view, as_json=as_json))


@app.command(epilog=epilog("adapt"), rich_help_panel=PANEL)
@choosing
def adapt(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A USD file.")],
    out: Annotated[Path, typer.Option(help="The layer to write, beside the scene or above it.")],
    chosen: Chosen = AS_AUTHORED,
    size: Annotated[str, typer.Option(metavar="WxH", help="Pixels; default: the scene's own, else 256 across.")] = "",
    as_json: Json = False,
) -> None:
    """Write a layer over a scene that makes it judgeable; the scene itself stays as it is."""
    from notabug.commands.adapt import command

    raise typer.Exit(
        command(source=scene, out=out, variants=chosen.variants, view=chosen.view, size=size, as_json=as_json)
    )


@app.command(epilog=epilog("export"), rich_help_panel=PANEL)
@choosing
def export(
    to: Annotated[Format, typer.Option("--to", help="The format.")],
    scenes: Scenes = None,
    chosen: Chosen = AS_AUTHORED,
    variants: Annotated[
        Variants, typer.Option(help="Default variants only, or each set varied in turn.")
    ] = Variants.default,
    out: Annotated[Path, typer.Option(help="Folder for class/scene/variant/.")] = Path("notabug-scenes"),
    meshes: Annotated[
        bool, typer.Option("--spheres-as-meshes", help='Write exact spheres as meshes: for spheres = "mesh".')
    ] = False,
    as_json: Json = False,
) -> None:
    """Write scenes for renderers that read no USD, with scene.json beside each."""
    from notabug.commands.export import command

    raise typer.Exit(
        command(scenes or [], chosen.variants, variants is Variants.all, to.value, out, as_json, chosen.view, meshes)
    )


@app.command("list", epilog=epilog("list"), rich_help_panel=PANEL)
def list_(
    topic: Annotated[Topic, typer.Argument(help="What to list.")] = Topic.scenes,
    as_json: Json = False,
) -> None:
    """List scenes, renderers, models, variants, workarounds, declarations, or the numbers that decide a verdict."""
    from notabug.commands.listing import command

    raise typer.Exit(command(topic.value, as_json))


@app.command(epilog=epilog("references"), rich_help_panel=PANEL)
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
    from notabug.commands.references import command

    raise typer.Exit(command(deed.value, scenes or [], variant or [], deep, as_json))
