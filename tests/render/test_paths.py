"""Light along paths against what is known of it: Eq. 5 without bounces, white rooms, and closed forms of lamps."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from tests.environment_maps import irradiance, write_map
from tests.render.path_scenes import GREY, path, scene_of, seen
from tests.variants import one_of

pytestmark = pytest.mark.light


@pytest.mark.parametrize(
    "light",
    [
        {"direction": [-1, 1, -1], "color": [1, 0.5, 0.25]},
        {"type": "point", "position": [1.5, -2, 1], "falloff": "inverse_square", "intensity": 3},
        {"type": "point", "position": [1.5, -2, 1]},
    ],
)
def test_without_bounces_lambert_is_eq_5(light: dict[str, Any]) -> None:
    """A light is as bright in both modes: a white surface that faces it sends back its intensity."""
    material = {"color": [0.8, 0.5, 0.2], "ambient": 0, "specular": 0, "diffuse": 1}
    direct = seen(scene_of(lights=[light], material=material), 4)[0]
    paths = seen(scene_of(lights=[light], material=material, lighting=path(detail=1)), 4)[0]
    assert len(paths) > 200
    assert paths.max() > 0.1
    assert np.allclose(direct, paths, atol=2e-6)


def test_two_lights_are_their_sum() -> None:
    """One of them is chosen for each sample; the mean is that of both."""
    lights = [{"direction": [-1, 1, -1]}, {"direction": [1, 1, -0.2], "intensity": 0.3}]
    both = seen(scene_of(lights=lights, lighting=path(), material={"specular": 0}), 256)[0]
    each = [
        seen(scene_of(lights=[light], lighting=path(), material={"specular": 0}), 256)[0] for light in lights
    ]
    assert abs(both.mean() - (each[0] + each[1]).mean()) < 0.001
    assert np.abs(both - each[0] - each[1]).max() < 0.25


@pytest.mark.parametrize(
    ("light", "rim", "error"),
    [
        ({"direction": [0, 1, -0.5]}, 12, 0.005),
        ({"type": "point", "position": [0, -3000, 1500]}, 16, 0.01),
    ],
    ids=["directional", "point"],
)
def test_a_disc_of_light_has_its_closed_form(light: dict[str, Any], rim: float, error: float) -> None:
    """Wholly over the horizon a disc lights as its middle: intensity times the cosine. No ray of a path can meet that of a
    point light, whose directions spread about its place; so all of it is asked for."""
    white = {"color": [1, 1, 1], "specular": 0, "diffuse": 1}
    lights = [{**light, "angular_size": 20}]
    colors, normals, _ = seen(scene_of(lights=lights, lighting=path(2), material=white), 64)
    cosine = normals @ (np.array([0, -1, 0.5]) / math.hypot(1, 0.5))
    lit = cosine > math.sin(math.radians(rim))
    assert lit.sum() > 250
    assert abs((colors[lit, 0] / cosine[lit]).mean() - 1) < error


def test_a_disc_is_found_by_mirrors() -> None:
    """In a mirror the disc shows its own radiance, intensity / sin^2 of half its size: samples of the surface find it."""
    light = {"direction": [0, 1, 0], "angular_size": 40}
    material = {"name": "mirror"}
    mirror = {"base": {"color": [1, 1, 1], "metalness": 1}, "specular": {"roughness": 0.02}}
    scene = scene_of(lights=[light], lighting=path(1), materials={"mirror": mirror}, material=material)
    colors, normals, _ = seen(scene, 64)
    middle = normals @ np.array([0, -1, 0]) > math.cos(math.radians(6))
    assert middle.sum() > 4
    assert abs(colors[middle].mean() * math.sin(math.radians(20)) ** 2 - 1) < 0.02


@pytest.mark.parametrize(
    ("roulette", "surroundings"),
    one_of((0, "environment"), (64, "background"), (0, "background"), (64, "environment")),
)
def test_light_that_bounces_adds_up(roulette: int, surroundings: str, tmp_path: Path) -> None:
    """Surfaces that reflect half and shine with half are as bright as a white sky, in all hollows: L = 1/2 + 1/2 L."""
    shining = {"base": {"color": [0.5, 0.5, 0.5]}, "specular": {"weight": 0}, "emission": {"luminance": 0.5}}
    sections: dict[str, Any] = {"background": GREY}
    if surroundings == "environment":
        write_map(tmp_path / "white.exr", 1.0)
        sections = {"environment": {"file": "white.exr"}}
    values = scene_of(
        formula={"name": "menger_sponge", "iterations": 3},
        camera={"position": [1.4, -2.6, 1.1], "fov": 40},
        materials={"m": shining},
        material={"name": "m"},
        lighting=path(32, roulette=roulette),
        **({"background": GREY} if surroundings == "background" else {}),
    )
    scene = values.placed(tmp_path).model_copy(update=sections)
    colors = seen(scene, 32)[0]
    assert abs(colors.mean() - 1) < 0.005


def test_roulette_does_not_change_the_mean() -> None:
    def bright(roulette: int) -> float:
        scene = scene_of(
            formula={"name": "menger_sponge", "iterations": 2},
            camera={"position": [1.4, -2.6, 1.1], "fov": 40},
            lights=[{"direction": [-1, 1, -1]}],
            background={"top": [0.5, 0.6, 0.8], "bottom": [0.2, 0.2, 0.2]},
            lighting=path(12, roulette=roulette),
            material={"color": [0.8, 0.8, 0.8]},
        )
        return float(seen(scene, 32)[0].mean())

    assert abs(bright(0) / bright(64) - 1) < 0.01


def test_environments_are_asked_and_met(tmp_path: Path) -> None:
    """A small bright spot in a map lights a Lambert ball with its irradiance, whether it is asked or met."""
    pixels = np.full((64, 128), 0.05, np.float32)
    pixels[16:20, 30:34] = 60.0
    write_map(tmp_path / "spot.exr", pixels)
    scene = scene_of(lighting=path(0), material={"color": [1, 1, 1], "specular": 0, "diffuse": 1}).placed(
        tmp_path
    )
    scene = scene.model_copy(update={"environment": {"file": "spot.exr", "background": False}})
    colors, normals, _ = seen(scene, 64)
    expected = irradiance(pixels, normals)[:, 0]
    usable = expected > 0.2
    assert usable.sum() > 100
    assert abs((colors[usable, 0] / expected[usable]).mean() - 1) < 0.02


def test_the_light_of_a_part_is_limited_and_told() -> None:
    scene = scene_of(
        lights=[{"direction": [-1, 1, -1], "intensity": 5}],
        formula={"name": "menger_sponge", "iterations": 2},
        lighting=path(3, clamp=0.02),
        background=GREY,
    )
    free = scene.model_copy(update={"lighting": path(3)})
    dark, bright = clfractal.render(scene), clfractal.render(free)
    assert dark["R"].sum() < bright["R"].sum()
    assert any("lighting.clamp" in line for line in dark.remarks)
    assert not any("lighting.clamp" in line for line in bright.remarks)


def test_ignored_keys_are_told() -> None:
    film = clfractal.render(scene_of(lighting=path(), material={"reflection": 0.4}, lights=[{}]))
    assert "lighting.mode path does not use material.reflection" in film.remarks
    film = clfractal.render(scene_of(materials={"m": {}}, material={"name": "m"}, lights=[{}]))
    assert "material.name m is for lighting.mode path; Phong's keys are shown" in film.remarks
    faces = [{"cut": True, "material": "m"}]
    film = clfractal.render(scene_of(materials={"m": {}}, lights=[{}], cut_planes=faces))
    assert "cut_planes.0.material m is for lighting.mode path; Phong's keys are shown" in film.remarks
