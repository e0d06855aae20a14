"""What is measured before a picture: the distance that is sharp, and the exposure; the numbers go into the header."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.camera.views import seen_by
from clfractal.device.select import Device
from clfractal.engine.settle import HIGHLIGHT, exposure_of, is_settled
from clfractal.scene.parts import PerspectiveCamera
from tests.calls import failure
from tests.render.shots import BALL, BALL_RADIUS, SOLIDS, engine_of
from tests.scenes import scene_of

CAMERA: dict[str, Any] = {"position": [0, -3, 0], "target": [0, 0, 0], "fov": 50, "f_number": 0.5}
SIZE = (96, 64)
STEREO = "stereo={screen_width: 0.6, screen_distance: 0.7}"


@pytest.fixture
def engine(device: Device) -> clfractal.Engine:
    return engine_of(device)


def ball(*overrides: str, **camera: Any) -> clfractal.Scene:
    scene = scene_of(BALL, {**CAMERA, **camera}, SIZE, renderer={"detail": 0.02})
    return clfractal.load_scene(scene.resolved(), overrides=overrides)


def focus_of(scene: clfractal.Scene) -> float:
    assert isinstance(scene.camera, PerspectiveCamera)
    assert scene.camera.measured_focus is None
    assert scene.camera.focus_distance is not None
    return scene.camera.focus_distance


def test_the_middle_is_sharp(engine: clfractal.Engine) -> None:
    """The ray through the middle of the pixel right below the picture's middle meets the ball at a known depth."""
    found = engine.settled(ball(focus="auto"))
    assert focus_of(found) == pytest.approx(3 - BALL_RADIUS, abs=1e-3)
    assert is_settled(found)
    assert engine.settled(found) is found


@pytest.mark.parametrize("place", [(0.4, 0.45), (0.62, 0.6)])
def test_a_place_of_the_picture_is_sharp(place: tuple[float, float], engine: clfractal.Engine) -> None:
    found = focus_of(engine.settled(ball(focus_on=place)))
    # The ray through that pixel's middle, met with the sphere.
    column, row = (int(part * side) for part, side in zip(place, SIZE, strict=True))
    half = math.tan(math.radians(25))
    ray = np.array(
        [(column + 0.5 - 48) / 32 * half, 1.0, (32 - row - 0.5) / 32 * half]
    )  # depth 1 along the view axis
    a, b, c = ray @ ray, -3.0, 9 - BALL_RADIUS**2
    depth = (-b - math.sqrt(b * b - a * c)) / a
    assert found == pytest.approx(depth, abs=1e-3)
    assert depth > 3 - BALL_RADIUS + 0.02


def test_beside_the_ball_its_nearest_rim_is_sharp(engine: clfractal.Engine) -> None:
    """Nothing lies in that corner; the rim of a sphere at distance 3 is at the depth 3 - radius^2 / 3."""
    found = focus_of(engine.settled(ball(focus_on=(0.99, 0.02))))
    assert found == pytest.approx(3 - BALL_RADIUS**2 / 3, abs=0.15)


def test_an_empty_picture_keeps_the_defaults(engine: clfractal.Engine) -> None:
    found = engine.settled(ball("output.exposure=auto", focus="auto", target=[0, -6, 0]))
    assert found.camera.measured_focus is None  # type: ignore[union-attr]
    assert found.camera.focus_distance is None  # type: ignore[union-attr]


def test_a_pinhole_needs_no_look() -> None:
    assert is_settled(ball(focus="auto", f_number=None))
    assert not is_settled(ball(focus="auto"))


def test_focus_and_distance_contradict() -> None:
    message = "camera.focus_on: measures the distance that is sharp; remove it, or focus_distance"
    assert str(failure(clfractal.SceneError, ball, focus_on=[0.5, 0.5], focus_distance=2)).endswith(message)


def test_views_of_a_layout_have_their_own_focus(engine: clfractal.Engine) -> None:
    """One with the scene's camera, one with its own, nearer."""
    own = "{position: [0, -2, 0], f_number: 1, focus: auto}"
    scene = ball(f"layout={{views: [{{}}, {{camera: {own}}}]}}", focus="auto")
    found = engine.settled(scene)
    assert focus_of(found) == pytest.approx(3 - BALL_RADIUS, abs=2e-3)
    assert found.layout is not None
    camera = found.layout.views[1].camera
    assert isinstance(camera, PerspectiveCamera)
    assert camera.focus_distance == pytest.approx(2 - BALL_RADIUS, abs=2e-3)


