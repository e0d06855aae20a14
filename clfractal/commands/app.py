"""The shell's commands and options. Each command's work is imported when it is called."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer

import clfractal
from clfractal.commands.shell import Shell
from clfractal.errors import STATUS_BAD_INPUT, STATUS_INTERRUPTED

Work = Callable[[], None]

app = typer.Typer(
    name="clfractal",
    help="Renders 3D fractals with OpenCL: YAML scenes in, finished pictures out.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Scene = Annotated[
    str, typer.Argument(metavar="SCENE", help="A scene file, or a picture that clfractal wrote.")
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Replace a value of the scene, such as camera.fov=30; repeatable."
    ),
]
DeviceOption = Annotated[
    str | None,
    typer.Option("--device", help="cpu, gpu, PLATFORM:DEVICE, or part of a name.  [env: CLFRACTAL_DEVICE]"),
]
Resolution = Annotated[
    str | None,
    typer.Option(
        "--resolution",
        metavar="N",
        help="Voxels along the longest side, or NX,NY,NZ.  [default: as in the scene, else 512]",
    ),
]
Precision = Annotated[
    str | None,
    typer.Option("--precision", help="auto, float32 or float64.  [default: as in the scene, else auto]"),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Show more: statistics, causes of errors, drivers' messages.")
]


def call(arguments: Sequence[str], shell: Shell) -> int:
    """Runs the command that the arguments name; gives the exit status.

    Typer only reads the arguments and returns the work as a function, which runs outside Typer.

    Raises:
        ClfractalError: and whatever else a command raises.
    """
    try:
        work = app(list(arguments), prog_name="clfractal", obj=shell, standalone_mode=False)
    except Exception as error:
        # Typer's own errors: their classes differ between its versions, but all have this method.
        tell = getattr(error, "format_message", None)
        if tell is None:
            raise
        command = getattr(getattr(error, "ctx", None), "command_path", "clfractal")
        text = " ".join(str(tell()).split()).rstrip(".")
        shell.refuse(f"{command}: {text}; see {command} --help")
        return STATUS_BAD_INPUT
    if work == STATUS_INTERRUPTED:  # Typer's status for Ctrl-C
        raise KeyboardInterrupt
    if callable(work):
        work()
    return 0


def _shell(context: typer.Context, *, quiet: bool = False, verbose: bool = False) -> Shell:
    shell = context.obj
    assert isinstance(shell, Shell)
    shell.quiet, shell.verbose = quiet, verbose
    return shell


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"clfractal {clfractal.__version__}")
        raise typer.Exit


@app.callback()
def root(
    _version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Renders 3D fractals with OpenCL: YAML scenes in, finished pictures out."""


@app.command()
def render(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o", "--output", help="An .exr or .png file; repeatable.  [default: the scene's name with .png]"
        ),
    ] = None,
    device: DeviceOption = None,
    precision: Annotated[
        str | None,
        typer.Option("--precision", help="auto, float32 or float64.  [default: as in the scene, else auto]"),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option("--size", metavar="WxH", help="Size in pixels; the camera stays where it is."),
    ] = None,
    overrides: Overrides = None,
    region: Annotated[
        str | None,
        typer.Option(
            "--region",
            metavar="X,Y,W,H",
            help="Render only this part of the picture; pixels from the top left.",
        ),
    ] = None,
    samples: Annotated[int | None, typer.Option("--samples", help="Rays per pixel, in total.")] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the work kept in OUTPUT.partial.")
    ] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    stats: Annotated[
        Path | None, typer.Option("--stats", metavar="FILE.json", help="Write times and counts as JSON.")
    ] = None,
) -> Work:
    """Render a scene to one or more picture files."""
    from clfractal.commands.render import Order, render_scene

    order = Order(
        scene=scene,
        outputs=tuple(output or ()),
        device=device,
        precision=precision,
        size=size,
        overrides=tuple(overrides or ()),
        region=region,
        samples=samples,
        resume=resume,
        stats=stats,
    )
    shell = _shell(context, quiet=quiet, verbose=verbose)
    return lambda: render_scene(order, shell)


