"""Formulas of glass beside an opaque set, opaque ones in a set of glass, and glass in glass: against the same bodies as
objects, which no march finds, and against what is known of balls.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device, choose
from clfractal.device.structs import Precision
from clfractal.scene.model import Scene
from tests.makers import maker
from tests.render.bits import alike_by_lanes
from tests.render.glass_scenes import colors_of, glass
from tests.render.path_scenes import BALL, GREY, path, scene_of
from tests.render.shots import normals_of, points_of, rays, shoot
from tests.variants import one_of

pytestmark = pytest.mark.light

SKY = {"top": [1, 0.6, 0.3], "bottom": [0.1, 0.3, 1]}
MATERIALS: dict[str, Any] = {
    "clear": glass(0, 1.5),
    "water": glass(0, 1.33, color=[0.3, 0.6, 0.9], depth=1.0),
    "amber": glass(0, 1.6, color=[0.9, 0.5, 0.2], depth=1.0),
    "dye": glass(0, 1.0, color=[0.9, 0.5, 0.2], depth=1.0),
    "milk": glass(0, 1.3, color=[0.9, 0.9, 0.9], depth=0.5, scatter=[0.8, 0.8, 0.8]),
    "skin": {"specular": {"weight": 0}, "subsurface": {"weight": 1, "color": [0.8, 0.5, 0.3], "radius": 0.1}},
    "clay": {"base": {"color": [0.7, 0.4, 0.2]}, "specular": {"weight": 0}},
    "white": {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}},
    "black": {"base": {"weight": 0}, "specular": {"weight": 0}},
}
# A ball of the set's own formula, or of an equation: middle, radius, material.
Ball = tuple[list[float], float, str]


def of_formula(ball: Ball) -> dict[str, Any]:
    middle, radius, material = ball
    return {"type": "formula", "formula": BALL, "scale": radius, "position": middle, "material": material}


def of_equation(ball: Ball) -> dict[str, Any]:
    middle, radius, material = ball
    return {"type": "sphere", "radius": radius, "position": middle, "material": material}


def scene(own: str, *balls: Ball, bounces: int = 32, **sections: Any) -> Scene:
    """A ball of radius 1 of a material, and what is joined to it."""
    return scene_of(
        objects={f"part{number}": of_formula(ball) for number, ball in enumerate(balls)},
        materials=MATERIALS,
        material={"name": own},
        lighting=path(bounces),
        image={"width": 48, "height": 48},
        **{"background": SKY, **sections},
    )


def of_objects(own: str, *balls: Ball, **sections: Any) -> Scene:
    """The same without a set."""
    named = [([0.0, 0.0, 0.0], 1.0, own), *balls]
    return scene_of(
        formula={"name": "none"},
        objects={f"part{number}": of_equation(ball) for number, ball in enumerate(named)},
        materials=MATERIALS,
        lighting=path(32),
        image={"width": 48, "height": 48},
        **{"background": SKY, **sections},
    )


BESIDE, WITHIN = [0.9, -0.5, 0.2], [0.7, -0.5, 0.2]
CASES: dict[str, tuple[str, list[Ball]]] = {
    "glass on a set of clay": ("clay", [(BESIDE, 0.8, "clear")]),
    "clay in a set of glass": ("clear", [(WITHIN, 0.6, "clay")]),
    "amber in water": ("water", [(WITHIN, 0.7, "amber")]),
    "water in amber": ("amber", [(WITHIN, 0.7, "water")]),
    "of one index with the air": ("water", [(WITHIN, 0.7, "dye")]),
    "one glass": ("water", [(WITHIN, 0.7, "water")]),
    "three glasses and clay": (
        "water",
        [(WITHIN, 0.7, "amber"), ([0.2, -0.6, 0.6], 0.6, "dye"), ([-0.3, -0.6, 0.2], 0.6, "clay")],
    ),
    "milk on a set of clay": ("clay", [(BESIDE, 0.8, "milk")]),
    "clay in milk": ("milk", [(WITHIN, 0.6, "clay")]),
}


@pytest.mark.parametrize(
    ("case", "precision"),
    one_of(
        ("glass on a set of clay", "float32"),
        *((name, "float32") for name in list(CASES)[1:]),
        ("amber in water", "float64"),
        ("clay in a set of glass", "float64"),
    ),
)
def test_parts_are_as_objects(case: str, precision: str) -> None:
    """Pixels agree within their noise with those of balls that are met by equations."""
    own, balls = CASES[case]
    samples = 256 if "milk" in case else 64
    found, expected = (
        colors_of(each, samples, precision=precision)
        for each in (scene(own, *balls), of_objects(own, *balls))
    )
    blocks = [each.reshape(8, 6, 8, 6, 3).mean(axis=(1, 3)) for each in (found, expected)]
    assert np.abs(blocks[0] - blocks[1]).max() < 0.02
    assert np.abs(found - expected).mean() < (0.006 if "milk" in case else 0.003)
    assert abs(float((found - expected).mean())) < 0.001


@pytest.mark.parametrize("own", one_of("white", "clear"))
def test_a_white_furnace_stays_white(own: str) -> None:
    """A white body and a clear one that overlap, under a white sky, are the sky."""
    other = "clear" if own == "white" else "white"
    found = colors_of(scene(own, (BESIDE, 0.8, other), background=GREY, bounces=96), 1024)
    assert abs(found.mean() - 1) < 0.002
    blocks = found.reshape(8, 6, 8, 6, 3).mean(axis=(1, 3, 4))
    assert np.abs(blocks - 1).max() < 0.01


FROM_AFAR = {"position": [0, -5, 0], "projection": "orthographic", "height": 2.2}


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_what_is_in_a_ball_is_seen_as_snell_says(precision: str) -> None:
    """A ray at a distance b from the middle is at b over the index within: so a black ball in one of glass is seen larger
    by the index. Before it there is only what Fresnel's equations reflect of the sky, and beside it all of the sky.
    """
    radius, index = 0.5, 1.5
    known = scene("clear", ([0, 0, 0], radius, "black"), background=GREY, camera=FROM_AFAR, bounces=64)
    found = colors_of(known, 64, precision=precision).mean(axis=-1)
    origin, _, footprint = rays(known)
    away = np.hypot(origin[..., 0], origin[..., 2])
    inner, outer = radius * index - footprint, radius * index + footprint
    mirrored = maker("tables_glass").fresnel_across(np.sqrt(1 - np.minimum(away, 0.999) ** 2), index)
    before = away < inner
    np.testing.assert_allclose(found[before], mirrored[before], atol=0.02)
    assert abs(float((found - mirrored)[before].mean())) < 0.002
    beside = (outer < away) & (away < 1 - 2 * footprint)
    np.testing.assert_allclose(found[beside], 1, atol=0.04)
    assert abs(float(found[beside].mean()) - 1) < 0.005


INSIDE = {"position": [0.1, -0.8, 0.1], "target": [0.3, 0.2, 0.2], "fov": 50}


@pytest.mark.parametrize(
    ("precision", "lanes"), one_of(("float32", None), ("float32", 4), ("float32", 1), ("float64", 4))
)
def test_walls_are_where_they_are_from_within_glass(
    device: Device, precision: Precision, lanes: int | None
) -> None:
    """An eye in a ball of glass sees places and normals of an opaque ball, and around that of the glass's own surface."""
    middle, radius = np.array([0.3, 0.2, 0.2]), 0.4
    known = scene("water", (middle.tolist(), radius, "clay"), camera=INSIDE, bounces=1)
    framebuffer = shoot(known, device, precision, **({"lanes": lanes} if lanes else {}))
    origin, direction, footprint = rays(known)
    arm = origin - middle
    along, across = (arm * direction).sum(-1), (arm * arm).sum(-1) - radius**2
    wall = along**2 > across
    ahead = (origin * direction).sum(-1)
    end = -ahead + np.sqrt(ahead**2 + 1 - (origin * origin).sum(-1))
    t = np.where(wall, -along - np.sqrt(np.maximum(along**2 - across, 0)), end)
    points = origin + t[..., None] * direction
    normals = np.where(wall[..., None], (points - middle) / radius, -points)
    seen = np.abs((normals * direction).sum(-1)) > 0.3
    assert (wall & seen).mean() > 0.1
    assert (~wall & seen).mean() > 0.1
    off = np.linalg.norm(points_of(framebuffer) - points, axis=-1) / (footprint * t)
    angle = np.degrees(np.arccos(np.clip((normals_of(framebuffer) * normals).sum(-1), -1, 1)))
    for of in (wall & seen, ~wall & seen):
        assert np.percentile(off[of], 95) < 1
        assert np.percentile(angle[of], 95) < 1


