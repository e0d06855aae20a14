"""The commands that propose scenes to choose from, and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clfractal.cli.options import DeviceOption, Overrides, Quiet, Scene, Verbose, Work, command

_Sheet = Annotated[
    Path | None, typer.Option("--sheet", metavar="FILE", help="Also write one picture of all.")
]
_SmallSize = Annotated[
    str | None,
    typer.Option(
        "--size", metavar="WxH", help="Size of the small pictures.  [default: the longer side is 320]"
    ),
]


@command
def vary(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="A picture, a sheet of all, with the scenes beside it; or a folder, for scenes each with its"
            " picture.  [default: here]",
        ),
    ] = Path(),
    count: Annotated[int, typer.Option("-n", "--count", help="Number of variations.")] = 12,
    strength: Annotated[str, typer.Option("--strength", help="slight, medium or heavy.")] = "medium",
    seed: Annotated[int, typer.Option("--seed", help="Number that selects the variations.")] = 0,
    only: Annotated[
        str | None,
        typer.Option(
            "--only", metavar="KINDS", help="What may change: formula,camera,colors or some of them."
        ),
    ] = None,
    sheet: _Sheet = None,
    size: _SmallSize = None,
    device: DeviceOption = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Write variations of a scene to choose from, with a sheet of small pictures or each with its own."""
    from clfractal.cli.order import Order
    from clfractal.cli.vary import Choice, vary_scene

    order = Order(scene=scene, device=device, size=size, overrides=tuple(overrides or ()))
    choice = Choice(output=output, count=count, strength=strength, seed=seed, sheet=sheet, only=only)
    return lambda: vary_scene(order, choice, context.obj)


@command
def find(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="A picture, a sheet of all, with the scenes beside it; a folder, for scenes each with its picture;"
            " or a scene file, with all as bookmarks.  [default: here]",
        ),
    ] = Path(),
    count: Annotated[int, typer.Option("-n", "--count", help="Number of views.")] = 12,
    seed: Annotated[int, typer.Option("--seed", help="Number that chooses the places that are tried.")] = 0,
    magnification: Annotated[
        float | None, typer.Option("--magnification", help="Look for deep places, so many times magnified.")
    ] = None,
    sheet: _Sheet = None,
    size: _SmallSize = None,
    device: DeviceOption = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Look for views near the set and within it, with depth and light, and write them as scenes to choose from."""
    from clfractal.cli.find import Choice, find_views
    from clfractal.cli.order import Order

    order = Order(scene=scene, device=device, size=size, overrides=tuple(overrides or ()))
    choice = Choice(output=output, count=count, seed=seed, magnification=magnification, sheet=sheet)
    return lambda: find_views(order, choice, context.obj)
