"""Reliefs of materials, by quantities and pictures, against normals of displaced surfaces in closed form and in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import clfractal
from clfractal.device.select import choose
from clfractal.device.structs import Precision
from clfractal.formulas.catalog import load_chain
from clfractal.integrators.points import distances
from clfractal.scene.load import dump_scene
from clfractal.scene.model import Scene
from tests.devices import check_usable
from tests.environment_maps import write_map
from tests.render.bits import alike_by_lanes
from tests.render.levels import orbit
from tests.render.normals_oracle import unit
from tests.render.path_scenes import path, seen
from tests.render.reliefs import BULB, EYE, Floats, displaced, facts, relief
from tests.render.shots import degrees
from tests.variants import one_of

pytestmark = pytest.mark.light


TRAP: dict[str, Any] = {"by": "trap", "trap": {"shape": "plane"}, "curve": [[0, 0], [1, 0.3]]}


Z = np.array([0.0, 0.0, 1.0])
SKEW = np.array([1.0, 0.0, 2.0]) / np.sqrt(5.0)
PLACE = np.array([0.6, -1.4, 0.5])
HEIGHTS: dict[str, tuple[dict[str, Any], Callable[[dict[str, Floats]], Floats]]] = {
    "height": (
        {"by": "height", "range": [-1, 1], "curve": [[0, 0], [1, 1]]},
        lambda found: np.tile(0.5 * Z, (len(found["P"]), 1)),
    ),
    "distance": (
        {"by": "distance", "center": PLACE.tolist(), "range": [0, 4], "curve": [[0, 0], [1, -2]]},
        lambda found: -0.5 * unit(found["P"] - PLACE),
    ),
    "normal": (
        {"by": "normal", "direction": [1, 0, 2], "curve": [[0, 0], [1, 0.8]]},
        # The normal of a ball of radius 1 changes as the place does.
        lambda found: np.tile(0.4 * SKEW, (len(found["P"]), 1)),
    ),
}


@pytest.mark.parametrize("by", one_of(*HEIGHTS))
@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_normals_are_those_of_the_displaced_ball(by: str, precision: Precision) -> None:
    check_usable(precision)
    height, gradient = HEIGHTS[by]
    found = facts(relief(height), precision=precision)
    assert degrees(found["N"], found["normal"]).max() > 20
    apart = degrees(displaced(found, gradient(found)), found["normal"])
    # Over a footprint, 1/20 of the radius, a height that bends changes its slope.
    assert np.median(apart) < 0.2
    assert apart.max() < 1.0


def around(n: Floats) -> tuple[Floats, Floats, Floats]:
    """Ways to the places around spots: corners of a triangle, in the frame of Duff and others 2017."""
    x, y, z = n.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    side = np.stack([1 + sign * x * x * a, sign * x * y * a, -sign * x], axis=-1)
    up = np.stack([x * y * a, sign + y * y * a, -y], axis=-1)
    return side, -0.5 * side + np.sqrt(0.75) * up, -0.5 * side - np.sqrt(0.75) * up


def differences(found: dict[str, Floats], width: float, height: Callable[[Floats], Floats]) -> Floats:
    """The gradient of the plane through a height at three places that are `width` apart."""
    reach = width / np.sqrt(3)
    ways = around(found["N"])
    return np.asarray(sum(height(found["P"] + reach * way)[:, None] * way for way in ways) / (1.5 * reach))


def least_height(points: Floats, applications: int = 12) -> Floats:
    """The trap of `TRAP` on the ball of z^2 + 0: the least |z| of all applications."""
    chain = load_chain({"name": "quaternion_julia", "julia": [0, 0, 0, 0]})
    least, alive = np.full(len(points), np.inf), np.linalg.norm(points, axis=-1) <= 4
    for z in orbit(chain, points, applications):
        least = np.where(alive, np.minimum(least, np.abs(z[2])), least)
        alive &= np.linalg.norm(z, axis=0) <= 4
    return np.where(np.isfinite(least), least, np.abs(points[:, 2]))


@pytest.mark.combination
def test_traps_are_compared_over_the_width() -> None:
    """The same differences of the same orbits in NumPy."""
    ball = {"name": "quaternion_julia", "iterations": 3, "julia": [0, 0, 0, 0]}
    found = facts(relief(TRAP, width=0.1, formula=ball), precision="float64")
    expected = displaced(found, differences(found, 0.1, lambda p: 0.3 * np.clip(least_height(p, 3), 0, 1)))
    apart = degrees(expected, found["normal"])
    assert degrees(found["N"], found["normal"]).max() > 15
    assert np.median(apart) < 0.2
    assert (apart < 2).mean() > 0.9


@pytest.mark.combination
def test_iterations_of_a_fractal() -> None:
    """The smooth count at the places around, by the list of points; exactly so where light is computed at the hit."""
    height = {"by": "iterations", "range": [1, 5], "curve": [[0, 0], [1, 0.1]]}
    scene = relief(height, width=0.1, **{**BULB, "formula": {"name": "mandelbulb", "iterations": 3}})
    found = facts(scene, precision="float64")

    def count(points: Floats) -> Floats:
        known = distances(scene.chain, points, 3, device=choose(), lanes=1, precision="float64")
        return np.asarray(np.clip((known.smooth - 1) / 4, 0, 1) * 0.1)

    expected = displaced(found, differences(found, 0.1, count), np.array(BULB["camera"]["position"]))
    apart = degrees(expected, found["normal"])
    assert np.median(degrees(found["N"], found["normal"])) > 2
    assert (apart < 1e-3).mean() > 0.3
    assert (apart < 1).mean() > 0.95


OBJECTS: dict[str, dict[str, Any]] = {
    "floor": {"type": "plane", "position": [0, 0, -1.1], "material": "m"},
    "ball": {
        "type": "sphere",
        "position": [1.2, -0.8, 0.4],
        "radius": 0.4,
        "scale": [1, 1, 0.6],
        "material": "m",
    },
    "box": {
        "type": "box",
        "position": [-1.2, -0.8, 0.4],
        "size": [0.6, 0.6, 0.6],
        "rotation": [10, 20, 30],
        "material": "m",
    },
    "post": {
        "type": "cylinder",
        "position": [1.2, -0.8, -0.7],
        "radius": 0.2,
        "height": 0.6,
        "material": "m",
    },
    "drop": {
        "type": "sphere",
        "join": "smooth_union",
        "position": [-0.9, 0, -0.6],
        "radius": 0.4,
        "material": "m",
    },
    "twin": {
        "type": "formula",
        "formula": {"name": "mandelbulb", "iterations": 3},
        "position": [-1.3, 0, -0.4],
        "scale": 0.4,
    },
}


@pytest.mark.parametrize("by", one_of("height", "normal"))
def test_objects_have_reliefs(by: str) -> None:
    """Planes, balls, boxes, cylinders, joined ones and formulas, by their own normals."""
    height = {"by": by, "direction": [0, 1, 2], "range": [-2, 2], "curve": [[0, -1], [1, 1]]}
    scene = relief(height, objects=OBJECTS, image={"width": 96, "height": 96})
    found = facts(scene)
    flat = np.abs(found["P"][:, 2] + 1.1) < 1e-4
    if by == "normal":
        # Flat faces have none by their normal; a round one has, as test_normals_are_those_of_the_displaced_ball says.
        assert flat.sum() > 300
        assert degrees(found["N"], found["normal"])[flat].max() < 0.1
        assert np.median(degrees(found["N"], found["normal"])[~flat]) > 5
        return
    gradient = np.tile(0.5 * np.array([0.0, 1.0, 2.0]) / np.sqrt(5.0), (len(flat), 1))
    apart = degrees(displaced(found, gradient), found["normal"])[np.abs(found["P"] @ gradient[0]) < 0.9]
    assert len(apart) > 3000
    assert degrees(found["N"], found["normal"]).max() > 20
    assert np.quantile(apart, 0.99) < 0.5


@pytest.mark.combination
def test_water_has_waves_and_a_relief() -> None:
    sea = {"type": "water", "position": [0, 0, -0.9], "material": "m", "waves": {"height": 0.2, "length": 2}}
    found = facts(
        relief(
            {"by": "height", "direction": [1, 0, 0], "curve": [[0, 0], [1, 0.4]], "range": [-2, 2]},
            objects={"sea": sea},
        )
    )
    of_sea = np.linalg.norm(found["P"], axis=-1) > 1.05
    assert of_sea.sum() > 200
    waves = degrees(found["N"], np.tile(Z, (len(of_sea), 1)))[of_sea]
    assert waves.max() > 5
    inside = np.abs(found["P"][:, 0]) < 1.8
    gradient = np.tile([0.1, 0.0, 0.0], (len(of_sea), 1))
    apart = degrees(displaced(found, gradient), found["normal"])[of_sea & inside]
    assert np.quantile(apart, 0.98) < 0.2


# -- blends


@pytest.mark.combination
def test_masks_make_edges() -> None:
    """A material that lies 0.3 over another: the mask's slope is the edge's."""
    materials = {
        "low": {},
        "high": {"bump": {"height": 0.3}},
        "m": {"blend": ["low", "high"], "mask": {"by": "height", "range": [-0.3, 0.3]}},
    }
    found = facts(relief(0, materials=materials))
    z = found["P"][:, 2]
    gradient = np.where((np.abs(z) < 0.25)[:, None], 0.5 * Z, 0.0)
    sure = np.abs(np.abs(z) - 0.3) > 0.06
    apart = degrees(displaced(found, gradient), found["normal"])
    edge = np.abs(z) < 0.25
    assert edge.sum() > 100
    assert apart[sure].max() < 0.5
    assert degrees(found["N"], found["normal"])[edge].min() > 10


def test_parts_of_a_blend_share_their_reliefs() -> None:
    """Half of one relief is a relief of half the height."""
    height = {"by": "height", "range": [-1, 1], "curve": [[0, 0], [1, 1]]}
    half = {**height, "curve": [[0, 0], [1, 0.5]]}
    materials = {"a": {"bump": {"height": height}}, "b": {}, "m": {"blend": ["a", "b"], "mask": 0.5}}
    one = facts(relief(0, materials=materials))["normal"]
    two = facts(relief(half))["normal"]
    assert np.abs(one - two).max() < 1e-4


# -- light


def test_what_is_lit_is_brighter() -> None:
    """A light from above: slopes up to it are lighter than the ball, slopes down darker; none is lit below the horizon."""
    light: dict[str, Any] = {
        "lights": [{"direction": [0, 0.5, -1]}],
        "background": {"top": [0, 0, 0], "bottom": [0, 0, 0]},
    }
    material = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
    wave = {"by": "height", "range": [0, 0.8], "repeat": True, "curve": [[0, 0], [0.5, 0.2], [1, 0]]}
    scene = relief(0, materials={"m": {**material, "bump": {"height": wave}}}, **light)
    bumped, normals, _ = seen(scene, 4)
    plain = seen(relief(0, materials={"m": material}, **light), 4)[0]
    toward = np.array([0, -0.5, 1]) / np.hypot(1, 0.5)
    cosine = normals @ toward
    assert np.abs(bumped[cosine < -0.1]).max() == 0
    assert (bumped - plain).max() > 0.1
    assert (bumped - plain).min() < -0.1


def test_a_flat_relief_changes_nothing() -> None:
    """Bit for bit: its text is the same."""
    plain = seen(relief(0), 4)[0]
    assert np.array_equal(plain, seen(relief(0.5), 4)[0])
    assert np.array_equal(plain, seen(relief({"by": "normal", "curve": [[0, 2], [1, 2]]}), 4)[0] * 1.0)


@pytest.mark.combination
def test_every_lane_is_alone() -> None:
    found = relief({"by": "normal", "curve": [[0, 0], [1, 0.2]]}, width=0.05, lighting=path(1), **BULB)
    alike_by_lanes(found, choose(), ("R", "normal.X"), share=0.95, apart=1e-3)


def test_normals_face_the_viewer() -> None:
    steep = {"by": "height", "range": [0, 0.4], "repeat": True, "curve": [[0, 0], [0.5, 2], [1, 0]]}
    found = facts(relief(steep))
    assert degrees(found["N"], found["normal"]).max() > 60
    faces = (found["N"] * unit(EYE - found["P"])).sum(axis=-1) > 0
    assert ((found["normal"] * unit(EYE - found["P"])).sum(axis=-1) > 0)[faces].all()
    assert np.allclose(np.linalg.norm(found["normal"], axis=-1), 1, atol=1e-5)


@pytest.mark.combination
@pytest.mark.parametrize("by", ["trap", "curvature"])
def test_traps_on_objects_beside_the_set(by: str) -> None:
    """A plane through the set's space shows the trap of each of its places; what only the set has is 0 there."""
    board = {"type": "plane", "position": [0, 1.5, 0], "normal": [0, -1, 0], "material": "m"}
    shown = {"by": by, "trap": {"shape": "plane"}, "palette": [[0, 0, 0], [1, 1, 1]]}
    dark = {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 1, "color": shown}}
    framebuffer = clfractal.render(
        relief(0, materials={"m": dark}, objects={"board": board}), channels=("R", "P.X", "P.Y", "P.Z")
    )
    place = np.stack([np.asarray(framebuffer[f"P.{axis}"], np.float64) for axis in "XYZ"], axis=-1)
    beside = np.abs(place[..., 1] - 1.5) < 1e-3
    assert beside.sum() > 300
    low = np.clip(least_height(place[beside]), 0, 1)
    assert np.ptp(low) > 0.5
    assert np.abs(np.asarray(framebuffer["R"])[beside] - (low if by == "trap" else 0)).max() < 0.01


