"""Moves of cut planes: inverse moves undo each other, points stay under the pointer, and planes keep their keys."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import inf, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.camera.views import plane_view
from clfractal.scene.rectangle import Axis, Placed, Plane
from clfractal.viewer import plane_moves
from clfractal.viewer.navigation import point_at, project
from tests.viewer.cameras import (
    SIZE,
    assert_same_pixel,
    numbers,
    places,
    plane_of,
)

AXES: tuple[Axis, ...] = ("normal", "side", "up", "x", "y", "z")
triples = st.tuples(*[numbers(-3, 3)] * 3)
Keys = set[str]


@st.composite
def planes(draw: st.DrawFn) -> Plane:
    """Planes with every set of keys: by middle and normal, by corners, with transformations."""
    center, angle = draw(triples), draw(numbers(-180, 180))
    width, height = draw(numbers(0.1, 4)), draw(numbers(0.1, 4))
    kind = draw(st.sampled_from(["middle", "corners", "transform"]))
    if kind == "transform":
        return Plane.model_validate(
            {
                "center": center,
                "width": width,
                "height": height,
                "transform": [{"rotate_side": angle}, {"move_up": draw(numbers(-1, 1))}, {"scale": 0.5}],
            }
        )
    normal = draw(triples.filter(lambda vector: np.linalg.norm(vector) > 0.1))
    plane = plane_of(center=center, normal=normal, width=width, height=height)
    if kind == "corners":
        placed = plane.placed
        return plane_of(corners=(placed.at(0, 0), placed.at(1, 0), placed.at(0, 1)))
    return plane


def values(placed: Placed) -> np.ndarray:
    vectors = placed.center + placed.side + placed.up + placed.normal
    return np.array([*vectors, placed.width, placed.height])


def assert_same_plane(found: Plane, expected: Plane | Placed, atol: float = 1e-12) -> None:
    placed = expected.placed if isinstance(expected, Plane) else expected
    np.testing.assert_allclose(values(found.placed), values(placed), rtol=0, atol=atol)


def assert_frame(plane: Plane) -> None:
    """The plane's vectors are perpendicular, of length 1 and right-handed."""
    placed = plane.placed
    frame = np.array([placed.side, placed.up, placed.normal])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)


def written(plane: Plane) -> Keys:
    """The keys that a plane is written with."""
    return {name for name, value in plane.model_dump().items() if value != Plane.model_fields[name].default}


# Fields


@given(planes(), numbers(-2, 2), numbers(-2, 2), numbers(-2, 2))
def test_moves_go_along_the_planes_axes_and_back(plane: Plane, normal: float, side: float, up: float) -> None:
    there = plane_moves.shift(plane, normal=normal, side=side, up=up)
    way = np.array(there.placed.center) - plane.placed.center
    frame = np.array([plane.placed.normal, plane.placed.side, plane.placed.up])
    np.testing.assert_allclose(frame @ way, (normal, side, up), atol=1e-12)
    assert_same_plane(plane_moves.shift(there, normal=-normal, side=-side, up=-up), plane)


@given(planes(), numbers(0.1, 10))
def test_scaling_keeps_the_middle_and_can_be_undone(plane: Plane, factor: float) -> None:
    there = plane_moves.scale(plane, factor)
    np.testing.assert_allclose(there.placed.center, plane.placed.center, atol=1e-12)
    assert there.placed.width == pytest.approx(factor * plane.placed.width)
    assert_same_plane(plane_moves.scale(there, 1 / factor), plane)


@given(planes(), st.sampled_from(AXES), numbers(-400, 400))
def test_rotations_keep_the_frame_and_can_be_undone(plane: Plane, axis: Axis, angle: float) -> None:
    there = plane_moves.rotate(plane, axis, angle)
    assert_frame(there)
    before, after = plane.placed, there.placed
    if axis in ("normal", "side", "up"):
        np.testing.assert_allclose(getattr(after, axis), getattr(before, axis), atol=1e-12)
        np.testing.assert_allclose(after.center, before.center, atol=1e-12)
    else:
        index = "xyz".index(axis)
        for name in ("center", "side", "up", "normal"):
            assert getattr(after, name)[index] == pytest.approx(getattr(before, name)[index], abs=1e-12)
    cosine = np.cos(np.radians(angle))
    turned = np.array([after.side, after.up, after.normal]).T @ np.array(
        [before.side, before.up, before.normal]
    )
    assert np.trace(turned) == pytest.approx(1 + 2 * cosine, abs=1e-9)
    assert_same_plane(plane_moves.rotate(there, axis, -angle), plane)


@given(planes(), st.sampled_from(AXES), numbers(-400, 400))
def test_rotations_in_place_keep_the_middle(plane: Plane, axis: Axis, angle: float) -> None:
    there = plane_moves.rotate_in_place(plane, axis, angle)
    np.testing.assert_allclose(there.placed.center, plane.placed.center, atol=1e-12)
    turned = plane_moves.rotate(plane, axis, angle)
    np.testing.assert_allclose(there.placed.normal, turned.placed.normal, atol=1e-12)
    np.testing.assert_allclose(there.placed.up, turned.placed.up, atol=1e-12)


