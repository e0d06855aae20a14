"""What the installed Mandelbulber 2 renders of a settings file: where each pixel's ray met the surface.

Its z-buffer, a PNG, has logarithms between the nearest and the farthest depth of the picture, and does not tell these
two. Its picture of places in space, a PNG too, has coordinates modulo about 1. Together they tell depths exactly.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.exchange.settings import Section

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

PROGRAM = "mandelbulber2"
FOLDER = Path("/usr/share/mandelbulber2")
FINER = 200
"""How much finer their surface is found than they would at this size: theirs is thicker than the set by a pixel."""
THINNER = 20
"""The same of surfaces whose thickness a file says: finer ones take minutes."""
LARGER = 2
"""How much larger pictures are of surfaces that theirs find by steps of a pixel, whatever else a file says."""
STEPS = 0.25
"""Their steps, as a part of those that a file chooses: theirs pass through what is thin."""
_NOTHING = 65535
_LEAST = 1e-4
"""Depths below this cannot be told: places have steps of 1.5e-5."""
_TURN = 65536 / 65535
"""Coordinates that are so far apart have the same level."""
_OFF = (
    "shadows_enabled",
    "ambient_occlusion_enabled",
    "raytraced_reflections",
    "DOF_enabled",
    "DOF_monte_carlo",
    "MC_soft_shadows_enable",
    "volumetric_fog_enabled",
    "iteration_fog_enable",
    "basic_fog_enabled",
    "glow_enabled",
    "fake_lights_enabled",
    "random_lights_group",
    "stereo_enabled",
    "antialiasing_enabled",
    "hdr_blur_enabled",
    "textured_background",
    "env_mapping_enable",
    "slow_shading",
    "main_light_volumetric_enabled",
    *(f"aux_light_enabled_{number}" for number in range(1, 5)),
)
"""What costs time, and changes nothing of where surfaces are."""


class TheirsError(Exception):
    """It made no picture; the message says why, in one line."""


class TooLongError(TheirsError):
    """It was stopped after the time given."""


@dataclass(frozen=True, slots=True)
class Depths:
    """Their picture's depths.

    Attributes:
        t: distances along the rays, scene units, shape (height, width); inf where nothing was hit.
        spread: by how much places and z-buffer disagree, relative, in the middle; nan if depths could not be told.
    """

    t: Floats
    spread: float


def is_there() -> bool:
    """Whether the program and its files are installed."""
    return shutil.which(PROGRAM) is not None and (FOLDER / "formula").is_dir()


def examples() -> list[Path]:
    """All its example settings, in an order that does not change."""
    return sorted((FOLDER / "examples").rglob("*.fract"))


def picture(
    path: Path, output: Path, size: tuple[int, int], overrides: dict[str, object], seconds: float
) -> None:
    """Renders a settings file to PNG files: `output`, and beside it what else the overrides ask for.

    Raises:
        TooLongError: it took too long.
        TheirsError: it made none.
    """
    with tempfile.TemporaryDirectory(prefix="mandelbulber-") as home:
        command: list[str | Path] = [PROGRAM, "-n", "-C", "-r", f"{size[0]}x{size[1]}", "-f", "png"]
        if overrides:
            command += ["-O", "#".join(f"{key}={value}" for key, value in overrides.items())]
        # Its own settings must be the defaults, and numbers with points.
        environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "HOME": home, "LC_ALL": "C.UTF-8"}
        try:
            subprocess.run(
                [*command, "-o", output.with_suffix(""), path],
                env=environment,
                capture_output=True,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise TooLongError(f"theirs took more than {seconds:g} s") from None
    if not output.is_file():
        raise TheirsError("theirs wrote no picture")


def depths(
    path: Path, main: Section, side: int, rays: Floats, eye: Floats, seconds: float, calm: Iterable[int] = ()
) -> Depths:
    """Where their rays meet the surface.

    Args:
        main: the file's settings, for how fine its surface is.
        rays: directions of length 1 through their pixels, shape (side, side, 3), as they have space.
        eye: where rays begin, shape (3,).
        calm: the numbers of waters without waves.

    Raises:
        TheirsError: it made no picture, or took too long.
    """
    asked: dict[str, object] = dict.fromkeys(_OFF, 0)
    asked |= {"optional_image_channels_enabled": 1, "zbuffer_enabled": 1, "zbuffer_quality": 1}
    asked |= {"world_enabled": 1, "world_quality": 1}
    asked["detail_level"] = FINER * main.number("detail_level", 1.0)
    if main.flag("constant_DE_threshold", False):  # which does not follow the level
        asked["DE_thresh"] = main.number("DE_thresh", 0.01) / THINNER
    asked["DE_factor"] = STEPS * main.number("DE_factor", 1.0)
    asked |= {f"mat{number}_transparency_of_surface": 0 for number in range(1, 10)}
    asked |= {f"primitive_water_{number}_relative_amplitude": 0 for number in calm}
    with tempfile.TemporaryDirectory(prefix="peers-") as folder:
        output = Path(folder, "picture.png")
        each = LARGER if main.flag("iteration_threshold_mode", False) else 1
        picture(path, output, (each * side, each * side), asked, seconds)
        # Rays go through the corners of pixels.
        levels = _read(output.with_name("picture_zbuffer.png"))[::each, ::each, 0]
        places = _read(output.with_name("picture_world.png"))[::each, ::each]
    farthest = main.number("view_distance_max", 50.0)
    return decoded(levels, places, rays, eye, 1.01 * farthest + 0.1)


def decoded(levels: Floats, places: Floats, rays: Floats, eye: Floats, farthest: float) -> Depths:
    """Depths, none beyond `farthest`, from the levels of z-buffer and places, shape (height, width[, 3])."""
    hit = levels != _NOTHING
    t = np.full(levels.shape, np.inf)
    if not hit.any():
        return Depths(t, 0.0)
    found = np.full(levels.shape, np.nan)
    for y, x in zip(*np.nonzero(hit), strict=True):
        found[y, x] = _along(places[y, x], rays[y, x], eye, farthest)
    sure = np.isfinite(found)
    if sure.sum() < 3 or np.median(found[sure]) < _LEAST:
        return Depths(np.where(hit, np.nan, np.inf), np.nan)
    # The logarithm of depth grows evenly with the level; levels are rounded down.
    level, log = levels[sure] + 0.5, np.log(found[sure])
    slope, start = _line(level, log, 1e-4 + 2e-5 / found[sure])
    t[hit] = np.exp(start + slope * (levels[hit] + 0.5))
    spread = float(np.median(np.abs(np.log(t[sure]) - log)))
    return Depths(t, spread)


def _along(place: Floats, ray: Floats, eye: Floats, farthest: float) -> float:
    """The only distance at which a ray's coordinates have these levels; nan if there is none, or several.

    A coordinate's level is 65535 times it, without what is behind the point, modulo 65536.
    """
    axis = int(np.argmax(np.abs(ray)))
    turns = np.arange(int(abs(ray[axis]) * farthest) + 2) * _TURN
    first = (place[axis] / 65535 - eye[axis]) * np.sign(ray[axis]) % _TURN
    # The nearest one may be about 0, and come out as one turn more by rounding.
    candidates = np.concatenate([[first - _TURN], first + turns]) / abs(ray[axis])
    points = eye + candidates[:, None] * ray
    off = (place + 0.5 * np.sign(points)) / 65535 - points
    off = (off + _TURN / 2) % _TURN - _TURN / 2
    near = (np.abs(off).max(axis=1) < 3e-5 + 3e-7 * np.abs(candidates)) & (candidates > -1e-4)
    if near.sum() != 1:
        return float("nan")
    return max(float(candidates[near][0] + off[near][0] @ ray), 1e-9)


def _line(x: Floats, y: Floats, within: Floats) -> tuple[float, float]:
    """Slope and start of the line that most points are on, to within so much in y; some may be anywhere."""
    if np.ptp(x) < 1:
        return 0.0, float(np.median(y))
    generator = np.random.default_rng(1)
    best, chosen = -1, np.ones(len(x), bool)
    for _ in range(300):
        a, b = generator.integers(len(x), size=2)
        if abs(x[a] - x[b]) < 0.1 * np.ptp(x):
            continue
        tried = (y[a] - y[b]) / (x[a] - x[b])
        near = np.abs(y - y[a] - tried * (x - x[a])) < 2 * within
        if tried >= 0 and near.sum() > best:
            best, chosen = near.sum(), near
    slope = start = 0.0
    for _ in range(3):  # what is on the line of many is more than what is on that of two
        weights = 1 / within[chosen]
        slope, start = (float(each) for each in np.polyfit(x[chosen], y[chosen], 1, w=weights))
        near = np.abs(y - start - slope * x) < 2 * within
        if near.sum() < 3 or np.ptp(x[near]) < 1:
            break
        chosen = near
    return slope, start


def _read(path: Path) -> Floats:
    import png

    if not path.is_file():
        raise TheirsError("theirs wrote no depths")
    width, height, rows, _ = png.Reader(filename=str(path)).asDirect()
    return np.vstack([np.asarray(row) for row in rows]).reshape(height, width, -1).astype(float)
