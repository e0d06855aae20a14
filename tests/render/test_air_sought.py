"""What fog scatters of planes, of light that is sought, and within what shines, against sums along the rays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.integrators.waves import surface_stages
from clfractal.scene.model import Scene
from clfractal.shading.air_lights import seeks_in_air
from clfractal.shading.emitters import emitters_of
from tests.render.bits import same
from tests.render.foggy import COLOR, EVEN, LAYER, MIST, SIDE, Shines, agree, both, foggy, of_ball
from tests.render.media import phase
from tests.render.path_scenes import BALL
from tests.render.shots import Floats, plan_of, rays, shoot, stacked
from tests.variants import one_of

pytestmark = pytest.mark.light

DARK: dict[str, Any] = {"base": {"color": [0, 0, 0]}, "specular": {"weight": 0}}
COLORS: dict[str, Any] = {"color": COLOR.tolist()}
"""Of what shines."""


FINE = {"samples": 1024}


def glow(luminance: Any) -> dict[str, Any]:
    """A black material that shines."""
    return {"glow": {**DARK, "emission": {"luminance": luminance, **COLORS}}}


def even_map(luminance: float) -> dict[str, Any]:
    """The same everywhere, which only a ray finds out."""
    return {"by": "height", "curve": [[0, luminance], [1, luminance]]}


def beside(scene: Scene, middle: Any, radius: float) -> Any:
    """Pixels whose middle rays do not meet a ball; a pixel is a quarter of the ball's radius to either side."""
    origin, way, _ = rays(scene)
    offset = np.asarray(middle) - origin
    along = (offset * way).sum(axis=-1)
    return np.linalg.norm(offset - along[..., None] * way, axis=-1) > radius


def half_space(scene: Scene, luminance: float) -> Shines:
    """An even plane above: half of all directions, by the phase function."""
    fog: Any = scene.fog
    z, turn = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(128) + 0.5) / 64 * math.pi)
    wide = np.sqrt(1 - z**2)
    upward = np.stack([wide * np.cos(turn), wide * np.sin(turn), z], axis=-1)

    def shines(points: Floats, way: Floats) -> Floats:
        part = 2 * math.pi * phase(upward @ way, fog.scattering.anisotropy).mean()
        return np.broadcast_to(part * luminance * COLOR, points.shape)

    return shines


@pytest.mark.parametrize("fog", one_of(MIST, EVEN))
@pytest.mark.parametrize("sought", [False, True])
def test_a_plane(device: Device, fog: dict[str, Any], sought: bool) -> None:
    """Rays that do not come to it."""
    plane = {"type": "plane", "position": [2, -1, 3], "material": "glow"}
    luminance = even_map(2) if sought else 2
    scene = foggy(fog, materials=glow(luminance), objects={"ceiling": plane})
    assert [each.sought for each in emitters_of(scene)] == [sought]
    down = rays(scene)[1][..., 2] <= 0
    agree(scene, device, half_space(scene, 2), down, noise=0.05, parts=500)


def ramp_of_ball(scene: Scene, middle: Any, radius: float) -> Shines:
    """A ball of which each place shines with 4 (1 + its normal's z)."""
    fog: Any = scene.fog
    z, turn = np.meshgrid((np.arange(24) + 0.5) / 12 - 1, (np.arange(32) + 0.5) / 16 * math.pi)
    wide = np.sqrt(1 - z**2)
    normals = np.stack([wide * np.cos(turn), wide * np.sin(turn), z], axis=-1).reshape(-1, 3)
    places, area = np.asarray(middle) + radius * normals, 4 * math.pi * radius**2 / len(normals)

    def shines(points: Floats, way: Floats) -> Floats:
        found = np.zeros(len(points))
        for first in range(0, len(points), 200):
            toward = places - points[first : first + 200, None]
            square = (toward**2).sum(axis=-1)
            part = phase(toward @ way / np.sqrt(square), fog.scattering.anisotropy)
            faces = np.maximum(-(toward * normals).sum(axis=-1), 0) / square**1.5
            found[first : first + 200] = (4 * (1 + normals[:, 2]) * faces * part * area).sum(axis=-1)
        return np.asarray(found[:, None] * COLOR)

    return shines


@pytest.mark.parametrize("fog", one_of(MIST, LAYER))
def test_a_ball_with_a_ramp(device: Device, fog: dict[str, Any]) -> None:
    middle, radius = [0.6, 0.2, 0.3], 0.4
    ball = {"type": "sphere", "position": middle, "radius": radius, "material": "glow"}
    ramp = {"by": "normal", "direction": [0, 0, 1], "range": [-1, 1], "curve": [[0, 0], [1, 8]]}
    scene = foggy(fog, materials=glow(ramp), objects={"it": ball})
    assert seeks_in_air(scene)
    agree(scene, device, ramp_of_ball(scene, middle, radius), beside(scene, middle, 1.5 * radius), parts=500)


