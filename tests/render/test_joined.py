"""Formulas and simple solids that are joined to one set, against their distances in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.scene.model import Scene
from tests.render.joined_oracle import (
    PLACED,
    SCALE,
    SIMPLE,
    Floats,
    a_sphere,
    agree,
    ball,
    marched,
    placed,
    smooth,
    solids,
)
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import (
    BALL,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    SOLIDS,
    colors,
    normals_of,
    points_of,
    rays,
    shoot,
)
from tests.scenes import scene_of
from tests.variants import one_of

TWIN = 0.5  # the size of an object that is the set
WAYS: dict[str, dict[str, Any]] = {"distance": {}, "steps": {"search": "steps", "step": 0.01}}


@pytest.mark.parametrize("join", ["cut", "intersection"])
@pytest.mark.parametrize("kind", SIMPLE)
@pytest.mark.parametrize("formula", one_of(QUICK_BALL, BALL), ids=["rule", "jacobian"])
def test_what_is_cut_out_or_in_common(device: Device, formula: dict[str, Any], kind: str, join: str) -> None:
    values, other = SIMPLE[kind]
    scene = scene_of(formula, PERSPECTIVE, (112, 96), objects={"tool": {**values, "join": join}})

    def distance(points: Floats) -> Floats:
        more = other(points)
        return np.maximum(ball(points), -more if join == "cut" else more)

    agree(device, scene, distance)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("precision", "lanes"), one_of(("float32", None), ("float32", 4), ("float32", 1), ("float64", 4))
)
def test_each_search_and_number_type(
    device: Device, way: str, precision: Precision, lanes: int | None
) -> None:
    objects = {
        "hole": {**SIMPLE["sphere"][0], "join": "cut"},
        "other": {
            "type": "formula",
            "formula": {"inline": SOLIDS, "iterations": 3},
            "scale": SCALE,
            **PLACED,
        },
    }
    scene = scene_of(BALL, PERSPECTIVE, (96, 80), objects=objects, renderer={"type": "surface", **WAYS[way]})
    other = placed(solids)

    def distance(points: Floats) -> Floats:
        return np.minimum(np.maximum(ball(points), -SIMPLE["sphere"][1](points)), other(points))

    agree(device, scene, distance, precision=precision, lanes=lanes, degrees=4.0)


@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("points", one_of(9, 1))
def test_a_formula_at_another_place(device: Device, camera: dict[str, Any], points: int) -> None:
    other = {"type": "formula", "formula": {"inline": SOLIDS, "iterations": 3}, "scale": SCALE, **PLACED}
    renderer = {"type": "surface", "points": {"count": points, "pattern": "grid"}}
    scene = scene_of(NOWHERE, camera, (112, 96), objects={"other": other}, renderer=renderer)
    agree(device, scene, placed(solids), degrees=6.0 if points > 1 else 1.0)


@pytest.mark.parametrize("formula", [BALL, QUICK_BALL], ids=["jacobian", "rule"])
def test_nothing_flows_to_the_ball_that_is_searched(device: Device, formula: dict[str, Any]) -> None:
    """A drop that is near to the formula's bounds, but not to its set, stays a drop."""
    middle = [2.2, 0, 0.1]
    drop = {"type": "sphere", "position": middle, "radius": 0.5, "join": "smooth_union", "smoothness": 0.25}
    camera = {**PERSPECTIVE, "target": [2.0, 0, 0.1], "fov": 32}
    wide = {**formula, "bounds": {"center": [0, 0, 0], "radius": 1.65}}
    scene = scene_of(wide, camera, (96, 96), objects={"drop": drop})
    exact = a_sphere(middle, 0.5)
    agree(device, scene, lambda points: np.minimum(ball(points), exact(points)))


def test_the_formula_at_home_looks_as_ever(device: Device) -> None:
    """A scene whose second formula is far away has the same picture."""
    formula = {"name": "mandelbulb", "iterations": 8}
    camera = {"position": [0.5, -2.6, 0.6], "fov": 35}
    far = {"type": "formula", "formula": {"name": "mandelbulb", "iterations": 8}, "position": [0, 60, 0]}
    alone = shoot(scene_of(formula, camera, (64, 64)), device)
    joined = shoot(scene_of(formula, camera, (64, 64), objects={"far": far}), device)
    assert (alone["A"] != joined["A"]).mean() < 0.02
    both = (alone["A"] == 1) & (joined["A"] == 1)
    apart = np.abs(alone["Z"][both] - joined["Z"][both])
    assert np.median(apart) < 2e-3
    assert np.percentile(apart, 80) < 1e-2
    assert np.median(np.linalg.norm(normals_of(alone) - normals_of(joined), axis=-1)[both]) < 0.05


def twin_of(
    formula: dict[str, Any], camera: dict[str, Any], side: int = 64, **sections: Any
) -> tuple[Any, Any]:
    """A scene, and the same one with its set as an object of half the size elsewhere."""
    place = np.array([1.5, 0.2, -0.4])
    moved = {
        "position": (place + TWIN * np.array(camera["position"])).tolist(),
        "target": place.tolist(),
        "fov": camera["fov"],
    }
    twin = {"type": "formula", "formula": formula, "position": place.tolist(), "scale": TWIN}
    alone = scene_of(formula, camera, (side, side), **sections)
    return alone, scene_of(NOWHERE, moved, (side, side), objects={"twin": twin}, **sections)


