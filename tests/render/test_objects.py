"""Objects beside the set: where rays meet them, against their equations; order, hiding, points and framebuffers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.render.objects_oracle import NOWHERE, light_of, met
from tests.render.shots import (
    BALL,
    BALL_RADIUS,
    CAMERAS,
    PERSPECTIVE,
    QUICK_BALL,
    beside,
    colors,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    view_of,
)
from tests.scenes import BALL_ITERATIONS, scene_of
from tests.variants import combinations, one_of

TURNED = {"rotation": [20, -35, 50], "position": [0.1, 0.2, -0.1]}
OBJECTS: dict[str, dict[str, Any]] = {
    "plane": {"type": "plane", "position": [0, 0, -0.4], "normal": [0.3, -0.2, 2]},
    "sphere": {"type": "sphere", "radius": 0.8, **TURNED},
    "ellipsoid": {"type": "sphere", "radius": 0.6, "scale": [0.5, 1.8, 1.1], **TURNED},
    "box": {"type": "box", "size": [1.2, 0.5, 0.9], "scale": [1, 2, 1], **TURNED},
    "cylinder": {"type": "cylinder", "radius": 0.4, "height": 1.3, **TURNED},
    "flat cylinder": {"type": "cylinder", "radius": 0.4, "scale": [2, 1, 0.5], **TURNED},
}


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize(
    ("precision", "lanes", "error"),
    [("float32", None, 5e-6), ("float32", 1, 5e-6), ("float64", 4, 1e-6)],
    ids=["float32", "one lane", "float64"],
)
@pytest.mark.parametrize("name", OBJECTS)
def test_an_object_is_where_its_equation_is_zero(
    device: Device, name: str, camera: str, precision: Precision, lanes: int | None, error: float
) -> None:
    # (Channels are float32, whatever the rays are.)
    scene = scene_of(NOWHERE, CAMERAS[camera], (48, 40), objects={name: OBJECTS[name]}, background=[0, 0, 0])
    framebuffer = shoot(scene, device, precision, lanes=lanes)
    t, normal, _ = met(scene, *rays(scene)[:2])
    found = beside(framebuffer, scene, t, normal, 1)
    assert found.both.sum() > 100
    assert found.deep.max() < error
    assert found.off.max() < 50 * error
    # At an edge both faces are right.
    assert (found.turned > 1e-3).sum() <= 3
    assert (framebuffer["iterations"][found.hit] == 0).all()


@pytest.mark.parametrize(
    "solid",
    [{"type": "box", "size": [3, 2, 2]}, {"type": "cylinder", "radius": 1.5, "height": 2}],
    ids=["box", "cylinder"],
)
def test_from_inside_a_solid_its_walls_are_seen(device: Device, solid: dict[str, Any]) -> None:
    camera = {"position": [0.1, -0.2, 0.1], "target": [1, 1, 0.3], "fov": 100}
    scene = scene_of(NOWHERE, camera, (40, 32), objects={"it": solid})
    t, normal, _ = met(scene, *rays(scene)[:2])
    found = beside(shoot(scene, device), scene, t, normal, 0)
    assert found.both.all()
    assert found.off.max() < 2e-5
    assert (found.turned > 1e-3).sum() <= 3


@pytest.mark.parametrize(
    ("precision", "lanes", "choppiness"),
    one_of(
        ("float32", None, 1.0),
        ("float32", None, 0.0),
        ("float32", 1, 0.0),
        ("float32", 1, 1.0),
        ("float64", 4, 0.0),
        ("float64", 4, 1.0),
    ),
)
def test_water_is_its_sum_of_waves(
    device: Device, precision: Precision, lanes: int | None, choppiness: float
) -> None:
    waves = {"height": 0.3, "length": 0.9, "choppiness": choppiness, "seed": 3, "time": 1.7}
    sea = {"type": "water", "position": [0.1, 0, -0.2], "normal": [0.1, 0.05, 1], "waves": waves}
    camera = {**PERSPECTIVE, "position": [1.5, -2.5, 0.7]}
    scene = scene_of(NOWHERE, camera, (40, 32), objects={"sea": sea})
    t, normal, _ = met(scene, *rays(scene)[:2])
    # (Far out waves are finer than pixels.)
    found = beside(
        shoot(scene, device, precision, lanes=lanes), scene, np.where(t < 6, t, np.inf), normal, 1280
    )
    assert found.both.sum() == (t < 6).sum() > 600
    # A crest that a ray only just meets may be thinner than what either search sees.
    assert (found.off > 1e-4).mean() < 0.004
    assert (found.turned > 2e-3).mean() < 0.006
    assert np.median(found.turned) < 2e-5


def test_significant_height_and_movement_of_waves() -> None:
    from clfractal.geometry.water import GRAVITY, wave_set
    from clfractal.scene.objects import WaterObject
    from tests.render.objects_oracle import heights

    def water(**waves: Any) -> WaterObject:
        return WaterObject.checked({"type": "water", "waves": {"height": 0.2, "length": 1.5, **waves}})

    random = np.random.default_rng(1)
    u, v = random.uniform(-300, 300, (2, 200_000))
    still = water(choppiness=1.0)
    height, along, across = heights(still, u, v)
    assert 4 * height.std() == pytest.approx(0.2, rel=0.02)
    assert np.abs(height).max() < wave_set(still).reach
    assert np.hypot(along, across).max() < wave_set(still).slope
    # Crests are higher than troughs are deep.
    assert (height**3).mean() > 0.1 * height.std() ** 3
    assert np.abs((heights(water(choppiness=0.0), u, v)[0] ** 3).mean()) < 0.05 * height.std() ** 3
    # Deep water: a wave of number k has moved by sqrt(g / k) after a second.
    before, after = wave_set(water()), wave_set(water(time=1.0))
    number = np.hypot(before.x, before.y)
    turned = np.exp(1j * (before.phase - after.phase))
    np.testing.assert_allclose(turned, np.exp(1j * np.sqrt(GRAVITY * number)), atol=1e-12)


def _crowd(order: list[str]) -> dict[str, Any]:
    known = {
        "floor": {"type": "plane", "position": [0, 0, -1.05], "material": "red"},
        "left": {"type": "sphere", "position": [-0.9, -0.6, -0.6], "radius": 0.4, "material": "grey"},
        "right": {"type": "box", "position": [0.9, 0.3, -0.3], "size": [0.5, 0.7, 1.2]},
        "through": {"type": "cylinder", "radius": 0.3, "height": 3, "rotation": [60, 20, 0]},
    }
    return {name: known[name] for name in order}


MATERIALS = {
    "red": {"base": {"color": [0.8, 0.1, 0.1]}},
    "grey": {"base": {"color": [0.4, 0.4, 0.4], "metalness": 1.0}, "specular": {"roughness": 0.1}},
}


@pytest.mark.parametrize("mode", one_of("direct", "path"))
def test_the_order_of_objects_changes_nothing(device: Device, mode: str) -> None:
    found = []
    for order in (["floor", "left", "right", "through"], ["through", "right", "floor", "left"]):
        scene = scene_of(
            BALL,
            PERSPECTIVE,
            (48, 40),
            objects=_crowd(order),
            materials=MATERIALS,
            lighting={"mode": mode},
        )
        found.append(stacked(shoot(scene, device)))
    np.testing.assert_array_equal(found[0], found[1])


@pytest.mark.parametrize("search", ["distance", "steps"])
@pytest.mark.parametrize("formula", [BALL, QUICK_BALL], ids=["jacobian", "scalar rule"])
def test_what_is_nearer_is_seen(device: Device, formula: dict[str, Any], search: str) -> None:
    """The ball and what goes through it, hides it and is hidden: the least of the depths of each alone."""
    settings = {"search": search}
    objects = _crowd(["floor", "left", "right", "through"])
    alone = shoot(scene_of(formula, PERSPECTIVE, (64, 48), renderer=settings), device)
    beside = shoot(
        scene_of(NOWHERE, PERSPECTIVE, (64, 48), objects=objects, materials=MATERIALS, renderer=settings),
        device,
    )
    both = shoot(
        scene_of(formula, PERSPECTIVE, (64, 48), objects=objects, materials=MATERIALS, renderer=settings),
        device,
    )
    one, other, found = (np.minimum(framebuffer["Z"], 1e6) for framebuffer in (alone, beside, both))
    assert (one < other).sum() > 300
    assert (other < one).sum() > 300
    # Where they meet, within a footprint, either is right.
    close = np.abs(one - other) < 0.02
    np.testing.assert_allclose(found[~close], np.minimum(one, other)[~close], atol=1e-5)
    first = (one < other)[..., None]
    np.testing.assert_allclose(
        normals_of(both)[~close], np.where(first, normals_of(alone), normals_of(beside))[~close], atol=1e-5
    )


def test_points_of_a_pixel_find_objects_on_their_own_rays(device: Device) -> None:
    points = {"pattern": "grid", "count": 9}
    objects = {"ball": {"type": "sphere", "radius": 0.8}}
    scene = scene_of(NOWHERE, PERSPECTIVE, (32, 32), objects=objects, renderer={"points": points})
    framebuffer = shoot(scene, device)
    expected = np.zeros((32, 32))
    for x in (1 / 6, 1 / 2, 5 / 6):
        for y in (1 / 6, 1 / 2, 5 / 6):
            origin, direction, _ = rays(scene, x, y)
            expected += np.isfinite(met(scene, origin, direction)[0]) / 9
    assert ((expected > 0) & (expected < 1)).sum() > 30
    assert (np.abs(framebuffer["A"] - expected) > 1e-5).sum() <= 1


@pytest.mark.parametrize("points", one_of(9, 1))
def test_an_object_hides_the_face_of_a_cut(device: Device, points: int) -> None:
    plane = {"center": [0, 0, 0], "normal": [0, -1, 0]}
    camera = {"position": [0, -4, 0], "target": [0, 0, 0], "fov": 40}
    ball = {"type": "sphere", "position": [0.3, -1.5, 0.2], "radius": 0.3}
    scene = scene_of(
        QUICK_BALL,
        camera,
        (40, 40),
        objects={"ball": ball},
        renderer={"points": {"pattern": "grid", "count": points}},
        cut_planes=[{"plane": plane, "cut": True, "opacity": 0}],
    )
    framebuffer = shoot(scene, device)
    origin, direction, _ = rays(scene)
    on_ball = np.isfinite(met(scene, origin, direction)[0])
    view = view_of(scene)
    depth = (points_of(framebuffer) - view.origin) @ view.axis
    assert on_ball.sum() > 40
    # With several points a pixel of its rim may show the face.
    assert (depth[on_ball] < 2.6).sum() >= on_ball.sum() - (0 if points == 1 else 2)
    face = (framebuffer["A"] == 1) & (framebuffer["Z"] > 2.6)
    assert face.sum() > 200
    np.testing.assert_allclose(framebuffer["Z"][face], 4, atol=0.05)


WHITE = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
DULL = {"ambient": 0, "diffuse": 1, "specular": 0, "color": [1, 1, 1]}
FLOOR = {"type": "plane", "position": [0, 0, -1], "material": "white"}
BULB = {"name": "mandelbulb", "iterations": 6}


def ball_object(formula: dict[str, Any], **values: Any) -> dict[str, Any]:
    return {"type": "formula", "formula": {"inline": formula, "iterations": BALL_ITERATIONS}, **values}


SHADOWS = one_of(
    (QUICK_BALL, "path", "distance", "float32", None),
    (QUICK_BALL, "path", "distance", "float32", 4),
    (BALL, "path", "distance", "float32", 4),
    (QUICK_BALL, "direct", "steps", "float32", 4),
    (QUICK_BALL, "direct", "distance", "float64", 4),
    (QUICK_BALL, "path", "distance", "float32", 1),
    (BALL, "direct", "distance", "float64", 1),
)


@pytest.mark.parametrize(("formula", "mode", "search", "precision", "lanes"), SHADOWS)
def test_a_small_ball_has_its_own_shadow(
    device: Device, formula: dict[str, Any], mode: str, search: str, precision: Precision, lanes: int | None
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
