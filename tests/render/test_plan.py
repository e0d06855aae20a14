"""The choice of the number type, regions, and what a float64 picture is for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device, has_float64
from clfractal.device.structs import Precision
from clfractal.errors import SceneError
from clfractal.images.tiles import Region
from clfractal.integrators.plan import (
    FLOAT32_STEPS_PER_PIXEL,
    choose_precision,
    finest_steps,
    make_plan,
    make_region,
)
from clfractal.scene.model import Scene
from tests.render.shots import BALL, BALL_RADIUS, ORTHOGRAPHIC, PERSPECTIVE, shoot, view_of
from tests.scenes import scene_of

DIRECTION = np.array([0.48, -0.6, 0.64])  # length 1


def close_up(pixel: float, **sections: Any) -> Scene:
    """The ball from 1000 pixels above its surface, pixels of this size, lit by a lamp 30 pixels above it."""
    surface = BALL_RADIUS * DIRECTION
    camera = {
        "projection": "orthographic",
        "position": (surface + 1000 * pixel * DIRECTION).tolist(),
        "target": surface.tolist(),
        "height": 48 * pixel,
    }
    lamp = {"type": "point", "position": (surface + 30 * pixel * DIRECTION).tolist(), "shadow": False}
    flat = {"color": [1, 1, 1], "ambient": 0, "diffuse": 1, "specular": 0}
    settings = {"renderer": {"detail": 0.1}, "lights": [lamp], "material": flat}
    return scene_of(BALL, camera, (48, 48), **{**settings, **sections})


def shading_error(device: Device, pixel: float, precision: Precision) -> tuple[float, float]:
    """Largest difference of R from the lamp's cosine law, and the share of pixels that hit."""
    framebuffer = shoot(close_up(pixel), device, precision)
    place = (np.arange(48) + 0.5 - 24)[None, :], (np.arange(48) + 0.5 - 24)[:, None]
    # On the scale of some pixels the ball is a plane, the lamp stands 30 pixels above it.
    cosine = 30 / np.sqrt(place[0] ** 2 + place[1] ** 2 + 30**2)
    hit = framebuffer["A"] > 0
    return float(np.abs(framebuffer["R"] - cosine)[hit].max(initial=0)), float(hit.mean())


def test_a_usual_camera_takes_float32() -> None:
    for camera in (PERSPECTIVE, ORTHOGRAPHIC):
        assert choose_precision(scene_of(BALL, camera), "auto", has_float64=True) == ("float32", "")


@pytest.mark.parametrize("pixel", [1e-9, 1e-7, 1e-6])
def test_a_deep_camera_takes_float64(pixel: float) -> None:
    scene = close_up(pixel)
    assert choose_precision(scene, "auto", has_float64=True) == ("float64", "")
    precision, remark = choose_precision(scene, "auto", has_float64=False)
    assert precision == "float32"
    assert "no float64" in remark


def test_what_is_asked_for_is_taken() -> None:
    deep, usual = close_up(1e-9), scene_of(BALL, PERSPECTIVE)
    assert choose_precision(deep, "float32", has_float64=True)[0] == "float32"
    assert choose_precision(usual, "float64", has_float64=True)[0] == "float64"
    with pytest.raises(SceneError, match="no float64"):
        choose_precision(usual, "float64", has_float64=False)


def test_auto_changes_where_pixels_come_near_float32s_steps() -> None:
    """The choice follows the footprint: halving the pixel halves the number of steps, and one size is the border."""
    sizes = 2.0 ** -np.arange(4, 30)
    steps = [finest_steps(close_up(s), view_of(close_up(s))) for s in sizes]
    np.testing.assert_allclose(steps[-1] / steps[-2], 0.5, rtol=1e-3)
    chosen = [choose_precision(close_up(s), "auto", has_float64=True)[0] for s in sizes]
    border = chosen.index("float64")
    assert chosen == ["float32"] * border + ["float64"] * (len(sizes) - border)
    assert steps[border - 1] >= FLOAT32_STEPS_PER_PIXEL > steps[border]


def test_float64_is_clean_where_float32_is_not(device: Device) -> None:
    """A lamp near the surface shades by differences of a few pixels: exactly so in float64. float32 cannot tell the
    pixels apart."""
    if not has_float64(device.info):
        with pytest.raises(SceneError):
            choose_precision(close_up(1e-8), "float64", has_float64=False)
        return
    error, share = shading_error(device, 1e-9, "float64")
    assert share == 1
    assert error < 0.02
    error, share = shading_error(device, 1e-9, "float32")
    assert error > 0.2 or share < 0.9


def test_auto_changes_before_float32_is_seen(device: Device) -> None:
    """The deepest camera that still takes float32 gives the same clean picture."""
    size = 2.0**-6
    while choose_precision(close_up(size / 2), "auto", has_float64=True)[0] == "float32":
        size /= 2
    error, share = shading_error(device, size, "float32")
    assert share == 1
    assert error < 0.05


def test_regions() -> None:
    size = (40, 30)
    assert make_region(size, None) == Region(0, 0, 40, 30)
    assert make_region(size, (39, 29, 1, 1)) == Region(39, 29, 1, 1)
    for wrong in ((0, 0, 41, 1), (0, 0, 1, 31), (-1, 0, 2, 2), (0, -1, 2, 2), (5, 5, 0, 1), (5, 5, 1, 0)):
        with pytest.raises(SceneError, match="inside the picture of 40 x 30 pixels"):
            make_region(size, wrong)


def test_what_a_plan_takes_from_the_scene() -> None:
    scene = scene_of(BALL, PERSPECTIVE, renderer={"samples": 9}, output={"channels": ["A", "Z"]})
    plan = make_plan(scene, precision="float32", lanes=4)
    assert (plan.samples, plan.channels, plan.region) == (9, ("A", "Z"), Region(0, 0, 64, 64))
    plan = make_plan(scene, precision="float32", lanes=4, samples=2, channels=("R",), region=(1, 2, 3, 4))
    assert (plan.samples, plan.channels, plan.region) == (2, ("R",), Region(1, 2, 3, 4))
    with pytest.raises(SceneError, match="channel"):
        make_plan(scene, precision="float32", lanes=4, channels=("R", "Q"))


def test_cut_planes_in_a_zoomed_volume_have_pixels() -> None:
    """Voxels may be coarse where pixels of a plane are fine: after a zoom of 3000 these are 28 steps of float32 wide."""
    volume = {"type": "volume", "box": {"size": 3}, "resolution": 8}
    zoom = [{"center": [0.5, 0, 0], "scale": 3000}]
    cases: dict[str, tuple[dict[str, Any], list[dict[str, Any]]]] = {
        "plain": (volume, [{}]),
        "zoom": ({**volume, "zoom": zoom}, []),
        "zoom and plane": ({**volume, "zoom": zoom}, [{}]),
    }
    found = {}
    for name, (renderer, planes) in cases.items():
        scene = scene_of(BALL, ORTHOGRAPHIC, (512, 512), renderer=renderer, cut_planes=planes)
        found[name] = choose_precision(scene, "auto", has_float64=True)[0]
    assert found == {"plain": "float32", "zoom": "float32", "zoom and plane": "float64"}
