"""Takes the noise out of a picture by Intel's Open Image Denoise (package `pyoidn`), in linear light."""

from __future__ import annotations

import importlib.util

import numpy as np
import numpy.typing as npt

from clfractal.errors import FileError, Where
from clfractal.images.tiled import Floats

NAME = "Open Image Denoise"
# The filter knows no brighter light (its range is that of half).
_BRIGHTEST = 65504.0


def check_installed() -> None:
    """Raises FileError, at `output.denoise`, if the package is not installed."""
    if importlib.util.find_spec("pyoidn") is None:
        raise _missing()


def denoised(
    colors: Floats,
    albedo: Floats | None = None,
    normals: Floats | None = None,
    *,
    coverage: Floats | None = None,
) -> Floats:
    """A picture without its noise; what the filter sees as detail of `albedo` and `normals` stays.

    The filter is Open Image Denoise's `RT` for light without an upper bound (Attila Afra, 2019 and later,
    openimagedenoise.org). It is told that albedo and normals may be noisy, too: a pixel's are means over its samples, which
    lenses and movement blur. The same input gives the same output on one machine.

    Args:
        colors: linear light, shape (height, width, 3). What is not a finite number counts as black, and negative light too;
            pixels brighter than 65504, which the filter does not know, stay as they are.
        albedo: what the surface reflects, 0 to 1, of the same shape.
        normals: of length 1 at most, of the same shape; only with albedo.
        coverage: shape (height, width); where it is 0 and there is no light, the filter may put none. None if coverage or
            light comes by chance, so that it may be right to.

    Raises:
        FileError: the package is not installed, or the filter failed; at `output.denoise`.
    """
    try:
        import pyoidn
    except ImportError:
        raise _missing() from None
    given = {"color": _bounded(colors, 0, _BRIGHTEST)}
    if albedo is not None:
        given["albedo"] = _bounded(albedo, 0, 1)
        if normals is not None:
            given["normal"] = _bounded(normals, -1, 1)
    try:
        found: Floats = pyoidn.denoise(**given, hdr=True)
    except (RuntimeError, OSError) as error:
        raise FileError(f"{NAME} failed: {error}", Where(path="output.denoise")) from error
    bright = np.isfinite(colors).all(axis=-1) & (colors > _BRIGHTEST).any(axis=-1)
    found[bright] = colors[bright]
    if coverage is not None:
        found[(coverage == 0) & (colors == 0).all(axis=-1)] = 0
    return found


def _bounded(image: Floats, low: float, high: float) -> npt.NDArray[np.float32]:
    """The image with values that the filter takes."""
    finite = np.nan_to_num(image.astype(np.float32, copy=False), nan=0.0, posinf=0.0, neginf=0.0)
    return np.ascontiguousarray(np.clip(finite, np.float32(low), np.float32(high)))


def _missing() -> FileError:
    return FileError(
        "needs the package pyoidn: pip install 'clfractal[denoise]'", Where(path="output.denoise")
    )
