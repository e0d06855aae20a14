"""Glass beside Mitsuba 3 (`pip install mitsuba`): what pictures of equal error cost.

    python -m benchmarks.glass [--samples N] [--rounds N] [--device NAME]

Both stand on a plane under an even sky and a lamp, without a formula, along paths of twelve bounces; Mitsuba is its variant
scalar_rgb. In turn, each program draws pictures with other random numbers, which tell the variance: of pixels, and of
blocks of 8 x 8 pixels, in which noise that neighbours share does not fade. Where both agree in the mean light, that is the
mean square of the error. It falls with the time, so their product is the cost of some error. Times are those of all cores
together, which both programs keep busy, and of rendering alone, without compiling.
"""

from __future__ import annotations

import argparse
from typing import Any

from benchmarks.equal_error import Drawn, Picture, drawn_by_turns, ours, print_head, print_rows, theirs
from clfractal.api import load_scene
from clfractal.scene.model import Scene

WIDTH, HEIGHT = 320, 240
EYE, TARGET, FOV = [2.5, -5, 2.2], [0, 0, 0.45], 30
BOUNCES, ROULETTE = 12, 4
SKY, LIGHT, FLOOR = [0.5, 0.55, 0.6], [12, 12, 12], [0.6, 0.6, 0.55]
LAMP: dict[str, Any] = {
    "position": [1.2, 1.5, 4],
    "direction": [-0.3, -0.35, -1],
    "width": 1.5,
    "height": 1.5,
}
GLASS: dict[str, Any] = {"specular": {"roughness": 0, "ior": 1.5}, "transmission": {"weight": 1}}
WATER: dict[str, Any] = {"specular": {"roughness": 0, "ior": 1.33}, "transmission": {"weight": 1}}
# From 0.002 to 1.3; and water in it from 0.08 to 1.31, a little above the rim.
TUMBLER: dict[str, Any] = {"type": "cylinder", "position": [0, 0, 0.651], "radius": 0.6, "height": 1.298}
DRINK: dict[str, Any] = {"type": "cylinder", "position": [0, 0, 0.695], "radius": 0.54, "height": 1.23}
SCENES: dict[str, dict[str, Any]] = {
    "ball": {"ball": {"type": "sphere", "position": [0, 0, 0.8], "radius": 0.8, "material": "glass"}},
    "water": {"tumbler": {**TUMBLER, "material": "glass"}, "drink": {**DRINK, "material": "water"}},
}


def scene_of(scene: str, samples: int, seed: int) -> Scene:
    """The scene for this engine."""
    return load_scene(
        {
            "version": 1,
            "formula": "none",
            "image": {"width": WIDTH, "height": HEIGHT},
            "camera": {"position": EYE, "target": TARGET, "fov": FOV},
            "lighting": {"mode": "path", "bounces": BOUNCES, "roulette": ROULETTE},
            "background": SKY,
            "lights": [{"type": "rectangle", **LAMP, "color": LIGHT}],
            "materials": {
                "floor": {"base": {"color": FLOOR}, "specular": {"weight": 0}},
                "glass": GLASS,
                "water": WATER,
            },
            "objects": {"floor": {"type": "plane", "material": "floor"}, **SCENES[scene]},
            "renderer": {"samples": samples, "seed": seed},
        }
    )


def of_mitsuba(scene: str, samples: int, seed: int) -> Picture:
    """Mitsuba's picture. Raises MissingError."""
    told = {
        "scene": scene,
        "samples": samples,
        "size": [WIDTH, HEIGHT],
        "eye": EYE,
        "target": TARGET,
        "fov": FOV,
        "bounces": BOUNCES,
        "roulette": ROULETTE,
        "sky": SKY,
        "light": LIGHT,
        "floor": FLOOR,
        "lamp": LAMP,
    }
    return theirs("mitsuba_glass", told, seed)


def measured(scene: str, rounds: int, samples: int, device: str | None) -> dict[str, Drawn]:
    """The pictures of both programs."""
    ours(scene_of(scene, 1, 0), device)  # builds the programs
    return drawn_by_turns(
        rounds,
        lambda seed: ours(scene_of(scene, samples, seed), device),
        lambda seed: of_mitsuba(scene, samples, seed),
    )


def main() -> None:
    """Measures both scenes, and prints a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--device")
    given = parser.parse_args()
    print_head()
    for scene in SCENES:
        print_rows(scene, measured(scene, given.rounds, given.samples, given.device))


if __name__ == "__main__":
    main()
