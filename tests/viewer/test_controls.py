"""The pointer in the picture, on a real session: what is under it stays there, clicks centre, focus and mark."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from clfractal.camera.views import scene_view
from clfractal.device.select import Device
from clfractal.viewer.controls import ALT, CONTROL, LEFT, MIDDLE, RIGHT, SHIFT
from clfractal.viewer.motion import TRANSITION_SECONDS
from clfractal.viewer.pointer import project
from tests.viewer.hands import VIEW, Hand
from tests.viewer.sessions import BALL, scene_of, wait_for

PLANE = "renderer={type: cut_plane, plane: {width: 3, height: 2.25}}"


@pytest.fixture
def hand(device: Device, request: pytest.FixtureRequest) -> Iterator[Hand]:
    made = Hand(scene_of(BALL, *getattr(request, "param", ())), device)
    yield made
    made.close()


@pytest.mark.parametrize(
    "hand", [(), ("camera={projection: orthographic, position: [0, -4, 0], height: 3}",)], indirect=True
)
def test_panning_keeps_the_point_under_the_pointer(hand: Hand) -> None:
    start, end = (60.0, 50.0), (75.0, 33.0)
    aim = hand.aim(*start)
    hand.drag(RIGHT, start, end)
    assert hand.at(aim.point) == pytest.approx(end, abs=0.01)
    assert hand.studio.history.depth("camera") == (1, 0)
    hand.studio.undo("camera")
    assert hand.at(aim.point) == pytest.approx(start, abs=0.01)


@pytest.mark.parametrize("place", [(60.0, 50.0), (3.0, 4.0)])
def test_orbiting_keeps_the_distance_to_the_pivot(place: tuple[float, float], hand: Hand) -> None:
    aim = hand.aim(*place)
    before = hand.studio.scene.camera
    pivot = np.array(aim.pivot)
    hand.drag(LEFT, place, (place[0] + 30, place[1] + 12))
    after = hand.studio.scene.camera
    assert after.position != before.position
    distances = [np.linalg.norm(np.array(camera.position) - pivot) for camera in (before, after)]
    assert distances[0] == pytest.approx(distances[1], rel=1e-6)
    assert hand.studio.history.depth("camera") == (1, 0)


# Targets far behind the body, before it, and beside it, as flights leave them.
_FLOWN = [
    ("camera={position: [0, -4, 0], target: [0, 60, 0]}",),
    ("camera={position: [0, -4, 0], target: [0, -3.9, 0]}",),
    ("camera={position: [0, -4, 0], target: [-2.2, 6, 0]}",),
    ("camera={projection: orthographic, position: [0.9, -4, 0], target: [0.9, 60, 0], height: 4}",),
]


@pytest.mark.parametrize("hand", _FLOWN, ids=["behind", "before", "beside", "flat"], indirect=True)
@pytest.mark.parametrize("way", [(1, 0), (0, 1)])
def test_a_drag_beside_the_body_keeps_it_in_view(way: tuple[int, int], hand: Hand) -> None:
    place = (3.0, 3.0)
    aim = hand.aim(*place)
    assert aim.point is None
    size, whole = np.array(VIEW), min(VIEW)  # a drag over the smaller side turns by half a turn
    for share in (0.25, 0.5, 0.75, 1.0, 1.5):
        end = place[0] + share * whole * way[0], place[1] + share * whole * way[1]
        hand.drag(LEFT, place, end)
        x, y, depth = project(scene_view(hand.studio.shown_scene), np.zeros(3), VIEW)
        assert depth > 0
        assert np.all((np.array([x, y]) > 0.04 * size) & (np.array([x, y]) < 0.96 * size)), share
        hand.studio.undo("camera")


@pytest.mark.parametrize("steps", [3.0, -2.0])
def test_the_wheel_zooms_to_the_pointer(steps: float, hand: Hand) -> None:
    place = (70.0, 40.0)
    aim = hand.aim(*place)
    distance = np.linalg.norm(np.array(hand.studio.scene.camera.position) - aim.point)
    hand.controls.wheel(steps, 0, aim, 1.0)
    assert hand.at(aim.point) == pytest.approx(place, abs=0.01)
    now = np.linalg.norm(np.array(hand.studio.scene.camera.position) - aim.point)
    assert (now < distance) == (steps > 0)
    hand.controls.rest(1.1)
    hand.controls.wheel(steps, 0, hand.aim(*place), 1.2)
    assert hand.studio.history.depth("camera") == (1, 0)
    hand.controls.rest(2.0)
    hand.controls.wheel(steps, SHIFT, hand.aim(*place), 2.1)
    assert hand.studio.history.depth("camera") == (2, 0)
    hand.controls.wheel(float("nan"), 0, hand.aim(*place), 2.2)
    hand.controls.wheel(1.0, 0, None, 2.2)


def test_a_double_click_centres(hand: Hand) -> None:
    place = (80.0, 40.0)
    aim = hand.aim(*place)
    hand.click(place)
    hand.click(place, after=0.2)
    assert hand.motion.active
    for share in (0.2, 0.7, 1.1):
        hand.motion.step(hand.now + share * TRANSITION_SECONDS, 0.01)
    assert not hand.motion.active
    assert hand.at(aim.point) == pytest.approx((VIEW[0] / 2, VIEW[1] / 2), abs=0.01)
    assert hand.studio.scene.camera.target == pytest.approx(aim.point, abs=1e-6)
    assert hand.studio.history.depth("camera") == (1, 0)


def test_two_slow_clicks_do_nothing(hand: Hand) -> None:
    before = hand.studio.scene
    hand.click((80.0, 40.0))
    hand.click((80.0, 40.0), after=1.0)
    hand.click((95.0, 40.0), after=0.1)
    assert hand.studio.scene is before
    assert not hand.motion.active


def test_a_click_sets_what_is_sharp(hand: Hand) -> None:
    aim = hand.aim(60, 50)
    hand.controls.focusing = True
    hand.click((60.0, 50.0))
    assert not hand.controls.focusing
    assert hand.studio.value("camera.focus_distance") == pytest.approx(aim.depth)
    hand.click((75.0, 50.0), CONTROL)
    assert hand.studio.value("camera.focus_distance") != pytest.approx(aim.depth, abs=1e-6)
    hand.click((2.0, 2.0), CONTROL)
    assert hand.studio.messages[-1].wrong


def test_a_rectangle_is_refined(hand: Hand) -> None:
    hand.controls.choosing_region = True
    hand.drag(LEFT, (20.0, 70.0), (60.0, 30.0))
    assert hand.studio.region == (20, 30, 40, 40)
    assert not hand.controls.choosing_region
    hand.drag(LEFT, (100.0, 90.0), (500.0, 500.0), ALT)
    assert hand.studio.region == (100, 90, 28, 6)
    hand.drag(LEFT, (20.0, 70.0), (22.0, 71.0), ALT)
    assert hand.studio.region is None


@pytest.mark.parametrize(
    ("hand", "start", "end", "region"),
    [
        (("stereo={mode: split}",), (70.0, 10.0), (90.0, 30.0), (6, 10, 20, 20)),
        (("stereo={mode: over_under_half}",), (10.0, 58.0), (30.0, 78.0), (10, 10, 20, 20)),
        (("stereo={mode: rows}",), (10.0, 12.0), (30.0, 32.0), (10, 12, 20, 20)),
    ],
    indirect=["hand"],
)
def test_a_rectangle_over_the_second_eyes_picture(
    hand: Hand, start: tuple[float, float], end: tuple[float, float], region: tuple[int, int, int, int]
) -> None:
    """It is counted in that eye's own pixels."""
    hand.controls.choosing_region = True
    hand.drag(LEFT, start, end)
    assert hand.studio.region == region


