"""The same sphere tracing in Numba: one ray after another, rows shared among the cores, float32, `fastmath`.

A ray that enters the formula's bounding sphere steps by the estimated distance until that is below the
pixel's footprint there. A lit hit sends one shadow ray, from a footprint before the hit and starting two
footprints away, blocked where the distance is below half a footprint. Run alone, this file writes both
pictures:

    python -m benchmarks.rivals.numba_march FOLDER
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

F = np.float32
# Numba widens float32 to float64 as soon as a plain Python number joins in: every constant is made float32.
ZERO, HALF, ONE, TWO, FOUR, EIGHT = F(0), F(0.5), F(1), F(2), F(4), F(8)
TINY = F(1e-30)
AMBIENT, DIFFUSE = F(0.15), F(0.85)
MANDELBULB_BAILOUT_SQUARED, HAST_BAILOUT_SQUARED = F(1e2), F(1e6)
ROWS_PER_CHUNK = 8  # neighbouring rows cost alike: halves of the picture would leave one core waiting

Compiled = TypeVar("Compiled", bound=Callable[..., Any])


class Estimate(NamedTuple):
    """Distance estimate (0 inside), direction of its growth (zeros if unknown), formula applications made."""

    distance: np.float32
    gx: np.float32
    gy: np.float32
    gz: np.float32
    applications: int


class Counts(NamedTuple):
    """What one frame took."""

    rays: int
    steps: int
    iterations: int


@dataclass(frozen=True, slots=True)
class View:
    """A perspective view and one directional light, right-handed; `to_light` need not have length one."""

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]
    to_light: tuple[float, float, float]
    bounds_center: tuple[float, float, float]
    bounds_radius: float
    iterations: int
    pixels: int = 1000
    fov_factor: float = 1.0  # height of the view plane at distance 1: 2 tan(fov / 2)

    def numbers(self) -> NDArray[np.float32]:
        """Six rows of three: eye, forward, right, up, direction to the light, centre of the bounds."""
        eye = np.array(self.position)
        forward = _unit(np.array(self.target) - eye)
        right = _unit(np.cross(forward, np.array(self.up)))
        rows = [
            eye,
            forward,
            right,
            np.cross(right, forward),
            _unit(np.array(self.to_light)),
            self.bounds_center,
        ]
        return np.array(rows, np.float32)


MANDELBULB_VIEW = View((0, -3, 0), (0, 0, 0), (0, 0, 1), (-0.5, -0.6, 0.62), (0, 0, 0), 1.3, iterations=250)
HAST_VIEW = View((-0.8, 2.2, 3), (-0.5, 0, 0), (0, 1, 0), (-0.4, 0.5, 0.77), (-0.3, 0, 0), 2.0, iterations=40)


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return cast("NDArray[np.float64]", vector / np.linalg.norm(vector))


def compiled(function: Compiled) -> Compiled:
    """Numba's `njit` with fast mathematics, keeping the function's type for the checker."""
    return cast(Compiled, numba.njit(fastmath=True)(function))


@compiled
def mandelbulb8(x0: np.float32, y0: np.float32, z0: np.float32, limit: int) -> Estimate:
    """White's rule of power 8 without trigonometry, and the scalar derivative 8 |z|^7 dr + 1."""
    x, y, z, dr = x0, y0, z0, ONE
    r2 = x * x + y * y + z * z
    n = 0
    while n < limit and r2 < MANDELBULB_BAILOUT_SQUARED:
        n += 1
        dr = EIGHT * r2 * r2 * r2 * math.sqrt(r2) * dr + ONE
        rho2 = x * x + y * y
        inverse = ONE / math.sqrt(rho2 + TINY)
        # Three squarings each: (z + i rho)^8 and (e^(i phi))^8.
        a, b, c, s = z, rho2 * inverse, x * inverse, y * inverse
        a, b, c, s = (a - b) * (a + b), TWO * a * b, (c - s) * (c + s), TWO * c * s
        a, b, c, s = (a - b) * (a + b), TWO * a * b, (c - s) * (c + s), TWO * c * s
        a, b, c, s = (a - b) * (a + b), TWO * a * b, (c - s) * (c + s), TWO * c * s
        x, y, z = b * c + x0, b * s + y0, a + z0
        r2 = x * x + y * y + z * z
    if r2 < MANDELBULB_BAILOUT_SQUARED:
        return Estimate(ZERO, ZERO, ZERO, ZERO, n)
    r = math.sqrt(r2)
    return Estimate(HALF * math.log(r) * r / dr, ZERO, ZERO, ZERO, n)


