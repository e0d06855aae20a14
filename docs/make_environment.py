"""Makes the environment maps that travel with the program: clfractal/environments/*.exr.

    python docs/make_environment.py          all of them
    python docs/make_environment.py dusk     one

Each is a function of direction (z up, y ahead, x to the right), evaluated on a finer grid and averaged. Light is
linear Rec. 709; white paper shines with 0.2 (dusk) to 1 under a map. The brightest spots are kept large and mild, so
that few rays find them.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.files.exr import write_exr

ENVIRONMENTS = Path(__file__).resolve().parents[1] / "clfractal" / "environments"
WIDTH = 512
FINER = 3
KEPT_BITS = 7  # of half precision's 10: a step of 1 in 128 is not seen in a mirror, and the files get small

Array = npt.NDArray[np.float64]


def directions(width: int) -> Array:
    """Unit vectors to the middles of the pixels of a map, shape (width / 2, width, 3)."""
    height = width // 2
    latitude = math.pi * (0.5 - (np.arange(height) + 0.5) / height)
    longitude = 2 * math.pi * ((np.arange(width) + 0.5) / width - 0.5)
    level = np.cos(latitude)[:, None]
    up = np.broadcast_to(np.sin(latitude)[:, None], (height, width))
    return np.stack([level * np.sin(longitude), level * np.cos(longitude), up], axis=-1)


def smooth(low: float, high: float, x: Array) -> Array:
    """0 below `low`, 1 above `high`, and smooth between; `low` may be the larger one."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def mixed(a: Array, b: Array, share: Array) -> Array:
    """Colours (..., 3) mixed by shares (...)."""
    return a + (b - a) * share[..., None]


def rgb(*values: float) -> Array:
    return np.array(values, float)


def toward(azimuth: float, elevation: float) -> Array:
    """A direction: azimuth from ahead to the right, and elevation, in degrees."""
    a, e = math.radians(azimuth), math.radians(elevation)
    return rgb(math.cos(e) * math.sin(a), math.cos(e) * math.cos(a), math.sin(e))


def noise(x: Array, y: Array, seed: int) -> Array:
    """Values from 0 to 1 at the corners of unit squares, blended smoothly between them; repeats after 256."""
    lattice = np.random.default_rng(seed).random((256, 256))
    column, row = np.floor(x), np.floor(y)
    s, t = x - column, y - row
    s, t = s * s * s * (s * (6 * s - 15) + 10), t * t * t * (t * (6 * t - 15) + 10)
    i, j = column.astype(int) % 256, row.astype(int) % 256
    k, m = (i + 1) % 256, (j + 1) % 256
    upper = lattice[j, i] * (1 - s) + lattice[j, k] * s
    lower = lattice[m, i] * (1 - s) + lattice[m, k] * s
    return upper * (1 - t) + lower * t


def clouds(x: Array, y: Array, seed: int, octaves: int = 5) -> Array:
    """Noise of many sizes, each turned against the one before, 0 to 1."""
    total, weight, sum_of_weights = np.zeros_like(x), 1.0, 0.0
    for octave in range(octaves):
        total += weight * noise(x, y, seed + octave)
        sum_of_weights += weight
        weight *= 0.5
        x, y = 1.6 * x + 1.2 * y + 17.3, 1.6 * y - 1.2 * x + 5.9  # twice as fine, turned by 37 degrees
    return total / sum_of_weights


def soft_box(
    view: Array, middle: Array, half: tuple[float, float], light: Array, *, corner: float = 0.06
) -> Array:
    """A lamp behind cloth: a rectangle at distance 1, of half size `half`, a little brighter in its middle."""
    side = np.cross(middle, rgb(0, 0, 1) if abs(middle[2]) < 0.95 else rgb(0, 1, 0))
    side /= np.linalg.norm(side)
    up = np.cross(side, middle)
    depth = view @ middle
    safe = np.maximum(depth, 1e-3)
    x, y = (view @ side) / safe, (view @ up) / safe
    beyond_x, beyond_y = np.abs(x) - half[0] + corner, np.abs(y) - half[1] + corner
    outside = np.hypot(np.maximum(beyond_x, 0), np.maximum(beyond_y, 0))
    distance = outside + np.minimum(np.maximum(beyond_x, beyond_y), 0) - corner
    inside = smooth(0.012, -0.012, distance) * (depth > 0)
    profile = 0.72 + 0.28 * np.exp(-1.6 * ((x / half[0]) ** 2 + (y / half[1]) ** 2))
    # What the lamp's rim throws on the wall around it.
    spill = 0.010 * np.exp(-np.maximum(distance, 0) / 0.22) * (depth > 0) * smooth(0.0, 0.4, depth)
    return (inside * profile + spill)[..., None] * light


