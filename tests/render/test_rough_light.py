"""Light that slightly rough water and solids bend: beside quadrature, rays that are traced in NumPy, and chance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from clfractal.scene.model import Scene
from clfractal.schema.shape import Solid
from clfractal.shading.clear_bodies import ROUGHEST, clear_bodies
from tests.render.bent_rays import SHAPES, Floats, bent, marched, normals, under
from tests.render.bent_scenes import ALBEDO, GLASS, INDEX, assert_as_by_chance, light_of, pool
from tests.variants import one_of

BOX = SHAPES["box"]
TOWARD = np.array([0.5, 0.3, -1.0]) / np.sqrt(1.34)
SUN = {"type": "directional", "direction": TOWARD.tolist(), "intensity": 3}


def roughened(scene: Scene, roughness: float, bounces: int | None = None) -> Scene:
    """The same with clear bodies of a roughness, and with other bounces."""
    values = scene.model_dump(mode="json", exclude_unset=True)
    for name in {"water", "glass"} & set(values["materials"]):
        values["materials"][name]["specular"]["roughness"] = roughness
    if bounces is not None:
        values["lighting"] |= {"bounces": bounces, "roulette": max(bounces, 1)}
    return Scene.model_validate(values)


def shown(cosine: Floats, alpha: float) -> Floats:
    """Smith's part of facets that is seen along a direction, by GGX."""
    square = np.maximum(cosine * cosine, 1e-12)
    return np.asarray(2 / (1 + np.sqrt(1 + alpha * alpha * (1 - square) / square)))


def scattered(
    way: Floats, normal: Floats, index: float, alpha: float, slopes: Floats
) -> tuple[Floats, Floats]:
    """Directions beyond facets with these slopes, drawn by GGX, of a boundary whose normal is against them, and the
    part that goes there.
    """
    aside = np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]]))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    facet = normal + slopes[:, :1] * aside + slopes[:, 1:] * np.cross(normal, aside)
    facet /= np.linalg.norm(facet, axis=1, keepdims=True)
    met, level = -(way * facet).sum(axis=1), -(way * normal).sum(axis=1)
    turned, part = bent(way, facet, index)
    beyond = -(turned * normal).sum(axis=1)
    part = part * shown(level, alpha) * shown(beyond, alpha) * met / (level * (facet * normal).sum(axis=1))
    return turned, np.where((met > 0) & (beyond > 0), part, 0.0)


def ggx_slopes(u: Floats, v: Floats, alpha: float) -> Floats:
    """Slopes of facets by two numbers in (0, 1), shape (n, 2)."""
    steep = alpha * np.sqrt(u / (1 - u))
    return np.column_stack([steep * np.cos(2 * np.pi * v), steep * np.sin(2 * np.pi * v)])


@pytest.mark.parametrize("roughness", one_of(0.2, 0.05, 0.1))
def test_a_floor_under_rough_water_has_the_suns_light(roughness: float) -> None:
    """A sun without a size, which no path meets: by quadrature over all facets, wherever they send the light to."""
    cells = (np.arange(400) + 0.5) / 400
    u, v = (each.ravel() for each in np.meshgrid(cells, cells))
    normal, way = (np.tile(each, (len(u), 1)) for each in (np.array([0.0, 0, 1]), TOWARD))
    alpha = roughness**2
    _, part = scattered(way, normal, INDEX, alpha, ggx_slopes(u, v, alpha))
    expected = ALBEDO * 3 * -TOWARD[2] * part.mean() / INDEX**2
    found = light_of(roughened(pool([SUN]), roughness), 64).mean()
    np.testing.assert_allclose(found, expected, rtol=5e-3)


def floor_under(solid: Solid, half: float, rays: int, alpha: float) -> float:
    """The mean irradiance of a square of the floor at z = -0.8 that a sun lights, which would bring 1 straight on.

    Of rays through the solid's facets, and beside it; those that are reflected, or meet it again, bring nothing.
    """
    wide, random = 1.3, np.random.default_rng(1)
    x, y = (
        ((each + random.random(each.shape)) / rays * 2 * wide - wide).ravel()
        for each in np.meshgrid(np.arange(rays), np.arange(rays))
    )
    at = np.column_stack([x, y, np.zeros_like(x)]) - 3 * TOWARD
    way, part = np.tile(TOWARD, (len(at), 1)), np.ones(len(at))
    reached, met = marched(solid, at, way, 1.0)
    inside = np.flatnonzero(met)

    def drawn() -> Floats:
        return ggx_slopes(random.random(len(inside)), random.random(len(inside)), alpha)

    turned, through = scattered(way[inside], normals(solid, reached[inside]), GLASS, alpha, drawn())
    turned = np.where(through[:, None] > 0, turned, way[inside])
    out, _ = marched(solid, reached[inside] + 1e-6 * turned, turned, -1.0)
    onward, beyond = scattered(turned, -normals(solid, out), 1 / GLASS, alpha, drawn())
    _, again = marched(solid, out + 1e-6 * onward, onward, 1.0)
    at[inside], way[inside] = out, onward
    part[inside] = np.where(again, 0.0, through * beyond)
    falls = way[:, 2] < -1e-3
    at, way, part = at[falls], way[falls], part[falls]
    place = at + ((-0.8 - at[:, 2]) / way[:, 2])[:, None] * way
    lit = np.abs(place[:, :2]).max(axis=1) < half
    return float(part[lit].sum() * (2 * wide / rays) ** 2 / (2 * half) ** 2)


