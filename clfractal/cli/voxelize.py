"""`clfractal voxelize`: a scene's formula as a grid of voxels in a file."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.cli.order import naming_options
from clfractal.cli.pipes import piped, refuse_stream
from clfractal.cli.progress import LINE_EVERY_SECONDS
from clfractal.cli.shell import Shell
from clfractal.device.activity import doing
from clfractal.errors import ClfractalError, FileError, SceneError, Where, speaking_of
from clfractal.files import memory
from clfractal.files.atomic import check_output
from clfractal.files.inputs import refuse_overwriting
from clfractal.files.volume_file import BESIDE, EXTENSIONS, write_volume
from clfractal.scene.coloring import Coloring
from clfractal.scene.load import load_coloring, load_scene, read_scene
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer

if TYPE_CHECKING:
    from clfractal.engine.grids import Talk

_AS_VOLUME, _AS_SURFACE, _PLAIN = (
    "renderer={type: volume}",
    "renderer={type: surface}",
    "coloring={by: solid}",
)


@dataclass(frozen=True, slots=True)
class GridOrder:
    """The options of `clfractal voxelize` and `clfractal mesh`, as they were given."""

    source: str
    output: Path
    resolution: str | None = None
    device: str | None = None
    precision: str | None = None
    overrides: tuple[str, ...] = ()
    folder: Path | None = None
    """Where files that the scene names are looked for; None: beside it."""


class StageProgress:
    """Prints a line now and then: how much of a stage is done."""

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._next = time.monotonic() + LINE_EVERY_SECONDS

    def say(self, stage: str, part: float) -> None:
        """Print the finished fraction of the stage, 0 to 1, unless a line was printed a moment ago."""
        now = time.monotonic()
        self._shell.alive()
        if now >= self._next and part < 1:
            self._next = now + LINE_EVERY_SECONDS
            self._shell.say(f"{stage}: {part:4.0%}")


def voxelize(order: GridOrder, shell: Shell, *, compress: bool = False) -> None:
    """Fills the grid of a scene and writes it; a grid that the scene shows from a file is converted.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device; an earlier file stays as it was.
    """
    if str(order.output).lower() == "-.npy":
        refuse_stream(order.output, "beside an NPY there is a second file; use -.nrrd")
    with piped(shell, order.source, [(order.output, ".nrrd")]) as files:
        (output,) = files.outputs
        _voxelize(replace(order, source=files.source, folder=files.folder, output=output), shell, compress)


def _voxelize(order: GridOrder, shell: Shell, compress: bool) -> None:
    start = time.perf_counter()
    check_output(order.output, EXTENSIONS)
    files: list[str | Path] = [order.output]
    if order.output.suffix.lower() == ".npy":
        if compress:
            raise FileError(
                "cannot be compressed: NPY has no compression; use .nrrd", Where(str(order.output))
            )
        files.append(f"{order.output}{BESIDE}")
        check_output(files[-1], (BESIDE,))
    scene, coloring = load_order(order)
    refuse_overwriting(files, scene.files)
    shell.state = lambda: f"{order.output}: interrupted, nothing was written"
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine import grids

    with speaking_of_order(order):
        volume = grids.given(scene)
        if volume is not None:
            grids.refuse_resolution(order.resolution)
        else:
            volume, _ = grids.filled(scene, coloring, order.device, talk_of(order, shell))
    with doing(f"writing {order.output}"):
        write_volume(order.output, volume, compress=compress)
    shell.state = lambda: "clfractal: interrupted"
    size = memory.shown(order.output.stat().st_size)
    sides = " x ".join(map(str, volume.values.shape[::-1]))
    shell.say(f"{order.output}: {sides} voxels, {size}, {time.perf_counter() - start:.2f} s")
    for remark in volume.remarks:
        shell.say(f"{order.source}: {remark}")


def load_order(order: GridOrder) -> tuple[Scene, Coloring]:
    """The scene with the options folded in, and the coloring that a mesh of it gets. The file is read once.

    The scene gets the volume renderer, with default values if it had another one. As this renderer does not support every
    coloring, the scene gets a plain coloring, and its own is checked separately, as for a surface.

    Raises:
        ClfractalError: errors name the option that was given.
    """
    given: dict[str, tuple[str, str]] = {}  # key -> option, value
    if order.resolution is not None:
        given["renderer.resolution"] = ("--resolution", _resolution(order.resolution))
    if order.precision is not None:
        given["renderer.precision"] = ("--precision", json.dumps(order.precision))
    read = read_scene(Path(order.source))
    text = read if order.folder is None else replace(read, folder=order.folder)
    kind = text.value("renderer", "type") or "surface"
    coloring = load_coloring(
        text,
        overrides=[*([] if kind == "surface" else [_AS_SURFACE]), *filter(_is_of_coloring, order.overrides)],
    )
    before = [_PLAIN] if kind == "volume" else [_AS_VOLUME, _PLAIN]
    wanted = [each for each in order.overrides if not _is_of_coloring(each)]
    overrides = [*before, *wanted, *(f"{key}={value}" for key, (_, value) in given.items())]
    try:
        scene = load_scene(text, overrides=overrides)
    except ClfractalError as error:
        key = (error.where.file or "").removeprefix("--set ")
        if key not in given:
            raise
        raise type(error)(error.message, replace(error.where, file=given[key][0])) from error
    if not isinstance(scene.renderer, VolumeRenderer):
        where = Where(order.source, path="renderer.type")
        raise SceneError(f"must be volume here, got {scene.renderer.type}", where)
    return scene, coloring


def _is_of_coloring(override: str) -> bool:
    return re.match(r"\s*coloring\s*[.=]", override) is not None


def _resolution(text: str) -> str:
    """As a value of the scene: voxels along the longest side, or along x, y and z."""
    if not re.fullmatch(r"-?\d{1,9}(,-?\d{1,9}){0,2}", text, re.ASCII) or text.count(",") == 1:
        raise SceneError(f"must be N or NX,NY,NZ, such as 256; got {text[:60]!r}", Where("--resolution"))
    return f"[{text}]" if "," in text else text


def talk_of(order: GridOrder, shell: Shell) -> Talk:
    """What goes on, as lines of the shell."""
    from clfractal.engine.grids import Talk

    return Talk(shell.say, lambda line: shell.say(f"{order.source}: {line}"), StageProgress(shell).say)


@contextmanager
def speaking_of_order(order: GridOrder) -> Iterator[None]:
    """Errors name the option that gave a value, else the source."""
    options = {"level": "--level", "resolution": "--resolution"}
    if order.resolution is not None:
        options["renderer.resolution"] = "--resolution"
    with speaking_of(order.source), naming_options(options):
        yield
