"""Grids of voxels made of scenes, as plain data, for `clfractal voxelize` and Python."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device, choose
from clfractal.engine.job import Job
from clfractal.engine.prepare import prepare
from clfractal.engine.remarks import remarks_of_grid
from clfractal.errors import SceneError, Where
from clfractal.files import memory
from clfractal.files.volume_file import SCENE_KEY, Volume
from clfractal.scene.checks import used_boxes
from clfractal.scene.coloring import Coloring
from clfractal.scene.model import Scene
from clfractal.scene.object_checks import check_objects
from clfractal.scene.volume import VolumeRenderer
from clfractal.voxels.fill import fill_grid
from clfractal.voxels.grid import Grid
from clfractal.voxels.lattice import lattice_of

COLORING_KEY = "coloring"
"""Key of the volume's text with the scene's coloring: the volume renderer supports fewer colorings than a mesh."""


def _nothing(*_: Any) -> None:
    """Nobody listens."""


@dataclass(frozen=True, slots=True)
class Talk:
    """Who is told what goes on.

    Attributes:
        say: a line about the work, such as what is compiled.
        note: a line about the source: what it needs, what cannot be done with it.
        progress: a stage, and its finished part, 0 to 1. An exception in it ends the work.
    """

    say: Callable[[str], None] = _nothing
    note: Callable[[str], None] = _nothing
    progress: Callable[[str, float], None] = _nothing

    def of(self, stage: str) -> Callable[[float], None]:
        """The progress of one stage."""
        return lambda part: self.progress(stage, part)


@dataclass(frozen=True, slots=True)
class Made:
    """Where a grid came from, and the look of its surface."""

    job: Job
    device: Device
    coloring: Coloring


def as_volume(scene: Scene) -> tuple[Scene, Coloring]:
    """A scene as grids are made of it, and the coloring of a mesh of it.

    The scene gets the volume renderer, with default values if it had another one, and a plain coloring: this renderer does
    not support every coloring.

    Raises:
        SceneError: the scene has an object that cannot be filled, such as water; at its key.
    """
    renderer: Any = scene.renderer if isinstance(scene.renderer, VolumeRenderer) else {"type": "volume"}
    changed = scene.model_copy(update={"renderer": renderer, "coloring": {}, "layout": None})
    # Else water would be missing without a word.
    check_objects(changed)
    return changed, scene.coloring


def filled(
    scene: Scene,
    coloring: Coloring,
    device: str | None = None,
    talk: Talk | None = None,
    token: CancelToken | None = None,
) -> tuple[Volume, Made]:
    """The grid of a volume scene's formula, and where it came from; the memory that it needs is told first.

    Raises:
        SceneError: it does not fit into memory.
        DeviceError, KernelBuildError: the device failed.
        Stopped: the token was set.
    """
    talk = talk or Talk()
    settings = volume_settings(scene)
    lattice = lattice_of(used_boxes(scene, settings)[1], settings.resolution)
    x, y, z = lattice.shape
    need = x * y * z * (1 if settings.store == "byte" else 4)
    have = memory.available()
    needs = f"{x} x {y} x {z} voxels need {memory.shown(need)} of memory"
    if need > have:
        raise SceneError(f"{needs}, {memory.shown(have)} are left", Where(path="renderer.resolution"))
    talk.note(f"{needs}, {memory.shown(have)} are left")
    chosen = choose(device)
    job = prepare(scene, chosen, on_start=talk.say)
    plan = job.views[0].plan

    def progress(stage: str, done: int, total: int) -> None:
        talk.progress(f"voxels, {stage}", done / max(total, 1))

    grid = fill_grid(
        scene,
        settings,
        chosen,
        lanes=plan.lanes,
        precision=plan.precision,
        on_compile=talk.say,
        progress=progress,
        token=token,
    )
    volume = _volume(grid, job, coloring)
    own = (job.remark,) if job.remark else ()
    return replace(volume, remarks=(*own, *remarks_of_grid(scene, volume.values))), Made(
        job, chosen, coloring
    )


def given(scene: Scene) -> Volume | None:
    """The grid from a file that a scene shows, with the scene's position and size; None if it shows its formula.

    It has no texts: the scene's formula did not make the grid.
    """
    found = scene.given
    if found is None:
        return None
    return Volume(
        found.values,
        found.place.first_voxel,
        np.array(found.place.steps),
        inputs=scene.files,
        remarks=remarks_of_grid(scene, found.values),
    )


def volume_settings(scene: Scene) -> VolumeRenderer:
    """The settings of a scene with the volume renderer."""
    assert isinstance(scene.renderer, VolumeRenderer)
    return scene.renderer


def refuse_resolution(resolution: object) -> None:
    """Raises SceneError if a resolution is given for a grid that has its own."""
    if resolution is not None:
        raise SceneError(
            "applies only to grids filled from a formula; the scene shows a file", Where(path="resolution")
        )


def _volume(grid: Grid, job: Job, coloring: Coloring) -> Volume:
    """The grid's values as they are stored, with where they are and the scene that made them."""
    settings = volume_settings(job.scene)
    texts = {
        # One line, and no colon before a space: VTK's reader would take the text before it for a field's name.
        SCENE_KEY: _one_line(job.resolved()),
        COLORING_KEY: _one_line(coloring.model_dump(mode="json")),
        "value": settings.value,
        # What the bytes 0 and 255 stand for; floats are the value's own numbers.
        "range": f"{grid.range[0]:g} {grid.range[1]:g}",
    }
    place = grid.place
    return Volume(grid.dense(), place.first_voxel, np.array(place.steps), texts, job.scene.files)


def _one_line(plain: Any) -> str:
    return json.dumps(plain, separators=(",", ":")).replace(": ", ":\\u0020")
