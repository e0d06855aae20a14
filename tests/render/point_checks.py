"""What the kernel for points is given, and how near its answers must be."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.structs import Precision
from clfractal.formulas.chain import Chain
from clfractal.integrators import records

Floats = npt.NDArray[np.float64]


def orbit_bytes(chain: Chain, iterations: int, precision: Precision, bailout: float | None) -> Any:
    return records.orbit_record(chain, iterations, precision, bailout).reshape(1).view(np.uint8)


def agree(full: Floats, normal: Floats, expected: Floats, gradient: Floats, tolerance: float = 1e-6) -> None:
    """All but a few points, those at a kink or where an orbit is chaotic, agree."""
    assert np.isfinite(full).all()
    assert np.isfinite(normal).all()
    outside = (full > 0) & (expected > 0)
    assert outside.sum() > 20
    assert ((full > 0) == (expected > 0)).mean() >= 0.99
    relative = np.abs(full / np.where(outside, expected, 1.0) - 1)[outside]
    assert (relative < tolerance).mean() >= 0.97, f"distances off by {np.quantile(relative, 0.97):.1e}"
    with np.errstate(all="ignore"):
        unit = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    off = np.abs(normal - unit).max(axis=1)[outside]
    assert (off < tolerance).mean() >= 0.97, f"normals off by {np.quantile(off, 0.97):.1e}"
