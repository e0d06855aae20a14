"""Views that a key chooses, and transitions between cameras."""

from __future__ import annotations

from math import tan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.camera.views import camera_view
from clfractal.scene.parts import AnyCamera, PerspectiveCamera
from clfractal.scene.stance import Extent
from clfractal.viewer import navigation
from clfractal.viewer.pose import pose_of, rotation, turned_about
from clfractal.viewer.standard_views import SIDES, Side
from clfractal.viewer.transition import eased
from tests.viewer.cameras import (
    SIZE,
    assert_same_pixel,
    assert_valid,
    cameras,
    numbers,
    orthographic,
    perspective,
    places,
    point_under,
    seen,
)


@given(
    cameras(),
    st.tuples(*[numbers(-5, 5)] * 3),
    numbers(0.001, 100),
    st.sampled_from([(640, 360), (200, 900)]),
)
def test_a_framed_ball_fills_nine_tenths_of_the_smaller_side(
    camera: AnyCamera, center: tuple[float, float, float], radius: float, size: tuple[int, int]
) -> None:
    framed = navigation.frame_all(camera, Extent(center, radius), size)
    view = camera_view(framed, *size)
    # Where rays touch the ball: on the cone from the eye, at a right angle to the radius.
    distance = pose_of(framed).distance
    cosine = radius / distance if view.eye is not None else 0.0
    sine = np.sqrt(1 - cosine**2)
    for direction, middle, axis in ((view.side, size[0] / 2, 0), (view.up, size[1] / 2, 1)):
        touched = np.array(center) + radius * (-cosine * view.axis + sine * direction)
        place = navigation.project(view, touched, size)
        assert abs(place[axis] - middle) == pytest.approx(0.45 * min(size), rel=1e-9)
    assert distance > radius
    assert framed.up == camera.up


@pytest.mark.parametrize("side", list(SIDES))
@given(camera=cameras())
@settings(max_examples=20)
def test_the_six_views(side: Side, camera: AnyCamera) -> None:
    moved = navigation.axis_view(camera, side, SIZE, Extent((1.0, 2.0, 3.0), 2.0))
    axis, up = SIDES[side]
    pose = pose_of(moved)
    np.testing.assert_allclose(pose.axis, axis, atol=1e-12)
    np.testing.assert_allclose(pose.up, up, atol=1e-12)
    np.testing.assert_allclose(moved.target, (1, 2, 3), atol=1e-12)
    kept = navigation.axis_view(camera, side, SIZE)
    assert kept.target == camera.target
    assert pose_of(kept).distance == pytest.approx(pose_of(camera).distance, rel=1e-9)


def test_the_front_has_x_to_the_right_and_opposite_sides_mirror_it() -> None:
    camera = perspective()
    rights = {side: pose_of(navigation.axis_view(camera, side, SIZE)).side for side in SIDES}
    expected: dict[Side, tuple[float, float, float]] = {
        "front": (1.0, 0.0, 0.0),
        "back": (-1.0, 0.0, 0.0),
        "top": (1.0, 0.0, 0.0),
        "bottom": (1.0, 0.0, 0.0),
        "right": (0.0, 1.0, 0.0),
        "left": (0.0, -1.0, 0.0),
    }
    for side, right in expected.items():
        np.testing.assert_allclose(rights[side], right, atol=1e-12)
    # From the right side one sees the side where x is large.
    assert navigation.axis_view(camera, "right", SIZE).position[0] > 0


@given(cameras())
def test_the_other_projection_keeps_the_size_at_the_target(camera: AnyCamera) -> None:
    distance = pose_of(camera).distance
    points = [point_under(camera, place, 1.0) for place in [(0, 0), (100, 300), (640, 200)]]
    other: AnyCamera
    if isinstance(camera, PerspectiveCamera):
        other = navigation.to_orthographic(camera)
        again: AnyCamera = navigation.to_perspective(other, like=camera)
        stepped = navigation.to_orthographic(camera, (camera.target, 2 * distance))
        assert seen(stepped, camera.target)[2] == pytest.approx(2 * distance, rel=1e-9)
        assert navigation.to_perspective(stepped, like=camera).fov == camera.fov
    else:
        other = navigation.to_perspective(camera, 60.0)
        again = navigation.to_orthographic(other)
        assert other.fov == 60.0
    for point in points:
        assert_same_pixel(seen(other, point), seen(camera, point))
        assert_same_pixel(seen(again, point), seen(camera, point))
    if isinstance(camera, PerspectiveCamera):
        np.testing.assert_allclose(again.position, camera.position, atol=1e-11)