@app.command()
def slices(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="A .png or .exr file; slice.png becomes slice_0001.png, ...; repeatable.  [default: slice.png]",
        ),
    ] = None,
    count: Annotated[int, typer.Option("--count", help="Number of slices.")] = 10,
    spacing: Annotated[
        float | None,
        typer.Option(
            "--spacing", help="Scene units between two slices.  [default: slices fill the formula's bounds]"
        ),
    ] = None,
    start: Annotated[
        int, typer.Option("--start", metavar="N", help="Number of the first slice to render.")
    ] = 1,
    device: DeviceOption = None,
    precision: Annotated[
        str | None,
        typer.Option("--precision", help="auto, float32 or float64.  [default: as in the scene, else auto]"),
    ] = None,
    size: Annotated[
        str | None, typer.Option("--size", metavar="WxH", help="Size in pixels; the plane stays where it is.")
    ] = None,
    overrides: Overrides = None,
    samples: Annotated[int | None, typer.Option("--samples", help="Samples per pixel, in total.")] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Render a stack of parallel cut planes to numbered picture files."""
    from clfractal.commands.render import Order
    from clfractal.commands.slices import Stack, render_slices

    order = Order(
        scene=scene,
        outputs=tuple(output or ()),
        device=device,
        precision=precision,
        size=size,
        overrides=tuple(overrides or ()),
        samples=samples,
    )
    stack = Stack(count, spacing, start)
    shell = _shell(context, quiet=quiet, verbose=verbose)
    return lambda: render_slices(order, stack, shell)


@app.command()
def vary(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Where the files go.  [default: here]")
    ] = Path(),
    count: Annotated[int, typer.Option("--count", help="Number of variations.")] = 12,
    strength: Annotated[str, typer.Option("--strength", help="slight, medium or heavy.")] = "medium",
    seed: Annotated[int, typer.Option("--seed", help="Number that selects the variations.")] = 0,
    only: Annotated[
        str | None,
        typer.Option(
            "--only", metavar="KINDS", help="What may change: formula,camera,colors or some of them."
        ),
    ] = None,
    sheet: Annotated[
        Path | None, typer.Option("--sheet", metavar="FILE.png", help="Also write one picture of all.")
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            "--size", metavar="WxH", help="Size of the small pictures.  [default: the longer side is 320]"
        ),
    ] = None,
    device: DeviceOption = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Write variations of a scene to choose from, each with a small picture."""
    from clfractal.commands.order import Order
    from clfractal.commands.vary import Choice, vary_scene

    order = Order(scene=scene, device=device, size=size, overrides=tuple(overrides or ()))
    choice = Choice(output, count, strength, seed, sheet, only)
    shell = _shell(context, quiet=quiet, verbose=verbose)
    return lambda: vary_scene(order, choice, shell)


@app.command()
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
    from clfractal.commands.voxelize import GridOrder
    from clfractal.commands.voxelize import voxelize as work

    order = GridOrder(scene, output, resolution, device, precision, tuple(overrides or ()))
    shell = _shell(context, quiet=quiet, verbose=verbose)
    return lambda: work(order, shell, compress=compress)


@app.command()
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
    from clfractal.commands.mesh import make_mesh
    from clfractal.commands.voxelize import GridOrder

    order = GridOrder(source, output, resolution, device, precision, tuple(overrides or ()))
    shell = _shell(context, quiet=quiet, verbose=verbose)
    return lambda: make_mesh(order, shell, level=level, close=not no_close)


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
    device: DeviceOption = None,
    verbose: Verbose = False,
) -> Work:
    """Check a scene and print it with every default filled in."""
    from clfractal.commands.check import check_scene

    shell = _shell(context, verbose=verbose)
    return lambda: check_scene(scene, tuple(overrides or ()), shell, parallax=parallax, device=device)


