"""What programs make a volume of, checked: each error is a line that names the argument."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.errors import SceneError, Where, arguments


def grid_of(values: Any) -> npt.NDArray[Any]:
    """Values as a volume has them: numbers of up to 64 bits in the machine's byte order, shape (nz, ny, nx)."""
    try:
        grid = values if isinstance(values, np.ndarray) else np.asarray(values)
    except (TypeError, ValueError):  # lists of unlike lengths
        grid = np.zeros(0, object)
    if grid.dtype.kind not in "biuf" or grid.dtype.itemsize > 8:
        kind = str(grid.dtype) if grid.dtype != object else arguments.shown(arguments.plain(values))
        raise SceneError(
            f"must be an array of integers or floats of up to 64 bits, got {kind}", Where(path="values")
        )
    if grid.ndim != 3 or 0 in grid.shape:
        raise SceneError(
            f"must have the shape (nz, ny, nx), with at least one voxel, got {grid.shape}",
            Where(path="values"),
        )
    return grid if grid.dtype.isnative else grid.astype(grid.dtype.newbyteorder("="))


def doubles(name: str, value: Any, shape: tuple[int, ...], form: str) -> npt.NDArray[np.float64]:
    """Finite numbers of a shape; `form` tells it in the message."""
    try:
        found = np.array(value)
        numbers = found.astype(np.float64, casting="unsafe" if found.dtype.kind in "iuf" else "no")
    except (TypeError, ValueError):
        numbers = np.zeros(0)
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise SceneError(f"must be {form}, all finite, got {_shown(value)}", Where(path=name))
    return numbers


def steps(value: Any) -> npt.NDArray[np.float64]:
    """The steps between voxels, as rows."""
    found = doubles("directions", value, (3, 3), "3 steps of 3 numbers each")
    longest = np.abs(found).max(axis=1, keepdims=True)
    if not longest.all() or np.linalg.matrix_rank(found / longest) < 3:
        raise SceneError(
            f"must be steps that do not lie in one plane, got {found.tolist()}", Where(path="directions")
        )
    return found


def _shown(value: Any) -> str:
    shape = getattr(value, "shape", None)
    return f"an array of shape {shape}" if isinstance(shape, tuple) else arguments.shown(value)


def texts(texts: Any) -> Mapping[str, str]:
    """Texts by keys."""
    if not isinstance(texts, Mapping):
        arguments.refuse("texts", "must be a mapping of texts", texts)
    for key, text in texts.items():
        if not isinstance(key, str) or not isinstance(text, str):
            arguments.refuse(
                "texts", "must be texts by keys that are texts", text if isinstance(key, str) else key
            )
    return texts


def paths(paths: Any) -> tuple[Path, ...]:
    """A list of paths."""
    if isinstance(paths, (str, Path)) or not isinstance(paths, Iterable):
        arguments.refuse("inputs", "must be a list of paths", paths)
    return tuple(arguments.path_of("inputs", each) for each in paths)
