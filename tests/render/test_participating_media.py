"""Media that scatter light, also below boundaries: Beer and Lambert's law, Chandrasekhar's half spaces, walks in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal
from clfractal.device.select import choose
from clfractal.scene.model import Scene
from tests.render.bits import alike_by_lanes
from tests.render.glass_scenes import BODIES, ball, colors_of, glass, scene
from tests.render.path_scenes import BLACK, GREY, path, scene_of, seen
from tests.variants import one_of

Floats = npt.NDArray[np.float64]


def depth_function(albedo: float, cosines: Floats) -> Floats:
    """Chandrasekhar's H for isotropic scattering (Radiative Transfer, 1950, chapter V), at given cosines."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    x, w = (nodes + 1) / 2, weights / 2
    h = np.ones_like(x)
    for _ in range(400):
        h = 1 / (np.sqrt(1 - albedo) + albedo / 2 * (w * x * h / (x[:, None] + x)).sum(axis=1))
    sums = (w * x * h / (cosines[..., None] + x)).sum(axis=-1)
    return np.asarray(1 / (np.sqrt(1 - albedo) + albedo / 2 * sums))


pytestmark = pytest.mark.light


WHITE = {"scatter": [1, 1, 1]}
E = float(np.exp(-1))


def milk(ior: float = 1.5, roughness: float = 0, **transmission: Any) -> dict[str, Any]:
    """A medium that absorbs nothing, unless more is said."""
    return glass(roughness, ior, **{"depth": 0.5, **WHITE, **transmission})


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_light_that_is_not_scattered_obeys_beer_and_lambert(precision: str) -> None:
    """A small lamp behind a slab that bends nothing, of a medium whose colours differ. (Next to nothing is scattered.)"""
    color, depth, width = np.array([0.7, 0.4, 0.2]), 0.8, 1.2
    scatter = np.array([0.3, 0.2, 0.9])
    materials = {
        "slab": milk(1.0, color=color.tolist(), depth=depth, scatter=scatter.tolist()),
        "lamp": {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 1}},
    }
    objects = {
        "slab": {"type": "box", "size": [9, width, 9], "material": "slab"},
        "lamp": {"type": "sphere", "radius": 3, "position": [0, 40, 0], "material": "lamp"},
    }
    colors = colors_of(scene(objects, materials, background=BLACK, bounces=16), 64, precision=precision)
    # It absorbs some of each colour, so nothing has to be raised.
    extinction = np.log(1 / color) / depth
    expected = np.exp(-extinction * width)
    assert 0 < colors[:4].mean() < 0.002
    np.testing.assert_allclose(colors[14:18, 14:18].mean(axis=(0, 1)), expected, rtol=0.03, atol=0.001)


def test_a_sea_of_milk_is_as_bright_as_chandrasekhars() -> None:
    """What a half space that bends nothing sends back of a white sky: 1 - H sqrt(1 - albedo), for three albedos at once."""
    albedo = np.array([0.5, 0.8, 0.95])
    sea = {"sea": {"type": "plane", "position": [0, 0, -1], "material": "milk"}}
    materials = {"milk": milk(1.0, color=[E, E, E], depth=1, scatter=albedo.tolist())}
    camera = {"position": [0, 40, 2], "target": [0, 44, -1], "fov": 30}
    colors = colors_of(scene(sea, materials, camera=camera, bounces=64), 64)
    side = ((np.arange(32) + 0.5) / 16 - 1) * np.tan(np.radians(15))
    right, up = np.meshgrid(side, -side)
    forward, above = np.array([0, 0.8, -0.6]), np.array([0, 0.6, 0.8])
    down = -(forward[2] + up * above[2]) / np.sqrt(1 + right**2 + up**2)
    for channel in range(3):
        expected = 1 - depth_function(albedo[channel], down) * np.sqrt(1 - albedo[channel])
        rows = np.abs(colors[..., channel] - expected).reshape(4, -1)
        assert rows.mean() < 0.1
        errors = (colors[..., channel] - expected).reshape(4, -1).mean(axis=1)
        assert np.abs(errors).max() < 0.012


