"""Surfaces in grids as triangles: what `clfractal mesh` writes and `clfractal.mesh` gives."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from clfractal.device.cancel import CancelToken
from clfractal.device.select import choose
from clfractal.engine import grids
from clfractal.engine.grids import COLORING_KEY, Made, Talk
from clfractal.engine.prepare import prepare
from clfractal.errors import ClfractalError, FileError, SceneError, Where
from clfractal.files import memory
from clfractal.files.document import write_document
from clfractal.files.mesh import Mesh
from clfractal.files.volume_file import SCENE_KEY, Volume
from clfractal.integrators.vertices import dress, on_faces
from clfractal.scene.coloring import Coloring
from clfractal.scene.grid_values import finite_range, in_words
from clfractal.scene.load import load_coloring, load_scene, read_scene
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer

Check = Callable[[Volume], None]


@dataclass(frozen=True, slots=True)
class _Found:
    """A grid whose surface is extracted, and its origin: None for volumes from other programs."""

    volume: Volume
    level: float
    made: Made | None
    is_file: bool


def check_library() -> None:
    """Raises FileError if the library that finds triangles is not installed."""
    if importlib.util.find_spec("skimage") is None:
        raise FileError("needs scikit-image: pip install scikit-image", Where("clfractal mesh"))


def of_scene(
    scene: Scene,
    coloring: Coloring,
    *,
    device: str | None = None,
    level: float | None = None,
    close: bool = True,
    check: Check | None = None,
    talk: Talk | None = None,
    token: CancelToken | None = None,
) -> Mesh:
    """The surface in the grid of a scene with the volume renderer.

    Args:
        coloring: the one of the mesh.
        level: in the unit of the scene's values, or in the numbers of the file that it shows; None: the scene's own.
        close: whether the surface is closed where it leaves the box.
        check: called with the grid before the surface is extracted.

    Raises:
        SceneError: a wrong level, or there is no surface.
        ClfractalError: see `grids.filled`.
    """
    talk = talk or Talk()
    volume = grids.given(scene)
    if volume is not None:
        found = _of_given(scene, volume, level, talk)
    else:
        volume, made = grids.filled(scene, coloring, device, talk, token)
        found = _Found(volume, _stored(level, volume, made.job.scene), made, False)
    return _extracted(found, close, check, talk)


def of_volume(
    volume: Volume,
    *,
    device: str | None = None,
    level: float | None = None,
    close: bool = True,
    precision: str | None = None,
    folder: Path | None = None,
    check: Check | None = None,
    talk: Talk | None = None,
) -> Mesh:
    """The surface in a volume, such as one that was read from a file.

    If the volume names the scene that made it, the mesh gets that formula's normals and colours.

    Args:
        level: in the volume's numbers; None: the level of the scene that made it, or half way between the least and the
            largest value.
        precision: number type of the normals; None: the scene's.
        folder: where files that the scene names are looked for.

    Raises:
        SceneError: there is no surface.
        DeviceError, KernelBuildError: normals could not be computed.
    """
    talk = talk or Talk()
    return _extracted(_of_file(volume, device, level, precision, folder, talk), close, check, talk)


def _extracted(found: _Found, close: bool, check: Check | None, talk: Talk) -> Mesh:
    from clfractal.voxels.isosurface import extract  # its library takes 0.3 s to load

    volume = found.volume
    if check is not None:
        check(volume)
    mesh = extract(
        volume.values,
        found.level,
        origin=volume.origin,
        directions=volume.directions,
        close=close,
        progress=talk.of("triangles"),
    )
    if not len(mesh.triangles):
        raise _no_surface(found, close)
    dressed = mesh if found.made is None else _dressed(mesh, found.made, volume, talk)
    return replace(dressed, inputs=volume.inputs, remarks=volume.remarks)


def _of_given(scene: Scene, volume: Volume, level: float | None, talk: Talk) -> _Found:
    """The grid from a file that a scene shows; a level is in the file's numbers, by default the scene's level."""
    assert scene.given is not None
    low, high = scene.given.low, scene.given.high
    wanted = grids.volume_settings(scene).used_level(low, high) if level is None else level
    talk.note(_summary(volume, wanted))
    return _Found(volume, wanted, None, True)


def _summary(volume: Volume, level: float) -> str:
    z, y, x = volume.values.shape
    return f"{x} x {y} x {z} voxels, {memory.shown(volume.values.nbytes)}, level {level:g}"


def _stored(level: float | None, volume: Volume, scene: Scene) -> float:
    """The level of a grid that a scene filled, as its values are stored."""
    settings = grids.volume_settings(scene)
    low, high = settings.value_range(scene.formula.iterations)
    wanted = settings.used_level(low, high) if level is None else level
    if not low < wanted <= high:
        raise SceneError(f"must be above {low:g} and at most {high:g}, got {wanted:g}", Where(path="level"))
    # Floats are a value's own numbers, bytes are spread over its range.
    return 255 * (wanted - low) / (high - low) if volume.values.dtype == np.uint8 else wanted


def _of_file(
    volume: Volume,
    device: str | None,
    level: float | None,
    precision: str | None,
    folder: Path | None,
    talk: Talk,
) -> _Found:
    made = _made(volume, device, precision, folder, talk)
    if level is None and made is not None and grids.volume_settings(made.job.scene).level is not None:
        level = _stored(None, volume, made.job.scene)
    elif level is None:
        found = finite_range(volume.values)
        if found is None or found[0] == found[1]:
            raise SceneError(f"has no surface: {in_words(volume.values)}")
        level = sum(found) / 2
    talk.note(_summary(volume, level))
    return _Found(volume, level, made, True)


def _made(
    volume: Volume, device: str | None, precision: str | None, folder: Path | None, talk: Talk
) -> Made | None:
    """The scene that made a volume, if the volume names it: it gives exact normals and colours."""
    text = volume.texts.get(SCENE_KEY)
    if not text or not ("\n" in text or text.startswith("{")):  # else it would be the name of a file
        return None
    try:
        overrides = [f"renderer.precision={precision}"] if precision else []
        read = replace(read_scene(text), folder=folder or Path())
        scene = load_scene(read, overrides=overrides)
        own = volume.texts.get(COLORING_KEY, "{}")
        coloring = load_coloring(read, overrides=["renderer={type: surface}", f"coloring={own}"])
    except ClfractalError as error:
        talk.note(f"its scene cannot be used, so normals come from the values: {error}")
        return None
    if not isinstance(scene.renderer, VolumeRenderer) or scene.renderer.file is not None:
        return None
    if not np.array_equal(volume.directions, np.diag(np.diag(volume.directions))):  # not along the axes
        return None
    chosen = choose(device)
    return Made(prepare(scene, chosen, on_start=talk.say), chosen, coloring)


def _text(made: Made) -> str:
    """The text about the scene that a mesh file contains."""
    resolved = made.job.resolved()
    del resolved["coloring"]
    coloring = write_document({"coloring": made.coloring.model_dump(mode="json")})
    return write_document(resolved) + "".join(f"# {line}\n" for line in coloring.splitlines())


def _no_surface(found: _Found, close: bool) -> ClfractalError:
    """The error for a surface without triangles, with the reason."""
    volume = found.volume
    z, y, x = volume.values.shape
    if not close and bool((np.asarray(volume.values[0, 0, 0]) >= found.level).all()):
        inside = "the whole box is inside"
        if found.is_file:
            inside = f"at the level {found.level:g} {inside}, as {in_words(volume.values)}"
        return SceneError(
            f"has no surface: {inside}; closed, its faces would be the surface (without --no-close)"
        )
    if found.is_file:
        return SceneError(f"has no surface at the level {found.level:g}: {in_words(volume.values)}")
    size = " x ".join(f"{side:.4g}" for side in volume.spacing * (x, y, z))
    middle = volume.origin + (np.array((x, y, z)) - 1) / 2 @ volume.directions
    place = ", ".join(f"{number:.6g}" for number in middle)
    return SceneError(
        f"nothing of the set lies in the box of {size} around [{place}], at {x} x {y} x {z} voxels"
    )


def _dressed(mesh: Mesh, made: Made, volume: Volume, talk: Talk) -> Mesh:
    """The mesh with the formula's normals and the scene's colours, and the scene as its text."""
    job, by = made.job, made.coloring.by
    plan = job.views[0].plan
    if made.coloring.kind.known != "at_hit":
        talk.say(f"coloring.by: {by} cannot be computed for vertices; they get the material's colour")
    spacing = np.diag(volume.directions)
    z, y, x = volume.values.shape
    dressed = dress(
        mesh,
        job.scene,
        made.coloring,
        made.device,
        lanes=plan.lanes,
        precision=plan.precision,
        voxel=float(volume.spacing.min()),
        flat=on_faces(mesh.vertices, volume.origin - spacing / 2, spacing, (x, y, z)),
        progress=talk.of("normals"),
    )
    return replace(dressed, text=_text(made))
