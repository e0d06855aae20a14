"""The commands that make grids and triangles, and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clfractal.cli.options import (
    DeviceOption,
    Overrides,
    Precision,
    Quiet,
    Resolution,
    Scene,
    Verbose,
    Work,
    command,
)


@command
def voxelize(
    context: typer.Context,
    scene: Scene,
    output: Annotated[Path, typer.Option("-o", "--output", help="An .nrrd or .npy file.")],
    resolution: Resolution = None,
    device: DeviceOption = None,
    precision: Precision = None,
    overrides: Overrides = None,
    compress: Annotated[bool, typer.Option("--gzip", help="Compress the values; NRRD only.")] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Fill a scene's grid of voxels and write it to a file."""
    from clfractal.cli.voxelize import GridOrder
    from clfractal.cli.voxelize import voxelize as work

    order = GridOrder(scene, output, resolution, device, precision, tuple(overrides or ()))
    return lambda: work(order, context.obj, compress=compress)


@command
def mesh(
    context: typer.Context,
    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help="A scene, or a volume: an .nrrd, .nhdr or .npy file.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="A .ply, .stl, .obj or .glb file.")],
    resolution: Resolution = None,
    level: Annotated[
        float | None,
        typer.Option(
            "--level", help="Value at the surface.  [default: renderer.level, else the middle of the range]"
        ),
    ] = None,
    no_close: Annotated[
        bool, typer.Option("--no-close", help="Leave the surface open where the box cuts it.")
    ] = False,
    device: DeviceOption = None,
    precision: Precision = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Write the surface in a scene's grid, or in a volume file, as triangles."""
    from clfractal.cli.mesh import make_mesh
    from clfractal.cli.voxelize import GridOrder

    order = GridOrder(source, output, resolution, device, precision, tuple(overrides or ()))
    return lambda: make_mesh(order, context.obj, level=level, close=not no_close)
