"""The Python API: scenes in, films of NumPy arrays out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from clfractal.errors import FormulaError
from clfractal.scene.load import load_scene as load_scene
from clfractal.scene.model import Scene

if TYPE_CHECKING:
    from clfractal.device.structs import Precision
    from clfractal.pictures.film import Film
    from clfractal.work.run import ProgressCallback

__all__ = ["escape", "load_scene", "render", "render_pair"]


def render(
    scene: Scene | str | Path | Mapping[str, Any],
    device: str | None = None,
    progress: ProgressCallback | None = None,
    *,
    precision: str | None = None,
    samples: int | None = None,
    region: tuple[int, int, int, int] | None = None,
    channels: Sequence[str] | None = None,
) -> Film:
    """Renders a scene into memory; a stereo scene's two pictures are combined by its mode (see `render_pair`).

    Args:
        scene: a Scene, or what `load_scene` takes: a path, YAML text, or plain data.
        device: `cpu`, `gpu`, `PLATFORM:DEVICE`, or part of a name; None: CLFRACTAL_DEVICE, else the best.
        progress: called with a `clfractal.Progress` after each batch of tiles; an exception in it ends
            the render.
        precision: `auto`, `float32` or `float64`; None: the scene's.
        samples: rays per pixel; None: the scene's.
        region: x, y, width, height of the part to render, pixels from the top left; None: all of it.
        channels: names of the channels; None: the scene's `output.channels`.

    Returns:
        A film: `film["R"]`, `film["Z"]`, ... are float32 arrays of shape (height, width) of the region;
        colours are linear Rec. 709, positions and depth in scene units.

    Raises:
        SceneError, FormulaError: the scene or a setting is wrong.
        DeviceError: no device, an unknown one, too little memory on it, or it failed.
        KernelBuildError: the generated program does not compile.
    """
    from clfractal.work.engine import Engine

    with Engine(device) as engine:
        return engine.render(
            scene, progress, precision=precision, samples=samples, region=region, channels=channels
        )


def render_pair(
    scene: Scene | str | Path | Mapping[str, Any],
    device: str | None = None,
    progress: ProgressCallback | None = None,
    *,
    precision: str | None = None,
    samples: int | None = None,
    channels: Sequence[str] | None = None,
) -> tuple[Film, Film]:
    """Renders both eyes' pictures of a stereo scene into memory, for any `stereo.mode`.

    Arguments and errors as for `render`.

    Returns:
        The films of the left and the right eye, of the size of `image` (half of it in the squeezed modes).
    """
    from clfractal.work.engine import Engine

    with Engine(device) as engine:
        return engine.render_pair(scene, progress, precision=precision, samples=samples, channels=channels)


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
        iterations: the maximum number of applications.
        bailout: |z| beyond which a point has escaped; None: the formula's.
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
    from clfractal.device.select import choose
    from clfractal.formulas.catalog import load_chain
    from clfractal.renderers import points as launch
    from clfractal.renderers.lanes import best_lanes, rule_of

    chain = load_chain(formula, parameters)
    if precision not in ("float32", "float64"):
        raise FormulaError(f"precision must be float32 or float64, got {precision!r}")
    if isinstance(iterations, bool) or not isinstance(iterations, (int, np.integer)) or iterations < 0:
        raise FormulaError(f"iterations must be a whole number, at least 0, got {iterations!r}")
    places = np.asarray(points, np.float64)
    if places.ndim != 2 or places.shape[1] != 3:
        raise FormulaError(f"points must have shape (n, 3), got {places.shape}")
    number, chosen = cast("Precision", precision), choose(device)
    lanes = best_lanes(chosen, number, rule_of(chain))
    return launch.escape(
        chain, places, int(iterations), device=chosen, lanes=lanes, precision=number, bailout=bailout
    )
