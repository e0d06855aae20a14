"""The same grid in Numba: the inside test of every voxel, rows shared among the cores, float32, `fastmath`.

Voxels of hast of power 2 after 40 applications in the benchmark's box, 512 a side, one byte each. There is neither an
octree nor a normal: every voxel is evaluated, and that is all. Run alone, this file prints times:

    python -m benchmarks.rivals.numba_grid
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, cast

import numba
import numpy as np
from numpy.typing import NDArray

F = np.float32
# Numba widens float32 to float64 as soon as a plain Python number joins in: every constant is made float32.
ONE, TWO, FOUR, HALF = F(1), F(2), F(4), F(0.5)
TINY = F(1e-30)
BAILOUT_SQUARED = F(16)
VOXELS, ITERATIONS, SIZE = 512, 40, 4.0
CENTER = (-0.3, 0.0, 0.0)
ROWS_PER_CHUNK = 64  # neighbouring rows cost alike: halves of the grid would leave one core waiting


def fill(corner: NDArray[np.float32], side: np.float32, limit: int, inside: NDArray[np.uint8]) -> None:
    """Fills an array of shape (voxels, voxels, voxels), z first: 255 inside, 0 outside."""
    voxels = inside.shape[0]
    for row in numba.prange(voxels * voxels):
        k, j = row // voxels, row % voxels
        y = corner[1] + (F(j) + HALF) * side
        z = corner[2] + (F(k) + HALF) * side
        for i in range(voxels):
            x = corner[0] + (F(i) + HALF) * side
            a, b, c = x, y, z
            n = 1
            while a * a + b * b + c * c <= BAILOUT_SQUARED and n < limit:
                s = ONE / math.sqrt(b * b + c * c + TINY)
                next_a = a * a - b * b - c * c + x
                next_b = TWO * s * a * (b * abs(b) - c * c) + y
                c = FOUR * a * b * c * s + z
                a, b = next_a, next_b
                n += 1
            inside[k, j, i] = 255 if a * a + b * b + c * c <= BAILOUT_SQUARED else 0


class NumbaGrid:
    """The grid, compiled once; `fill()` fills it again.

    Attributes:
        inside: 255 inside, 0 outside, shape (voxels, voxels, voxels), z first.
    """

    def __init__(self, *, voxels: int = VOXELS, iterations: int = ITERATIONS) -> None:
        self.iterations = iterations
        self._fill = cast(Callable[..., None], cast(Any, numba.njit(fastmath=True, parallel=True))(fill))
        self._corner = np.array([middle - SIZE / 2 for middle in CENTER], np.float32)
        self._side = F(SIZE / voxels)
        self.inside = np.zeros((voxels, voxels, voxels), np.uint8)
        self._fill(self._corner, self._side, 2, np.zeros((8, 8, 8), np.uint8))  # compiles

    def fill(self) -> float:
        """Fills the grid; milliseconds."""
        start = time.perf_counter()
        with numba.parallel_chunksize(ROWS_PER_CHUNK):
            self._fill(self._corner, self._side, self.iterations, self.inside)
        return 1e3 * (time.perf_counter() - start)


def main() -> None:
    """Print the times of some fills."""
    grid = NumbaGrid()
    print(*(f"{grid.fill():.0f} ms" for _ in range(3)), f"{np.count_nonzero(grid.inside):,} voxels inside")


if __name__ == "__main__":
    main()
