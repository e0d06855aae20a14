"""Formula objects that are small in the picture: the balls around them are never seen, whatever they are near."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import BALL, BALL_RADIUS, QUICK_BALL, colors, points_of, shoot
from tests.scenes import BALL_ITERATIONS, scene_of
from tests.variants import combinations, one_of

WHITE = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
DULL = {"ambient": 0, "diffuse": 1, "specular": 0, "color": [1, 1, 1]}
FLOOR = {"type": "plane", "position": [0, 0, -1], "material": "white"}
BULB = {"name": "mandelbulb", "iterations": 6}


def light_of(mode: str) -> dict[str, Any]:
    """Light that surfaces reflect once."""
    return {"lighting": {"mode": mode, **({"bounces": 0} if mode == "path" else {})}}


def ball_object(formula: dict[str, Any], **values: Any) -> dict[str, Any]:
    return {"type": "formula", "formula": {"inline": formula, "iterations": BALL_ITERATIONS}, **values}


SHADOWS = one_of(
    (QUICK_BALL, "path", "distance", "float32", 4),
    (BALL, "path", "distance", "float32", 4),
    (QUICK_BALL, "direct", "steps", "float32", 4),
    (QUICK_BALL, "direct", "distance", "float64", 4),
    (QUICK_BALL, "path", "distance", "float32", 1),
    (BALL, "direct", "distance", "float64", 1),
)


@pytest.mark.parametrize(("formula", "mode", "search", "precision", "lanes"), SHADOWS)
def test_a_small_ball_has_its_own_shadow(
    device: Device, formula: dict[str, Any], mode: str, search: str, precision: Precision, lanes: int
) -> None:
    """A ball of six pixels in a formula's ball that is three times as large."""
    formula = {**formula, "bounds": {"center": [0, 0, 0], "radius": 3}}
    scale, way = 0.1, np.array([0.3, 0.2, -1.0])
    # (Where any formula lacks a rule all rays prove their hits.)
    own = NOWHERE if formula.get("derivative") is None else {**NOWHERE, "derivative": "dr"}
    scene = scene_of(
        own,
        {"position": [0.4, -4.5, 3], "target": [0, 0, -1], "fov": 30},
        (80, 80),
        objects={
            "floor": FLOOR,
            "ball": ball_object(formula, scale=scale, position=[0, 0, -0.6], material="white"),
        },
        materials={"white": WHITE},
        material=DULL,
        lights=[{"direction": way.tolist()}],
        renderer={"search": search, "step": 0.02},
        background=[0, 0, 0],
        **light_of(mode),
    )
    framebuffer = shoot(scene, device, precision, lanes=lanes)
    points = points_of(framebuffer)
    on_floor = (framebuffer["A"] == 1) & (np.abs(points[..., 2] + 1) < 1e-4)
    toward = -way / np.linalg.norm(way)
    from_ball = points - np.array([0, 0, -0.6])
    along = from_ball @ toward
    passes = np.sqrt((from_ball**2).sum(-1) - along**2) / (scale * BALL_RADIUS)
    # A shadow ray hits where the distance is half a footprint, a fifth of the radius; and distances are half of the
    # true ones.
    dark, lit = on_floor & (passes < 0.95), on_floor & (passes > 1.45)
    annulus = lit & (passes < 3)
    shown = colors(framebuffer)[..., 0]
    assert dark.sum() > 8
    assert annulus.sum() > 60
    np.testing.assert_allclose(shown[dark], 0, atol=1e-4)
    np.testing.assert_allclose(shown[lit], toward[2], atol=1e-3)


def bulb(kind: str, scale: float, mode: str, size: int) -> Scene:
    """A bulb over a plane, of `scale` with all around it: as the scene's own formula, or as an object far from that."""
    middle = np.array([0.0, 0, 0]) if kind == "main" else np.array([100.0, 0, 0]) * scale
    camera = {
        "position": (middle + scale * np.array([1.5, -3.2, 1.4])).tolist(),
        "target": middle.tolist(),
        "fov": 40,
    }
    objects: dict[str, Any] = {"floor": {**FLOOR, "position": [0, 0, -1.2 * scale]}}
    renderer: dict[str, Any] = {"samples": 16}
    own = BULB
    if kind != "main":
        own = {"name": "menger_sponge", "iterations": 1}
        objects["bulb"] = {"type": "formula", "formula": BULB, "scale": scale, "position": middle.tolist()}
        renderer["bounds"] = {"center": middle.tolist(), "radius": 3 * scale}
    return scene_of(
        own,
        camera,
        (size, size),
        objects=objects,
        materials={"white": WHITE},
        material={"name": "white"} if mode == "path" else DULL,
        lights=[{"direction": [-0.6, 0.5, -1], "intensity": 2, "angular_size": 2}],
        renderer=renderer,
        background=[0, 0, 0],
        **light_of(mode),
    )