@pytest.mark.parametrize("eye_in", one_of("the set", "a part"))
def test_paths_begin_in_the_glass_that_the_eye_is_in(eye_in: str) -> None:
    """As from within an object: no boundary is at the eye."""
    if eye_in == "the set":
        own, balls, camera = "water", [([0.3, 0.2, 0.2], 0.4, "clay")], INSIDE
    else:
        own, balls = "clay", [([0.1, -1.3, 0.1], 0.6, "amber")]
        camera = {"position": [0.1, -1.5, 0.1], "target": [0.5, 0, 0.1], "fov": 60}
    found, expected = (
        colors_of(each, 64)
        for each in (scene(own, *balls, camera=camera), of_objects(own, *balls, camera=camera))
    )
    assert np.abs(found - expected).mean() < 0.003
    assert expected.mean() > 0.05


@pytest.mark.parametrize("way", one_of("join", "plane"))
def test_a_cut_shows_what_is_at_each_place(way: str) -> None:
    """A plane through a ball of glass with a black heart: the face is black as far as the heart is, and mirrors beside."""
    radius = 0.5
    sections: dict[str, Any] = {"camera": FROM_AFAR, "background": GREY}
    known = scene("clear", ([0, 0, 0], radius, "black"), **sections)
    if way == "join":
        half = {"type": "plane", "normal": [0, 1, 0], "join": "cut"}
        known = known.model_copy(update={"objects": {**known.objects, "half": half}})
    else:
        opened = {"plane": {"center": [0, 0, 0], "normal": [0, -1, 0]}, "cut": True, "opacity": 0}
        known = known.model_copy(update={"cut_planes": [opened]})
    found = colors_of(known, 32).mean(axis=-1)
    origin, _, footprint = rays(known)
    away = np.hypot(origin[..., 0], origin[..., 2])
    assert found[away < radius - 2 * footprint].max() < 0.01
    beside = (radius + 2 * footprint < away) & (away < 1 - 2 * footprint)
    assert found[beside].min() > 0.03
    assert found[beside].mean() > 0.3


@pytest.mark.combination
@pytest.mark.parametrize("case", ["clay in a set of glass", "three glasses and clay", "clay in milk"])
def test_every_lane_is_alone(case: str) -> None:
    own, balls = CASES[case]
    known = scene(own, *balls)
    alike_by_lanes(
        known.model_copy(update={"renderer": known.surface.model_copy(update={"samples": 8})}), choose()
    )


@pytest.mark.combination
def test_light_below_boundaries_ends_at_what_is_opaque() -> None:
    """A white body below which light goes, with a white opaque heart, in a set of glass: all is white under a white sky."""
    white = {**MATERIALS["skin"], "subsurface": {"weight": 1, "color": [1, 1, 1], "radius": 0.2}}
    known = scene("clear", (BESIDE, 0.8, "skin"), (WITHIN, 0.4, "white"), background=GREY, bounces=96)
    known = known.model_copy(update={"materials": {**known.materials, "skin": white}})
    found = colors_of(known, 64)
    assert abs(found.mean() - 1) < 0.01