def test_the_right_hand_rule() -> None:
    turned = plane_moves.rotate(plane_of(normal=(0.0, 0.0, 1.0)), "x", 90)
    np.testing.assert_allclose(turned.placed.normal, (0, -1, 0), atol=1e-12)
    np.testing.assert_allclose(turned.placed.up, (0, 0, 1), atol=1e-12)


@given(planes(), st.lists(st.tuples(st.sampled_from(AXES), numbers(-90, 90)), max_size=40))
@settings(max_examples=40)
def test_many_rotations_keep_the_frame_and_are_undone_backwards(
    plane: Plane, turns: list[tuple[Axis, float]]
) -> None:
    there = plane
    for axis, angle in turns:
        there = plane_moves.rotate(there, axis, angle)
    assert_frame(there)
    for axis, angle in reversed(turns):
        there = plane_moves.rotate(there, axis, -angle)
    assert_same_plane(there, plane, 1e-11)


# By a pointer


@given(planes(), places(), numbers(-100, 100), numbers(-100, 100))
def test_the_picture_follows_the_pointer(
    plane: Plane, place: tuple[float, float], dx: float, dy: float
) -> None:
    point = point_at(plane_view(plane.placed, *SIZE), *place, SIZE, 0.0)
    moved = plane_moves.pan(plane, dx, dy, SIZE)
    found = project(plane_view(moved.placed, *SIZE), point, SIZE)
    assert_same_pixel(found, (place[0] + dx, place[1] + dy))
    assert found[2] == pytest.approx(0, abs=1e-12)
    assert_same_plane(plane_moves.pan(moved, -dx, -dy, SIZE), plane)


@given(planes(), places(), numbers(0.05, 20))
def test_zoom_keeps_the_point_under_the_pointer(
    plane: Plane, place: tuple[float, float], factor: float
) -> None:
    point = point_at(plane_view(plane.placed, *SIZE), *place, SIZE, 0.0)
    there = plane_moves.zoom_to(plane, *place, SIZE, factor)
    assert_same_pixel(project(plane_view(there.placed, *SIZE), point, SIZE), place)
    assert there.placed.width == pytest.approx(factor * plane.placed.width)
    assert_same_plane(plane_moves.zoom_to(there, *place, SIZE, 1 / factor), plane, 1e-11)


@given(planes(), numbers(-170, 170), numbers(10, 170))
def test_the_picture_spins_with_the_pointer(plane: Plane, angle: float, radius: float) -> None:
    def on_circle(degrees: float) -> tuple[float, float]:
        turn = np.radians(degrees)
        return SIZE[0] / 2 + radius * float(np.cos(turn)), SIZE[1] / 2 - radius * float(np.sin(turn))

    start, end = on_circle(20), on_circle(20 + angle)
    point = point_at(plane_view(plane.placed, *SIZE), *start, SIZE, 0.0)
    there = plane_moves.spin(plane, start, end, SIZE)
    assert_same_pixel(project(plane_view(there.placed, *SIZE), point, SIZE), end)
    np.testing.assert_allclose(there.placed.normal, plane.placed.normal, atol=1e-12)


def test_what_is_in_front_of_a_plane_follows_a_tilt() -> None:
    plane = plane_of(width=6.4, height=3.6)
    front = (0.0, 0.0, 1.0)
    right = project(plane_view(plane_moves.tilt(plane, 30, 0, SIZE).placed, *SIZE), front, SIZE)
    down = project(plane_view(plane_moves.tilt(plane, 0, 30, SIZE).placed, *SIZE), front, SIZE)
    moved = 100 * np.sin(np.radians(15))
    assert_same_pixel(right, (SIZE[0] / 2 + moved, SIZE[1] / 2))
    assert_same_pixel(down, (SIZE[0] / 2, SIZE[1] / 2 + moved))


# Keys


@given(planes(), numbers(0.1, 1), st.sampled_from(AXES))
def test_a_plane_keeps_its_keys(plane: Plane, amount: float, axis: Axis) -> None:
    moves = [
        plane_moves.shift(plane, normal=amount, up=-amount),
        plane_moves.scale(plane, amount / 2),
        plane_moves.rotate(plane, axis, 50 * amount),
        plane_moves.pan(plane, 10, 20, SIZE),
    ]
    for moved in moves:
        assert moved != plane
        assert (moved.corners is None) == (plane.corners is None)
        assert bool(moved.transform) == bool(plane.transform)
        if plane.transform:
            assert written(moved) == written(plane)
            assert (moved.center, moved.normal, moved.up) == (plane.center, plane.normal, plane.up)