@app.command()
def devices(context: typer.Context, quiet: Quiet = False, verbose: Verbose = False) -> Work:
    """List every OpenCL device and its speed, which is measured once and then remembered."""
    from clfractal.commands.devices import list_devices

    shell = _shell(context, quiet=quiet, verbose=verbose)
    return lambda: list_devices(shell)


@app.command()
def formulas(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(help="Name of a formula in the library.")] = None,
) -> Work:
    """List the library of formulas, or describe one."""
    from clfractal.commands.formulas import list_formulas, tell_formula

    shell = _shell(context)
    return lambda: shell.print(list_formulas() if name is None else tell_formula(name))


@app.command()
def schema(context: typer.Context) -> Work:
    """Print the JSON Schema of scene files, for editors."""
    import json

    from clfractal.scene import load

    shell = _shell(context)
    return lambda: shell.print(json.dumps(load.schema(), indent=2))


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
    from clfractal.commands.bench import run

    shell = _shell(context, quiet=quiet, verbose=verbose)
    shell.mute_drivers()
    return lambda: run(device=device, json_file=json_file, shell=shell, wanted=rows or ())


@app.command()
def view(
    context: typer.Context,
    scene: Annotated[
        str | None,
        typer.Argument(
            metavar="[SCENE]",
            help="A scene file, or a picture that clfractal wrote.  [default: the gallery]",
        ),
    ] = None,
    device: DeviceOption = None,
    size: Annotated[
        str | None, typer.Option("--size", metavar="WxH", help="Size of the window.  [default: 1280x720]")
    ] = None,
    fullscreen: Annotated[bool, typer.Option("--fullscreen", help="Fill the screen.")] = False,
    monitors: Annotated[
        str | None,
        typer.Option(
            "--monitors",
            metavar="1,2",
            help="Fill these screens, counted from the left: one borderless window over all of them.",
        ),
    ] = None,
    windows: Annotated[
        bool, typer.Option("--windows", help="With two monitors: a window for each, one eye each.")
    ] = False,
    stereo: Annotated[
        str | None,
        typer.Option(
            "--stereo", metavar="MODE", help="anaglyph, split, rows, ... as stereo.mode; off: without."
        ),
    ] = None,
    overrides: Overrides = None,
    shot: Annotated[
        Path | None,
        typer.Option(
            "--shot",
            metavar="FILE.png",
            help="Write what the window shows once it is finished, and close it.",
        ),
    ] = None,
    save: Annotated[
        Path | None, typer.Option("--save", metavar="FILE.yaml", help="Where Ctrl+S saves the scene.")
    ] = None,
    record: Annotated[
        Path | None, typer.Option("--record", metavar="FILE", help="Record all events with their times.")
    ] = None,
    play: Annotated[
        Path | None,
        typer.Option(
            "--play", metavar="FILE", help="Play recorded events, and close the window after the last."
        ),
    ] = None,
    panels: Annotated[
        bool, typer.Option("--panels/--no-panels", help="Begin with the panels open, or only the picture.")
    ] = True,
    share: Annotated[
        bool,
        typer.Option(
            "--share/--no-share", help="Share textures between OpenCL and OpenGL where it is possible."
        ),
    ] = True,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Open a window: explore a scene live, in mono or stereo, and save what you see."""
    from clfractal.commands.view import size_of
    from clfractal.commands.view import view as work
    from clfractal.viewer.options import Options

    options = Options(
        scene,
        device,
        size_of(size),
        fullscreen,
        monitors,
        windows,
        stereo,
        tuple(overrides or ()),
        shot,
        save,
        record,
        play,
        panels,
        share,
    )
    shell = _shell(context, quiet=quiet, verbose=verbose)
    return lambda: work(options, shell)
