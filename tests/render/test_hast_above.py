"""hast from above: in the plane c = 0 it is the Mandelbrot set, and the thesis's pictures of it have two errors, loose
islands left of the needle and a hole in the left globe. Ours have neither."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import ndimage

from clfractal.device.select import Device, has_float64
from clfractal.formulas import reference
from clfractal.formulas.language import Chain
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.lanes import best_lanes
from clfractal.integrators.points import escape
from tests.render.shots import Floats, points_of, shoot
from tests.scenes import scene_of

ITERATIONS = 250
FORMULA = {"name": "hast", "parameters": {"power": 2}, "iterations": ITERATIONS}
CHANNELS = ("A", "P.X", "P.Y", "P.Z")
# The share of pixels whose centre is in the set and which may be missed: one of a hundred thousand is. Which ones follows
# from last bits.
LOST = 2.5e-5

Bools = npt.NDArray[np.bool_]


def from_above(
    device: Device, x: float, y: float, height: float, side: int
) -> tuple[Framebuffer, Floats, Floats, Chain]:
    """The picture, and x and y of its columns and rows."""
    camera: dict[str, Any] = {
        "projection": "orthographic",
        "position": [x, y, 3],
        "target": [x, y, 0],
        "up": [0, 1, 0],
        "height": height,
    }
    scene = scene_of(FORMULA, camera, (side, side), lights=[])
    place = (np.arange(side) + 0.5 - side / 2) * height / side
    return shoot(scene, device, channels=CHANNELS), x + place, y - place, scene.chain


def mandelbrot(columns: Floats, rows: Floats) -> Bools:
    """Which points of a grid have |z| <= 4 for 250 applications of z^2 + c."""
    c = (columns[None, :] + 1j * rows[:, None]).ravel()
    z, index = np.zeros_like(c), np.arange(c.size)
    for _ in range(ITERATIONS):
        z = z * z + c
        near = np.abs(z) <= 4
        z, c, index = z[near], c[near], index[near]
    inside = np.zeros(len(columns) * len(rows), bool)
    inside[index] = True
    return inside.reshape(len(rows), len(columns))


def components(covered: Bools) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int64]]:
    """8-connected components, numbered from 1 by their size, and their sizes."""
    labels, count = ndimage.label(covered, np.ones((3, 3)))
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    rank = np.zeros(count + 1, np.int32)
    rank[1 + np.argsort(-sizes, kind="stable")] = 1 + np.arange(count)
    return rank[labels], np.sort(sizes)[::-1]


def point_inside(
    chain: Chain, device: Device, columns: Floats, rows: Floats, depth: Floats, pixel: float
) -> npt.NDArray[np.float64] | None:
    """A point that does not escape in the columns of space under pixels at (columns, rows), shapes (n,), or None.

    Samples fall all through the bounding sphere, a half of them around the depths that were hit; then they crowd, round
    after round on half the scale, where points took longest to escape. The device counts, NumPy checks what it finds.
    """
    random = np.random.default_rng(1)
    count = 1 << 15
    precision: Any = "float64" if has_float64(device.info) else "float32"
    lanes = best_lanes(device, precision)
    low = np.stack([columns, rows], axis=-1) - pixel / 2
    own = random.integers(len(columns), size=count)
    points = np.empty((count, 3))
    points[:, :2] = low[own] + random.random((count, 2)) * pixel
    everywhere = random.uniform(-chain.radius, chain.radius, count)
    points[:, 2] = np.where(np.arange(count) % 2, everywhere, depth[own] + random.normal(size=count) * pixel)
    for scale in pixel * 0.5 ** np.arange(12):
        counts, inside = escape(chain, points, ITERATIONS, device=device, lanes=lanes, precision=precision)
        found = points[inside][:10]
        if len(found):
            confirmed = reference.escape(chain, found, ITERATIONS)[1]
            if confirmed.any():
                return np.asarray(found[confirmed][0])
        best = np.argsort(-counts, kind="stable")[:256]
        chosen = best[random.integers(len(best), size=count)]
        own = own[chosen]
        points = points[chosen] + random.normal(size=(count, 3)) * scale
        points[:, :2] = np.clip(points[:, :2], low[own], low[own] + pixel)
    return None


def test_the_issue_of_the_thesis(device: Device) -> None:
    """At 1000 x 1000: nothing of the Mandelbrot set is missing, all of the picture hangs together, or is there."""
    side, height = 1000, 3.0
    framebuffer, columns, rows, chain = from_above(device, -0.6, 0, height, side)
    covered, inside = framebuffer["A"] > 0, mandelbrot(columns, rows)
    assert 0.16 < inside.mean() < 0.18  # its area, 1.5066, over the picture's, and 250 iterations' excess
    assert (inside & ~covered).sum() <= LOST * inside.sum()
    labels, sizes = components(covered)
    assert sizes[0] >= 0.999 * covered.sum()
    points = points_of(framebuffer)
    empty = {}
    for island in range(2, len(sizes) + 1):
        r, c = np.nonzero(labels == island)
        if point_inside(chain, device, columns[c], rows[r], points[r, c, 2], height / side) is None:
            empty[f"{columns[c[0]]}, {rows[r[0]]}"] = len(c)
    # Which pixels are hit falsely follows from the last bits of a distance, and so from the processor's estimate of
    # 1/sqrt: AMD's leaves four such islands here, of seven pixels of 270,000, Intel's none, or ten of eighteen.
    assert sum(empty.values()) <= 1e-4 * covered.sum(), empty


@pytest.mark.parametrize(("x", "side"), [(-0.6, 900), (-0.75, 900), (-0.6, 333)])
def test_a_ray_whose_own_line_meets_the_set_hits(device: Device, x: float, side: int) -> None:
    """The set is a sheet without thickness there. Over its left globe lie layers in which distances are much too large;
    ten pixels of 128,000 were lost in them."""
    framebuffer, columns, rows, _ = from_above(device, x, 0, 3.1, side)
    inside = mandelbrot(columns, rows)
    assert (inside & (framebuffer["A"] == 0)).sum() <= LOST * inside.sum()


@pytest.mark.parametrize(
    ("x", "y", "height", "share"),
    [(-0.6, 0.0, 2.9, 0.999), (-0.75, 0.1, 0.25, 0.999), (-1.75, 0.0, 0.15, 0.98)],
    ids=["another framing", "sea horses", "needle"],
)
def test_no_luck_of_one_framing(device: Device, x: float, y: float, height: float, share: float) -> None:
    """Other pixel places, and close views. Around the needle the set is a dust of specks finer than a pixel on threads
    without thickness: there one centre in a thousand may be missed, and small parts may look loose."""
    framebuffer, columns, rows, _ = from_above(device, x, y, height, 400)
    covered, inside = framebuffer["A"] > 0, mandelbrot(columns, rows)
    assert inside.sum() > 2000
    assert (inside & ~covered).sum() <= 1e-3 * inside.sum()
    assert components(covered)[1][0] >= share * covered.sum()


def test_what_touches_a_pixel_is_proved(device: Device) -> None:
    """From aside, of few applications, whose solid is thick enough for steps to find: a pixel that is hit though none of 64
    rays through it meets the solid is rare. Valleys of the potential, whose distances are too small, would be hits."""
    camera = {"position": [-2.5, -2.7, 1.5], "target": [-0.66, 0, 0.02], "fov": 33}
    by_distance, by_steps = (
        scene_of({**FORMULA, "iterations": 10}, camera, (96, 54), lights=[], renderer=renderer)
        for renderer in ({}, {"search": "steps", "step": 0.004})
    )
    hit = shoot(by_distance, device, channels=("A",))["A"] > 0
    covered = shoot(by_steps, device, channels=("A",), samples=64)["A"] > 0
    middle = shoot(by_steps, device, channels=("A",))["A"] > 0
    assert covered.sum() > 1400
    # A pixel's own ray sees what it meets.
    assert not (middle & ~hit).any()
    # At rims a ray may pass within `detail` of the solid, beside all 64: 71 pixels.
    assert (hit & ~covered).sum() < 0.06 * covered.sum()