def test_words_stay_where_they_hold() -> None:
    plane = plane_of(normal=(0.0, -1.0, 1.2), width=2.9, height=2.9)
    moved = plane_moves.zoom_to(plane_moves.shift(plane, normal=0.5), 10, 20, SIZE, 0.5)
    assert (moved.normal, moved.up) == (plane.normal, None)
    upright = plane_of(normal=(0.3, -1.0, 0.55), up=(0.0, 0.0, 1.0))
    assert plane_moves.shift(upright, side=1).up == (0.0, 0.0, 1.0)
    # The horizon of a plane that turns about z stays level, so its words for `up` hold.
    turned = plane_moves.rotate(upright, "z", 90)
    assert turned.up == (0.0, 0.0, 1.0)
    np.testing.assert_allclose(
        np.array(turned.normal) * np.linalg.norm(upright.normal), (1, 0.3, 0.55), atol=1e-12
    )


def test_steps_that_commute_are_joined_and_undone_ones_vanish() -> None:
    plane = Plane.model_validate({"transform": [{"rotate_side": -12}, {"rotate_normal": -12}]})
    turned = plane_moves.rotate(plane, "normal", 5)
    assert [step.model_dump(exclude_none=True) for step in turned.transform] == [
        {"rotate_side": -12},
        {"rotate_normal": -7},
    ]
    moved = plane
    for _ in range(10):
        moved = plane_moves.pan(moved, 3, 4, SIZE)
        moved = plane_moves.zoom_to(moved, 100, 100, SIZE, 0.9)
    names = [next(iter(step.model_dump(exclude_none=True))) for step in moved.transform]
    assert names == ["rotate_side", "rotate_normal", "move_side", "move_up", "scale"]
    back = plane_moves.rotate(plane_moves.rotate(plane, "x", 40), "x", -40)
    assert back == plane


def test_a_long_list_of_steps_becomes_a_middle_and_a_normal() -> None:
    plane = Plane.model_validate({"transform": [{"rotate_side": -12}]})
    moved = plane
    expected = plane.placed
    for _ in range(20):
        moved = plane_moves.tilt(moved, 5, 3, SIZE)
        assert len(moved.transform) <= plane_moves.MOST_STEPS
        expected = plane_moves.tilt(plane_of(normal=expected.normal, up=expected.up), 5, 3, SIZE).placed
    assert not moved.transform
    np.testing.assert_allclose(moved.placed.normal, expected.normal, atol=1e-12)
    np.testing.assert_allclose(moved.placed.up, expected.up, atol=1e-12)


def test_corners_too_near_to_tell_a_right_angle_become_a_middle_and_a_normal() -> None:
    plane = plane_of(corners=((1.0, 0.0, 0.0), (2.0, 0.1, 0.0), (1.0, 0.0, 1.0)))
    for _ in range(120):
        plane = plane_moves.scale(plane, 0.8)
        assert_frame(plane)
    assert plane.corners is None
    assert plane.width == pytest.approx(np.hypot(1, 0.1) * 0.8**120)
    np.testing.assert_allclose(plane.center, (1.5, 0.05, 0.5), atol=1e-12)


# Whatever is asked, the plane is valid

wild = st.one_of(st.floats(), st.sampled_from([1e300, -1e300, inf, nan, 1e6]), numbers(-50, 50))


@given(planes(), st.data())
@settings(max_examples=200)
def test_every_plane_is_valid_whatever_is_asked(plane: Plane, data: st.DataObject) -> None:
    for _ in range(8):
        a, b, c = (data.draw(wild) for _ in range(3))
        axis = data.draw(st.sampled_from(AXES))
        moves: dict[str, Callable[[], Plane]] = {
            "shift": partial(plane_moves.shift, plane, normal=a, side=b, up=c),
            "scale": partial(plane_moves.scale, plane, a),
            "rotate": partial(plane_moves.rotate, plane, axis, a),
            "in_place": partial(plane_moves.rotate_in_place, plane, axis, a),
            "pan": partial(plane_moves.pan, plane, a, b, SIZE),
            "zoom_to": partial(plane_moves.zoom_to, plane, a, b, SIZE, c),
            "spin": partial(plane_moves.spin, plane, (a, b), (b, c), SIZE),
            "tilt": partial(plane_moves.tilt, plane, a, b, SIZE),
        }
        plane = moves[data.draw(st.sampled_from(sorted(moves)))]()
        Plane.model_validate(plane.model_dump())
        assert_frame(plane)


def test_a_step_beyond_its_range_leaves_a_valid_plane() -> None:
    """Joined steps may leave a step's range: the plane is then told by its middle, or stays as it is."""
    plane = Plane(center=(0, 0, 0), normal=(0, 0, 1), transform=({"rotate_side": 30}, {"scale": 0.5}))
    for side in (9e5, 2e6, 5e13):
        moved = plane_moves.shift(plane, side=side)
        Plane.model_validate(moved.model_dump())
        assert_frame(moved)