def studio(view: Array) -> Array:
    """Soft boxes in a dark grey room: a warm key in front, cool strips at the sides, a lamp above."""
    z = view[..., 2]
    wall = mixed(rgb(0.030, 0.032, 0.037), rgb(0.075, 0.074, 0.076), np.exp(-((z / 0.33) ** 2)))
    away = np.hypot(view[..., 0], view[..., 1]) / np.maximum(-z, 1e-3)
    pool = np.exp(-((away / 1.9) ** 2))
    floor = mixed(rgb(0.070, 0.069, 0.070), rgb(0.30, 0.288, 0.27), pool)
    # The floor bends up into the wall, as a photographer's paper does.
    room = mixed(wall, floor, smooth(0.02, -0.22, z))
    lamps = (
        soft_box(view, toward(-128, 36), (0.50, 0.36), 7.0 * rgb(1.0, 0.93, 0.83)),
        soft_box(view, toward(97, 14), (0.12, 0.78), 4.6 * rgb(0.80, 0.91, 1.0)),
        soft_box(view, toward(-38, 18), (0.09, 0.62), 6.0 * rgb(1.0, 0.98, 0.95)),
        soft_box(view, toward(30, 76), (0.44, 0.20), 3.4 * rgb(0.97, 0.98, 1.0)),
        soft_box(view, toward(46, 10), (0.17, 0.17), 2.4 * rgb(1.0, 0.50, 0.20), corner=0.17),
    )
    return room + sum(lamps)


SUN = toward(-52, 4.5)


def dusk_sky(view: Array) -> Array:
    """The sky shortly before the sun sets, for directions at and above the horizon."""
    up = np.maximum(view[..., 2], 0.0)
    flat = np.maximum(np.hypot(view[..., 0], view[..., 1]), 1e-6)
    beside = (view[..., 0] * SUN[0] + view[..., 1] * SUN[1]) / (flat * math.hypot(SUN[0], SUN[1]))
    near = 0.5 + 0.5 * beside  # 1 on the sun's side, 0 on the other
    height = np.degrees(np.arcsin(np.clip(up, 0, 1)))
    sky = mixed(rgb(0.125, 0.215, 0.46), rgb(0.030, 0.068, 0.20), smooth(12, 75, height))
    # Away from the sun: the earth's shadow, and the pink band above it.
    band = np.exp(-(((height - 11) / 7.5) ** 2)) * (1 - near) ** 0.8
    sky = mixed(sky, rgb(0.52, 0.29, 0.40), 0.85 * band)
    shadow = np.exp(-((height / 4.5) ** 2)) * (1 - near) ** 1.2
    sky = mixed(sky, rgb(0.20, 0.22, 0.36), 0.8 * shadow)
    # Toward the sun: yellow, orange and rose above each other.
    sky = mixed(sky, rgb(0.74, 0.36, 0.40), np.exp(-((height / 24) ** 2)) * near**2.5 * 0.85)
    sky = mixed(sky, rgb(1.55, 0.62, 0.22), np.exp(-((height / 11) ** 2)) * near**4)
    sky = mixed(sky, rgb(2.6, 1.35, 0.48), np.exp(-((height / 5.5) ** 2)) * near**14)
    return sky + sunlight(view, disc=True) + cirrus(view, near, height)


def sunlight(view: Array, *, disc: bool) -> Array:
    """The sun's disc and the glow around it."""
    angle = np.degrees(np.arccos(np.clip(view @ SUN, -1, 1)))
    glow = 5.5 * np.exp(-angle / 3.2) + 1.1 * np.exp(-angle / 12)
    light = glow[..., None] * rgb(1.0, 0.55, 0.20)
    if disc:
        light = light + 100 * smooth(2.5, 1.9, angle)[..., None] * rgb(1.0, 0.70, 0.36)
    return light