def unlike(framebuffer: Framebuffer, other: Framebuffer) -> tuple[float, float]:
    """How much more light a picture has than another, and the part of its pixels that differ by a fifth of the mean."""
    a, b = colors(other)[..., 0], colors(framebuffer)[..., 0]
    return float(b.mean() / a.mean() - 1), float((np.abs(a - b) > 0.2 * a.mean()).mean())


@pytest.mark.parametrize(
    ("scale", "mode"), one_of((0.28, "path"), (1000.0, "path"), (0.001, "direct"), (1.0, "direct"))
)
def test_an_object_looks_like_the_scenes_own_formula(device: Device, scale: float, mode: str) -> None:
    """The same arrangement at other sizes is the same picture, but for places at a fractal's rims.

    Along paths light is computed at a part of the cone that is told in estimates, and those of objects are scaled by their
    own formula already: theirs lies nearer.
    """
    for size in (96, 40):
        framebuffer = shoot(bulb("object", scale, mode, size), device)
        more, differ = unlike(framebuffer, shoot(bulb("main", 1.0, mode, size), device))
        assert abs(more) < (0.008 if mode == "path" else 0.004), size
        assert differ < 0.004, size


@pytest.mark.parametrize("formula", [QUICK_BALL, *combinations([BALL])])
def test_nothing_shows_the_ball_in_front_of_a_surface(device: Device, formula: dict[str, Any]) -> None:
    """Where a formula's ball, but not the formula, is before another surface that one is seen as if it were alone."""
    camera = {"position": [0, -8, 0], "target": [0, 0, 0], "fov": 30}
    wall = {
        "variables": ["x", "y", "z"],
        "map": ["x", "y", "z"],
        "add": "none",
        "degree": 1,
        "shape": "max(abs(x) - 2, abs(y - 2) - 2, abs(z) - 2)",
        "bounds": {"center": [0, 2, 0], "radius": 4},
        "bailout": 10,
        **({"derivative": "dr"} if formula is QUICK_BALL else {}),
    }
    common: dict[str, Any] = {
        "lights": [{"direction": [0, 1, 0]}],
        "material": DULL,
        "background": [0, 0, 0],
        "renderer": {"samples": 4},
    }
    formula = {**formula, "bounds": {"center": [0, 0, 0], "radius": 3}}
    scale = 0.06
    for x, y in ((0.0, -0.125), (1.93, -0.1), (-1.95, 0.0)):
        middle = np.array([x, y, 0.4])
        small = {"small": ball_object(formula, scale=scale, position=middle.tolist())}
        alone = shoot(scene_of(wall, camera, (96, 96), **common), device)
        framebuffer = shoot(scene_of(wall, camera, (96, 96), objects=small, **common), device)
        eye = np.array([0, -8, 0])
        way = points_of(alone) - eye
        way /= np.linalg.norm(way, axis=-1, keepdims=True)
        to_middle = middle - eye
        passes = np.linalg.norm(to_middle - (way @ to_middle)[..., None] * way, axis=-1) / scale
        around = (alone["A"] == 1) & (passes > 2.8) & (passes < 3.8)
        assert around.sum() > 10
        # Where a ray begins moves its hit by parts of a footprint, which is 0.045 wide.
        np.testing.assert_allclose(framebuffer["Z"][around], alone["Z"][around], atol=0.025)
        np.testing.assert_allclose(colors(framebuffer)[around], colors(alone)[around], atol=5e-3)


def test_what_flows_into_another_does_not_flow_into_its_ball(device: Device) -> None:
    """A smooth union wider than the formulas' balls is the same whatever balls are around them."""

    def ball(radius: float, around: float) -> dict[str, Any]:
        return {
            "variables": ["x", "y", "z"],
            "map": ["x", "y", "z"],
            "add": "none",
            "degree": 1,
            "shape": f"sqrt(x*x + y*y + z*z) - {radius}",
            "bounds": {"center": [0, 0, 0], "radius": around},
            "bailout": 10,
            "derivative": "dr",
        }

    def joined(own: float, other: float) -> Framebuffer:
        drop = {
            "type": "formula",
            "formula": {"inline": ball(0.2, other), "iterations": 1},
            "position": [0.85, 0, 0.1],
            "join": "smooth_union",
            "smoothness": 0.6,
        }
        camera = {"position": [0, -4, 0], "target": [0.3, 0, 0], "fov": 35}
        return shoot(scene_of(ball(0.5, own), camera, (96, 72), objects={"drop": drop}), device)

    wide = joined(1.5, 1.5)
    for own, other in ((0.51, 0.21), (0.6, 0.3)):
        framebuffer = joined(own, other)
        assert framebuffer["A"].mean() == pytest.approx(wide["A"].mean(), rel=2e-3)
        off = np.abs(colors(framebuffer) - colors(wide)).max(-1)
        assert (off > 0.03).sum() < 10
