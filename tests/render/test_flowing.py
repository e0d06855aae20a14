"""What flows together blends its colours and materials by the share that the smooth minimum gives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.joined_oracle import Floats, a_sphere, marched, smooth, solids
from tests.render.shots import BALL, PERSPECTIVE, SOLIDS, points_of, rays, shoot
from tests.scenes import scene_of
from tests.variants import one_of

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


def check(framebuffer: Any, scene: Scene, shown: Floats) -> None:
    """The picture has the blended colours, and some that are neither's."""
    origin, direction, _ = rays(scene)

    def distance(points: Floats) -> Floats:
        return smooth(np.maximum(solids(points), 0), a_sphere(PLACE, RADIUS)(points), WIDTH)

    met = np.isfinite(marched(distance, origin, direction)) & (framebuffer["A"] == 1)
    share = share_of_drop(points_of(framebuffer))[met][:, None]
    assert ((share > 0.2) & (share < 0.8)).sum() > 200
    off = np.abs(shown[met] - (OWN + share * (DROP - OWN))).max(axis=-1)
    # Colours are those of the place where light is computed, some footprints before the surface.
    assert np.median(off) < 5e-3
    assert np.percentile(off, 90) < 0.06, np.percentile(off, [50, 90, 95, 99])
    assert np.percentile(off, 97) < 0.15


def colors(framebuffer: Any) -> Floats:
    return np.stack([framebuffer[name] for name in "RGB"], axis=-1).astype(float)


def test_colours_are_blended(device: Device) -> None:
    materials = {"drop": {"base": {"color": DROP.tolist()}, "specular": {"weight": 0}}}
    scene = flowing(
        {"material": "drop"},
        materials=materials,
        material={"color": OWN.tolist(), **LIT},
        # From behind: ambient light alone.
        lights=[{"type": "directional", "direction": [1.5, -2.5, 1.2]}],
    )
    framebuffer = shoot(scene, device)
    check(framebuffer, scene, colors(framebuffer))


def test_materials_are_blended_along_paths(device: Device) -> None:
    materials = {
        "own": {**DULL, "emission": {"luminance": 1, "color": OWN.tolist()}},
        "drop": {**DULL, "emission": {"luminance": 2, "color": (DROP / 2).tolist()}},
    }
    scene = flowing(
        {"material": "drop"},
        materials=materials,
        material={"name": "own"},
        lights=[],
        background=[0, 0, 0],
        lighting={"mode": "path", "bounces": 0},
    )
    framebuffer = shoot(scene, device)
    check(framebuffer, scene, colors(framebuffer))


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
