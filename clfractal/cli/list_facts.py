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
    command,
)


@command
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

    return lambda: check_scene(
        scene, tuple(overrides or ()), context.obj, parallax=parallax, as_json=as_json, device=device
    )


@command
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
    return lambda: probe_pixel(order, pixel, context.obj, as_json=as_json)


@command
def devices(
    context: typer.Context, as_json: AsJson = False, quiet: Quiet = False, verbose: Verbose = False
) -> Work:
    """List every OpenCL device and its speed, which is measured once and then remembered."""
    from clfractal.cli.devices import list_devices

    return lambda: list_devices(context.obj, as_json=as_json)


@command
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

    return lambda: work(tuple(scenes or ()), device, precision, context.obj)


@command
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

    facts, words = (
        (work.facts_of_all, work.list_formulas)
        if name is None
        else (lambda: work.facts_of(name), lambda: work.tell_formula(name))
    )
    return lambda: context.obj.print_json(facts()) if as_json else context.obj.print(words())


@command
def schema(context: typer.Context) -> Work:
    """Print the JSON Schema of scene files, for editors."""
    from clfractal.scene import load

    return lambda: context.obj.print_json(load.schema())


@command
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
    stages: Annotated[
        bool, typer.Option("--stages", help="Print instead what each stage of the rows' pictures takes.")
    ] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Measure this machine's speed and print a table."""
    from clfractal.cli import bench, bench_stages

    run = bench_stages.run if stages else bench.run
    return lambda: run(device=device, json_file=json_file, shell=context.obj, wanted=rows or ())
