"""The same cut plane in Numba: one pixel after another, rows shared among the cores, float32, `fastmath`.

Escape counts of hast of power 2 at z = 0, 256 iterations, on a plane of 4 x 4 units, a megapixel; colours from a table
over count / limit, black inside. With `periodicity` an orbit that comes back ends at once, as in the engine (Brent's
test, here after every application). Run alone, this file writes its pictures and prints times:

    python -m benchmarks.rivals.numba_plane FOLDER
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numba
import numpy as np
from numpy.typing import NDArray

F = np.float32
# Numba widens float32 to float64 as soon as a plain Python number joins in: every constant is made float32.
ZERO, ONE, TWO, FOUR = F(0), F(1), F(2), F(4)
TINY = F(1e-30)
BAILOUT_SQUARED = F(16)
PIXELS, ITERATIONS, WIDTH = 1000, 256, 4.0
PALETTE_SIZE = 256
ROWS_PER_CHUNK = 8  # neighbouring rows cost alike: halves of the picture would leave one core waiting

Renderer = Callable[..., None]


def make_renderer(*, periodicity: bool) -> Renderer:
    """A compiled function that fills a picture of counts and one of colours, and the applications of each row."""

    def render(
        corner: NDArray[np.float32],
        step: np.float32,
        limit: int,
        palette: NDArray[np.float32],
        counts: NDArray[np.float32],
        colors: NDArray[np.float32],
        applications: NDArray[np.int64],
    ) -> None:
        for row in numba.prange(counts.shape[0]):
            total = 0
            y = corner[1] - (F(row) + F(0.5)) * step
            z = corner[2]
            for column in range(counts.shape[1]):
                x = corner[0] + (F(column) + F(0.5)) * step
                a, b, c = x, y, z
                n = 1
                inside = False
                kept_a, kept_b, kept_c, keep = a, b, c, 8
                while a * a + b * b + c * c <= BAILOUT_SQUARED:
                    if n == limit:
                        inside = True
                        break
                    s = ONE / math.sqrt(b * b + c * c + TINY)
                    next_a = a * a - b * b - c * c + x
                    next_b = TWO * s * a * (b * abs(b) - c * c) + y
                    c = FOUR * a * b * c * s + z
                    a, b = next_a, next_b
                    n += 1
                    if periodicity:
                        if a == kept_a and b == kept_b and c == kept_c:
                            inside = True
                            break
                        if n == keep:
                            kept_a, kept_b, kept_c, keep = a, b, c, 2 * keep
                total += n
                count = F(limit) if inside else F(n)
                counts[row, column] = count
                place = count / F(limit) * F(PALETTE_SIZE - 1)
                first = min(int(place), PALETTE_SIZE - 2)
                share = place - F(first)
                for i in range(3):
                    low, high = palette[first, i], palette[first + 1, i]
                    colors[row, column, i] = ZERO if inside else low + share * (high - low)
            applications[row] = total

    return cast(Renderer, cast(Any, numba.njit(fastmath=True, parallel=True))(render))


class NumbaPlane:
    """The plane, compiled once; `frame()` draws it again.

    Attributes:
        counts: whole escape counts, shape (pixels, pixels), the first row at the top.
        colors: linear red, green and blue, shape (pixels, pixels, 3).
    """

    def __init__(
        self, *, pixels: int = PIXELS, iterations: int = ITERATIONS, periodicity: bool = False
    ) -> None:
        self.iterations = iterations
        self._render = make_renderer(periodicity=periodicity)
        self._step = F(WIDTH / pixels)
        self._corner = np.array([-WIDTH / 2, WIDTH / 2, 0], np.float32)
        self._palette = np.linspace(0, 1, 3 * PALETTE_SIZE, dtype=np.float32).reshape(PALETTE_SIZE, 3)
        self._applications = np.zeros(pixels, np.int64)
        self.counts = np.zeros((pixels, pixels), np.float32)
        self.colors = np.zeros((pixels, pixels, 3), np.float32)
        self.frame()  # compiles

    def frame(self) -> tuple[float, int]:
        """Draws the plane; milliseconds and formula applications."""
        start = time.perf_counter()
        with numba.parallel_chunksize(ROWS_PER_CHUNK):
            self._render(
                self._corner,
                self._step,
                self.iterations,
                self._palette,
                self.counts,
                self.colors,
                self._applications,
            )
        return 1e3 * (time.perf_counter() - start), int(self._applications.sum())


def main() -> None:
    """Write the pictures into the folder named on the command line and print their times."""
    from PIL import Image

    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    for name, periodicity in (("plane", False), ("plane-periodicity", True)):
        plane = NumbaPlane(periodicity=periodicity)
        frames = [plane.frame() for _ in range(5)]
        Image.fromarray(np.uint8(255 * np.sqrt(plane.colors))).save(folder / f"numba-{name}.png")
        print(
            name, *(f"{milliseconds:.0f} ms" for milliseconds, _ in frames), f"{frames[0][1]:,} applications"
        )


if __name__ == "__main__":
    main()
