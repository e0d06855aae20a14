"""Clouds beside Mitsuba 3 (`pip install mitsuba`): what pictures of equal error cost.

    python -m benchmarks.clouds [--scene NAME] [--samples N] [--rounds N] [--device NAME]

A thin cloud and a thick, nearly white one, each in a grid of 64^3, and a cumulus in one of 256^3, of which nine in ten
voxels are empty: under an even sky and a sun. Mitsuba is its variant scalar_rgb with `volpath`. In turn,
each program draws pictures with other random numbers, which tell the variance: of pixels, and of blocks of 8 x 8 pixels.
Where both agree in the mean light, that is the mean square of the error. It falls with the time, so their product is the
cost of some error. Times are those of all cores together, and of rendering alone, without compiling and files.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.equal_error import Drawn, Picture, drawn_by_turns, ours, print_head, print_rows, theirs
from clfractal.api import load_scene
from clfractal.scene.model import Scene

WIDTH, HEIGHT = 160, 120
EYE, TARGET, FOV = [1.6, -5.2, 0.4], [0, 0, -0.05], 19
SIDE = 2.0
SKY, SUN, FROM_SUN = [0.4, 0.5, 0.7], [2.0, 1.8, 1.5], [-0.6, 0.5, -0.62]
STOPS = 65

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Medium:
    """A cloud in a box of SIDE around the origin.

    Attributes:
        voxels: along a side.
        extinction: where its values are 1, per scene unit.
        albedo, anisotropy: of a scattering.
        bounces, roulette: as in `lighting`.
        samples: of a pixel: ours, and Mitsuba's.
    """

    voxels: int
    extinction: float
    albedo: float
    anisotropy: float
    bounces: int
    roulette: int
    samples: tuple[int, int]


SCENES = {
    "thin": Medium(64, 1.2, 0.9, 0.5, 16, 4, (64, 64)),
    "thick": Medium(64, 60.0, 0.999, 0.0, 128, 16, (16, 16)),
    "256^3": Medium(256, 80.0, 0.99, 0.8, 64, 8, (16, 16)),
}


def values(voxels: int) -> npt.NDArray[np.float32]:
    """A heap of cloud, 0 to 1, with billows of many sizes and nothing around it; shape (z, y, x)."""
    across = ((np.arange(voxels) + 0.5) / voxels * 2 - 1).astype(np.float32)
    z, y, x = np.meshgrid(across, across, across, indexing="ij")
    random = np.random.default_rng(7)
    shape = np.full_like(x, -1)
    for _ in range(14):
        right, back, up = (random.normal(size=3) * [0.3, 0.25, 0.16]).astype(np.float32)
        distance = np.sqrt((x - right) ** 2 + (y - back) ** 2 + (z - up) ** 2)
        shape = np.maximum(shape, 1 - distance / np.float32(random.uniform(0.2, 0.4)))
    # Noise whose power falls as in turbulence: the same waves whatever the grid.
    waves = np.zeros_like(x)
    for octave in range(5):
        for _ in range(6):
            way = random.normal(size=3)
            a, b, c = (way * 7 * 2**octave / np.linalg.norm(way)).astype(np.float32)
            waves += np.abs(np.sin(x * a + y * b + z * c + np.float32(random.uniform(0, 7)))) / 2**octave
    waves = (waves - waves.mean()) / waves.std()
    return np.asarray(np.clip(2.5 * (shape + 0.12 * waves), 0, 1), np.float32)


def scene_of(medium: Medium, folder: Path, samples: int, seed: int) -> Scene:
    """The scene of a medium whose values are in a folder."""
    at = np.linspace(0, 1, STOPS)
    opacity = -np.expm1(-medium.extinction * SIDE / medium.voxels * at)
    return load_scene(
        {
            "version": 1,
            "formula": "none",
            "image": {"width": WIDTH, "height": HEIGHT},
            "camera": {"position": EYE, "target": TARGET, "fov": FOV},
            "lighting": {"mode": "path", "bounces": medium.bounces, "roulette": medium.roulette},
            "background": SKY,
            "lights": [{"direction": FROM_SUN, "color": SUN}],
            "objects": {
                "cloud": {
                    "type": "volume",
                    "file": "cloud.npy",
                    "size": SIDE,
                    "anisotropy": medium.anisotropy,
                    "transfer": {
                        "opacity": [
                            {"at": place, "opacity": each}
                            for place, each in zip(at.tolist(), opacity.tolist(), strict=True)
                        ],
                        "color": [{"at": 0, "color": [medium.albedo] * 3}],
                    },
                },
            },
            "renderer": {"samples": samples, "seed": seed},
        },
        folder=folder,
    )


def of_mitsuba(medium: Medium, folder: Path, samples: int, seed: int) -> Picture:
    """Mitsuba's picture. Raises MissingError."""
    told: dict[str, Any] = {
        **asdict(medium),
        "samples": samples,
        "size": [WIDTH, HEIGHT],
        "side": SIDE,
        "values": str(folder / "cloud.npy"),
        "eye": EYE,
        "target": TARGET,
        "fov": FOV,
        "sky": SKY,
        "sun": SUN,
        "from_sun": FROM_SUN,
    }
    return theirs("mitsuba_clouds", told, seed)


def measured(medium: Medium, rounds: int, samples: tuple[int, int], device: str | None) -> dict[str, Drawn]:
    """The pictures of both programs."""
    with tempfile.TemporaryDirectory(prefix="clouds-") as name:
        folder = Path(name)
        np.save(folder / "cloud.npy", values(medium.voxels))
        ours(scene_of(medium, folder, 1, 0), device)  # builds the programs
        return drawn_by_turns(
            rounds,
            lambda seed: ours(scene_of(medium, folder, samples[0], seed), device),
            lambda seed: of_mitsuba(medium, folder, samples[1], seed),
        )


def main() -> None:
    """Measures the scenes, and prints a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", action="append", choices=list(SCENES))
    parser.add_argument("--samples", type=int)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--device")
    given = parser.parse_args()
    print_head()
    for scene in given.scene or SCENES:
        medium = SCENES[scene]
        samples = (given.samples, given.samples) if given.samples else medium.samples
        print_rows(scene, measured(medium, given.rounds, samples, given.device))


if __name__ == "__main__":
    main()
