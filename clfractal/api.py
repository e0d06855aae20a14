"""The Python API: scenes in, framebuffers of NumPy arrays out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from clfractal.errors import FormulaError, Where, arguments
from clfractal.scene.load import as_scene
from clfractal.scene.load import load_scene as load_scene
from clfractal.scene.model import Scene

if TYPE_CHECKING:
    from clfractal.device.select import Device
    from clfractal.device.structs import Precision
    from clfractal.engine.any_engine import Elsewhere
    from clfractal.engine.grids import Talk
    from clfractal.engine.run import ProgressCallback
    from clfractal.files.mesh import Mesh
    from clfractal.files.volume_file import Volume
    from clfractal.formulas.language import Chain
    from clfractal.images.framebuffer import Framebuffer
    from clfractal.images.probe import Probe
    from clfractal.integrators.points import Distances
    from clfractal.scene.coloring import Coloring

__all__ = ["distances", "escape", "load_scene", "mesh", "probe", "render", "render_pair", "voxelize"]

SceneLike: TypeAlias = Scene | str | Path | Mapping[str, Any]
"""A scene, or what `load_scene` takes."""

PRECISIONS = ("auto", "float32", "float64")


def render(
    scene: Scene | str | Path | Mapping[str, Any],
    device: str | Sequence[str] | None = None,
    progress: ProgressCallback | None = None,
    *,
    precision: str | None = None,
    samples: int | None = None,
    size: tuple[int, int] | None = None,
    region: tuple[int, int, int, int] | None = None,
    channels: Sequence[str] | None = None,
    quality: str | None = None,
    executor: Elsewhere | None = None,
) -> Framebuffer:
    """Renders a scene into memory; a stereo scene's two pictures are combined by its mode (see `render_pair`).

    Args:
        scene: a Scene, or what `load_scene` takes: a path, YAML text, or plain data.
        device: `cpu`, `gpu`, `PLATFORM:DEVICE`, or part of a name; None: CLFRACTAL_DEVICE, else the best. `all`, parts such
            as `cpu/2+2` or a list of names are several devices, which render tiles side by side.
        progress: called with a `clfractal.Progress` after each batch of tiles; an exception in it ends
            the render.
        precision: `auto`, `float32` or `float64`; None: the scene's.
        samples: rays per pixel; None: the scene's.
        size: width and height of the picture, pixels; it shows what the scene's own size shows. None: the scene's.
        region: x, y, width, height of the part to render, pixels from the top left; None: all of it.
        channels: names of the channels; None: the scene's `output.channels`.
        quality: `draft`, `good`, `final` or `print`: samples and noise together, in the place of the scene's;
            `samples` wins.
        executor: a `clfractal.Cluster` that renders in the place of a device of this process.

    Returns:
        A framebuffer: `framebuffer["R"]`, `framebuffer["Z"]`, ... are float32 arrays of shape (height, width) of the
        region; colours are linear Rec. 709, positions and depth in scene units.

    Raises:
        SceneError, FormulaError: the scene or a setting is wrong.
        DeviceError: no device, an unknown one, too little memory on it, or it failed.
        KernelBuildError: the generated program does not compile.
    """
    from clfractal.engine.engine import engine_on

    with engine_on(device, executor) as engine:
        return engine.render(
            scene,
            progress,
            precision=precision,
            samples=samples,
            size=size,
            region=region,
            channels=channels,
            quality=quality,
        )


def render_pair(
    scene: Scene | str | Path | Mapping[str, Any],
    device: str | Sequence[str] | None = None,
    progress: ProgressCallback | None = None,
    *,
    precision: str | None = None,
    samples: int | None = None,
    size: tuple[int, int] | None = None,
    channels: Sequence[str] | None = None,
    quality: str | None = None,
    executor: Elsewhere | None = None,
) -> tuple[Framebuffer, Framebuffer]:
    """Renders both eyes' pictures of a stereo scene into memory, for any `stereo.mode`.

    Arguments and errors as for `render`.

    Returns:
        The framebuffers of the left and the right eye, of the size of `image` (half of it in the squeezed modes).
    """
    from clfractal.engine.engine import engine_on

    with engine_on(device, executor) as engine:
        return engine.render_pair(
            scene,
            progress,
            precision=precision,
            samples=samples,
            size=size,
            channels=channels,
            quality=quality,
        )


def probe(
    scene: Scene | str | Path | Mapping[str, Any],
    x: int,
    y: int,
    device: str | None = None,
    *,
    precision: str | None = None,
) -> Probe:
    """What lies at a pixel of a scene's picture, found by one ray through its middle; a lens is closed for it.

    Args:
        scene: as for `render`.
        x, y: the pixel, from the top left of the finished picture.
        device: as for `render`.
        precision: as for `render`.

    Returns:
        The point, its normal, depth and distance (scene units), and counts: see `Probe`.

    Raises:
        SceneError, FormulaError: the scene is wrong, or the pixel is not in its picture.
        DeviceError, KernelBuildError: as for `render`.
    """
    from clfractal.engine.engine import Engine

    with Engine(device) as engine:
        return engine.probe(scene, x, y, precision=precision)


def escape(
    formula: str | Path | Mapping[str, Any],
    points: npt.ArrayLike,
    *,
    iterations: int,
    bailout: float | None = None,
    parameters: Mapping[str, float] | None = None,
    precision: str = "float32",
    device: str | None = None,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Counts the applications of a formula until points escape.

    Args:
        formula: a name of the library, the path of a formula file, or a mapping: a formula, or a scene's
            `formula` section (which may have `julia` and `chain`).
        points: shape (n, 3), scene units.
        iterations: the maximum number of applications, up to 2,000,000,000.
        bailout: |z| beyond which a point has escaped, above 0; None: the formula's.
        parameters: values of the formula's parameters that differ from the defaults.
        precision: `float32` or `float64`.
        device: as for `render`.

    Returns:
        (iterations, inside): integer and boolean arrays of shape (n,). The first array counts applications until
        |z| > bailout, at most `iterations`; a point that has not escaped by then is inside.

    Raises:
        FormulaError: the formula, a parameter or another argument is wrong.
        FileError: the formula's file cannot be read.
        DeviceError, KernelBuildError: as for `render`.
    """
    from clfractal.device.orbit import MOST_APPLICATIONS
    from clfractal.integrators import points as launch

    asked = _asked(formula, parameters, points, iterations, MOST_APPLICATIONS, precision)
    if bailout is not None:
        bailout = arguments.number("bailout", bailout, most=1e9, above=0, error=FormulaError)
    chosen, lanes = asked.on(device)
    return launch.escape(
        asked.chain,
        asked.points,
        asked.iterations,
        device=chosen,
        lanes=lanes,
        precision=asked.precision,
        bailout=bailout,
    )