@pytest.mark.combination
def test_walks_and_bounces_agree() -> None:
    """Where something may be near, each scattering is a bounce; else all until the next boundary are one."""
    objects = {"body": {**BODIES["sphere"], "material": "jade"}}
    jade = milk(1.4, color=[0.6, 0.8, 0.5], scatter=[0.7, 0.8, 0.9], scatter_anisotropy=0.4)
    gradient = {"top": [1, 0.6, 0.2], "bottom": [0.1, 0.2, 0.5]}
    blocks = []
    for radius in (1.2, 60):
        bounds = {"bounds": {"radius": radius}}
        found = scene(objects, {"jade": jade}, background=gradient, renderer=bounds, bounces=64)
        blocks.append(colors_of(found, 64).reshape(4, 8, 4, 8, 3).mean(axis=(1, 3)))
    assert np.ptp(blocks[0]) > 0.2
    assert np.abs(blocks[0] - blocks[1]).max() < 0.02


def test_the_eye_in_milk_sees_milk() -> None:
    """Where nothing but the medium is before it: all of the picture is covered, and its places are in the medium."""
    around = {"around": {"type": "sphere", "radius": 6, "position": [0, -4, 0], "material": "fog"}}
    fog = milk(1.0, color=[E, E, E], depth=0.2, scatter=[0.9, 0.9, 0.9])
    found = scene(around, {"fog": fog}, bounces=32)
    film = clfractal.render(found, channels=("R", "A", "Z", "N.Y", "object"))
    assert film["A"].min() == 1
    assert 0 < np.median(film["Z"]) < 0.5
    assert (film["N.Y"] < 0).all()
    assert (film["object"] == film["object"][0, 0]).mean() > 0.99
    assert film["object"][0, 0] > 0


@pytest.mark.combination
def test_what_differs_from_place_to_place_is_that_where_paths_go_in() -> None:
    """A ball before white that is milk above and only dark below."""
    scatter = {"by": "normal", "palette": [[0, 0, 0], [0, 0, 0], [0.9, 0.9, 0.9], [0.9, 0.9, 0.9]]}
    objects = {"body": {**BODIES["sphere"], "material": "m"}}
    dark: dict[str, Any] = {"color": [E, E, E], "depth": 0.3}
    mixed, participating = (
        colors_of(scene(objects, {"m": milk(1.0, scatter=each, **dark)}), 32)[..., 0].mean(axis=1)
        for each in (scatter, [0.9, 0.9, 0.9])
    )
    assert abs(mixed[4:9] / participating[4:9] - 1).max() < 0.05
    assert (mixed[20:26] < participating[20:26] - 0.1).all()


MATT = {"weight": 0}


def skin(specular: dict[str, Any] = MATT, **values: Any) -> dict[str, Any]:
    """A material of a medium below its boundary; `base` is not seen."""
    return {
        "base": {"color": [0, 0, 0]},
        "specular": specular,
        "subsurface": {"weight": 1, **values},
    }


def set_of(material: dict[str, Any], bounces: int = 8, **sections: Any) -> Scene:
    """The set, a ball of radius 1."""
    plain = {"materials": {"m": material}, "background": GREY}
    return scene_of(
        material={"name": "m"},
        lighting=path(bounces),
        image={"width": 32, "height": 32},
        **{**plain, **sections},
    )