@pytest.mark.parametrize("own", one_of(False, True))
def test_a_formula(device: Device, own: bool) -> None:
    """A ball of radius 1 (or 0.4) in a ball of directions twice as large: from inside of that it is found by chance."""
    if own:
        scene = foggy(EVEN, formula=BALL, materials=glow(3), material={"name": "glow"}, renderer=FINE)
        middle, radius = [0.0, 0.0, 0.0], 1.0
    else:
        middle, radius = [0.6, 0.2, 0.3], 0.4
        it = {"type": "formula", "formula": BALL, "scale": radius, "position": middle, "material": "glow"}
        scene = foggy(EVEN, materials=glow(3), objects={"it": it}, renderer=FINE)
    (shining,) = emitters_of(scene)
    assert shining.sought
    assert shining.ball is not None
    assert shining.ball[1] > 1.5 * radius
    agree(
        scene,
        device,
        of_ball(scene, middle, radius, 3 * COLOR),
        beside(scene, middle, 1.2 * radius),
        noise=0.3,
    )


def test_in_a_room_that_shines(device: Device) -> None:
    """From everywhere alike, and from the wall behind the fog."""
    room = {"type": "box", "size": [14, 16, 12], "rotation": [0, 0, 20], "material": "glow"}
    scene = foggy({"density": 0.2, "anisotropy": 0.4}, materials=glow(2), objects={"room": room})
    assert seeks_in_air(scene)
    assert not any(each.sought for each in emitters_of(scene))
    film = shoot(scene, device)
    seen = stacked(film, ("R", "G", "B")).astype(float)
    origin = rays(scene)[0]
    depth = np.linalg.norm(stacked(film, ("P.X", "P.Y", "P.Z")) - origin, axis=-1)
    passes = np.exp(-0.2 * depth)
    wanted = 2 * COLOR * (passes + (1 - passes))[..., None]
    assert passes.max() < 0.5
    assert seen.mean(axis=(0, 1)) == pytest.approx(wanted.mean(axis=(0, 1)), rel=0.003)
    np.testing.assert_allclose(seen, wanted, rtol=0.03)


SHAPES: dict[str, dict[str, Any]] = {
    "torus": {"type": "torus", "radius": 0.4, "tube": 0.15, "rotation": [40, 0, 0]},
    "box": {"type": "box", "size": [0.5, 0.3, 0.7], "rotation": [20, 30, 0]},
    "cone": {"type": "cone", "radius": 0.4, "height": 0.6, "rotation": [10, 50, 0]},
}


@pytest.mark.parametrize("name", one_of("torus", "box", "cone"))
def test_what_is_sought_is_as_bright_as_what_is_known(device: Device, name: str) -> None:
    """Behind a wall, too, and beside another light."""
    objects = {
        "it": {**SHAPES[name], "position": [0.3, 0.3, 0.2], "material": "glow"},
        "wall": {"type": "box", "position": [0.5, 0, 0.9], "size": [1.5, 1.5, 0.05], "material": "dark"},
        "other": {"type": "sphere", "position": [-1.5, 1, 0], "radius": 0.1, "material": "lamp"},
    }
    lamp = {**DARK, "emission": {"luminance": 30}}
    known, sought = (
        foggy(
            MIST,
            materials={**glow(luminance), "dark": DARK, "lamp": lamp},
            objects=objects,
            renderer={"samples": 1024},
        )
        for luminance in (8, even_map(8))
    )
    assert seeks_in_air(sought)
    assert not seeks_in_air(known)
    one, other = (stacked(shoot(each, device), ("R", "G", "B")).astype(float) for each in (known, sought))
    assert one.mean(axis=(0, 1)) == pytest.approx(other.mean(axis=(0, 1)), rel=0.01)
    near = np.isclose(one, other, rtol=0.15, atol=0.03 * one.max()).all(axis=-1)
    assert near.mean() > 0.98


def test_many_things_are_as_bright_as_each_alone(device: Device) -> None:
    """More than sixteen, of which one is chosen from their tree; those that are sought among them."""
    draws = np.random.default_rng(4)
    places = draws.uniform(-2, 2, (20, 3))
    objects = {
        f"ball{number}": {
            "type": "sphere",
            "position": place.tolist(),
            "radius": 0.06,
            "material": "glow" if number % 3 else "faint",
        }
        for number, place in enumerate(places)
    }
    faint = {**DARK, "emission": {"luminance": even_map(10)}}
    scene = foggy(EVEN, materials={**glow(30), "faint": faint}, objects=objects, renderer={"samples": 512})
    free = np.ones((SIDE, SIDE), bool)
    for place in places:
        free &= beside(scene, place, 0.3)
    shines = both(
        *(
            of_ball(scene, place, 0.06, 30 * COLOR if number % 3 else [10, 10, 10])
            for number, place in enumerate(places)
        )
    )
    agree(scene, device, shines, free)


def test_a_part_of_the_picture_has_its_bits(device: Device) -> None:
    """And asks for light by the stages of light that is sought, before others."""
    it = {
        "type": "formula",
        "formula": {"name": "mandelbulb", "iterations": 4},
        "scale": 0.6,
        "material": "glow",
    }
    luminance = {"by": "trap", "range": [0, 2], "curve": [[0, 0], [1, 8]]}
    scene = foggy(LAYER, materials=glow(luminance), objects={"it": it}, renderer={"samples": 2})
    stages = [each.kernel for each in surface_stages(scene, plan_of(scene, device), (0, 1))]
    assert stages.index("send_air") < stages.index("gather_sought_air") < stages.index("scatter_paths")
    whole = stacked(shoot(scene, device))
    part = stacked(shoot(scene, device, region=(3, 2, 11, 9)))
    assert same(np.ascontiguousarray(whole[2:11, 3:14]), part)
