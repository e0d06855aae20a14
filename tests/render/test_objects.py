"""Objects beside the set: where rays meet them, against their equations; order, hiding, points and framebuffers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from tests.render.objects_oracle import NOWHERE, met
from tests.render.shots import (
    BALL,
    CAMERAS,
    PERSPECTIVE,
    QUICK_BALL,
    beside,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    view_of,
)
from tests.scenes import scene_of
from tests.variants import one_of

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