def test_escape_ends_what_is_under_way(hand: Hand) -> None:
    assert not hand.controls.cancel()
    hand.controls.choosing_region = True
    hand.controls.press(LEFT, 0, (10, 10), hand.aim(10, 10), 5.0)
    hand.controls.move((40, 40))
    assert hand.controls.cancel()
    hand.controls.release((40, 40))
    assert hand.studio.region is None
    assert not hand.controls.dragging


@pytest.mark.parametrize("hand", [(PLANE,)], indirect=True)
def test_a_plane_is_panned_turned_and_zoomed(hand: Hand) -> None:
    def plane() -> object:
        return hand.studio.scene.renderer.plane  # type: ignore[union-attr]

    first = plane()
    hand.drag(LEFT, (60.0, 50.0), (60.0 + 128 / 3, 50.0))
    center = np.array(hand.studio.value("renderer.plane.center"))
    assert np.linalg.norm(center) == pytest.approx(1.0, rel=1e-6)
    hand.drag(MIDDLE, (60.0, 50.0), (80.0, 50.0))
    assert plane() != first
    hand.drag(RIGHT, (100.0, 50.0), (60.0, 90.0))
    assert hand.studio.history.depth("scene") == (3, 0)
    height = hand.studio.scene.renderer.plane.placed.height  # type: ignore[union-attr]
    hand.controls.wheel(2.0, 0, hand.aim(30, 30), 1.0)
    assert hand.studio.scene.renderer.plane.placed.height == pytest.approx(height * 0.88**2)  # type: ignore[union-attr]
    for _ in range(4):
        hand.studio.undo("scene")
    assert plane() == first