COLORINGS: dict[str, dict[str, Any]] = {
    "thickness": {"scale": 2.0, "step": 0.01},
    "iterations": {"scale": 0.3},
    "trap": {"scale": 1.0, "trap": {"shape": "point", "center": [0.4, 0.1, 0.2]}},
}


@pytest.mark.parametrize("by", one_of(*COLORINGS))
def test_each_formula_has_its_own_colouring(device: Device, by: str) -> None:
    """The same set as an object, smaller and elsewhere, has the colours that it has by itself."""
    coloring = {"by": by, "repeat": False, **COLORINGS[by]}
    alone, joined = twin_of(
        {"name": "mandelbulb", "iterations": 7},
        {"position": [0.3, -2.5, 0.5], "fov": 35},
        160,
        material={"ambient": 1, "diffuse": 0.2, "specular": 0},
        coloring=coloring,
    )
    if by == "thickness":  # in scene units
        smaller = {**coloring, "scale": coloring["scale"] / TWIN, "step": coloring["step"] * TWIN}
        joined = joined.model_copy(update={"coloring": smaller})
    first, second = shoot(alone, device), shoot(joined, device)
    both = (first["A"] == 1) & (second["A"] == 1)
    assert both.mean() > 0.8
    assert np.median(np.abs(colors(first) - colors(second))[both], axis=0).max() < 0.06
    assert np.std(second["R"][both]) > 0.04


def test_walls_have_their_own_colour_and_light_along_paths(device: Device) -> None:
    tool = {"type": "plane", "position": [0, 0, 0], "normal": [0, 0, -1], "join": "cut", "material": "red"}
    scene = scene_of(
        BALL,
        {"position": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], "fov": 30},
        (32, 32),
        objects={"tool": tool},
        materials={"red": {"base": {"color": [0.8, 0.1, 0.05]}, "specular": {"weight": 0}}},
        lights=[],
        background=[1, 1, 1],
        lighting={"mode": "path", "bounces": 2},
        renderer={"type": "surface", "samples": 16},
    )
    framebuffer = shoot(scene, device, samples=16)
    middle = (slice(13, 19), slice(13, 19))
    assert (framebuffer["A"][middle] == 1).all()
    np.testing.assert_allclose(points_of(framebuffer)[middle][..., 2], 0, atol=2e-3)
    np.testing.assert_allclose(
        normals_of(framebuffer)[middle], np.broadcast_to([0, 0, 1], (6, 6, 3)), atol=1e-2
    )


@pytest.mark.parametrize("by", one_of("closeness", "trap"))
def test_a_formula_beside_the_set_glows(device: Device, by: str) -> None:
    formula, camera = {"name": "mandelbulb", "iterations": 6}, {"position": [0.3, -3, 0.5], "fov": 45}
    glow = {"by": by, "width": 0.1, "reach": 0.5}
    alone, joined = twin_of(formula, camera, background=[0, 0, 0], lights=[])
    alone = alone.model_copy(update={"glow": {**glow, "color": [1, 1, 1]}})
    # Widths are of the scene: half of them around a set of half the size.
    joined = joined.model_copy(update={"glow": {**glow, "width": 0.05, "color": [1, 1, 1]}})
    first, second = (shoot(scene, device, samples=16)["G"] for scene in (alone, joined))
    assert first.mean() > 0.02
    assert second.mean() == pytest.approx(first.mean(), rel=0.08)


@pytest.mark.combination
def test_along_paths_it_has_the_same_light(device: Device) -> None:
    formula, camera = {"name": "mandelbulb", "iterations": 5}, {"position": [0.3, -3, 0.5], "fov": 40}
    alone, joined = twin_of(
        formula,
        camera,
        lighting={"mode": "path", "bounces": 3},
        environment={"name": "dusk"},
        lights=[{"direction": [1, 1, -1]}],
        materials={"clay": {"base": {"color": [0.7, 0.5, 0.3]}}},
        material={"name": "clay"},
    )
    first, second = (shoot(scene, device, samples=64) for scene in (alone, joined))
    for channel in "RGB":
        assert second[channel].mean() == pytest.approx(first[channel].mean(), rel=0.03)


PLACE, RADIUS, WIDTH = [0.9, -0.7, 0.4], 0.35, 0.4
CAMERA = {**PERSPECTIVE, "target": [0.9, -0.7, 0.3], "fov": 24}
OWN, DROP = np.array([0.1, 0.7, 0.3]), np.array([0.8, 0.2, 0.5])
LIT = {"ambient": 1, "diffuse": 0, "specular": 0}
DULL: dict[str, Any] = {"base": {"weight": 0}, "specular": {"weight": 0}}


def flowing(drop: dict[str, Any], **sections: Any) -> Scene:
    each = {
        "type": "sphere",
        "position": PLACE,
        "radius": RADIUS,
        "join": "smooth_union",
        "smoothness": WIDTH,
    }
    return scene_of(
        {"inline": SOLIDS, "iterations": 3}, CAMERA, (96, 80), objects={"drop": {**each, **drop}}, **sections
    )


