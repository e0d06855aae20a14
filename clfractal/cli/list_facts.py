"""The commands that check and tell, and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clfractal.cli import completion
from clfractal.cli.options import (
    AsJson,
    DeviceOption,
    Overrides,
    Precision,
    Quiet,
    Scene,
    Verbose,
    Work,
    app,
    shell_of,
)


@app.command()
def check(
    context: typer.Context,
    scene: Scene,
    overrides: Overrides = None,
    parallax: Annotated[
        bool,
        typer.Option(
            "--parallax", help="Measure the depth of a stereo scene and print its range of parallax."
        ),
    ] = False,
    as_json: AsJson = False,
    device: DeviceOption = None,
    verbose: Verbose = False,
) -> Work:
    """Check a scene and print it with every default filled in."""
    from clfractal.cli.check import check_scene

    shell = shell_of(context, verbose=verbose)
    return lambda: check_scene(
        scene, tuple(overrides or ()), shell, parallax=parallax, as_json=as_json, device=device
    )


@app.command()
def probe(
    context: typer.Context,
    scene: Scene,
    pixel: Annotated[str, typer.Argument(metavar="X,Y", help="The pixel, counted from the top left.")],
    as_json: AsJson = False,
    device: DeviceOption = None,
    precision: Precision = None,
    size: Annotated[
        str | None,
        typer.Option("--size", metavar="WxH", help="Size of the picture in pixels, instead of the scene's."),
    ] = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Tell what lies at a pixel: point, normal, depth, distance, counts."""
    from clfractal.cli.order import Order
    from clfractal.cli.probe import probe_pixel

    order = Order(
        scene=scene, device=device, precision=precision, size=size, overrides=tuple(overrides or ())
    )
    shell = shell_of(context, quiet=quiet, verbose=verbose)
    return lambda: probe_pixel(order, pixel, shell, as_json=as_json)


@app.command()
def devices(
    context: typer.Context, as_json: AsJson = False, quiet: Quiet = False, verbose: Verbose = False
) -> Work:
    """List every OpenCL device and its speed, which is measured once and then remembered."""
    from clfractal.cli.devices import list_devices

    shell = shell_of(context, quiet=quiet, verbose=verbose)
    return lambda: list_devices(shell, as_json=as_json)


@app.command()
def precompile(
    context: typer.Context,
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SCENE]...",
            help="Scene files, or pictures that clfractal wrote.  [default: all formulas and scenes of the library]",
        ),
    ] = None,
    device: DeviceOption = None,
    precision: Precision = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Compile programs before pictures and windows wait for them; they are kept in the cache."""
    from clfractal.cli.precompile import precompile as work

    shell = shell_of(context, quiet=quiet, verbose=verbose)
    return lambda: work(tuple(scenes or ()), device, precision, shell)


@app.command()
def formulas(
    context: typer.Context,
    name: Annotated[
        str | None,
        typer.Argument(
            help="Name of a formula, of the library or your own.", autocompletion=completion.formula_names
        ),
    ] = None,
    as_json: AsJson = False,
) -> Work:
    """List the library of formulas, or describe one."""
    from clfractal.cli import list_formulas as work

    shell = shell_of(context)
    facts, words = (
        (work.facts_of_all, work.list_formulas)
        if name is None
        else (lambda: work.facts_of(name), lambda: work.tell_formula(name))
    )
    return lambda: shell.print_json(facts()) if as_json else shell.print(words())


@app.command()
def schema(context: typer.Context) -> Work:
    """Print the JSON Schema of scene files, for editors."""
    from clfractal.scene import load

    shell = shell_of(context)
    return lambda: shell.print_json(load.schema())


@app.command()
def bench(
    context: typer.Context,
    device: DeviceOption = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE.json", help="Also write the table as JSON.")
    ] = None,
    rows: Annotated[
        list[str] | None,
        typer.Option("--row", metavar="NAME", help="Measure only this row; repeatable."),
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Measure this machine's speed and print a table."""
    from clfractal.cli.bench import run

    shell = shell_of(context, quiet=quiet, verbose=verbose)
    return lambda: run(device=device, json_file=json_file, shell=shell, wanted=rows or ())