def test_a_lens_in_stereo_focuses_on_the_screen(engine: clfractal.Engine) -> None:
    """Unless the camera says otherwise: the plane through the target, at 3 times 0.7 / 0.6 of what it is wide."""
    scene = ball(STEREO)
    job = engine.prepare(scene)
    wide = 2 * 3 * math.tan(math.radians(25)) * SIZE[0] / SIZE[1]
    screen = wide * 0.7 / 0.6
    assert [view.camera.focus_distance for view in job.views] == pytest.approx([screen, screen])
    plane = "{center: [0, -0.5, 0], normal: [0, -1, 0], width: 2}"
    job = engine.prepare(clfractal.load_scene(scene.resolved(), overrides=[f"stereo.plane={plane}"]))
    assert [view.camera.focus_distance for view in job.views] == pytest.approx([2 * 0.7 / 0.6] * 2)
    job = engine.prepare(ball(STEREO, focus_distance=1.25))
    assert [view.camera.focus_distance for view in job.views] == [1.25, 1.25]


def test_both_eyes_have_the_focus_of_the_eye_between_them(engine: clfractal.Engine) -> None:
    scene = ball(STEREO, focus="auto")
    job = engine.prepare(scene)
    wide = 2 * 3 * math.tan(math.radians(25)) * SIZE[0] / SIZE[1]
    expected = wide * 0.7 / 0.6 - BALL_RADIUS  # the viewer sits where the screen wants it
    assert [view.camera.focus_distance for view in job.views] == pytest.approx([expected] * 2, abs=2e-3)
    seen, eye = seen_by(scene, "left")
    assert engine.preview.depth(seen, (0.5, 0.5), eye) != job.views[0].camera.focus_distance


def test_regions_and_headers_give_the_same_bits(engine: clfractal.Engine) -> None:
    """Of the scene, of a part of it, and of the scene in the picture's header, which has numbers."""
    scene = ball("output.exposure=auto", focus_on=[0.4, 0.4])
    framebuffer = engine.render(scene, samples=2)
    part = engine.render(scene, samples=2, region=(30, 20, 20, 10))
    again = engine.render(clfractal.load_scene(framebuffer.header["scene"]), samples=2)
    for name in "RGBZ":
        np.testing.assert_array_equal(part[name], framebuffer[name][20:30, 30:50])
        np.testing.assert_array_equal(again[name], framebuffer[name])
    header = clfractal.load_scene(framebuffer.header["scene"])
    assert is_settled(header)
    assert header.output.exposure == framebuffer.header["exposure"] == part.header["exposure"]
    assert again.header["scene"] == framebuffer.header["scene"]


def lit(intensity: float, **sections: Any) -> clfractal.Scene:
    """A white sphere and a box in the light of the viewer's own lamp; the background must not count."""
    lights = [{"direction": [0, 1, 0], "intensity": intensity, "shadow": False}]
    return scene_of(
        SOLIDS,
        {"position": [0, -5, 1]},
        SIZE,
        lights=lights,
        output={"exposure": "auto"},
        background={"top": [50, 50, 50], "bottom": [50, 50, 50]},
        **sections,
    )


def test_twice_the_light_needs_a_stop_less(engine: clfractal.Engine) -> None:
    one, four = (engine.settled(lit(intensity)).output.stops for intensity in (1, 4))
    assert one - four == pytest.approx(2, abs=0.02)


def test_the_brightest_hundredth_begins_near_white(engine: clfractal.Engine) -> None:
    framebuffer = engine.render(lit(0.3))
    seen = framebuffer["A"] > 0.5
    assert seen.mean() > 0.05
    bright = 0.2126 * framebuffer["R"] + 0.7152 * framebuffer["G"] + 0.0722 * framebuffer["B"]
    shown = bright[seen] * 2.0 ** framebuffer.header["exposure"]
    assert float(np.quantile(shown, 0.99)) == pytest.approx(HIGHLIGHT, rel=0.03)


def framebuffer_of(bright: Any) -> clfractal.Framebuffer:
    """A framebuffer of one row, grey, wholly covered."""
    row = np.asarray(bright, np.float32)[None]
    framebuffer = clfractal.Framebuffer("RGBA", (row.shape[1], 1))
    framebuffer.fill({"R": row, "G": row, "B": row, "A": np.ones_like(row)})
    return framebuffer


def test_sparks_do_not_darken_the_rest() -> None:
    """Three of a hundred pixels are ten thousand times as bright: the rest stays visible."""
    bright = np.full(100, 0.1)
    bright[:3] = 1000.0
    stops = exposure_of([framebuffer_of(bright)])
    mean = math.exp((97 * math.log(0.1) + 3 * math.log(1000)) / 100)
    assert stops == pytest.approx(math.log2(0.045 / mean), abs=0.006)
    assert 0.1 * 2**stops > 0.02
    assert exposure_of([framebuffer_of(np.zeros(9))]) == 0
    assert exposure_of([framebuffer_of([0.75, np.inf, np.nan])]) == pytest.approx(0, abs=0.006)
