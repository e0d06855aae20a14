"""`clfractal slices`: a stack of parallel cut planes as numbered pictures."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.cli.order import naming_options
from clfractal.cli.pipes import piped, refuse_stream
from clfractal.cli.progress import shown_rate
from clfractal.cli.render import Order, ordered_scene
from clfractal.cli.shell import Shell
from clfractal.errors import SceneError, Where
from clfractal.files.frame_names import PARTIAL
from clfractal.files.inputs import refuse_overwriting
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.model import Scene
from clfractal.scene.rectangle import moved

if TYPE_CHECKING:
    from clfractal.device.select import Device

MOST_SLICES = 100_000
_LINE_SECONDS = 2.0


@dataclass(frozen=True, slots=True)
class Stack:
    """Which planes to show: `count` of them, `spacing` scene units apart, the scene's own in the middle.

    `spacing` None: the planes span the formula's bounds. `start` is the number of the first slice to render, from 1.
    """

    count: int = 10
    spacing: float | None = None
    start: int = 1


def render_slices(order: Order, stack: Stack, shell: Shell) -> None:
    """Renders the planes of a scene's stack, each to its own files.

    The planes follow each other along the normal, towards the viewer; `slice.png` becomes slice_0001.png, slice_0002.png
    and so on. A slice's files appear complete or not at all; finished slices stay even if a later one fails.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device.
    """
    for path in order.outputs:
        refuse_stream(path, "slices are several files")
    with piped(shell, order.scene, [(path, "") for path in order.outputs]) as files:
        _render_slices(replace(order, scene=files.source, folder=files.folder), stack, shell)


def _render_slices(order: Order, stack: Stack, shell: Shell) -> None:
    begun = time.perf_counter()
    _check(stack)
    scene = ordered_scene(order)
    if not isinstance(scene.renderer, CutPlaneRenderer):
        where = Where(order.scene, path="renderer.type")
        raise SceneError(f"must be cut_plane for slices, got {scene.renderer.type}", where)
    numbers = range(stack.start, stack.count + 1)
    files = [_numbered(order.outputs, number, stack.count) for number in numbers]
    check_numbered(scene, files)
    scenes = [slice_scene(scene, stack, number) for number in numbers]
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.cli.numbered import render_one
    from clfractal.engine.engine import Engine

    engine = Engine(order.device, tell=shell.say)
    # (One exposure for the whole stack: that of the scene's own plane, in its middle.)
    settled = engine.settled(scene)
    if settled is not scene:
        scenes = [slice_scene(settled, stack, number) for number in numbers]
    with naming_options():
        precision = order.precision or _precision(scenes, engine.device)
    told, rays, number = begun, 0, stack.start
    shell.state = lambda: (
        f"{files[number - stack.start][0]}: interrupted with {number - 1} of {stack.count} slices done;"
        f" --start {number} continues"
    )
    for number, each, paths in zip(numbers, scenes, files, strict=True):
        with naming_options():
            job = engine.prepare(each, precision=precision, samples=order.samples)
        rays += render_one(job, engine, paths, shell).state.rays
        now = time.perf_counter()
        if now - told > _LINE_SECONDS and number < stack.count:
            told = now
            left = (now - begun) / (number + 1 - stack.start) * (stack.count - number)
            shell.say(f"slices: {number} of {stack.count}, {left:.0f} s left")
    shell.state = lambda: "clfractal: interrupted"
    seconds = time.perf_counter() - begun
    first, last = files[0][0], files[-1][0]
    shell.say(f"{first} to {last.name}: {seconds:.2f} s, {shown_rate(rays / seconds)}")


def slice_scene(scene: Scene, stack: Stack, number: int) -> Scene:
    """The scene of one plane of a stack, `number` from 1; it renders that slice alone.

    Raises:
        SceneError: the plane is too far away.
    """
    assert isinstance(scene.renderer, CutPlaneRenderer)
    spacing = stack.spacing if stack.spacing is not None else 2 * scene.chain.radius / stack.count
    offset = (number - (stack.count + 1) / 2) * spacing
    try:
        plane = moved(scene.renderer.plane, normal=offset)
    except SceneError as error:
        raise SceneError(
            f"puts slice {number} outside the range of coordinates", Where("--spacing")
        ) from error
    renderer = scene.renderer.model_copy(update={"plane": plane})
    # A picture of its own: tracks would put the plane back.
    return scene.model_copy(update={"renderer": renderer, "animation": None})


def _check(stack: Stack) -> None:
    if not 1 <= stack.count <= MOST_SLICES:
        raise SceneError(f"must be from 1 to {MOST_SLICES:,}, got {stack.count}", Where("--count"))
    if not 1 <= stack.start <= stack.count:
        raise SceneError(f"must be from 1 to the count, {stack.count}, got {stack.start}", Where("--start"))
    if stack.spacing is not None and not (math.isfinite(stack.spacing) and stack.spacing > 0):
        raise SceneError(f"must be a number above 0, got {stack.spacing:g}", Where("--spacing"))


def _numbered(outputs: tuple[Path, ...], number: int, count: int) -> tuple[Path, ...]:
    digits = max(4, len(str(count)))
    paths = outputs or (Path("slice.png"),)
    return tuple(path.with_name(f"{path.stem}_{number:0{digits}d}{path.suffix}") for path in paths)


def check_numbered(scene: Scene, files: list[tuple[Path, ...]], others: Sequence[Path] = ()) -> None:
    """Checks the files of all pictures of a command, and others that it writes, before anything is rendered."""
    from clfractal.images.formats import Content, check_output
    from clfractal.images.outputs import output_files

    written, content = [*others], Content.of(scene)
    for paths in files:
        for path in paths:
            for file in output_files(scene.stereo, path):
                if paths is files[0] or file.exists() or file.is_symlink():
                    check_output(file, content)
                written.append(file)
        written.append(paths[0].with_name(paths[0].name + PARTIAL))
    refuse_overwriting(written, scene.files)


def _precision(scenes: list[Scene], device: Device) -> str:
    """One number type for the whole stack: the more precise of those that its two ends need."""
    from clfractal.device.select import has_float64
    from clfractal.integrators.plan import choose_precision

    wanted = scenes[0].renderer.precision
    able = has_float64(device.info)
    found = {choose_precision(end, wanted, has_float64=able)[0] for end in (scenes[0], scenes[-1])}
    return max(found)