def test_inversion_is_that_of_thick_bodies() -> None:
    """Albedos by the formula that kernels have, beside Chandrasekhar's half spaces that scatter all around (1950, V)."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    cosines = (nodes + 1) / 2
    for color in np.linspace(0.02, 0.98, 13):
        s = 4.09712 + 4.20863 * color - np.sqrt(9.59217 + 41.6808 * color + 17.7126 * color**2)
        albedo = 1 - s * s
        back = 1 - depth_function(albedo, cosines) * np.sqrt(1 - albedo)
        assert abs((weights * cosines * back).sum() - color) < 0.003


@pytest.mark.parametrize("anisotropy", [0.0, 0.6, -0.4])
def test_thick_bodies_have_their_colour(anisotropy: float) -> None:
    """A half space under a white sky."""
    color = np.array([0.2, 0.5, 0.85])
    ground = {"ground": {"type": "plane", "position": [0, 0, -1], "material": "m"}}
    material = skin(color=color.tolist(), radius=0.1, scatter_anisotropy=anisotropy)
    camera = {"position": [0, 40, 2], "target": [0, 44, -1], "fov": 30}
    colors = colors_of(scene(ground, {"m": material}, camera=camera, bounces=8), 64)
    np.testing.assert_allclose(colors.mean(axis=(0, 1)), color, atol=0.012)


def test_dense_bodies_are_lamberts() -> None:
    """The radius is far below a pixel: a ball under a light of one direction, which is asked for where paths come out."""
    color, toward = np.array([0.8, 0.5, 0.2]), np.array([0.6, -0.64, 0.48])
    material = skin(color=color.tolist(), radius=0.002, radius_scale=[1, 1, 1])
    lights = [{"direction": (-toward).tolist(), "intensity": 1}]
    colors, normals, _ = seen(set_of(material, background=BLACK, lights=lights), 64)
    lit = normals @ toward > 0.3
    assert lit.sum() > 100
    colors, expected = colors[lit], color * (normals @ toward)[lit, None]
    assert np.abs(colors.mean(axis=0) / expected.mean(axis=0) - 1).max() < 0.02
    assert np.abs(colors - expected).mean() < 0.06


def walk_in_ball(radius: float, albedo: float, count: int = 200_000) -> float:
    """What comes out of a ball with a radius of so many mean free paths, of light that goes in by Lambert's law."""
    random = np.random.default_rng(7)
    sine = np.sqrt(random.random(count))
    direction = np.stack([sine, np.zeros(count), -np.sqrt(1 - sine * sine)], axis=1)
    place = np.tile([0.0, 0.0, radius], (count, 1))
    weight, out = np.ones(count), 0.0
    while len(place):
        place = place + random.exponential(size=len(place))[:, None] * direction
        inside = (place * place).sum(axis=1) < radius * radius
        out += float(weight[~inside].sum())
        place, weight = place[inside], weight[inside] * albedo
        z, turn = 2 * random.random(len(place)) - 1, 2 * np.pi * random.random(len(place))
        level = np.sqrt(1 - z * z)
        direction = np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)
        alive = weight > 1e-4
        place, weight, direction = place[alive], weight[alive], direction[alive]
    return out / count


def test_a_ball_is_that_of_a_random_walk() -> None:
    """Before white, of three optical radii at once: of the set and of an object, whose walks are others."""
    color, radius, scale = 0.6, 0.5, np.array([1.0, 0.5, 0.125])
    material = skin(color=[color] * 3, radius=radius, radius_scale=scale.tolist())
    s = 4.09712 + 4.20863 * color - np.sqrt(9.59217 + 41.6808 * color + 17.7126 * color**2)
    expected = [walk_in_ball(1 / (radius * part), 1 - s * s) for part in scale]
    assert max(expected) - min(expected) > 0.05
    of_set = seen(set_of(material), 128)[0].mean(axis=0)
    objects = {"body": {**BODIES["sphere"], "material": "m"}}
    of_object = colors_of(scene(objects, {"m": material}, bounces=8), 256)[13:19, 13:19].mean(axis=(0, 1))
    np.testing.assert_allclose(of_set, expected, atol=0.006)
    np.testing.assert_allclose(of_object, expected, atol=0.01)


@pytest.mark.combination
@pytest.mark.parametrize(
    "found",
    [
        scene({"body": {**BODIES["box"], "material": "m"}}, {"m": milk(color=[0.8, 0.9, 0.7])}, bounces=16),
        ball(0.1, bounces=16),
        set_of(skin(radius=0.1), background={"top": [1, 0.6, 0.2], "bottom": [0.1, 0.2, 0.5]}),
    ],
    ids=["milk", "glass", "skin"],
)
def test_every_lane_is_alone(found: Scene) -> None:
    samples = found.surface.model_copy(update={"samples": 8})
    alike_by_lanes(found.model_copy(update={"renderer": samples}), choose())
