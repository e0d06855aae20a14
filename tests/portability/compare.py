"""When two implementations' pictures of one scene count as the same.

All implementations do the same operations in the same order, so most pixels agree to a few roundings. What
differs is how a multiplication and an addition are fused and the last digit of `log` or `sin`; near a
fractal's finest details that decides whether a ray hits here or a little farther on, and such a pixel may
then differ by any amount. Hence a share of the pixels is limited, and not the difference of any one.

Measured between PoCL 3.0, PoCL 3.1 and Intel's runtime on pictures of 96 x 72: at most 0.42 % of the pixels of a
float32 picture (hast, single pixels at its needle and rims: a hit there is proved by a descent of up to twelve steps,
each of which magnifies the last digit, and PoCL's reciprocal roots are estimates refined where Intel's are exact; the
other pictures have none), none of a float64 picture. Of PoCL 6 and rusticl 0.19 % and 0.88 % of `still`, which is of
hast with two samples and all kinds of rays (a third of these pixels at its needle), 0.09 % and 0.26 % of its plane;
volumes have none. The faults that these pictures have found touched more: a driver's `pow` that spoiled neighbouring
lanes 2.5 % and 4 %, a distance of ours that depended on the neighbouring lanes 0.5 % of a float64 picture. The limits
stand between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Picture = npt.NDArray[np.float32]

# Largest share of pixels that may differ visibly.
LIMITS = {"float32": 0.008, "float64": 0.001}
# Of pictures that differ more by their nature, see above.
OWN_LIMITS = {"still float32": 0.012}
# A visible difference of R, G, B or A: two steps of 8 bits at full brightness.
VISIBLE = 2 / 255
# A distance, position, normal or count that differs by more than this, relative to 1 and its own size, is
# another one.
DATA = 0.01


@dataclass(frozen=True, slots=True)
class Difference:
    """How two pictures differ; `fault` is empty if they count as the same."""

    share: float
    fault: str
    pixels: npt.NDArray[np.bool_]


def difference(ours: Picture, theirs: Picture, precision: str, name: str = "") -> Difference:
    """Compare two pictures of shape (channels, height, width), whose first channels are R, G, B and A.

    Args:
        name: as the picture is called, if it may have a limit of its own.
    """
    if ours.shape != theirs.shape:
        return Difference(1.0, f"shapes {ours.shape} and {theirs.shape}", np.ones((1, 1), np.bool_))
    pixels = _different(ours, theirs)
    share = float(pixels.mean())
    broken = _no_numbers(ours) | _no_numbers(theirs)
    if broken.any():
        return Difference(share, "colours that are no numbers", pixels | broken)
    limit = OWN_LIMITS.get(name, LIMITS[precision])
    # A tiny picture has so few pixels that one is more than its share: one is always allowed.
    if int(pixels.sum()) > max(1, int(limit * pixels.size)):
        return Difference(share, f"{share:.2%} of the pixels differ, {limit:.1%} may", pixels)
    return Difference(share, "", pixels)


def _no_numbers(picture: Picture) -> npt.NDArray[np.bool_]:
    """Pixels with an infinite colour or a NaN anywhere; a distance may be infinite."""
    return np.asarray(~np.isfinite(picture[:4]).all(axis=0) | np.isnan(picture).any(axis=0))


def _different(ours: Picture, theirs: Picture) -> npt.NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        apart = np.abs(ours - theirs)
        same = (ours == theirs) | (np.isnan(ours) & np.isnan(theirs))
        apart = np.where(same, 0, np.where(np.isfinite(apart), apart, np.inf))
        size = 1 + np.where(np.isfinite(ours), np.abs(ours), 0)
    visible = (apart[:4] > VISIBLE).any(axis=0)
    return np.asarray(visible | (apart[4:] > DATA * size[4:]).any(axis=0))
