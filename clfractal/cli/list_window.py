"""The command that opens the window, and its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clfractal.cli.options import DeviceOption, Overrides, Quiet, Verbose, Work, command


@command
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
    from clfractal.cli.view import size_of
    from clfractal.cli.view import view as work
    from clfractal.viewer.window_options import Options

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
    context.obj.patient = False  # the window shows what takes long
    return lambda: work(options, context.obj)
