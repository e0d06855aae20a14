"""What lists of commands share: the Typer application, how a command is made, options that several have.

Each command's work is imported when it is called.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

import typer

from clfractal.cli import completion
from clfractal.cli.shell import Shell

Work = Callable[[], None]

app = typer.Typer(
    name="clfractal",
    help="Renders 3D fractals with OpenCL: YAML scenes in, finished pictures out.",
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Scene = Annotated[
    str,
    typer.Argument(
        metavar="SCENE", help="A scene file, or a picture that clfractal wrote; - is standard input."
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Replace a value of the scene, such as camera.fov=30; repeatable."
    ),
]
DeviceOption = Annotated[
    str | None,
    typer.Option(
        "--device",
        help="cpu, gpu, PLATFORM:DEVICE, or part of a name.  [env: CLFRACTAL_DEVICE]",
        autocompletion=completion.kinds_of_devices,
    ),
]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="ADDRESS",
        help="Render on a Dask cluster: its scheduler, such as tcp://HOST:8786, or local:N for N workers here.",
    ),
]
DevicesOption = Annotated[
    list[str] | None,
    typer.Option(
        "--device",
        help="cpu, gpu, PLATFORM:DEVICE, or part of a name; cpu/2+2 for parts of one; all; repeatable."
        "  [env: CLFRACTAL_DEVICE]",
        autocompletion=completion.kinds_of_devices,
    ),
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
    typer.Option(
        "--precision",
        help="auto, float32 or float64.  [default: as in the scene, else auto]",
        autocompletion=completion.precisions,
    ),
]
Size = Annotated[
    str | None,
    typer.Option("--size", metavar="WxH", help="Size in pixels; the camera stays where it is."),
]
Samples = Annotated[int | None, typer.Option("--samples", help="Rays per pixel, in total.")]
Quality = Annotated[
    str | None,
    typer.Option(
        "--quality",
        metavar="PRESET",
        help="draft, good, final or print: samples and noise together; other options win.",
        autocompletion=completion.quality_presets,
    ),
]
Denoise = Annotated[
    bool,
    typer.Option(
        "--denoise", help="Take the noise out of the finished picture by Open Image Denoise (extra denoise)."
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Show more: statistics, causes of errors, drivers' messages.")
]


def command(function: Callable[..., Work]) -> Callable[..., Work]:
    """Makes a function a command of its name; its options say how much the shell tells, which is `context.obj`.

    A name that is a word of Python has `_` behind it.
    """

    @app.command(function.__name__.rstrip("_"))
    @wraps(function)
    def read(**given: Any) -> Work:
        shell: Shell = given["context"].obj
        shell.quiet, shell.verbose = given.get("quiet", False), given.get("verbose", False)
        return function(**given)

    return read
