"""Moves of cameras: what is under the pointer stays there, and every camera is a valid one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import hypot, inf, nan

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from clfractal.camera.views import View, camera_view, eye_view, middle_view
from clfractal.scene.parts import AnyCamera, PerspectiveCamera
from clfractal.scene.stance import Extent
from clfractal.scene.stereo import Eye, Stereo
from clfractal.viewer import navigation
from clfractal.viewer.pose import Style, pose_of
from clfractal.viewer.standard_views import SIDES, Side
from tests.viewer.cameras import (
    SIZE,
    assert_same_pixel,
    assert_same_place,
    assert_valid,
    cameras,
    numbers,
    orthographic,
    perspective,
    places,
    point_under,
    seen,
)

Z = (0.0, 0.0, 1.0)
styles: st.SearchStrategy[Style] = st.sampled_from(["turntable", "free"])


# Pixels and points


@given(cameras(), places(), numbers(0.01, 100))
def test_a_point_under_a_place_is_seen_there(
    camera: AnyCamera, place: tuple[float, float], share: float
) -> None:
    depth = share * pose_of(camera).distance
    view = camera_view(camera, *SIZE)
    point = navigation.point_at(view, *place, SIZE, depth)
    assert_same_place(navigation.project(view, point, SIZE), (*place, depth))
    origin, direction = navigation.ray_at(view, *place, SIZE)
    away = point - origin
    np.testing.assert_allclose(np.cross(away, direction), 0, atol=float(1e-10 * np.linalg.norm(away) + 1e-12))


@given(places(), numbers(0.2, 5), st.sampled_from(["left", "right", "middle"]))
def test_points_and_places_agree_for_eyes_beside_the_middle(
    place: tuple[float, float], depth: float, name: str
) -> None:
    stereo = Stereo.model_validate({"screen_width": 0.5, "screen_distance": 0.6})
    middle = middle_view(stereo, perspective(), *SIZE)
    view = eye_view(middle, stereo, Eye(name))  # type: ignore[arg-type]
    point = navigation.point_at(view, *place, SIZE, depth)
    assert_same_place(navigation.project(view, point, SIZE), (*place, depth))


@pytest.mark.parametrize("camera", [perspective(), orthographic()])
def test_depth_is_measured_from_the_views_origin(camera: AnyCamera) -> None:
    view = replace(camera_view(camera, *SIZE), origin=np.array([0.2, -5.0, 0.3]))
    point = navigation.point_at(view, 100, 50, SIZE, 4.0)
    assert point[1] == pytest.approx(-1)
    assert_same_place(navigation.project(view, point, SIZE), (100, 50, 4))


@given(cameras(), st.tuples(*[numbers(-1, 1)] * 3))
def test_places_agree_with_the_matrix_of_the_exr_files(
    camera: AnyCamera, offset: tuple[float, float, float]
) -> None:
    view = camera_view(camera, *SIZE)
    point = np.array(camera.target) + 0.5 * pose_of(camera).distance * np.array(offset)
    x, y, _, w = np.append(point, 1.0) @ view.world_to_ndc()
    assume(w > 0.01)
    assert_same_pixel(seen(camera, point), (x / w * SIZE[0], y / w * SIZE[1]))


def test_a_point_behind_the_eye_is_nowhere() -> None:
    x, y, depth = seen(perspective(), (0, -4, 0))
    assert np.isnan([x, y]).all()
    assert depth == -1


def test_the_middle_of_a_pixel_is_half_a_pixel_from_its_corner() -> None:
    camera = orthographic(height=3.6)
    assert_same_place(seen(camera, (0.005, 0, -0.005)), (320.5, 180.5, 3.0))


# Orbit


@given(cameras(), places(), numbers(0.05, 20), numbers(-300, 300), numbers(-300, 300), styles)
def test_the_pivot_keeps_its_pixel_and_depth(
    camera: AnyCamera, place: tuple[float, float], share: float, dx: float, dy: float, style: Style
) -> None:
    pivot = point_under(camera, place, share)
    moved = navigation.orbit(camera, pivot, dx, dy, SIZE, style)
    assert_valid(moved)
    assert_same_place(seen(moved, pivot), seen(camera, pivot))
    assert pose_of(moved).distance == pytest.approx(pose_of(camera).distance, rel=1e-9)


@pytest.mark.parametrize("style", ["turntable", "free"])
@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.3)])
def test_what_is_in_front_follows_the_pointer(style: Style, up: tuple[float, float, float]) -> None:
    camera = perspective(up=up)
    for vertical in (None, Z):
        if vertical is not None and style == "turntable" and up[0]:
            continue  # a turntable seen from a tilted head moves along its own axis
        front = (0.0, -0.5, 0.0)
        right = navigation.orbit(camera, (0, 0, 0), 5, 0, SIZE, style, vertical=vertical)
        down = navigation.orbit(camera, (0, 0, 0), 0, 5, SIZE, style, vertical=vertical)
        before = seen(camera, front)
        for moved in (right, down):
            assert pose_of(moved).up @ pose_of(camera).up > 0.9
        assert seen(right, front)[0] > before[0] + 1
        assert seen(right, front)[1] == pytest.approx(before[1], abs=0.1)
        assert seen(down, front)[1] > before[1] + 1
        assert seen(down, front)[0] == pytest.approx(before[0], abs=0.1)


@given(cameras(), st.lists(st.tuples(numbers(-2000, 2000), numbers(-2000, 2000)), max_size=30))
def test_a_turntable_keeps_the_horizon_level_and_its_up(
    camera: AnyCamera, drags: list[tuple[float, float]]
) -> None:
    for dx, dy in drags:
        camera = navigation.orbit(camera, camera.target, dx, dy, SIZE)
        pose = pose_of(camera)
        assert camera.up == Z
        assert abs(pose.side[2]) < 1e-9
        assert abs(pose.axis[2]) <= np.sin(np.radians(89.9)) + 1e-9


def test_a_turntable_stops_before_the_pole_and_comes_back() -> None:
    camera = perspective(position=(0.0, -3.0, 0.5))
    above = navigation.orbit(camera, (0, 0, 0), 0, 1e6, SIZE)
    assert pose_of(above).axis[2] == pytest.approx(-np.sin(np.radians(89.9)), abs=1e-12)
    assert above.position[1] < 0
    still = navigation.orbit(above, (0, 0, 0), 0, 50, SIZE)
    np.testing.assert_allclose(still.position, above.position, atol=1e-12)
    below = navigation.orbit(above, (0, 0, 0), 0, -1e6, SIZE)
    assert pose_of(below).axis[2] == pytest.approx(np.sin(np.radians(89.9)), abs=1e-12)
    assert below.position[1] < 0


@pytest.mark.parametrize(("side", "away"), [("top", -40), ("bottom", 40)])
def test_a_turntable_leaves_a_pole_with_a_level_horizon(side: Side, away: float) -> None:
    camera = navigation.axis_view(perspective(), side, SIZE)
    stuck = navigation.orbit(camera, (0, 0, 0), 0, -away, SIZE, vertical=Z)
    np.testing.assert_allclose(stuck.position, camera.position, atol=1e-12)
    left = navigation.orbit(camera, (0, 0, 0), 25, away, SIZE, vertical=Z)
    pose = pose_of(left)
    assert abs(pose.side[2]) < 1e-9
    assert pose.up[2] > 0
    after = navigation.orbit(left, (0, 0, 0), 10, 0, SIZE, vertical=Z)
    assert after.up == Z


@given(cameras(), numbers(-180, 180), numbers(-200, 200))
def test_a_turntable_keeps_the_roll_of_a_rolled_camera(camera: AnyCamera, degrees: float, dx: float) -> None:
    rolled = navigation.roll(camera, degrees)
    moved = navigation.orbit(rolled, camera.target, dx, 0, SIZE, vertical=Z)
    assert pose_of(moved).up[2] == pytest.approx(pose_of(rolled).up[2], abs=1e-8)
    assert pose_of(moved).side[2] == pytest.approx(pose_of(rolled).side[2], abs=1e-8)


@given(cameras(), numbers(-200, 200), numbers(-50, 50), styles)
def test_a_drag_back_undoes_a_drag(camera: AnyCamera, dx: float, dy: float, style: Style) -> None:
    if style == "turntable":
        dy = 0.0
    there = navigation.orbit(camera, (1.0, 2.0, 3.0), dx, dy, SIZE, style)
    back = navigation.orbit(there, (1.0, 2.0, 3.0), -dx, -dy, SIZE, style)
    np.testing.assert_allclose(back.position, camera.position, atol=1e-11)
    np.testing.assert_allclose(pose_of(back).up, pose_of(camera).up, atol=1e-9)


def test_a_free_orbit_in_a_circle_rolls() -> None:
    camera = perspective()
    for dx, dy in [(60, 0), (0, 60), (-60, 0), (0, -60)]:
        camera = navigation.orbit(camera, (0, 0, 0), dx, dy, SIZE, "free")
    assert abs(pose_of(camera).side[2]) > 0.05


def test_half_a_turn_is_a_drag_across_the_smaller_side() -> None:
    moved = navigation.orbit(perspective(), (0, 0, 0), 360, 0, SIZE)
    np.testing.assert_allclose(moved.position, (0, 3, 0), atol=1e-12)


# Pan and zoom


@given(cameras(), places(), numbers(0.05, 20), numbers(-300, 300), numbers(-300, 300))
def test_pan_takes_the_point_along(
    camera: AnyCamera, place: tuple[float, float], share: float, dx: float, dy: float
) -> None:
    point = point_under(camera, place, share)
    moved = navigation.pan(camera, dx, dy, SIZE, share * pose_of(camera).distance)
    assert_same_place(seen(moved, point), np.add(seen(camera, point), (dx, dy, 0)))
    np.testing.assert_allclose(pose_of(moved).axis, pose_of(camera).axis, atol=1e-9)


@given(cameras(), places())
def test_pan_where_nothing_is_moves_the_target(camera: AnyCamera, place: tuple[float, float]) -> None:
    moved = navigation.pan(camera, 13, -7, SIZE, inf)
    assert_same_place(seen(moved, camera.target), np.add(seen(camera, camera.target), (13, -7, 0)))


@given(cameras(), places(), numbers(0.05, 20), numbers(-3, 3))
def test_zoom_keeps_what_is_under_the_pointer(
    camera: AnyCamera, place: tuple[float, float], share: float, power: float
) -> None:
    factor = 2.0**power
    depth = share * pose_of(camera).distance
    point = point_under(camera, place, share)
    near = point_under(camera, (place[0] + 30, place[1]), share)
    moved = navigation.zoom_to(camera, *place, SIZE, factor, depth)
    assert_same_pixel(seen(moved, point), place)
    # Beside it things grow by the factor.
    assert seen(moved, near)[0] - place[0] == pytest.approx(30 / factor, rel=1e-6)
    if isinstance(camera, PerspectiveCamera):
        assert seen(moved, point)[2] == pytest.approx(factor * depth, rel=1e-9)
        assert pose_of(moved).distance == pytest.approx(factor * pose_of(camera).distance, rel=1e-9)
    else:
        assert seen(moved, point)[2] == pytest.approx(depth, rel=1e-9)


def test_a_deep_zoom_ends_before_the_view_is_rounded_away() -> None:
    camera: AnyCamera = perspective(position=(0.3, -3.0, 0.7), target=(0.3, 0.1, 0.2))
    axis = pose_of(camera).axis
    point = np.array(camera.target)
    for _ in range(400):
        camera = navigation.dolly(camera, 0.8, point)
        assert_valid(camera)
        assert pose_of(camera).axis == pytest.approx(axis, abs=1e-4)
    assert pose_of(camera).distance < 1e-10
    for _ in range(400):
        camera = navigation.dolly(camera, 1 / 0.8, point)
    assert_valid(camera)
    assert 1e5 < pose_of(camera).distance < 1e6


@pytest.mark.parametrize("factor", [0.0, -1.0, inf, nan])
def test_a_factor_that_is_none_moves_nothing(factor: float) -> None:
    assert navigation.dolly(perspective(), factor) == perspective()


@given(places(), numbers(0.2, 4), numbers(-20, 20), numbers(0.3, 3))
def test_moves_hold_in_the_view_of_the_eye_between_two(
    place: tuple[float, float], share: float, dx: float, factor: float
) -> None:
    stereo = Stereo.model_validate({"screen_width": 0.5, "screen_distance": 0.6})
    camera = perspective(position=(1.0, -3.0, 1.0))

    def looked(at: PerspectiveCamera) -> View:
        return middle_view(stereo, at, *SIZE)

    view = looked(camera)
    depth = share * float((view.center - view.origin) @ view.axis)
    point = navigation.point_at(view, *place, SIZE, depth)
    zoomed = navigation.zoom_to(camera, *place, SIZE, factor, depth, view=view)
    assert_same_pixel(navigation.project(looked(zoomed), point, SIZE), place)
    panned = navigation.pan(camera, dx, dx, SIZE, depth, view=view)
    assert_same_pixel(navigation.project(looked(panned), point, SIZE), (place[0] + dx, place[1] + dx))


# Centre, roll, level


@given(cameras(), places(), numbers(0.05, 20))
def test_a_centred_point_is_in_the_middle_as_large_as_before(
    camera: AnyCamera, place: tuple[float, float], share: float
) -> None:
    point = point_under(camera, place, share)
    moved = navigation.center_on(camera, point)
    depth = share * pose_of(camera).distance
    assert_same_place(seen(moved, point), (SIZE[0] / 2, SIZE[1] / 2, depth))
    np.testing.assert_allclose(moved.target, point, atol=1e-12)
    np.testing.assert_allclose(pose_of(moved).axis, pose_of(camera).axis, atol=1e-9)


def test_a_point_behind_the_camera_is_centred_at_the_old_distance() -> None:
    moved = navigation.center_on(perspective(), (1, -10, 1))
    np.testing.assert_allclose(moved.target, (1, -10, 1))
    np.testing.assert_allclose(moved.position, (1, -13, 1))


@given(cameras(), numbers(-1000, 1000))
def test_roll_turns_the_picture_anticlockwise(camera: AnyCamera, degrees: float) -> None:
    rolled = navigation.roll(camera, degrees)
    point = point_under(camera, (SIZE[0] / 2 + 100, SIZE[1] / 2), 1.0)
    x, y, _ = seen(rolled, point)
    angle = np.radians(degrees)
    expected = (SIZE[0] / 2 + 100 * np.cos(angle), SIZE[1] / 2 - 100 * np.sin(angle))
    assert_same_pixel((x, y), expected)
    assert hypot(x - SIZE[0] / 2, y - SIZE[1] / 2) == pytest.approx(100)


@given(cameras(), numbers(-179, 179))
def test_a_rolled_camera_can_be_levelled(camera: AnyCamera, degrees: float) -> None:
    level = navigation.levelled(navigation.roll(camera, degrees))
    assert level.up == Z
    assert level.position == camera.position


def test_a_camera_that_looks_down_cannot_be_levelled() -> None:
    camera = navigation.axis_view(perspective(), "top", SIZE)
    assert navigation.levelled(camera) == camera


# Whatever is asked, the camera is valid

wild = st.one_of(
    st.floats(), st.sampled_from([0.0, 1e300, -1e300, 1e-300, inf, -inf, nan, 1e6, -1e6]), numbers(-500, 500)
)
positions = st.tuples(*[st.one_of(numbers(-1e6, 1e6), numbers(-3, 3), st.just(0.0))] * 3)


@st.composite
def any_cameras(draw: st.DrawFn) -> AnyCamera:
    """Every camera that a scene may have."""
    values: dict[str, object] = {
        "position": draw(positions),
        "target": draw(positions),
        "up": draw(positions),
    }
    try:
        if draw(st.booleans()):
            return perspective(**values, fov=draw(numbers(1e-6, 179.9)))
        return orthographic(**values, height=draw(numbers(1e-12, 1e6)))
    except ValueError:
        return perspective()


@st.composite
def moved(draw: st.DrawFn, camera: AnyCamera) -> AnyCamera:
    """The camera after any move with any numbers."""
    a, b, c = draw(wild), draw(wild), draw(wild)
    point = draw(st.one_of(positions, st.tuples(wild, wild, wild)))
    sides = draw(st.one_of(st.none(), st.tuples(wild, wild, wild)))
    shown = Extent(point, abs(a)) if sides is None else Extent.box(point, sides)
    moves: dict[str, Callable[[], AnyCamera]] = {
        "orbit": lambda: navigation.orbit(camera, point, a, b, SIZE, draw(styles)),
        "vertical": lambda: navigation.orbit(camera, point, a, b, SIZE, vertical=Z),
        "pan": lambda: navigation.pan(camera, a, b, SIZE, c),
        "dolly": lambda: navigation.dolly(camera, a, point),
        "zoom_to": lambda: navigation.zoom_to(camera, a, b, SIZE, abs(c), draw(wild)),
        "center_on": lambda: navigation.center_on(camera, point),
        "roll": lambda: navigation.roll(camera, a),
        "level": lambda: navigation.levelled(camera),
        "frame": lambda: navigation.frame_all(camera, shown, SIZE),
        "side": lambda: navigation.axis_view(camera, draw(st.sampled_from(list(SIDES))), SIZE, shown),
        "orthographic": lambda: navigation.to_orthographic(camera, (point, abs(a))),
        "perspective": lambda: navigation.to_perspective(camera, draw(numbers(1e-6, 179))),
        "between": lambda: navigation.interpolated(camera, draw(any_cameras()), a),
    }
    return moves[draw(st.sampled_from(sorted(moves)))]()


@given(any_cameras(), st.data())
@settings(max_examples=150, deadline=None)
def test_every_camera_is_valid_whatever_is_asked(camera: AnyCamera, data: st.DataObject) -> None:
    for _ in range(10):
        camera = data.draw(moved(camera))
        assert_valid(camera)
