"""`clfractal mesh`: the surface in a scene's grid, or in a volume file, as triangles in a file."""

from __future__ import annotations

import importlib.util
import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clfractal.commands.shell import Shell
from clfractal.commands.voxelize import (
    COLORING_KEY,
    GridOrder,
    StageProgress,
    fill,
    given_volume,
    grid_volume,
    load_order,
)
from clfractal.errors import ClfractalError, FileError, SceneError, Where
from clfractal.files import memory
from clfractal.files.atomic import check_output
from clfractal.files.document import write_document
from clfractal.files.inputs import noting, refuse_overwriting
from clfractal.files.mesh import EXTENSIONS, SINGLE_PRECISION, TOO_FINE, Mesh, is_too_fine, write_mesh
from clfractal.files.nrrd import MAGIC
from clfractal.files.regular import read_bytes
from clfractal.files.volume import SCENE_KEY, Volume, read_volume
from clfractal.scene.coloring import Coloring
from clfractal.scene.load import load_coloring, load_scene, read_scene
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer

if TYPE_CHECKING:
    from clfractal.device.select import Device
    from clfractal.work.job import Job

_NPY = b"\x93NUMPY"


@dataclass(frozen=True, slots=True)
class _Made:
    """The origin of a grid, and the look of its surface."""

    job: Job
    device: Device
    coloring: Coloring


@dataclass(frozen=True, slots=True)
class _Found:
    """A grid whose surface is extracted, and its origin: None for volumes from other programs."""

    volume: Volume
    level: float
    made: _Made | None
    is_file: bool


def make_mesh(order: GridOrder, shell: Shell, *, level: float | None = None, close: bool = True) -> None:
    """Extracts the surface of a scene's grid or of a volume file, and writes it.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device; an existing file stays unchanged.
    """
    start = time.perf_counter()
    shell.mute_drivers()
    check_output(order.output, EXTENSIONS)
    _check_library()
    if level is not None and not math.isfinite(level):
        raise SceneError(f"must be a number, got {level}", Where("--level"))
    shell.state = lambda: f"{order.output}: interrupted, nothing was written"
    read = read_bytes(Path(order.source), prefix=8)
    is_volume = read.startswith((MAGIC, _NPY))
    found = _of_file(order, level, shell) if is_volume else _of_scene(order, level, shell)
    _check_fine(order, found.volume)
    from clfractal.voxels.mesh import extract

    stages = StageProgress(shell)
    volume = found.volume
    mesh = extract(
        volume.values,
        found.level,
        origin=volume.origin,
        directions=volume.directions,
        close=close,
        progress=stages.of("triangles"),
    )
    if not len(mesh.triangles):
        raise _nothing(order, found, close)
    if found.made is not None:
        mesh = _dressed(mesh, found.made, volume, stages, shell)
    write_mesh(order.output, mesh, text=_text(found.made) if found.made is not None else "")
    shell.state = lambda: "clfractal: interrupted"
    size = memory.shown(order.output.stat().st_size)
    shell.say(
        f"{order.output}: {len(mesh.vertices):,} vertices, {len(mesh.triangles):,} triangles, {size},"
        f" {time.perf_counter() - start:.2f} s"
    )


def _check_library() -> None:
    if importlib.util.find_spec("skimage") is None:
        raise FileError("needs scikit-image: pip install scikit-image", Where("clfractal mesh"))


def _of_scene(order: GridOrder, level: float | None, shell: Shell) -> _Found:
    """The scene's grid, filled; a level is in the unit of the scene's values, by default the scene's level."""
    scene, coloring = load_order(order)
    refuse_overwriting([order.output], scene.files)
    volume = given_volume(order, scene)
    if volume is not None:
        return _of_given(order, scene, volume, level, shell)
    grid, job, device = fill(order, scene, shell)
    volume = grid_volume(grid, job, coloring)
    return _Found(volume, _stored(level, volume, job.scene), _Made(job, device, coloring), False)


def _of_given(order: GridOrder, scene: Scene, volume: Volume, level: float | None, shell: Shell) -> _Found:
    """The grid from a file that a scene shows; a level is in the file's numbers, by default the scene's level."""
    assert isinstance(scene.renderer, VolumeRenderer)
    assert scene.given is not None
    wanted = scene.renderer.used_level(scene.given.low, scene.given.high) if level is None else level
    z, y, x = volume.values.shape
    shell.say(
        f"{order.source}: {x} x {y} x {z} voxels, {memory.shown(volume.values.nbytes)}, level {wanted:g}"
    )
    return _Found(volume, wanted, None, True)


def _stored(level: float | None, volume: Volume, scene: Scene) -> float:
    """The level of a grid that a scene filled, as its values are stored."""
    assert isinstance(scene.renderer, VolumeRenderer)
    low, high = scene.renderer.value_range(scene.formula.iterations)
    wanted = scene.renderer.used_level(low, high) if level is None else level
    if not low < wanted <= high:
        raise SceneError(f"must be above {low:g} and at most {high:g}, got {wanted:g}", Where("--level"))
    # Floats are a value's own numbers, bytes are spread over its range.
    return 255 * (wanted - low) / (high - low) if volume.values.dtype == np.uint8 else wanted


