"""Flying: its speed follows the distance to the surface, smoothly, and never goes through it."""

from __future__ import annotations

from math import exp, inf, nan
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.scene.parts import AnyCamera, OrthographicCamera
from clfractal.viewer import flying
from clfractal.viewer.flying import Fly, Key
from clfractal.viewer.pose import pose_of
from tests.viewer.cameras import (
    SIZE,
    assert_valid,
    cameras,
    numbers,
    orthographic,
    perspective,
    seen,
)

KEYS: tuple[Key, ...] = get_args(Key)
held = st.frozensets(st.sampled_from(KEYS), max_size=4)


def fly(
    camera: AnyCamera, keys: set[Key], seconds: float, frames: int, distance: float, state: Fly | None = None
) -> AnyCamera:
    """The camera after some frames at a constant distance."""
    state = state or Fly()
    for _ in range(frames):
        camera = state.step(camera, keys, (0, 0), seconds / frames, distance)
    return camera


@pytest.mark.parametrize(
    ("key", "direction"),
    [
        ("forward", (0, 1, 0)),
        ("back", (0, -1, 0)),
        ("right", (1, 0, 0)),
        ("left", (-1, 0, 0)),
        ("up", (0, 0, 1)),
        ("down", (0, 0, -1)),
    ],
)
def test_keys_fly_along_the_picture(key: Key, direction: tuple[float, float, float]) -> None:
    camera = perspective()
    moved = np.array(fly(camera, {key}, 1.0, 60, 0.1).position) - camera.position
    np.testing.assert_allclose(moved / np.linalg.norm(moved), direction, atol=1e-12)
    assert np.linalg.norm(moved) == pytest.approx(0.1 * flying.SPEED, rel=0.1)


@given(cameras(), numbers(1e-6, 1e3), held)
def test_speed_is_proportional_to_the_distance(camera: AnyCamera, scale: float, keys: frozenset[Key]) -> None:
    if isinstance(camera, OrthographicCamera):
        camera = perspective(position=camera.position, target=camera.target)
    once = np.array(Fly().step(camera, keys, (0, 0), 0.1, 1e-3 * scale).position) - camera.position
    twice = np.array(Fly().step(camera, keys, (0, 0), 0.1, 2e-3 * scale).position) - camera.position
    np.testing.assert_allclose(twice, 2 * once, atol=1e-13)


def test_the_way_does_not_depend_on_the_frame_rate() -> None:
    for seconds in (0.05, 0.2, 1.0):
        few = fly(perspective(), {"forward", "left"}, seconds, 5, 0.2)
        many = fly(perspective(), {"forward", "left"}, seconds, 500, 0.2)
        np.testing.assert_allclose(few.position, many.position, atol=1e-12)


def test_it_starts_and_stops_smoothly_within_a_fifth_of_a_second() -> None:
    state, camera = Fly(), perspective()
    ways = []
    for frame in range(80):
        keys: set[Key] = {"forward"} if frame < 40 else set()
        after = state.step(camera, keys, (0, 0), 0.01, 1.0)
        ways.append(after.position[1] - camera.position[1])
        camera = after
    full = flying.SPEED * 0.01
    assert ways[0] < 0.1 * full
    assert ways[20] == pytest.approx(full, rel=0.06)
    assert max(np.abs(np.diff(ways))) < 0.2 * full
    assert ways[61] < 0.06 * full
    state.step(camera, set(), (0, 0), 0.25, 1.0)
    state.step(camera, set(), (0, 0), 0.25, 1.0)
    assert not state.moving
    assert state.step(camera, set(), (0, 0), 0.01, 1.0) == camera


def test_towards_a_wall_it_slows_down_and_never_arrives() -> None:
    state, camera = (
        Fly(factor=flying.FASTEST),
        perspective(position=(0.0, -1.0, 0.0), target=(0.0, 9.0, 0.0)),
    )
    for _ in range(40):
        before = -camera.position[1]
        camera = state.step(camera, {"forward"}, (0, 0), 0.25, before)
        assert 0.5 * before * (1 - 1e-9) <= -camera.position[1] < before
    assert -camera.position[1] < 1e-9


@given(held, numbers(0, 10), numbers(1e-3, 1e3), numbers(flying.SLOWEST, flying.FASTEST))
def test_a_step_is_at_most_half_the_distance(
    keys: frozenset[Key], seconds: float, distance: float, factor: float
) -> None:
    state, camera = Fly(factor=factor), perspective()
    for _ in range(5):
        after = state.step(camera, keys, (0, 0), seconds, distance)
        way = np.linalg.norm(np.array(after.position) - camera.position)
        assert way <= 0.5 * distance * (1 + 1e-9) + 1e-12
        camera = after


def test_diagonals_are_not_faster_and_opposite_keys_cancel() -> None:
    camera = perspective()
    straight = np.array(fly(camera, {"forward"}, 0.5, 20, 0.1).position) - camera.position
    diagonal = np.array(fly(camera, {"forward", "left", "up"}, 0.5, 20, 0.1).position) - camera.position
    assert np.linalg.norm(diagonal) == pytest.approx(np.linalg.norm(straight))
    assert fly(camera, {"left", "right"}, 0.5, 20, 0.1) == camera


def test_the_wheel_changes_the_speed() -> None:
    state = Fly()
    state.faster(4)
    assert state.factor == pytest.approx(2)
    state.faster(-8)
    assert state.factor == pytest.approx(0.5)
    state.faster(1e9)
    assert state.factor == flying.FASTEST
    state.faster(-1e9)
    assert state.factor == flying.SLOWEST
    state.faster(nan)
    assert state.factor == flying.SLOWEST


