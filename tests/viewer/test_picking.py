"""What lies under the pointer, in every way of showing: a point of the ball is on the ball, where the pointer is."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.engine.show import Look
from clfractal.images.modes import eye_at
from clfractal.scene.model import Scene
from clfractal.scene.stereo import Mode, Stereo
from clfractal.viewer.aim import aimed
from clfractal.viewer.display import Shown
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.picking import picked
from clfractal.viewer.pointer import project
from clfractal.viewer.viewport import image_of, render_key
from tests.render.shots import BALL_RADIUS
from tests.viewer.sessions import BALL, scene_of, session_on, shown_frame

WINDOW = (128, 96)
MODES = (None, *get_args(Mode))
STEREO = "stereo={screen_width: 0.5, screen_distance: 0.7, mode: %s, swap: %s}"


def in_window(mode: str | None, *overrides: str, swap: bool = False) -> Scene:
    """A scene of the ball as a window renders it."""
    stereo = () if mode is None else (STEREO % (mode, str(swap).lower()),)
    # (Rays end where the ball is nearer than a part of a pixel.)
    stereo = (*stereo, "renderer.detail=0.02")
    scene = scene_of(BALL, *stereo, *overrides)
    width, height = image_of(scene.stereo, WINDOW)
    return scene_of(BALL, *stereo, *overrides, f"image.width={width}", f"image.height={height}")


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("mode", MODES)
def test_a_point_of_the_ball_is_on_the_ball(mode: str | None, swap: bool, device: Device) -> None:
    """And the eye whose picture is there sees it in that place; in both halves, where there are two."""
    scene = in_window(mode, swap=swap)
    halves = {"split": (2, 1), "split_half": (2, 1), "pair": (2, 1), "multi_view": (2, 1)}
    halves |= {"over_under": (1, 2), "over_under_half": (1, 2)}
    across, down = halves.get(mode or "", (1, 1))
    eyes = set()
    with session_on(device) as watch:
        frame = watch.finished(render_key(scene))
        look = Look(0.0, scene.stereo)
        shown, _ = shown_frame(device, watch, frame, look)
        width, height = frame.arrangement.size(look)
        hits = 0
        for place in np.random.default_rng(1).random((60, 2)):
            # Near the middle of each half: the ball's rim is steep.
            half = place * (across, down)
            inside = np.array([0.5, 0.5]) + 0.25 * (half % 1 - 0.5)
            x, y = (half // 1 + inside) / (across, down) * (width, height)
            x, y = np.floor(x) + 0.5, np.floor(y) + 0.5
            found = shown_pick(shown, x, y)
            assert found is not None
            if found.point is None:
                continue
            hits += 1
            assert np.linalg.norm(found.point) == pytest.approx(BALL_RADIUS, abs=4e-3)
            at = project(found.camera, np.array(found.point), found.size)
            assert (at[0], at[1]) == pytest.approx((found.x, found.y), abs=1e-2)
            if found.view.eye.name != "middle":
                eyes.add(found.view.eye.name)
        assert hits > 50
    if across * down == 2:
        assert eyes == {"left", "right"}
    elif mode in ("left", "right"):
        assert eyes == {mode}


def shown_pick(shown: Shown, x: float, y: float) -> Any:
    """What is there; not typed as optional, because most of the tests know that something is."""
    return picked(shown, x, y)


@pytest.mark.parametrize("swap", [False, True])
def test_halves_belong_to_the_eyes_that_are_shown_there(swap: bool) -> None:
    stereo = Stereo.model_validate({"mode": "split", "swap": swap})
    assert eye_at(stereo, (50, 40), 10, 20) == (int(swap), 10, 20)
    assert eye_at(stereo, (50, 40), 60, 20) == (int(not swap), 10, 20)
    below = Stereo.model_validate({"mode": "over_under_half", "swap": swap})
    assert eye_at(below, (50, 40), 10, 19) == (int(swap), 10, 19)
    assert eye_at(below, (50, 40), 10, 20) == (int(not swap), 10, 0)


def test_nothing_is_hit_beside_the_ball_and_nothing_outside(device: Device) -> None:
    with session_on(device) as watch:
        frame = watch.finished(in_window(None))
        shown, _ = shown_frame(device, watch, frame, Look())
    sky = shown_pick(shown, 2, 2)
    assert sky is not None
    assert sky.point is None
    assert np.isinf(sky.depth)
    for x, y in ((-1, 5), (5, -1), (WINDOW[0], 5), (5, WINDOW[1])):
        assert shown_pick(shown, x, y) is None


def test_coarse_pictures_are_picked_too(device: Device) -> None:
    with session_on(device, Pacing(seconds_per_pixel=1e-4)) as watch:
        watch.pauses = lambda frame: True
        watch.session.request(in_window(None, "camera.fov=40"), moving=True)
        watch.shows(lambda frame: True)
        frame = watch.rest()
        assert frame.divider > 1
        shown, _ = shown_frame(device, watch, frame, Look())
        found = shown_pick(shown, 64.5, 48.5)
    assert found.point is not None
    assert np.linalg.norm(found.point) == pytest.approx(BALL_RADIUS, abs=0.03)


def test_views_of_a_layout_are_told_apart(device: Device) -> None:
    layout = (
        "layout={columns: 2, gap: 4, views: [{camera: {position: [4, 0, 0]}},"
        " {renderer: {type: cut_plane, plane: {width: 3}}}]}"
    )
    scene = in_window(None, layout)
    with session_on(device) as watch:
        shown, _ = shown_frame(device, watch, watch.finished(scene), Look())
    left, right, gap = (shown_pick(shown, x, 48) for x in (31.5, 96.5, 63.5))
    assert gap is None
    assert left.point == pytest.approx((BALL_RADIUS, 0, 0), abs=0.1)
    assert (left.view.number, right.view.number) == (0, 1)
    first, second = aimed(scene, left), aimed(scene, right)
    assert (first.camera_path, first.plane_path) == ("layout.views.0.camera", "")
    assert (second.camera_path, second.plane_path) == ("camera", "layout.views.1.renderer.plane")
    assert first.camera.position == (4, 0, 0)
    assert second.plane is not None


@pytest.mark.parametrize("mode", ["split_half", "over_under_half", "anaglyph"])
def test_an_aim_is_seen_by_the_eye_between_both(mode: str, device: Device) -> None:
    scene = in_window(mode)
    with session_on(device) as watch:
        shown, _ = shown_frame(device, watch, watch.finished(render_key(scene)), Look(0.0, scene.stereo))
    pick = shown_pick(shown, 30, 30)
    aim = aimed(scene, pick)
    eyes = [np.array(view.camera.eye, float) for view in shown.frame.views]
    assert aim.view.eye is not None
    assert tuple(aim.view.eye) == pytest.approx(tuple(np.mean(eyes, axis=0)), abs=1e-9)
    assert np.linalg.norm(eyes[0] - eyes[1]) > 0.01