def distances(
    formula: str | Path | Mapping[str, Any],
    points: npt.ArrayLike,
    *,
    iterations: int = 30,
    parameters: Mapping[str, float] | None = None,
    precision: str = "float32",
    device: str | None = None,
) -> Distances:
    """Distances from points to a formula's set, with the normals there.

    Args:
        formula: as for `escape`.
        points: shape (n, 3), scene units.
        iterations: applications that the set is made of, up to 1,000,000: the set of points that do not escape in so many.
        parameters, precision, device: as for `escape`.

    Returns:
        Arrays of shape (n,) and (n, 3): `step`, the distance that rays march by; `full`, the distance by the whole
        Jacobian; `normal`, the direction in which the distance grows, of length 1; `smooth`, the smooth escape count;
        and `inside`. Distances are estimates in scene units, 0 inside.

    Raises:
        FormulaError: the formula, a parameter or another argument is wrong.
        FileError: the formula's file cannot be read.
        DeviceError, KernelBuildError: as for `render`.
    """
    from clfractal.integrators import points as launch
    from clfractal.scene.formula import MOST_ITERATIONS

    asked = _asked(formula, parameters, points, iterations, MOST_ITERATIONS, precision, least=1)
    chosen, lanes = asked.on(device)
    return launch.distances(
        asked.chain, asked.points, asked.iterations, device=chosen, lanes=lanes, precision=asked.precision
    )


def voxelize(
    scene: Scene | str | Path | Mapping[str, Any],
    device: str | None = None,
    progress: Callable[[str, float], None] | None = None,
    *,
    resolution: int | Sequence[int] | None = None,
    precision: str | None = None,
) -> Volume:
    """Fills the grid of a scene's formula, as `clfractal voxelize` does.

    A scene without the volume renderer gets one with default settings. If its volume renderer shows a file, the result is
    that file's grid.

    Args:
        scene, device: as for `render`.
        progress: called with the stage of the work and its finished part, 0 to 1; an exception in it ends the work.
        resolution: voxels along the longest side, or along x, y and z; None: the scene's.
        precision: `auto`, `float32` or `float64`; None: the scene's.

    Returns:
        A volume: `values` of shape (nz, ny, nx), and where its voxels are: `origin`, `directions`, scene units.

    Raises:
        SceneError, FormulaError: the scene or an argument is wrong, or the grid does not fit into memory.
        DeviceError, KernelBuildError: as for `render`.
    """
    from clfractal.engine import grids

    arguments.function("progress", progress)
    wanted, coloring = _volume_scene(scene, resolution, precision)
    volume = grids.given(wanted)
    if volume is not None:
        grids.refuse_resolution(resolution)
        return volume
    return grids.filled(wanted, coloring, device, _talk(progress))[0]