@pytest.mark.parametrize("roughness", one_of(0.2, 0.1))
def test_a_floor_under_a_rough_box_has_the_suns_light_of_rays_through_it(
    roughness: float,
) -> None:
    """All ways over two boundaries, with none that is left out or found twice: beside rays from the sun."""
    half, eye = 0.45, -0.62
    view: dict[str, Any] = {
        "eye": [0, 0, eye],
        "target": [0, 0, -0.8],
        "fov": float(np.degrees(2 * np.arctan(half / 0.18))),
    }
    scene = roughened(under(BOX, [SUN], 24, bounces=0, **view), roughness)
    solid = scene.objects["ball"]
    assert isinstance(solid, Solid)
    expected = ALBEDO * 3 * -TOWARD[2] * floor_under(solid, half, 500, roughness**2)
    found = np.mean([light_of(scene, 32, seed).mean() for seed in range(4)])
    np.testing.assert_allclose(found, expected, rtol=0.01)


@pytest.mark.parametrize("body", one_of("box", "water"))
def test_a_little_roughness_is_smooth(body: str) -> None:
    """A roughness of 0.01 spreads light less than a pixel: the same light on the whole."""
    view: dict[str, Any] = {"eye": [0, 0, -0.62], "target": [0, 0, -0.8], "fov": 135, "bounces": 0}
    scene = pool([SUN]) if body == "water" else under(BOX, [SUN], **view)
    smooth, rough = (
        np.mean([light_of(each, 32, seed).mean() for seed in range(4)])
        for each in (scene, roughened(scene, 0.01))
    )
    np.testing.assert_allclose(rough, smooth, rtol=0.01)


LAMP = {"type": "sphere", "position": [0.6, -0.8, 0.7], "radius": 0.4, "intensity": 5}
OVER = {"type": "sphere", "position": [0.5, 0.4, 1.8], "radius": 0.3, "intensity": 8}
SOLIDS_VIEW: dict[str, Any] = {"eye": [-0.1, 0, -0.6], "target": [-0.1001, 0, -0.8], "fov": 100, "bounces": 2}
CASES: dict[str, tuple[Callable[[], Scene], float]] = {
    "water": (lambda: pool([LAMP], bounces=1), 0.2),
    "box": (lambda: under(BOX, [OVER], **SOLIDS_VIEW), 0.2),
}


@pytest.mark.light
@pytest.mark.parametrize("case", list(CASES))
def test_no_light_is_lost_or_counted_twice(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A lamp that paths find by chance, too, within so many bounces: the same light on the whole, and less noise."""
    make, roughness = CASES[case]
    scene = roughened(make(), roughness)
    own, chance = assert_as_by_chance(scene, 64, monkeypatch)
    # At equal samples.
    assert own / 4 < chance


@pytest.mark.light
@pytest.mark.parametrize("roughness", [0.2])
def test_a_white_floor_under_a_rough_box_in_a_white_furnace_is_white(roughness: float) -> None:
    """With a ball that shines as all around does, which chains lead to through the glass."""
    scene = roughened(under(BOX, [], bounces=64), roughness).model_dump(mode="json", exclude_unset=True)
    scene["background"] = {"top": [1, 1, 1], "bottom": [1, 1, 1]}
    scene["materials"] |= {
        "white": {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}},
        "shines": {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 1}},
    }
    scene["objects"]["lamp"] = {
        "type": "sphere",
        "radius": 0.3,
        "position": [0.4, 0.3, 1.2],
        "material": "shines",
    }
    found = np.array([light_of(Scene.model_validate(scene), 64, seed) for seed in range(4)])
    assert abs(found.mean() - 1) < 0.01


def test_a_suns_light_comes_over_water_once() -> None:
    """A path that has found its way into the water asks no sun once more that its floor has asked through it."""
    twice = [light_of(roughened(pool([SUN]), 0.2, bounces), 256).mean() for bounces in (0, 1)]
    assert twice[0] <= twice[1] * 1.005
    # A bounce more brings what the floor sees of itself in the water, a tenth and not as much again.
    assert twice[1] < 1.3 * twice[0]


@pytest.mark.parametrize(
    ("specular", "crossed"),
    [
        ({"roughness": 0}, 2),
        ({"roughness": ROUGHEST}, 2),
        ({"roughness": ROUGHEST + 0.01}, 0),
        ({"roughness": 0.1, "anisotropy": 0.5}, 0),
    ],
)
def test_bodies_that_are_too_rough_are_left_to_chance(specular: dict[str, float], crossed: int) -> None:
    """As are those with facets that are drawn out."""
    scene = under(BOX, [SUN]).model_dump(mode="json", exclude_unset=True)
    scene["materials"]["glass"]["specular"] |= specular
    assert clear_bodies(Scene.model_validate(scene)) == [crossed, 0]


def test_rough_bodies_that_are_curved_are_left_to_chance() -> None:
    """Facets tear their chains apart."""
    waves_, ball = pool([SUN], height=0.1), under({"type": "sphere", "radius": 0.5}, [SUN])
    assert [clear_bodies(each) for each in (waves_, ball)] == [[1, 0], [2, 0]]
    assert [clear_bodies(roughened(each, 0.1)) for each in (waves_, ball)] == [[0, 0], [0, 0]]