# -- what is told


def waves(folder: Path, count: int = 256) -> None:
    """A picture of one wave to the right, whose numbers are as they are."""
    row = 0.5 + 0.5 * np.sin(2 * np.pi * (np.arange(count) + 0.5) / count)
    write_map(folder / "waves.exr", np.tile(row, (count, 1)))


def floor(folder: Path, scale: float, **sections: Any) -> Scene:
    """A plane from above, with a relief by that picture."""
    height = {"texture": "waves.exr", "scale": scale, "curve": [[0, 0], [1, 0.1]]}
    scene = relief(
        height,
        camera={"position": [0.1, 0.2, 4], "target": [0.1, 0.2, 0], "up": [0, 1, 0], "fov": 30},
        objects={"floor": {"type": "plane", "position": [0, 0, 1.2], "material": "m"}},
        image={"width": 64, "height": 64},
        **sections,
    )
    return clfractal.load_scene(dump_scene(scene.placed(folder)), folder=folder)


def test_a_picture_is_a_relief(tmp_path: Path) -> None:
    """A plane with a wave: its normals in closed form; a footprint is 1/43 of the wave."""
    waves(tmp_path)
    found = facts(floor(tmp_path, 1.0))
    x = found["P"][:, 0]
    gradient = np.stack([0.1 * np.pi * np.cos(2 * np.pi * x), 0 * x, 0 * x], axis=-1)
    expected = displaced(found, gradient, np.array([0.1, 0.2, 4]))
    assert degrees(found["N"], found["normal"]).max() > 16
    assert degrees(expected, found["normal"]).max() < 1.0


