"""The commands that make pictures, and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clfractal.cli.options import (
    ClusterOption,
    Denoise,
    DeviceOption,
    DevicesOption,
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


@command
def render(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="An .exr, .png, .jpg or .webp file, or - for standard output; repeatable.  [default: SCENE with .png]",
        ),
    ] = None,
    device: DevicesOption = None,
    cluster: ClusterOption = None,
    precision: Precision = None,
    size: Size = None,
    overrides: Overrides = None,
    region: Annotated[
        str | None,
        typer.Option(
            "--region",
            metavar="X,Y,W,H",
            help="Render only this part of the picture; pixels from the top left.",
        ),
    ] = None,
    samples: Samples = None,
    quality: Quality = None,
    denoise: Denoise = False,
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
    from clfractal.cli.render import Order, render_scene

    order = Order(
        scene=scene,
        outputs=tuple(output or ()),
        device=tuple(device) if device else None,
        cluster=cluster,
        precision=precision,
        size=size,
        overrides=tuple(overrides or ()),
        region=region,
        samples=samples,
        resume=resume,
        stats=stats,
        quality=quality,
        denoise=denoise,
    )
    return lambda: render_scene(order, context.obj)


@command
def animate(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="A picture file, as for render, with # for the frame's number: frame_####.exr; or a film: film.mp4,"
            " .mkv or .mov; repeatable.  [default: SCENE_####.png]",
        ),
    ] = None,
    frames: Annotated[
        str | None,
        typer.Option("--frames", metavar="A-B:STEP", help="Render only these frames, counted from 0."),
    ] = None,
    device: DevicesOption = None,
    cluster: ClusterOption = None,
    precision: Precision = None,
    size: Size = None,
    overrides: Overrides = None,
    samples: Samples = None,
    quality: Quality = None,
    denoise: Denoise = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Keep frames that are there, and continue the one in work.")
    ] = False,
    preview: Annotated[
        Path | None,
        typer.Option("--preview", metavar="FILE", help="Write a sheet of small frames instead."),
    ] = None,
    missing: Annotated[
        bool, typer.Option("--missing", help="Print which frames are missing, as --frames takes them.")
    ] = False,
    codec: Annotated[
        str | None,
        typer.Option(
            "--codec", help="Of films: h264, h265, av1, ffv1 or prores.  [default: by the file's name]"
        ),
    ] = None,
    bits: Annotated[int | None, typer.Option("--bits", help="Of films: bits per channel.")] = None,
    chroma: Annotated[str | None, typer.Option("--chroma", help="Of films: 420, 422, 444 or rgb.")] = None,
    crf: Annotated[
        int | None,
        typer.Option("--crf", help="Of films: the encoder's quality; smaller is better and larger."),
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    stats: Annotated[
        Path | None, typer.Option("--stats", metavar="FILE.json", help="Write times and counts as JSON.")
    ] = None,
) -> Work:
    """Render the frames of a scene's animation to numbered picture files, or films."""
    from clfractal.cli.animate import animate_scene, list_missing
    from clfractal.cli.film_sheet import preview_film
    from clfractal.cli.order import Order
    from clfractal.files.film_kinds import Recipe

    order = Order(
        scene=scene,
        outputs=tuple(output or ()),
        device=tuple(device) if device else None,
        cluster=cluster,
        precision=precision,
        size=size,
        overrides=tuple(overrides or ()),
        samples=samples,
        quality=quality,
        denoise=denoise,
        resume=resume,
        stats=stats,
    )
    recipe = Recipe(codec, bits, chroma, crf)
    if missing:
        return lambda: list_missing(order, frames, context.obj)
    if preview is not None:
        return lambda: preview_film(order, preview, frames, context.obj)
    return lambda: animate_scene(order, frames, recipe, context.obj)


@command
def sound(
    context: typer.Context,
    source: Annotated[str, typer.Argument(metavar="FILE.wav", help="A WAV file.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="A .csv file.")] = Path("tracks.csv"),
    fps: Annotated[float, typer.Option("--fps", help="Frames per second.")] = 30.0,
    frames: Annotated[
        int | None,
        typer.Option("--frames", metavar="N", help="Number of frames.  [default: as long as the sound]"),
    ] = None,
    band: Annotated[
        list[str] | None,
        typer.Option(
            "--band",
            metavar="NAME=LOW-HIGH",
            help="A band of frequencies, Hz; repeatable.  [default: bass=20-150, middle=150-2000, treble=2000-16000]",
        ),
    ] = None,
    threshold: Annotated[
        float, typer.Option("--threshold", help="What is not louder than this part of the loudest is 0.")
    ] = 0.0,
    fade: Annotated[
        float, typer.Option("--fade", metavar="SECONDS", help="Time in which a beat fades to a third.")
    ] = 0.15,
    gain: Annotated[float, typer.Option("--gain", help="Factor on all values.")] = 1.0,
    absolute: Annotated[
        bool,
        typer.Option("--absolute", help="1 is a sine at full scale, and not each band's loudest frame."),
    ] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Write how loud a sound is, frame by frame, as a table for a scene's tracks."""
    from clfractal.cli.sound import SoundOrder, write_loudness

    order = SoundOrder(
        Path(source), output, fps, frames, tuple(band or ()), not absolute, threshold, fade, gain
    )
    return lambda: write_loudness(order, context.obj)


@command
def slices(
    context: typer.Context,
    scene: Scene,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            help="A picture file, as for render; slice.png becomes slice_0001.png, ...; repeatable.  [default: slice.png]",
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
    precision: Precision = None,
    size: Annotated[
        str | None, typer.Option("--size", metavar="WxH", help="Size in pixels; the plane stays where it is.")
    ] = None,
    overrides: Overrides = None,
    samples: Annotated[int | None, typer.Option("--samples", help="Samples per pixel, in total.")] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> Work:
    """Render a stack of parallel cut planes to numbered picture files."""
    from clfractal.cli.render import Order
    from clfractal.cli.slices import Stack, render_slices

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
    return lambda: render_slices(order, stack, context.obj)