def mesh(
    source: Scene | Volume | str | Path | Mapping[str, Any],
    device: str | None = None,
    progress: Callable[[str, float], None] | None = None,
    *,
    level: float | None = None,
    close: bool = True,
    resolution: int | Sequence[int] | None = None,
    precision: str | None = None,
) -> Mesh:
    """The surface in the grid of a scene's formula, or in a volume, as triangles: as `clfractal mesh` does.

    It has the formula's own normals and the scene's colours, if the scene is known. It needs scikit-image.

    Args:
        source: a scene as for `voxelize`, or a `Volume`.
        device, progress, resolution, precision: as for `voxelize`. A volume has no resolution to choose.
        level: the value at the surface; None: the scene's, or half way between a volume's least and largest values.
        close: whether the surface is closed where it leaves the grid.

    Returns:
        A mesh: `vertices` (n, 3) in scene units, `triangles` (m, 3), `normals` and `colors` of vertices.

    Raises:
        SceneError, FormulaError: the source or an argument is wrong, there is no surface, or no memory for the grid.
        FileError: scikit-image is not installed.
        DeviceError, KernelBuildError: as for `render`.
    """
    from clfractal.engine import grids, meshes
    from clfractal.files.volume_file import Volume

    meshes.check_library()
    arguments.function("progress", progress)
    if level is not None:
        level = arguments.number("level", level)
    close = arguments.flag("close", close)
    talk = _talk(progress)
    if isinstance(source, Volume):
        if resolution is not None:
            arguments.refuse("resolution", "applies to scenes only; the source is a volume", resolution)
        return meshes.of_volume(
            source, device=device, level=level, close=close, precision=_precision(precision), talk=talk
        )
    wanted, coloring = _volume_scene(source, resolution, precision)
    if wanted.given is not None:
        grids.refuse_resolution(resolution)
    return meshes.of_scene(wanted, coloring, device=device, level=level, close=close, talk=talk)


def _volume_scene(
    source: SceneLike, resolution: int | Sequence[int] | None, precision: str | None
) -> tuple[Scene, Coloring]:
    """The scene that a grid is made of, with arguments in it, and the coloring of its mesh."""
    from clfractal.engine import grids

    scene, coloring = grids.as_volume(as_scene(source))
    given = {"resolution": resolution, "precision": _precision(precision)}
    changes = {key: value for key, value in given.items() if value is not None}
    if changes:
        scene = scene.model_copy(update={"renderer": scene.renderer.model_copy(update=changes)})
    return scene, coloring


def _precision(given: str | None) -> str | None:
    return None if given is None else arguments.word("precision", given, PRECISIONS)


def _talk(progress: Callable[[str, float], None] | None) -> Talk:
    from clfractal.engine.grids import Talk

    return Talk() if progress is None else Talk(progress=progress)


@dataclass(frozen=True, slots=True)
class _Asked:
    """A question about points, checked."""

    chain: Chain
    points: npt.NDArray[np.float64]
    iterations: int
    precision: Precision

    def on(self, device: str | None) -> tuple[Device, int]:
        """The device, and its lanes.

        Raises:
            FormulaError: it has no float64.
            DeviceError: there is none.
        """
        from clfractal.device.select import choose, has_float64
        from clfractal.integrators.lanes import best_lanes, rule_of

        chosen = choose(device)
        if self.precision == "float64" and not has_float64(chosen.info):
            raise FormulaError("the device has no float64; use float32", Where(path="precision"))
        return chosen, best_lanes(chosen, self.precision, rule_of(self.chain))


def _asked(
    formula: str | Path | Mapping[str, Any],
    parameters: Mapping[str, float] | None,
    points: npt.ArrayLike,
    iterations: int,
    most: int,
    precision: str,
    *,
    least: int = 0,
) -> _Asked:
    from clfractal.formulas.catalog import load_chain

    if not isinstance(formula, (str, Path, Mapping)):
        allowed = "must be a name of the library, a path or a mapping"
        arguments.refuse("formula", allowed, arguments.plain(formula), FormulaError)
    if parameters is not None and not isinstance(parameters, Mapping):
        arguments.refuse("parameters", "must be a mapping", arguments.plain(parameters), FormulaError)
    chain = load_chain(arguments.plain(formula), arguments.plain(parameters))
    number = cast("Precision", arguments.word("precision", precision, PRECISIONS[1:], FormulaError))
    count = arguments.whole("iterations", iterations, least, most, FormulaError)
    return _Asked(chain, _points(points), count, number)


def _points(points: npt.ArrayLike) -> npt.NDArray[np.float64]:
    try:
        found = np.asarray(points)
        array = found.astype(np.float64, casting="unsafe" if found.dtype.kind in "biuf" else "no", copy=False)
    except (ValueError, TypeError):
        raise FormulaError("must be numbers of shape (n, 3)", Where(path="points")) from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise FormulaError(f"must have shape (n, 3), got {array.shape}", Where(path="points"))
    if not np.isfinite(array).all():
        raise FormulaError("must be finite", Where(path="points"))
    return array