def _of_file(order: GridOrder, level: float | None, shell: Shell) -> _Found:
    """A volume of a file; a level is in the file's numbers.

    The default is the level of the scene that made the volume, or half way between the least and the largest value.
    """
    for option, value in (("--set", order.overrides), ("--resolution", order.resolution)):
        if value:
            raise SceneError("applies to scenes only; the source is a volume", Where(option))
    from clfractal.voxels.mesh import value_range

    with noting() as files:
        volume = read_volume(order.source)
    refuse_overwriting([order.output], files)
    made = _made(order, volume, shell)
    if level is None and made is not None and _has_level(made.job.scene):
        level = _stored(None, volume, made.job.scene)
    elif level is None:
        low, high = value_range(volume.values)
        if low == high:
            raise SceneError(f"has no surface: all its values are {low:g}", Where(order.source))
        level = (low + high) / 2
    z, y, x = volume.values.shape
    shell.say(
        f"{order.source}: {x} x {y} x {z} voxels, {memory.shown(volume.values.nbytes)}, level {level:g}"
    )
    return _Found(volume, level, made, True)


def _has_level(scene: Scene) -> bool:
    return isinstance(scene.renderer, VolumeRenderer) and scene.renderer.level is not None


def _made(order: GridOrder, volume: Volume, shell: Shell) -> _Made | None:
    """The scene that made a volume, if the volume names it: it gives exact normals and colours."""
    text = volume.texts.get(SCENE_KEY)
    if not text or not ("\n" in text or text.startswith("{")):  # else it would be the name of a file
        return None
    from clfractal.device.select import choose
    from clfractal.work.prepare import prepare

    try:
        overrides = [f"renderer.precision={order.precision}"] if order.precision else []
        read = replace(read_scene(text), folder=Path(order.source).parent)
        scene = load_scene(read, overrides=overrides)
        own = volume.texts.get(COLORING_KEY, "{}")
        coloring = load_coloring(read, overrides=["renderer={type: surface}", f"coloring={own}"])
    except ClfractalError as error:
        shell.say(f"{order.source}: its scene cannot be used, so normals come from the values: {error}")
        return None
    if not isinstance(scene.renderer, VolumeRenderer) or scene.renderer.file is not None:
        return None
    if not _is_along_axes(volume):
        return None
    device = choose(order.device)
    return _Made(prepare(scene, device, on_start=shell.say), device, coloring)


def _text(made: _Made) -> str:
    """The text about the scene that a mesh file contains."""
    resolved = made.job.resolved()
    del resolved["coloring"]
    coloring = write_document({"coloring": made.coloring.model_dump(mode="json")})
    return write_document(resolved) + "".join(f"# {line}\n" for line in coloring.splitlines())


def _is_along_axes(volume: Volume) -> bool:
    return bool(np.array_equal(volume.directions, np.diag(np.diag(volume.directions))))


def _check_fine(order: GridOrder, volume: Volume) -> None:
    """Refuses a mesh that is too fine for its format before the work, not after it."""
    shape = np.array(volume.values.shape[::-1])
    reach = float(np.abs([volume.origin, volume.origin + (shape - 1) @ volume.directions]).max())
    if order.output.suffix.lower() in SINGLE_PRECISION and is_too_fine(float(volume.spacing.min()), reach):
        raise FileError(f"cannot be written: {TOO_FINE}", Where(str(order.output)))


def _nothing(order: GridOrder, found: _Found, close: bool) -> ClfractalError:
    """The error for a surface without triangles, with the reason."""
    z, y, x = found.volume.values.shape
    if not close and bool((np.asarray(found.volume.values[0, 0, 0]) >= found.level).all()):
        return SceneError(
            "has no surface: the whole box is inside; without --no-close its faces would be the surface",
            Where(order.source),
        )
    if found.is_file:
        from clfractal.voxels.mesh import value_range

        low, high = value_range(found.volume.values)
        text = f"has no surface at the level {found.level:g}: its values are from {low:g} to {high:g}"
        return SceneError(text, Where(order.source))
    size = " x ".join(f"{side:.4g}" for side in found.volume.spacing * (x, y, z))
    middle = found.volume.origin + (np.array((x, y, z)) - 1) / 2 @ found.volume.directions
    place = ", ".join(f"{number:.6g}" for number in middle)
    return SceneError(
        f"nothing of the set lies in the box of {size} around [{place}], at {x} x {y} x {z} voxels",
        Where(order.source),
    )


def _dressed(mesh: Mesh, made: _Made, volume: Volume, stages: StageProgress, shell: Shell) -> Mesh:
    """The mesh with the formula's normals and the scene's colours."""
    from clfractal.renderers.vertices import COLORED_BY, dress, on_faces

    job, by = made.job, made.coloring.by
    plan = job.views[0].plan
    if by not in COLORED_BY:
        shell.say(f"coloring.by: {by} cannot be computed for vertices; they get the material's colour")
    spacing = np.diag(volume.directions)
    z, y, x = volume.values.shape
    return dress(
        mesh,
        job.scene,
        made.coloring,
        made.device,
        lanes=plan.lanes,
        precision=plan.precision,
        voxel=float(volume.spacing.min()),
        flat=on_faces(mesh.vertices, volume.origin - spacing / 2, spacing, (x, y, z)),
        progress=stages.of("normals"),
    )
