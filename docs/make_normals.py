"""Measures the five normals, for docs/normals.md: its tables, and its pictures docs/pictures/normals_*.webp.

    python docs/make_normals.py            measures, and writes the tables into the page (a minute)
    python docs/make_normals.py --show     only prints them
    python docs/make_normals.py --pictures the pictures

Errors are angles between the normal of a pixel (channels N.X, N.Y, N.Z) and the true one. On a ball that is the
radius through the pixel's point. On the Mandelbulb of figure 13 it is the mean of 8 x 8 exact normals spread over
the pixel, from a picture eight times as fine in float64: what a perfect pixel would show.
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from clfractal.api import load_scene, render
from clfractal.files import resources
from clfractal.scene.model import Scene

DOCS = Path(__file__).resolve().parent
PAGE = DOCS / "normals.md"
BEGIN, END = "<!-- measured -->\n", "<!-- end of measured -->\n"
NORMALS = ("one_triangle", "eight_triangles_shading", "eight_triangles_normal", "least_squares", "gradient")

# Squaring x + iy + jz squares its length: eight times below 4 is a ball.
BALL: dict[str, Any] = {
    "inline": {
        "variables": ["x", "y", "z"],
        "map": ["x*x - y*y - z*z", "2*x*y", "2*x*z"],
        "add": "none",
        "degree": 2,
        "bounds": {"center": [0, 0, 0], "radius": 1.5},
        "bailout": 4,
    },
    "iterations": 8,
}
BALL_RADIUS = 4.0 ** (2.0**-8)
FOOTPRINTS = (16, 128)  # pixels to the ball's radius
SLANTS = (15, 45, 70)  # degrees between the normal and the direction to the viewer, each plus or minus 5
SIZES = (128, 512, 2048)  # of figure 13, pixels
FINER = 8
CROP = (970, 1030, 360, 360)  # of figure 13 at its full size: x, y, width, height
MEASURED = 64  # pixels along a side of the part that is measured
TIMED = 192

Floats = npt.NDArray[np.float64]


def angles(a: Floats, b: Floats) -> Floats:
    """Degrees between unit vectors, shape (..., 3); accurate for small angles."""
    chord = np.linalg.norm(a - b, axis=-1)
    return np.asarray(np.degrees(2 * np.arcsin(np.clip(chord / 2, 0, 1))))


def vectors(scene: Scene, what: str, **settings: Any) -> Floats:
    """Channels N or P of a rendered scene, shape (rows, columns, 3)."""
    names = [f"{what}.{axis}" for axis in "XYZ"]
    framebuffer = render(scene, channels=names, **settings)
    return np.stack([framebuffer[name] for name in names], axis=-1).astype(np.float64)


def ball_errors(normal: str) -> dict[tuple[int, int], float]:
    """Root mean square of the errors in degrees on a ball, by pixels to its radius and by slant."""
    errors = {}
    for pixels in FOOTPRINTS:
        side = 2 * pixels + 16
        camera = {"projection": "orthographic", "position": [0, -3, 0], "height": side * BALL_RADIUS / pixels}
        scene = load_scene(
            {
                "version": 1,
                "formula": BALL,
                "image": {"width": side, "height": side},
                "camera": camera,
                "renderer": {"points": {"pattern": "grid", "count": 9}, "normal": normal},
                "lights": [],
            }
        )
        found = vectors(scene, "N", precision="float32")
        points = vectors(scene, "P", precision="float32")
        true = points / np.linalg.norm(points, axis=-1, keepdims=True).clip(1e-9)
        slant = np.degrees(np.arccos(np.clip(-true[..., 1], -1, 1)))
        error = angles(found, true)
        for middle in SLANTS:
            band = (abs(slant - middle) < 5) & (np.linalg.norm(points, axis=-1) > 0)
            errors[pixels, middle] = float(np.sqrt((error[band] ** 2).mean()))
    return errors


def figure(normal: str, size: int, *more: str) -> Scene:
    """A scene of figure 13, unlit, as wide and high as told in pixels."""
    path = resources.folder("scenes") / f"figure13_{normal}.yaml"
    sizes = [f"image.width={size}", f"image.height={size}", "renderer.samples=1"]
    return load_scene(path, overrides=[*sizes, *more])


def part(size: int, side: int) -> tuple[int, int, int, int]:
    """The square of figure 13 around the middle of CROP, `side` pixels wide, where all of the picture is `size`."""
    middle_x, middle_y = CROP[0] + CROP[2] / 2, CROP[1] + CROP[3] / 2
    left, top = (round(middle * size / SIZES[-1]) - side // 2 for middle in (middle_x, middle_y))
    return left, top, side, side


def true_normals(size: int) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Means of FINER x FINER exact normals of the measured part of figure 13, and where all of them are there."""
    left, top, width, height = (FINER * edge for edge in part(size, MEASURED))
    scene = figure("gradient", FINER * size, "renderer.points=null", "lights=[]")
    fine = vectors(scene, "N", precision="float64", region=(left, top, width, height))
    blocks = fine.reshape(MEASURED, FINER, MEASURED, FINER, 3)
    mean = blocks.mean(axis=(1, 3))
    length = np.linalg.norm(mean, axis=-1, keepdims=True)
    whole = (np.linalg.norm(blocks, axis=-1) > 0.5).all(axis=(1, 3))
    return mean / length.clip(1e-9), whole