def cirrus(view: Array, near: Array, height: Array) -> Array:
    """Thin streaks of cloud, lit from below."""
    plane = 1.0 / (np.maximum(view[..., 2], 0.0) + 0.10)
    x, y = view[..., 0] * plane, view[..., 1] * plane
    along, across = 0.82 * x + 0.57 * y, 0.82 * y - 0.57 * x
    bend = clouds(0.5 * along, 0.5 * across, 40, 3)
    streaks = clouds(0.55 * along + 1.5 * bend, 2.6 * across + 2.2 * bend, 50, 6)
    patches = clouds(0.40 * along + 9, 0.55 * across, 60, 3)
    cover = smooth(0.47, 0.78, streaks) * smooth(0.36, 0.66, patches) * smooth(1.0, 7.0, height)
    warm = mixed(rgb(0.30, 0.22, 0.34), rgb(1.75, 0.66, 0.36), smooth(0.15, 0.95, near**1.5))
    high = smooth(55, 15, height)[..., None]
    return cover[..., None] * warm * (0.35 + 0.65 * high)


def ridges(view: Array, sizes: Sequence[float], tallest: float) -> Array:
    """Elevation of a chain of hills all around, in degrees."""
    azimuth = np.arctan2(view[..., 0], view[..., 1])
    line = np.zeros_like(azimuth)
    for index, size in enumerate(sizes):
        line += np.sin((index * 2 + 3 + index * index) * azimuth + 1.7 * index * index + 0.4) * size
    return tallest * (0.5 + 0.5 * line / sum(sizes))


def dusk_land(view: Array) -> Array:
    """Sky and two chains of hills in the haze."""
    light = dusk_sky(view)
    elevation = np.degrees(np.arcsin(np.clip(view[..., 2], -1, 1)))
    glow = sunlight(view, disc=False)
    for sizes, tallest, tone, haze in (
        ((1.0, 0.7, 0.5, 0.32, 0.2), 4.2, rgb(0.155, 0.120, 0.185), 0.22),
        ((0.8, 0.9, 0.3, 0.42, 0.3, 0.12), 2.3, rgb(0.050, 0.042, 0.066), 0.07),
    ):
        hill = smooth(0.12, -0.12, elevation - ridges(view[:, ::-1] if haze < 0.1 else view, sizes, tallest))
        light = mixed(light, tone + haze * glow, hill)
    return light


def dusk(view: Array) -> Array:
    """A lake after a clear day: a low sun on the left, a glowing horizon, hills, and all of it again in the water."""
    land = dusk_land(view)
    # Waves tilt the mirror: the picture in the water is drawn out downwards, the more the steeper one looks.
    depth = np.maximum(-view[..., 2], 0.0)
    mirrored = np.zeros_like(view)
    tilts = np.array([-2.4, -1.6, -0.9, -0.35, 0.0, 0.35, 0.9, 1.6, 2.4])
    weights = np.exp(-((tilts / 1.5) ** 2))
    ripple = 0.7 * (clouds(6 * view[..., 0] / (depth + 0.05), 6 * view[..., 1] / (depth + 0.05), 80, 3) - 0.5)
    for tilt, weight in zip(tilts, weights / weights.sum(), strict=True):
        slope = 0.028 * (tilt + ripple) * smooth(0.0, 0.12, depth)
        elevation = np.arcsin(np.clip(depth, 0, 1)) + 2 * slope
        elevation = np.maximum(elevation, 0.0)
        flat = np.maximum(np.hypot(view[..., 0], view[..., 1]), 1e-6)
        bent = np.stack(
            [
                view[..., 0] / flat * np.cos(elevation),
                view[..., 1] / flat * np.cos(elevation),
                np.sin(elevation),
            ],
            axis=-1,
        )
        mirrored += weight * np.minimum(dusk_land(bent), 14.0)
    # Schlick's approximation of the reflectance of water, raised for a lake that is more than a black hole.
    share = 0.16 + 0.84 * (1 - depth) ** 5
    water = mixed(np.broadcast_to(rgb(0.016, 0.034, 0.062), view.shape), mirrored, share)
    return 1.2 * mixed(land, water, smooth(0.003, -0.003, view[..., 2]))


