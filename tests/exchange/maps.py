"""What formulas of settings files do to points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.exchange.mandelbulber import import_text
from clfractal.formulas.backends import NumpyBackend
from clfractal.formulas.catalog import resolve
from clfractal.formulas.reference import apply as apply_formula
from tests.exchange.files import settings

Doubles = npt.NDArray[np.float64]
POINTS: Doubles = np.random.default_rng(3).normal(size=(3, 500))


def mapped(formula: dict[str, Any], state: Doubles, point: Doubles) -> Doubles:
    """z after an application of a formula, what is added included."""
    bound = resolve({"inline": formula}).links[0].bound
    found = apply_formula(bound, list(state), list(point), NumpyBackend())
    return np.array([np.broadcast_to(part, state.shape[1]) for part in found])


def formula_of(folder: Path, fractal: str = "", main: str = "") -> dict[str, Any]:
    """The scene's formula of a file whose first formula is the text `mandelbulb` of a folder."""
    # (What does not escape is a solid, even where the eye is.)
    text = settings(f"N 9;\nalpha_enabled 1;\n{main}\niteration_threshold_mode true;", fractal)
    section = import_text(text, "x.fract", formulas=folder).scene["formula"]
    assert isinstance(section, dict)
    return section