@compiled
def hast2(x: np.float32, y: np.float32, z: np.float32, limit: int) -> Estimate:
    """The two-imaginary-part rule of power 2 (Englund 2010, Eq. 3 and 4) with its full Jacobian J.

    The step is |z| log|z| / (2 |J^T z / |z||); J^T z gives the normal too.
    """
    a, b, c = x, y, z
    j00, j01, j02, j10, j11, j12, j20, j21, j22 = ONE, ZERO, ZERO, ZERO, ONE, ZERO, ZERO, ZERO, ONE
    r2 = a * a + b * b + c * c
    n = 0
    while n < limit and r2 < HAST_BAILOUT_SQUARED:
        n += 1
        q2 = b * b + c * c
        s = ONE / math.sqrt(q2 + TINY)
        s3 = s * s * s
        ab = abs(b)
        m = b * ab - c * c
        d00, d01, d02 = TWO * a, -TWO * b, -TWO * c
        d10, d11 = TWO * s * m, TWO * a * (TWO * s * ab - m * s3 * b)
        d12 = TWO * a * (-TWO * c * s - m * s3 * c)
        d20, d21, d22 = FOUR * b * c * s, FOUR * a * c * (s - b * b * s3), FOUR * a * b * (s - c * c * s3)
        a, b, c = a * a - q2 + x, TWO * s * a * m + y, FOUR * a * b * c * s + z
        j00, j10, j20 = (
            d00 * j00 + d01 * j10 + d02 * j20 + ONE,
            d10 * j00 + d11 * j10 + d12 * j20,
            d20 * j00 + d21 * j10 + d22 * j20,
        )
        j01, j11, j21 = (
            d00 * j01 + d01 * j11 + d02 * j21,
            d10 * j01 + d11 * j11 + d12 * j21 + ONE,
            d20 * j01 + d21 * j11 + d22 * j21,
        )
        j02, j12, j22 = (
            d00 * j02 + d01 * j12 + d02 * j22,
            d10 * j02 + d11 * j12 + d12 * j22,
            d20 * j02 + d21 * j12 + d22 * j22 + ONE,
        )
        r2 = a * a + b * b + c * c
    if r2 < HAST_BAILOUT_SQUARED:
        return Estimate(ZERO, ZERO, ZERO, ZERO, n)
    gx, gy, gz = j00 * a + j10 * b + j20 * c, j01 * a + j11 * b + j21 * c, j02 * a + j12 * b + j22 * c
    length = math.sqrt(gx * gx + gy * gy + gz * gz)
    return Estimate(HALF * r2 * HALF * math.log(r2) / length, gx / length, gy / length, gz / length, n)


Renderer = Callable[
    [NDArray[np.float32], np.float32, np.float32, int, NDArray[np.float32], NDArray[np.int64]], None
]


