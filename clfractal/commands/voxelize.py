"""`clfractal voxelize`: a scene's formula as a grid of voxels in a file."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clfractal.commands.progress import LINE_EVERY_SECONDS
from clfractal.commands.shell import Shell
from clfractal.errors import ClfractalError, FileError, SceneError, Where
from clfractal.files import memory
from clfractal.files.atomic import check_output
from clfractal.files.inputs import refuse_overwriting
from clfractal.files.volume import BESIDE, EXTENSIONS, SCENE_KEY, Volume, write_volume
from clfractal.scene.coloring import Coloring
from clfractal.scene.load import load_coloring, load_scene, read_scene
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer

if TYPE_CHECKING:
    from clfractal.device.select import Device
    from clfractal.voxels.grid import Grid
    from clfractal.work.job import Job

_AS_VOLUME, _AS_SURFACE, _PLAIN = (
    "renderer={type: volume}",
    "renderer={type: surface}",
    "coloring={by: solid}",
)
COLORING_KEY = "coloring"
"""Key of the volume's text with the scene's coloring: the volume renderer supports fewer colorings than a mesh."""


@dataclass(frozen=True, slots=True)
class GridOrder:
    """The options of `clfractal voxelize` and `clfractal mesh`, as they were given."""

    source: str
    output: Path
    resolution: str | None = None
    device: str | None = None
    precision: str | None = None
    overrides: tuple[str, ...] = ()


class StageProgress:
    """Prints a line now and then: how much of a stage is done."""

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._next = time.monotonic() + LINE_EVERY_SECONDS

    def say(self, stage: str, part: float) -> None:
        """Print the finished fraction of the stage, 0 to 1, unless a line was printed a moment ago."""
        now = time.monotonic()
        if now >= self._next and part < 1:
            self._next = now + LINE_EVERY_SECONDS
            self._shell.say(f"{stage}: {part:4.0%}")

    def of(self, stage: str) -> Callable[[float], None]:
        """The same for one stage, as a function of the finished fraction."""
        return lambda part: self.say(stage, part)


def voxelize(order: GridOrder, shell: Shell, *, compress: bool = False) -> None:
    """Fills the grid of a scene and writes it; a grid that the scene shows from a file is converted.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device; an earlier file stays as it was.
    """
    start = time.perf_counter()
    shell.mute_drivers()
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
    volume = given_volume(order, scene)
    if volume is None:
        grid, job, _ = fill(order, scene, shell)
        volume = grid_volume(grid, job, coloring)
    write_volume(order.output, volume, compress=compress)
    shell.state = lambda: "clfractal: interrupted"
    size = memory.shown(order.output.stat().st_size)
    sides = " x ".join(map(str, volume.values.shape[::-1]))
    shell.say(f"{order.output}: {sides} voxels, {size}, {time.perf_counter() - start:.2f} s")


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
    text = read_scene(Path(order.source))
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


def fill(order: GridOrder, scene: Scene, shell: Shell) -> tuple[Grid, Job, Device]:
    """The scene's grid, its job and the device that it is on; the memory that it needs is printed first.

    Raises:
        ClfractalError: it does not fit; the device failed.
    """
    assert isinstance(scene.renderer, VolumeRenderer)
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.device.select import choose
    from clfractal.scene.checks import used_boxes
    from clfractal.voxels.fill import FillProgress, fill_grid
    from clfractal.voxels.lattice import lattice_of
    from clfractal.work.prepare import prepare

    settings = scene.renderer
    lattice = lattice_of(used_boxes(scene, settings)[1], settings.resolution)
    x, y, z = lattice.shape
    need = x * y * z * (1 if settings.store == "byte" else 4)
    have = memory.available()
    needs = f"{x} x {y} x {z} voxels need {memory.shown(need)} of memory"
    if need > have:
        where = Where("--resolution") if order.resolution else Where(order.source, path="renderer.resolution")
        raise SceneError(f"{needs}, {memory.shown(have)} are left", where)
    shell.say(f"{order.source}: {needs}, {memory.shown(have)} are left")
    device = choose(order.device)
    job = prepare(scene, device, on_start=shell.say)
    plan = job.views[0].plan
    if job.remark:
        shell.say(f"{order.source}: {job.remark}")
    stages = StageProgress(shell)

    def progress(state: FillProgress) -> None:
        stages.say(f"voxels, {state.stage}", state.done / max(state.total, 1))

    grid = fill_grid(
        scene,
        settings,
        device,
        lanes=plan.lanes,
        precision=plan.precision,
        on_compile=shell.say,
        progress=progress,
    )
    return grid, job, device


def given_volume(order: GridOrder, scene: Scene) -> Volume | None:
    """The grid from a file that a scene shows, with the scene's position and size; None if it shows its formula.

    It has no texts: the scene's formula did not make the grid.
    """
    given = scene.given
    if given is None:
        return None
    if order.resolution is not None:
        raise SceneError(
            "applies only to grids filled from a formula; the scene shows a file", Where("--resolution")
        )
    spacing = np.array(given.spacing)
    return Volume(given.values, np.array(given.corner) + spacing / 2, np.diag(spacing))


def grid_volume(grid: Grid, job: Job, coloring: Coloring) -> Volume:
    """The grid's values as they are stored, with where they are and the scene that made them."""
    settings = job.scene.renderer
    assert isinstance(settings, VolumeRenderer)
    corner, spacing = np.array(grid.corner), np.array(grid.spacing)
    texts = {
        # One line, and no colon before a space: VTK's reader would take the text before it for a field's name.
        SCENE_KEY: _one_line(job.resolved()),
        COLORING_KEY: _one_line(coloring.model_dump(mode="json")),
        "value": settings.value,
        # What the bytes 0 and 255 stand for; floats are the value's own numbers.
        "range": f"{grid.range[0]:g} {grid.range[1]:g}",
    }
    return Volume(grid.dense(), corner + spacing / 2, np.diag(spacing), texts)


def _one_line(plain: Any) -> str:
    return json.dumps(plain, separators=(",", ":")).replace(": ", ":\\u0020")