def test_a_light_is_dragged(hand: Hand) -> None:
    before = hand.studio.scene.lights[0]
    hand.drag(LEFT, (64.0, 48.0), (80.0, 30.0), SHIFT)
    assert hand.studio.scene.lights[0] != before
    assert hand.studio.history.depth("scene") == (1, 0)


@pytest.mark.parametrize(
    "hand", [("renderer={type: volume, resolution: 16}", "coloring.by=solid")], indirect=True
)
def test_the_zoom_box_is_moved_applied_and_stepped_back(hand: Hand) -> None:
    hand.controls.mark()
    box = hand.controls.box
    assert box is not None
    hand.drag(LEFT, (60.0, 50.0), (70.0, 50.0))
    assert hand.controls.box != box
    small = hand.controls.box
    hand.controls.wheel(1.0, 0, hand.aim(60, 50), 1.0)
    assert hand.controls.box != small
    hand.controls.apply_box()
    assert len(hand.studio.value("renderer.zoom")) == 1
    wait_for(lambda: hand.studio.session.idle)
    assert hand.studio.session.problem is None
    hand.controls.step_back()
    assert hand.studio.value("renderer.zoom") == []
    hand.controls.step_back()


def test_nothing_happens_outside_the_picture(hand: Hand) -> None:
    before = hand.studio.scene
    hand.controls.press(LEFT, 0, (-5, -5), None, 1.0)
    hand.controls.move((50, 50))
    hand.controls.release((50, 50))
    assert hand.studio.scene is before


def test_a_click_that_hardly_moves_is_no_drag(hand: Hand) -> None:
    before = hand.studio.scene
    hand.drag(LEFT, (60.0, 50.0), (61.0, 50.5))
    assert hand.studio.scene is before
    assert hand.studio.history.depth("camera") == (0, 0)


LAYOUT = "layout={columns: 2, views: [{camera: {position: [4, 0, 0]}}, {}]}"


@pytest.mark.parametrize("hand", [(LAYOUT,)], indirect=True)
def test_each_view_of_a_layout_moves_its_own_camera(hand: Hand) -> None:
    own, common = hand.studio.value("layout.views.0.camera"), hand.studio.value("camera")
    hand.drag(RIGHT, (31.0, 48.0), (40.0, 48.0))
    assert hand.studio.value("layout.views.0.camera") != own
    assert hand.studio.value("camera") == common
    moved = hand.studio.value("layout.views.0.camera")
    hand.drag(RIGHT, (96.0, 48.0), (100.0, 48.0))
    assert hand.studio.value("camera") != common
    assert hand.studio.value("layout.views.0.camera") == moved


def test_the_wheel_beside_the_body_zooms_at_the_targets_distance(hand: Hand) -> None:
    before = hand.studio.scene.camera
    hand.controls.wheel(1.0, 0, hand.aim(3.0, 3.0), 1.0)
    after = hand.studio.scene.camera
    nearer = math.dist(after.position, after.target)
    assert nearer == pytest.approx(0.88 * math.dist(before.position, before.target))