def overcast(view: Array) -> Array:
    """A grey day: three times as bright above as at the horizon, a veiled sun, and dull ground."""
    z = view[..., 2]
    up = np.maximum(z, 0.0)
    plane = 1.0 / (up + 0.22)
    x, y = view[..., 0] * plane, view[..., 1] * plane
    bend = clouds(0.7 * x + 3, 0.7 * y, 110, 3)
    folds = clouds(0.95 * x + 1.3 * bend, 0.95 * y - 1.1 * bend, 120, 6)
    large = clouds(0.33 * x, 0.33 * y + 6, 130, 3)
    structure = 1 + (1.15 * (folds - 0.5) + 0.95 * (large - 0.5)) * smooth(0.0, 0.30, up)
    veil = np.exp(-((np.degrees(np.arccos(np.clip(view @ toward(-140, 48), -1, 1))) / 34) ** 2))
    # Moon and Spencer (1942): the overcast sky, (1 + 2 sin(elevation)) / 3 of the zenith.
    bright = (1 + 2 * up) / 3 * 0.95 * structure
    tint = mixed(rgb(0.84, 0.93, 1.06), rgb(1.0, 0.995, 0.98), np.clip(veil + 0.9 * (folds - 0.5), 0, 1))
    sky = bright[..., None] * tint + (0.75 * veil * (0.35 + 1.3 * folds))[..., None] * rgb(1.0, 0.97, 0.92)
    haze = rgb(0.56, 0.60, 0.65)
    sky = mixed(sky, haze, 0.7 * np.exp(-((up / 0.07) ** 2)))
    elevation = np.degrees(np.arcsin(np.clip(z, -1, 1)))
    for sizes, tallest, tone in (
        ((1.0, 0.5, 0.6, 0.25, 0.2), 6.5, rgb(0.40, 0.44, 0.48)),
        ((0.7, 0.9, 0.4, 0.5, 0.22, 0.1), 3.2, rgb(0.25, 0.28, 0.29)),
    ):
        sky = mixed(
            sky,
            tone,
            smooth(0.12, -0.12, elevation - ridges(view[:, ::-1] if tallest < 4 else view, sizes, tallest)),
        )
    depth = np.maximum(-z, 1e-3)
    x, y = view[..., 0] / depth, view[..., 1] / depth
    patches = clouds(0.8 * x, 0.8 * y, 140, 5)
    ground = mixed(rgb(0.118, 0.122, 0.098), rgb(0.205, 0.192, 0.160), 0.5 + 0.8 * (patches - 0.5))
    ground = mixed(ground, rgb(0.26, 0.28, 0.28), np.exp(-depth / 0.10))
    return mixed(sky, ground, smooth(0.004, -0.004, z))


MAPS: dict[str, Callable[[Array], Array]] = {"studio": studio, "dusk": dusk, "overcast": overcast}


def picture(name: str, width: int = WIDTH, finer: int = FINER) -> npt.NDArray[np.float32]:
    """A map of shape (width / 2, width, 3): means over squares of `finer` x `finer` points."""
    height = width // 2
    fine = MAPS[name](directions(width * finer))
    return fine.reshape(height, finer, width, finer, 3).mean(axis=(1, 3)).astype(np.float32)


def rounded(pixels: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Rounded to the bits that are kept."""
    fraction, exponent = np.frexp(pixels)
    scale = 2.0 ** (KEPT_BITS + 1)
    return np.ldexp(np.round(fraction * scale) / scale, exponent).astype(np.float32)


def write(name: str) -> Path:
    """Makes one file."""
    pixels = rounded(picture(name))
    height, width, _ = pixels.shape
    path = ENVIRONMENTS / f"{name}.exr"
    write_exr(
        path,
        [{channel: pixels[..., place] for place, channel in enumerate("RGB")}],
        display=(width, height),
        region=(0, 0, width, height),
        channels="RGB",
        half="RGB",
        header={"owner": "clfractal", "comments": f"{name}: made by docs/make_environment.py"},
    )
    return path


def main(names: Sequence[str]) -> None:
    ENVIRONMENTS.mkdir(exist_ok=True)
    for name in names or MAPS:
        path = write(name)
        print(f"{path.name}: {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
