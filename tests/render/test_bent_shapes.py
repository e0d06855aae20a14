"""Light that clear solids bend: beside rays that are traced in NumPy, closed forms, and what paths find by chance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.scene.model import Scene
from clfractal.schema.shape import Solid
from tests.render.bent_rays import SHAPES, Floats, bent, marched, normals, transmittance, under
from tests.render.bent_scenes import ALBEDO, GLASS, assert_as_by_chance, light_of
from tests.variants import one_of

STRAIGHT = (1 - ((GLASS - 1) / (GLASS + 1)) ** 2) ** 2
"""What goes straight on through two boundaries."""


@pytest.mark.parametrize("distance", one_of(1.5, 1.0, 2.5))
def test_an_ellipsoid_that_is_a_ball_bends_light_as_the_ball(distance: float) -> None:
    """On the axis, by the focal length."""
    sun = {"type": "directional", "direction": [0, 0, -1], "intensity": 3}
    view: dict[str, Any] = {
        "eye": [0, -1, 0.6 - distance],
        "target": [0, 0, -distance],
        "fov": 0.2,
        "bounces": 0,
    }
    scene = under({"type": "sphere", "radius": 0.5, "scale": [1, 1, 1.0001]}, [sun], **view)
    focal = 0.5 * GLASS / (2 * (GLASS - 1))
    expected = ALBEDO * 3 * STRAIGHT / (1 - distance / focal) ** 2
    np.testing.assert_allclose(light_of(scene, 4).mean(), expected, rtol=0.005)


# Half of how thick the body is on the axis, and the radii of curvature along x and y at both ends of it.
LENSES: dict[str, tuple[dict[str, Any], float, tuple[float, float], float]] = {
    "ellipsoid": (
        {"type": "sphere", "radius": 0.5, "scale": [0.8, 0.6, 0.5]},
        0.25,
        (0.4**2 / 0.25, 0.3**2 / 0.25),
        0.0,
    ),
    "cylinder": (
        {"type": "cylinder", "radius": 0.25, "height": 4, "rotation": [90, 0, 0]},
        0.25,
        (0.25, np.inf),
        0.0,
    ),
    "torus": ({"type": "torus", "radius": 0.9, "tube": 0.2}, 0.2, (0.2, np.inf), 0.9),
    "box": ({"type": "box", "size": [4, 4, 0.5]}, 0.25, (np.inf, np.inf), 0.0),
}


def across_a_ring(radius: float, tube: float, distance: float) -> float:
    """The irradiance of a floor under a ring, below its tube, of a sun straight above, that the opposite side brings.

    In the plane through the ring's axis: a ray that meets the tube under an angle leaves it under the same one.
    """
    angle = np.linspace(0, np.pi / 2, 200_001)[1:-1]
    inner = np.arcsin(np.sin(angle) / GLASS)
    turned, leaves = 2 * (angle - inner), angle + np.pi - 2 * inner
    begins = radius + tube * np.sin(angle)
    ends = radius + tube * np.sin(leaves) - np.tan(turned) * (distance + tube * np.cos(leaves))
    falls = turned < np.pi / 2
    (first,) = np.flatnonzero(falls[:-1] & (np.diff(np.sign(ends + radius)) != 0))[:1]
    narrows = (
        (begins[first + 1] - begins[first]) / abs(ends[first + 1] - ends[first]) * begins[first] / radius
    )
    return float(transmittance(np.cos(angle[first]), GLASS) ** 2 * narrows)


@pytest.mark.parametrize("shape", one_of("ellipsoid", "cylinder", "torus", "box"))
def test_a_place_on_the_axis_of_a_lens_has_a_suns_light_by_its_curvatures(shape: str) -> None:
    """Far behind all foci: by the matrices of rays near the axis, in both planes; of a ring across it, too."""
    body, half, curvatures, x = LENSES[shape]
    distance, turns = 3.0, 1.0
    for radius in curvatures:
        power = (GLASS - 1) / radius
        # A ray that leaves the floor with an angle of 1 over the height at which it enters, and that at which it leaves.
        low = distance - half
        inner = (1 - power * low) / GLASS
        high = low + 2 * half * inner
        turns *= GLASS * inner - power * high
    sun = {"type": "directional", "direction": [0, 0, -1], "intensity": 3}
    view: dict[str, Any] = {
        "eye": [x, -1, 0.6 - distance],
        "target": [x, 0, -distance],
        "fov": 0.2,
        "bounces": 0,
    }
    across = across_a_ring(0.9, 0.2, distance) if shape == "torus" else 0.0
    expected = ALBEDO * 3 * (STRAIGHT / abs(turns) + across)
    samples = 256 if shape == "torus" else 4
    # (The mean, since a chain that few beginnings find is made up for by those that find it.)
    np.testing.assert_allclose(light_of(under(body, [sun], **view), samples).mean(), expected, rtol=0.005)


def floor_under(solid: Solid, toward: Floats, half: float, cells: int, rays: int) -> Floats:
    """The irradiance of cells of the floor at z = -0.8, shape (y, x), of a sun that would bring 1 to each straight on.

    Of one ray in each square of a grid over the solid, and beside it; those that are reflected, or meet it again, bring
    nothing.
    """
    wide, random = 1.3, np.random.default_rng(1)
    x, y = (
        ((each + random.random(each.shape)) / rays * 2 * wide - wide).ravel()
        for each in np.meshgrid(np.arange(rays), np.arange(rays))
    )
    at = np.column_stack([x, y, np.zeros_like(x)]) - 3 * toward
    way = np.tile(toward, (len(at), 1))
    part = np.ones(len(at))
    reached, met = marched(solid, at, way, 1.0)
    inside = np.flatnonzero(met)
    turned, through = bent(way[inside], normals(solid, reached[inside]), GLASS)
    out, _ = marched(solid, reached[inside] + 1e-6 * turned, turned, -1.0)
    onward, beyond = bent(turned, -normals(solid, out), 1 / GLASS)
    _, again = marched(solid, out + 1e-6 * onward, onward, 1.0)
    at[inside], way[inside], part[inside] = out, onward, np.where(again, 0.0, through * beyond)
    falls = way[:, 2] < -1e-3
    at, way, part = at[falls], way[falls], part[falls]
    place = at + ((-0.8 - at[:, 2]) / way[:, 2])[:, None] * way
    edges = np.linspace(-half, half, cells + 1)
    found, *_ = np.histogram2d(place[:, 1], place[:, 0], bins=(edges, edges), weights=part)
    return np.asarray(found * (2 * wide / rays) ** 2 / (2 * half / cells) ** 2)


@pytest.mark.parametrize("shape", one_of("cone", "box", "ellipsoid", "cylinder", "torus"))
def test_a_floor_under_a_solid_has_the_suns_light_of_rays_through_it(shape: str) -> None:
    """All ways over two boundaries, with none that is left out or found twice: beside rays from the sun."""
    toward = np.array([0.2, 0.1, -1.0]) / np.sqrt(1.05)
    sun = {"type": "directional", "direction": toward.tolist(), "intensity": 3}
    cells, half, eye = 6, 0.45, -0.62
    view: dict[str, Any] = {
        "eye": [0, 0, eye],
        "target": [0, 0, -0.8],
        "fov": float(np.degrees(2 * np.arctan(half / 0.18))),
    }
    scene = under(SHAPES[shape], [sun], 48, bounces=0, **view)
    solid = scene.objects["ball"]
    assert isinstance(solid, Solid)
    expected = ALBEDO * 3 * -toward[2] * floor_under(solid, toward, half, cells, 400)
    found = np.mean([light_of(scene, 16, seed) for seed in range(4)], axis=0)
    found = found[::-1].reshape(cells, 8, cells, 8).mean(axis=(1, 3))
    assert abs(found.mean() - expected.mean()) < 0.005 * expected.mean()
    np.testing.assert_allclose(found, expected, rtol=0.05, atol=0.03 * float(expected.mean()))


CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "torus": ("torus", {"position": [0.5, 0.4, 1.8]}),
    "box": ("box", {"position": [0.5, 0.4, 1.8]}),
    "ellipsoid": ("ellipsoid", {"position": [0.5, 0.4, 1.8]}),
    "cone": ("cone", {"position": [0.2, 0.1, 1.6]}),
    "lamp in a ring": ("torus", {"position": [0.05, 0, 0.1], "radius": 0.12}),
}


@pytest.mark.light
@pytest.mark.parametrize("case", one_of("torus", *(name for name in CASES if name != "torus")))
def test_no_light_is_lost_or_counted_twice(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A lamp that paths find by chance, too: the same light on the whole, and less noise."""
    shape, lamp = CASES[case]
    view: dict[str, Any] = {"eye": [0, -1.5, 0.2], "target": [-0.15, -0.1, -0.8]}
    scene = under(SHAPES[shape], [{"type": "sphere", "radius": 0.5, "intensity": 8, **lamp}], 16, **view)
    # (Few beginnings find some chains of the cone, which are made up for by bright dots in a few pixels.)
    over_pixels = np.median if case == "cone" else np.mean
    own, chance = assert_as_by_chance(scene, 48, monkeypatch, over_pixels=over_pixels)
    # At equal samples.
    assert own / 4 < chance


@pytest.mark.light
@pytest.mark.parametrize("shape", one_of("cylinder", "torus", "box"))
def test_a_white_floor_under_a_solid_in_a_white_furnace_is_white(shape: str) -> None:
    """With a ball that shines as all around does, which chains lead to through the glass."""
    white = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
    scene = under(SHAPES[shape], [], bounces=64).model_dump(mode="json", exclude_unset=True)
    scene["background"] = {"top": [1, 1, 1], "bottom": [1, 1, 1]}
    scene["materials"] |= {
        "white": white,
        "shines": {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 1}},
    }
    scene["objects"]["lamp"] = {
        "type": "sphere",
        "radius": 0.3,
        "position": [0.4, 0.3, 1.2],
        "material": "shines",
    }
    found = np.array([light_of(Scene.model_validate(scene), 64, seed) for seed in range(4)])
    assert abs(found.mean() - 1) < 0.005
