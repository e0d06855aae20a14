"""Meshes in files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles.

    Attributes:
        vertices: (n, 3), scene units, right-handed, z up.
        triangles: (m, 3), indices of vertices, counter-clockwise seen from outside.
        normals: (n, 3), unit length, or None.
        colors: (n, 3), linear Rec. 709, 0 to 1, or None.
    """

    vertices: npt.NDArray[np.float64]
    triangles: npt.NDArray[np.int32]
    normals: npt.NDArray[Any] | None = None
    colors: npt.NDArray[Any] | None = None
