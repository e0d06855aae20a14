"""`clfractal mesh`: the surface in a scene's grid, or in a volume file, as triangles in a file."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from clfractal.cli.pipes import piped
from clfractal.cli.shell import Shell
from clfractal.cli.voxelize import GridOrder, load_order, speaking_of_order, talk_of
from clfractal.device.activity import doing
from clfractal.errors import FileError, SceneError, Where
from clfractal.files import memory
from clfractal.files.atomic import check_output
from clfractal.files.file_kinds import kind_of
from clfractal.files.inputs import noting, refuse_overwriting
from clfractal.files.mesh import EXTENSIONS, SINGLE_PRECISION, TOO_FINE, Mesh, is_too_fine, write_mesh
from clfractal.files.volume_file import Volume, read_volume


def make_mesh(order: GridOrder, shell: Shell, *, level: float | None = None, close: bool = True) -> None:
    """Extracts the surface of a scene's grid or of a volume file, and writes it.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device; an existing file stays unchanged.
    """
    with piped(shell, order.source, [(order.output, ".ply")]) as files:
        (output,) = files.outputs
        named = replace(order, source=files.source, folder=files.folder, output=output)
        _make_mesh(named, shell, level, close)


def _make_mesh(order: GridOrder, shell: Shell, level: float | None, close: bool) -> None:
    start = time.perf_counter()
    check_output(order.output, EXTENSIONS)
    if level is not None and not math.isfinite(level):
        raise SceneError(f"must be a number, got {level}", Where("--level"))
    shell.state = lambda: f"{order.output}: interrupted, nothing was written"
    is_volume = kind_of(Path(order.source)) == "volume"
    mesh = (_of_file if is_volume else _of_scene)(order, shell, level, close)
    with doing(f"writing {order.output}"):
        write_mesh(order.output, mesh)
    shell.state = lambda: "clfractal: interrupted"
    size = memory.shown(order.output.stat().st_size)
    shell.say(
        f"{order.output}: {len(mesh.vertices):,} vertices, {len(mesh.triangles):,} triangles, {size},"
        f" {time.perf_counter() - start:.2f} s"
    )
    for remark in mesh.remarks:
        shell.say(f"{order.source}: {remark}")


def _of_scene(order: GridOrder, shell: Shell, level: float | None, close: bool) -> Mesh:
    scene, coloring = load_order(order)
    refuse_overwriting([order.output], scene.files)
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine import grids, meshes

    meshes.check_library()
    with speaking_of_order(order):
        if scene.given is not None:
            grids.refuse_resolution(order.resolution)
        return meshes.of_scene(
            scene,
            coloring,
            device=order.device,
            level=level,
            close=close,
            check=lambda volume: _check_fine(order, volume),
            talk=talk_of(order, shell),
        )


def _of_file(order: GridOrder, shell: Shell, level: float | None, close: bool) -> Mesh:
    for option, value in (("--set", order.overrides), ("--resolution", order.resolution)):
        if value:
            raise SceneError("applies to scenes only; the source is a volume", Where(option))
    with noting() as files, doing(f"reading {order.source}"):
        volume = read_volume(order.source)
    refuse_overwriting([order.output], files)
    from clfractal.engine import meshes

    meshes.check_library()
    with speaking_of_order(order):
        return meshes.of_volume(
            volume,
            device=order.device,
            level=level,
            close=close,
            precision=order.precision,
            folder=Path(order.source).parent,
            check=lambda volume: _check_fine(order, volume),
            talk=talk_of(order, shell),
        )


def _check_fine(order: GridOrder, volume: Volume) -> None:
    """Refuses a mesh that is too fine for its format before the work, not after it."""
    shape = np.array(volume.values.shape[::-1])
    reach = float(np.abs([volume.origin, volume.origin + (shape - 1) @ volume.directions]).max())
    if order.output.suffix.lower() in SINGLE_PRECISION and is_too_fine(float(volume.spacing.min()), reach):
        raise FileError(f"cannot be written: {TOO_FINE}", Where(str(order.output)))
