"""Light below boundaries (`subsurface`): nothing is lost, thick bodies have their colour, dense ones are Lambert's.

Balls are those of a random walk in NumPy.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.integrators.plan import make_plan
from clfractal.integrators.surface import program_texts
from clfractal.scene.model import Scene
from tests.render.glass_scenes import BODIES, colors_of, scene
from tests.render.path_scenes import BLACK, GREY, path, scene_of, seen

pytestmark = pytest.mark.light


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
    from tests.render.half_space import depth_function

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


def test_scenes_without_it_do_not_know_it() -> None:
    texts = []
    for values in ({}, {"color": [0.5, 0.6, 0.7], "radius": 2}):
        found = scene_of(lighting=path(2), materials={"m": {"subsurface": values}}, material={"name": "m"})
        plan = make_plan(found, precision="float32", lanes=4, channels=("R", "G", "B"))
        texts.append([text.flat.text for text in program_texts(found, plan)])
    assert texts[0] == texts[1]
    assert len(texts[0]) == 5