def share_of_drop(points: Floats) -> Floats:
    """The derivative of the smooth minimum by the drop's distance."""
    a, b = np.maximum(solids(points), 0), a_sphere(PLACE, RADIUS)(points)
    others = 0.5 * np.maximum(WIDTH - np.abs(a - b), 0) / WIDTH
    return np.asarray(np.where(b < a, 1 - others, others))


def flown(points: Floats) -> Floats:
    """The distance to what has flowed together."""
    return smooth(np.maximum(solids(points), 0), a_sphere(PLACE, RADIUS)(points), WIDTH)


def test_a_smooth_union_is_where_its_smooth_minimum_is_0(device: Device) -> None:
    scene = flowing({})
    front = agree(device, scene, flown, degrees=6)
    origin, direction, _ = rays(scene)
    exact = a_sphere(PLACE, RADIUS)
    plain = marched(lambda points: np.minimum(solids(points), exact(points)), origin, direction)
    sooner = plain - np.where(front, marched(flown, origin, direction), 0)
    assert (sooner[front] > 0.02).sum() > 100, "something flows between both"


# What shows colours alone: ambient light (a lamp is behind), and materials that shine.
SHOWN: dict[str, dict[str, Any]] = {
    "direct": {
        "materials": {"drop": {"base": {"color": DROP.tolist()}, "specular": {"weight": 0}}},
        "material": {"color": OWN.tolist(), **LIT},
        "lights": [{"type": "directional", "direction": [1.5, -2.5, 1.2]}],
    },
    "path": {
        "materials": {
            "own": {**DULL, "emission": {"luminance": 1, "color": OWN.tolist()}},
            "drop": {**DULL, "emission": {"luminance": 2, "color": (DROP / 2).tolist()}},
        },
        "material": {"name": "own"},
        "lights": [],
        "background": [0, 0, 0],
        "lighting": {"mode": "path", "bounces": 0},
    },
}


@pytest.mark.parametrize("mode", SHOWN)
def test_colours_are_blended(device: Device, mode: str) -> None:
    """The picture has the blended colours, and some that are neither's."""
    scene = flowing({"material": "drop"}, **SHOWN[mode])
    framebuffer = shoot(scene, device)
    origin, direction, _ = rays(scene)
    met = np.isfinite(marched(flown, origin, direction)) & (framebuffer["A"] == 1)
    share = share_of_drop(points_of(framebuffer))[met][:, None]
    assert ((share > 0.2) & (share < 0.8)).sum() > 200
    off = np.abs(colors(framebuffer)[met] - (OWN + share * (DROP - OWN))).max(axis=-1)
    # Colours are those of the place where light is computed, some footprints before the surface.
    assert np.median(off) < 5e-3
    assert np.percentile(off, 90) < 0.06, np.percentile(off, [50, 90, 95, 99])
    assert np.percentile(off, 97) < 0.15


@pytest.mark.parametrize("by", one_of("iterations", "trap"))
def test_counts_and_traps_are_between_those_of_both(device: Device, by: str) -> None:
    """Two formulas that flow together have no line between their colours."""
    coloring: dict[str, Any] = {"by": by, "scale": 0.1, "repeat": False, "palette": ["#000000", "#ffffff"]}
    formula = BALL
    if by == "trap":
        # Orbits that stay where they begin: traps are distances in each one's own space.
        formula = {**SOLIDS, "let": {}, "shape": "sqrt(x*x + y*y + z*z) - 1"}
        coloring |= {"trap": {"shape": "point", "center": [0.4, 0.1, 0.2]}, "scale": 0.6}
    other = {
        "type": "formula",
        "formula": {"inline": formula, "iterations": 4},
        "position": [1.5, -0.3, 0.2],
        "scale": 0.7,
        "join": "smooth_union",
        "smoothness": 0.3,
    }
    scene = scene_of(
        formula,
        {"position": [0.9, -4.5, 0.6], "target": [0.8, 0, 0], "fov": 32},
        (128, 80),
        objects={"other": other},
        coloring=coloring,
        material=LIT,
        lights=[{"type": "directional", "direction": [0, -1, 0], "shadow": False}],
    )
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] == 1
    grey, deep = framebuffer["R"].astype(float), np.where(hit, framebuffer["Z"], 100).astype(float)
    # Single pixels where counts are noise do not matter; nor do outlines, where the colour may jump.
    around = sliding_window_view(grey, (5, 5)).reshape(76, 124, 25)
    smooth_grey = np.median(around, axis=-1)
    rows = sliding_window_view(deep, (5, 5)).reshape(76, 124, 25)
    on_slope = np.ptp(rows, axis=-1) < 0.3
    beside = on_slope[:, 1:] & on_slope[:, :-1]
    assert beside.mean() > 0.2
    spread = np.ptp(smooth_grey[on_slope])
    assert spread > 0.2, "both have colours of their own"
    assert np.abs(np.diff(smooth_grey, axis=1))[beside].max() < 0.15 * spread