def fractal_errors(normal: str, size: int, true: Floats, whole: npt.NDArray[np.bool_]) -> tuple[float, float]:
    """Median and 90 % quantile of the errors in degrees on figure 13 of that size."""
    scene = figure(normal, size, "lights=[]")
    found = vectors(scene, "N", precision="float32", region=part(size, MEASURED))
    median, high = np.quantile(angles(found, true)[whole], [0.5, 0.9])
    return float(median), float(high)


def seconds(scene: Scene) -> float:
    """Processor time of this process for the timed part of figure 13, the least of three."""
    region = part(scene.image.width, TIMED)
    times = []
    for _ in range(4):
        before = resource.getrusage(resource.RUSAGE_SELF)
        render(scene, channels=["R", "G", "B"], region=region, precision="float32")
        after = resource.getrusage(resource.RUSAGE_SELF)
        times.append(after.ru_utime - before.ru_utime)
    return min(times[1:])  # the first one builds the program


def number(value: float) -> str:
    """Two significant digits, three decimals at most."""
    if value < 0.0005:
        return "0"
    digits = min(3, max(0, 1 - int(np.floor(np.log10(value)))))
    return f"{value:.{digits}f}"


def table(head: Sequence[str], row: Callable[[str], Sequence[str]]) -> str:
    """A table with a line for each normal."""
    lines = [f"| `normal` | {' | '.join(head)} |", "|---|" + "--:|" * len(head)]
    lines += [f"| `{normal}` | {' | '.join(row(normal))} |" for normal in NORMALS]
    return "\n".join(lines) + "\n"


def measured() -> str:
    """The measured part of the page."""
    balls = {normal: ball_errors(normal) for normal in NORMALS}
    ball_head = [f"1/{pixels}, {slant}°" for pixels in FOOTPRINTS for slant in SLANTS]
    ball = table(ball_head, lambda normal: [number(error) for error in balls[normal].values()])

    truths = {size: true_normals(size) for size in SIZES}
    fractal_head = [f"{size}, {which}" for size in SIZES for which in ("median", "90 %")]
    fractal = table(
        fractal_head,
        lambda normal: [
            number(error) for size in SIZES for error in fractal_errors(normal, size, *truths[size])
        ],
    )

    single = seconds(figure("gradient", SIZES[-1], "renderer.points=null"))
    times = table(["time"], lambda normal: [f"{seconds(figure(normal, SIZES[-1])) / single:.1f}"])
    return (
        f"### On a ball\n\n{ball}\n### On the Mandelbulb\n\n{fractal}\n"
        f"### Time\n\n{times}| one point, `gradient` | 1.0 |\n"
    )


def make_pictures() -> None:
    """The crops of figure 13 at full size, one sample for each pixel."""
    for normal in NORMALS:
        scene = figure(normal, SIZES[-1])
        framebuffer = render(scene, channels=["R", "G", "B"], region=CROP)
        target = DOCS / "pictures" / f"normals_{normal}.webp"
        Image.fromarray(framebuffer.to_rgb8(scene.output.stops)).save(target, "WEBP", lossless=True, method=4)
        print(target)


def main(arguments: Sequence[str]) -> None:
    """Makes the pictures, or measures."""
    if "--pictures" in arguments:
        make_pictures()
        return
    result = measured()
    print(result)
    if "--show" not in arguments:
        page = PAGE.read_text("utf-8")
        before, rest = page.split(BEGIN)
        PAGE.write_text(before + BEGIN + result + END + rest.split(END)[1], "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
