"""A pool, and a ball of glass over a floor, for tests of light that these bend."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.integrators import state, waves
from clfractal.scene.model import Scene

INDEX, GLASS, ALBEDO = 1.33, 1.5, 0.8
BLACK = {"top": [0, 0, 0], "bottom": [0, 0, 0]}


def pool(
    lights: list[dict[str, Any]], eye: float = -0.4, bounces: int = 0, height: float = 0, **objects: Any
) -> Scene:
    """A white floor under water with waves of a height, looked at from another height."""
    water = {"specular": {"roughness": 0, "ior": INDEX}, "transmission": {"weight": 1}}
    return Scene.model_validate(
        {
            "version": 1,
            "formula": "none",
            "image": {"width": 12, "height": 12},
            "camera": {"position": [0, -1.5, eye], "target": [0, 0, -1 if eye < 1 else 0.3], "fov": 40},
            "lighting": {"mode": "path", "bounces": bounces, "roulette": max(bounces, 1)},
            "background": BLACK,
            "materials": {
                "water": water,
                "white": {"base": {"color": [ALBEDO] * 3}, "specular": {"weight": 0}},
                "shines": {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 5}},
            },
            "objects": {
                "water": {"type": "water", "waves": {"height": height}, "material": "water"},
                "floor": {"type": "plane", "position": [0, 0, -1], "material": "white"},
                **objects,
            },
            "lights": lights,
        }
    )


def light_of(scene: Scene, samples: int, seed: int = 0) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The picture's green, shape (height, width)."""
    renderer = scene.surface.model_copy(update={"samples": samples, "seed": seed})
    return np.asarray(clfractal.render(scene.model_copy(update={"renderer": renderer}))["G"], np.float64)


def assert_as_by_chance(
    scene: Scene,
    samples: int,
    monkeypatch: pytest.MonkeyPatch,
    tolerance: float = 0.005,
    over_pixels: Callable[..., Any] = np.mean,
) -> tuple[float, float]:
    """The same light on the whole as paths find with four times the samples; gives both pictures' variances."""
    seeds = range(5)
    found = np.array([light_of(scene, samples, seed) for seed in seeds])
    for each in (waves, state):
        monkeypatch.setattr(each, "has_bent_light", lambda scene: False)
    by_chance = np.array([light_of(scene, 4 * samples, seed) for seed in seeds])
    one, other = found.mean(axis=(1, 2)), by_chance.mean(axis=(1, 2))
    error = np.sqrt((one.var(ddof=1) + other.var(ddof=1)) / len(seeds))
    assert abs(one.mean() - other.mean()) < tolerance * other.mean() + 3 * error
    own, chance = (float(over_pixels(each.var(axis=0, ddof=1))) for each in (found, by_chance))
    return own, chance


def transmittance(cosine: float) -> float:
    """Of unpolarised light that enters the water (Fresnel), its angle given by the cosine outside."""
    beyond = np.sqrt(1 - (1 - cosine**2) / INDEX**2)
    across = (cosine - INDEX * beyond) / (cosine + INDEX * beyond)
    along = (INDEX * cosine - beyond) / (INDEX * cosine + beyond)
    return float(1 - (across**2 + along**2) / 2)


def under_ball(
    lights: list[dict[str, Any]],
    eye: list[float],
    target: list[float],
    fov: float,
    bounces: int,
    **sections: Any,
) -> Scene:
    """A ball of glass at the origin, with a radius of 0.5, over a white floor."""
    white = {"base": {"color": [ALBEDO] * 3}, "specular": {"weight": 0}}
    glass = {"specular": {"roughness": 0, "ior": GLASS}, "transmission": {"weight": 1}}
    return Scene.model_validate(
        {
            "version": 1,
            "formula": "none",
            "image": {"width": 12, "height": 12},
            "camera": {"position": eye, "target": target, "fov": fov},
            "lighting": {"mode": "path", "bounces": bounces, "roulette": bounces},
            "background": BLACK,
            "materials": {"glass": glass, "white": white},
            "objects": {
                "ball": {"type": "sphere", "radius": 0.5, "material": "glass"},
                "floor": {"type": "plane", "position": target, "material": "white"},
            },
            "lights": lights,
            **sections,
        }
    )