def test_without_a_surface_the_last_known_distance_counts_at_first_the_targets() -> None:
    first = Fly().step(perspective(), {"forward"}, (0, 0), 0.1, inf)
    assert first == Fly().step(perspective(), {"forward"}, (0, 0), 0.1, 3.0)
    states = Fly(), Fly()
    cameras = [state.step(perspective(), {"forward"}, (0, 0), 0.1, 0.2) for state in states]
    assert states[0].step(cameras[0], {"forward"}, (0, 0), 0.1, inf) == states[1].step(
        cameras[1], {"forward"}, (0, 0), 0.1, 0.2
    )


def test_the_target_comes_along_with_the_surface() -> None:
    camera = fly(perspective(), {"right"}, 5.0, 300, 1e-4)
    assert pose_of(camera).distance == pytest.approx(1e-4, rel=0.01)
    np.testing.assert_allclose(pose_of(camera).axis, (0, 1, 0), atol=1e-9)
    still = perspective()
    assert Fly().step(still, set(), (0, 0), 1.0, 1e-4) == still


def test_a_surface_nearer_than_any_target_can_be_is_left_again() -> None:
    state, camera = Fly(), perspective()
    for _ in range(300):
        camera = state.step(camera, {"right"}, (0, 0), 0.1, 1e-14)
    for _ in range(100):
        camera = state.step(camera, {"back"}, (0, 0), 0.1, 1e-14)
    assert 1e-12 < pose_of(camera).distance < 1e-10
    assert camera.position[0] > 0
    assert camera.position[1] < perspective().position[1]


# Looking and rolling


@given(cameras(), numbers(-40, 40), numbers(-8, 8))
def test_a_look_to_the_right_and_down_moves_the_picture_the_other_way(
    camera: AnyCamera, right: float, down: float
) -> None:
    for state in (Fly(), Fly(vertical=(0, 0, 1))):
        looked = state.step(camera, set(), (right, down), 1 / 60, 1.0)
        assert looked.position == pytest.approx(camera.position, abs=1e-12)
        before, after = pose_of(camera), pose_of(looked)
        assert pose_of(camera).axis @ after.axis > 0
        if state.vertical is not None:
            assert looked.up == (0.0, 0.0, 1.0)
            turned = np.arctan2(before.axis[0], before.axis[1]) + np.radians(right)
            assert np.sin(np.arctan2(after.axis[0], after.axis[1]) - turned) == pytest.approx(0, abs=1e-9)
            dropped = np.degrees(np.arcsin(before.axis[2]) - np.arcsin(after.axis[2]))
            assert dropped == pytest.approx(down, abs=1e-6)
        elif right and abs(right) > 1e-6:
            assert (after.axis @ before.side > 0) == (right > 0)


def test_a_head_cannot_look_over_the_pole() -> None:
    camera = Fly(vertical=(0, 0, 1)).step(perspective(), set(), (0, -500), 1 / 60, 1.0)
    assert pose_of(camera).axis[2] == pytest.approx(np.sin(np.radians(89.9)))


def test_roll_right_turns_the_camera_clockwise() -> None:
    camera = fly(perspective(), {"roll_right"}, 0.5, 30, 1.0)
    assert camera.position == perspective().position
    x, y, _ = seen(camera, (0.5, 0, 0))
    assert x > SIZE[0] / 2
    assert y < SIZE[1] / 2 - 10
    pose = pose_of(camera)
    angle = np.degrees(np.arctan2(pose.up[0], pose.up[2]))
    # The way of a pace that approaches the full one exponentially.
    ease = 0.2 / 3
    assert angle == pytest.approx(flying.ROLL_SPEED * (0.5 - ease * (1 - exp(-0.5 / ease))), rel=1e-9)
    back = fly(camera, {"roll_left"}, 0.5, 30, 1.0)
    np.testing.assert_allclose(pose_of(back).up, (0, 0, 1), atol=1e-9)


def test_an_orthographic_camera_zooms_instead() -> None:
    camera = orthographic(height=2.0)
    near = fly(camera, {"forward"}, 1.0, 60, 5.0)
    assert isinstance(near, OrthographicCamera)
    ease = 0.2 / 3
    assert near.height == pytest.approx(2 * exp(-flying.SPEED * (1 - ease * (1 - exp(-1 / ease)))), rel=1e-9)
    assert near.position == pytest.approx(camera.position, abs=1e-12)
    aside = fly(camera, {"right"}, 1.0, 60, 5.0)
    assert aside.position[0] == pytest.approx(2 * flying.SPEED * (1 - ease), rel=1e-3)
    assert aside.position[1:] == pytest.approx(camera.position[1:], abs=1e-12)


wild = st.one_of(st.floats(), numbers(-100, 100))


@given(cameras(), st.lists(st.tuples(held, wild, wild, wild, wild, wild), max_size=30), st.booleans())
@settings(deadline=None)
def test_every_camera_is_valid_whatever_is_held(
    camera: AnyCamera,
    moments: list[tuple[frozenset[Key], float, float, float, float, float]],
    upright: bool,
) -> None:
    state = Fly(vertical=(0, 0, 1) if upright else None)
    for keys, right, down, seconds, distance, wheel in moments:
        state.faster(wheel)
        camera = state.step(camera, keys, (right, down), seconds, distance)
        assert_valid(camera)