def test_near_pictures_have_no_edges(tmp_path: Path) -> None:
    """Their slopes are measured over a pixel of theirs at least: else each pixel would be a step."""
    waves(tmp_path, 8)
    found = facts(floor(tmp_path, 1.0))
    x = found["P"][:, 0]
    steps = np.abs(np.diff(found["normal"][np.argsort(x), 0]))
    assert np.ptp(found["normal"][:, 0]) > 0.4
    assert steps.max() < 0.06


def test_far_pictures_are_flat(tmp_path: Path) -> None:
    """What a pixel cannot show is not seen: nothing shimmers."""
    waves(tmp_path)
    found = facts(floor(tmp_path, 0.01))
    assert degrees(found["N"], found["normal"]).max() < 0.2


def test_codes_of_a_picture_are_heights(tmp_path: Path) -> None:
    """A grey ramp of codes rises evenly."""
    codes = np.tile(np.arange(256, dtype=np.uint8), (64, 1))
    Image.fromarray(codes).save(tmp_path / "ramp.png")
    height = {"texture": "ramp.png", "scale": 4, "curve": [[0, 0], [1, 0.8]]}
    scene = relief(height, objects={"floor": {"type": "plane", "position": [0, 0, -0.8], "material": "m"}})
    scene = clfractal.load_scene(dump_scene(scene.placed(tmp_path)), folder=tmp_path)
    found = facts(scene)
    on_floor = (np.abs(found["P"][:, 2] + 0.8) < 1e-4) & (np.abs((found["P"][:, 0] + 2) % 4 - 2) > 0.3)
    on_floor &= found["P"][:, 1] > -2
    assert on_floor.sum() > 50
    expected = displaced(found, np.tile([0.2, 0.0, 0.0], (len(on_floor), 1)))
    assert np.quantile(degrees(expected, found["normal"])[on_floor], 0.9) < 0.3