def test_a_projection_without_room_for_the_eye_widens_its_angle() -> None:
    camera = orthographic(position=(0.0, -10.0, 0.0), height=1e6)
    eye = navigation.to_perspective(camera, 1.0)
    assert_valid(eye)
    assert 2 * pose_of(eye).distance * tan(np.radians(eye.fov) / 2) == pytest.approx(1e6)
    assert eye.fov > 50


def test_the_lens_survives_the_other_projection() -> None:
    camera = perspective(fov=20, f_number=2.0, focus_distance=1.5, sensor_height=0.03)
    assert navigation.to_perspective(navigation.to_orthographic(camera), like=camera) == camera


# Transitions


def both(camera: AnyCamera, other: AnyCamera) -> bool:
    return type(camera) is type(other)


@given(cameras(), cameras(), numbers(0, 1))
def test_transitions_begin_and_end_exactly_and_are_valid(a: AnyCamera, b: AnyCamera, t: float) -> None:
    assert navigation.interpolated(a, b, 0.0) == a
    assert navigation.interpolated(a, b, 1.0) == b
    between = navigation.interpolated(a, b, t)
    assert_valid(between)
    if both(a, b) and 0 < t < 1:
        near = navigation.interpolated(a, b, 1e-9)
        np.testing.assert_allclose(near.position, a.position, atol=1e-5)
        np.testing.assert_allclose(pose_of(near).up, pose_of(a).up, atol=1e-6)
        near = navigation.interpolated(a, b, 1 - 1e-9)
        np.testing.assert_allclose(near.position, b.position, atol=1e-5)
        np.testing.assert_allclose(pose_of(near).up, pose_of(b).up, atol=1e-6)


@given(cameras(), places(), numbers(0.5, 2), numbers(-5, 5), numbers(0, 1))
def test_a_transition_of_a_zoom_keeps_the_point_and_grows_exponentially(
    camera: AnyCamera, place: tuple[float, float], share: float, power: float, t: float
) -> None:
    factor = 2.0**power
    depth = share * pose_of(camera).distance
    point = point_under(camera, place, share)
    there = navigation.zoom_to(camera, *place, SIZE, factor, depth)
    between = navigation.interpolated(camera, there, t)
    assert_same_pixel(seen(between, point), place)
    beside = point_under(camera, (place[0] + 30, place[1]), share)
    if isinstance(camera, PerspectiveCamera):
        assert seen(between, beside)[0] - place[0] == pytest.approx(30 / factor**t, rel=1e-6)


@given(cameras(), st.sampled_from(list(SIDES)), numbers(0, 1))
def test_a_transition_turns_about_one_axis_evenly(camera: AnyCamera, side: Side, t: float) -> None:
    there = navigation.axis_view(camera, side, SIZE)
    between = navigation.interpolated(camera, there, t)

    def frame(of: AnyCamera) -> np.ndarray:
        pose = pose_of(of)
        return np.stack([pose.side, pose.up, pose.axis])

    def angle(a: np.ndarray, b: np.ndarray) -> float:
        return 2 * float(np.arcsin(min(np.linalg.norm(a - b) / np.sqrt(8), 1.0)))

    whole = angle(frame(camera), frame(there))
    assert angle(frame(camera), frame(between)) == pytest.approx(t * whole, abs=1e-6)
    assert angle(frame(between), frame(there)) == pytest.approx((1 - t) * whole, abs=1e-6)


@given(
    cameras(), numbers(-1e-6, 1e-6), numbers(0.1, 0.9), st.sampled_from([(0.0, 0.0, 1.0), (1.0, 2.0, 3.0)])
)
def test_a_transition_by_half_a_turn_keeps_its_axis(
    camera: AnyCamera, off: float, t: float, about: tuple[float, float, float]
) -> None:
    axis = np.array(about) / np.linalg.norm(about)
    pose = pose_of(camera)
    there = turned_about(
        camera, camera.target, rotation(axis, np.pi + off), rotation(axis, np.pi + off) @ pose.up
    )
    between = pose_of(navigation.interpolated(camera, there, t))
    # A turn about the axis keeps what every vector has along it.
    for name in ("side", "up", "axis"):
        assert getattr(between, name) @ axis == pytest.approx(getattr(pose, name) @ axis, abs=1e-7)


@given(numbers(-1, 2))
def test_easing_is_within_its_ends_and_symmetric(t: float) -> None:
    assert 0 <= eased(t) <= 1
    assert eased(1 - t) == pytest.approx(1 - eased(t), abs=1e-12)