def make_renderer(estimate: Callable[..., Estimate], *, analytic_normal: bool) -> Renderer:
    """The march for one formula.

    Its arguments: View.numbers(), bounds radius, pixel size at distance 1, iteration limit, the picture to
    fill (float32, square), and steps and iterations of each row to fill (int64, shape (height, 2)).
    """

    def render(
        view: NDArray[np.float32],
        radius: np.float32,
        pixel: np.float32,
        limit: int,
        picture: NDArray[np.float32],
        counts: NDArray[np.int64],
    ) -> None:
        size = picture.shape[0]
        radius2 = radius * radius
        ex, ey, ez = view[0]
        lx, ly, lz = view[4]
        cx, cy, cz = view[5]
        half_size = F(size) * HALF
        for row in numba.prange(size):
            steps = 0
            iterations = 0
            v = -(F(row) + HALF - half_size) * pixel
            for column in range(size):
                u = (F(column) + HALF - half_size) * pixel
                dx = view[1, 0] + u * view[2, 0] + v * view[3, 0]
                dy = view[1, 1] + u * view[2, 1] + v * view[3, 1]
                dz = view[1, 2] + u * view[2, 2] + v * view[3, 2]
                length = ONE / math.sqrt(dx * dx + dy * dy + dz * dz)
                dx, dy, dz = dx * length, dy * length, dz * length
                ox, oy, oz = ex - cx, ey - cy, ez - cz
                middle = -(ox * dx + oy * dy + oz * dz)
                under_root = middle * middle - (ox * ox + oy * oy + oz * oz - radius2)
                picture[row, column] = ZERO
                if under_root <= ZERO:
                    continue
                t, end = max(middle - math.sqrt(under_root), ZERO), middle + math.sqrt(under_root)
                hit = False
                nx, ny, nz = ZERO, ZERO, ZERO
                while t < end and not hit:
                    e = estimate(ex + t * dx, ey + t * dy, ez + t * dz, limit)
                    steps += 1
                    iterations += e.applications
                    if analytic_normal and e.distance > ZERO:
                        nx, ny, nz = e.gx, e.gy, e.gz
                    if e.distance < t * pixel:
                        hit = True
                    else:
                        t += e.distance
                if not hit:
                    continue
                h = t * pixel * HALF
                px, py, pz = ex + (t - TWO * h) * dx, ey + (t - TWO * h) * dy, ez + (t - TWO * h) * dz
                if not analytic_normal:
                    # Differences on a tetrahedron: four distances instead of six.
                    e1 = estimate(px + h, py - h, pz - h, limit)
                    e2 = estimate(px - h, py - h, pz + h, limit)
                    e3 = estimate(px - h, py + h, pz - h, limit)
                    e4 = estimate(px + h, py + h, pz + h, limit)
                    iterations += e1.applications + e2.applications + e3.applications + e4.applications
                    nx = e1.distance - e2.distance - e3.distance + e4.distance
                    ny = -e1.distance - e2.distance + e3.distance + e4.distance
                    nz = -e1.distance + e2.distance - e3.distance + e4.distance
                    length = ONE / math.sqrt(nx * nx + ny * ny + nz * nz + TINY)
                    nx, ny, nz = nx * length, ny * length, nz * length
                facing = nx * lx + ny * ly + nz * lz
                s = FOUR * h
                lit = facing > ZERO
                while lit:
                    qx, qy, qz = px + s * lx, py + s * ly, pz + s * lz
                    if (qx - cx) * (qx - cx) + (qy - cy) * (qy - cy) + (qz - cz) * (qz - cz) > radius2:
                        break
                    e = estimate(qx, qy, qz, limit)
                    steps += 1
                    iterations += e.applications
                    lit = e.distance >= h
                    s += e.distance
                picture[row, column] = AMBIENT + (DIFFUSE * facing if lit else ZERO)
            counts[row, 0] = steps
            counts[row, 1] = iterations

    return cast(Renderer, numba.njit(fastmath=True, parallel=True)(render))


class NumbaMarch:
    """One row of the table, compiled once; `frame()` draws it again."""

    def __init__(self, view: View, estimate: Callable[..., Estimate], *, analytic_normal: bool) -> None:
        self.view = view
        self._render = make_renderer(estimate, analytic_normal=analytic_normal)
        self.picture = np.zeros((view.pixels, view.pixels), np.float32)
        self._counts = np.zeros((view.pixels, 2), np.int64)
        self.frame()  # compiles

    def frame(self) -> tuple[float, Counts]:
        """Draw `picture` (values 0..1); milliseconds and what it took."""
        view = self.view
        start = time.perf_counter()
        with numba.parallel_chunksize(ROWS_PER_CHUNK):
            self._render(
                view.numbers(),
                F(view.bounds_radius),
                F(view.fov_factor / view.pixels),
                view.iterations,
                self.picture,
                self._counts,
            )
        milliseconds = 1e3 * (time.perf_counter() - start)
        steps, iterations = self._counts.sum(axis=0)
        return milliseconds, Counts(self.picture.size, int(steps), int(iterations))


def mandelbulb_march() -> NumbaMarch:
    """Row `mandelbulb8-shadow`."""
    return NumbaMarch(MANDELBULB_VIEW, mandelbulb8, analytic_normal=False)


def hast_march() -> NumbaMarch:
    """Row `hast2-shadow`."""
    return NumbaMarch(HAST_VIEW, hast2, analytic_normal=True)


def main() -> None:
    """Write both pictures into the folder named on the command line and print their times."""
    from PIL import Image

    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    for name, make in (("mandelbulb8-shadow", mandelbulb_march), ("hast2-shadow", hast_march)):
        march = make()
        times = [march.frame() for _ in range(3)]
        Image.fromarray(np.uint8(255 * np.clip(march.picture, 0, 1))).save(folder / f"numba-{name}.png")
        print(name, *(f"{milliseconds:.0f} ms" for milliseconds, _ in times), times[-1][1])


if __name__ == "__main__":
    main()
