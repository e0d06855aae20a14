"""How much of an anaglyph reaches the wrong eye through a pair of filters."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from clfractal.images.anaglyph import IDEAL, LUMINANCE, Filter, Floats, Glasses

REAL_RED_CYAN: tuple[Filter, Filter] = ((0.381, 0.030, 0.010), (0.063, 0.379, 0.554))
"""A real pair: luminance of each primary of a cathode ray tube behind the filter, in its luminance without it.

From the tristimulus values in W. R. Sanders, D. F. McAllister, "Producing Anaglyphs from Synthetic Images",
Proc. SPIE 5006, 2003.
"""


def leaking(glasses: Glasses, share: float) -> tuple[Filter, Filter]:
    """Filters that pass their own primaries as a whole, and `share` of every other's light."""
    (a, b, c), (d, e, f) = np.maximum(IDEAL[glasses], share).tolist()
    return (a, b, c), (d, e, f)


def filtered(
    picture: Floats,
    eye: Literal["left", "right"],
    glasses: Glasses,
    filters: tuple[Filter, Filter] | None = None,
) -> Floats:
    """What an eye sees of a picture of shape (..., 3) through its filter; an ideal one of these glasses if None.

    A filter weakens each primary, and does not change its colour: spectra are not looked at.
    """
    left, right = filters or IDEAL[glasses]
    seen: Floats = picture * np.asarray(left if eye == "left" else right, np.float32)
    return seen


def ghosting(
    composed: Callable[[Floats, Floats], Floats],
    left: Floats,
    right: Floats,
    glasses: Glasses,
    filters: tuple[Filter, Filter] | None = None,
) -> tuple[float, float]:
    """How much of the other eye's picture the left and the right eye see.

    Of luminance through the filters (see `filtered`): what changes when the other eye's picture is switched off,
    summed over all pixels without its sign, as a share of all that remains; infinite if nothing does.

    Args:
        composed: makes the shown picture of the left and the right eye's, all of shape (..., 3).
    """
    black = np.zeros_like(left)
    both = composed(left, right)

    def share(eye: Literal["left", "right"], own: Floats) -> float:
        seen, alone = (filtered(shown, eye, glasses, filters) @ np.array(LUMINANCE) for shown in (both, own))
        ghost, light = float(np.abs(seen - alone).sum()), float(alone.sum())
        return ghost / light if light else (math.inf if ghost else 0.0)

    return share("left", composed(left, black)), share("right", composed(black, right))
