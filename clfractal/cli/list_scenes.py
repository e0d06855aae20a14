"""The commands about scene files, and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clfractal.cli import completion
from clfractal.cli.options import (
    DeviceOption,
    Overrides,
    Precision,
    Quality,
    Quiet,
    Samples,
    Scene,
    Size,
    Verbose,
    Work,
    command,
)
from clfractal.errors import FileError, Where


@command
def scenes(
    context: typer.Context,
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="A scene to print; with --sheet the scenes to show.",
            autocompletion=completion.scene_names,
        ),
    ] = None,
    sheet: Annotated[
        Path | None,
        typer.Option("--sheet", metavar="FILE", help="Write one picture with small pictures of all scenes."),
    ] = None,
    device: DeviceOption = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """List the scenes that come with the program, print one, or show them in a picture."""
    from clfractal.cli.show_scenes import draw_sheet, list_scenes, tell_scene

    wanted = names or []

    def work() -> None:
        if sheet is not None:
            draw_sheet(wanted, sheet, device, context.obj)
        elif len(wanted) > 1:
            raise FileError(
                f"prints one scene, got {len(wanted)}; --sheet shows several", Where("clfractal scenes")
            )
        else:
            context.obj.print(tell_scene(wanted[0]) if wanted else list_scenes())

    return work


@command
def import_(
    context: typer.Context,
    source: Annotated[
        str,
        typer.Argument(
            metavar="FILE", help="Settings of Mandelbulber 2 (.fract), or a fragment of FragM (.frag)."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="SCENE", help="The scene file.  [default: FILE.yaml, here]"),
    ] = None,
    look: Annotated[
        str,
        typer.Option(
            "--look", metavar="LOOK", help="same: light and colours as there; ours: light along paths."
        ),
    ] = "same",
    formulas: Annotated[
        Path | None,
        typer.Option(
            "--formulas",
            metavar="FOLDER",
            help="Where the texts of its formulas are.  [default: where it is installed]",
        ),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(
            "--preset", metavar="NAME", help="A preset of a fragment.  [default: Default, else the first]"
        ),
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Make a scene of a file of Mandelbulber 2 or FragM, and tell what of it was not taken over."""
    from clfractal.cli.import_scene import import_scene

    return lambda: import_scene(source, output, look, formulas, preset, context.obj)


@command
def new(
    context: typer.Context,
    name: Annotated[str, typer.Argument(metavar="NAME", help="The file to write; .yaml may be left out.")],
    formula: Annotated[
        str | None,
        typer.Option(
            "--formula",
            metavar="F",
            help="A formula's name, or a formula file.  [default: mandelbulb]",
            autocompletion=completion.formula_names,
        ),
    ] = None,
    device: DeviceOption = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Write a scene to start from: all of a formula in the picture, in a good light, with comments."""
    from clfractal.cli.new import new_scene

    return lambda: new_scene(name, formula, device, context.obj)


@command
def watch(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o", "--output", help="A picture file; repeatable.  [default: the scene's name with .png]"
        ),
    ] = None,
    size: Size = None,
    samples: Samples = None,
    quality: Quality = None,
    device: DeviceOption = None,
    precision: Precision = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Render a scene anew whenever it or a file that it names changes; Ctrl-C ends it."""
    from clfractal.cli.order import Order
    from clfractal.cli.watch import watch_scene

    order = Order(
        scene=scene,
        outputs=tuple(output or ()),
        device=device,
        precision=precision,
        size=size,
        overrides=tuple(overrides or ()),
        samples=samples,
        quality=quality,
    )
    return lambda: watch_scene(order, context.obj)
