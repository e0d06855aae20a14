"""Planes in space: where they lie, how they are moved about, and what is refused."""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import SceneError
from clfractal.scene.load import load_scene
from clfractal.scene.rectangle import AXES, Axis, Placed, Plane, moved, rotated, scaled

Floats = npt.NDArray[np.float64]

coordinates = st.floats(-10, 10).map(lambda x: round(x, 6))
vectors = st.tuples(coordinates, coordinates, coordinates)
sizes = st.floats(1e-3, 100)
degrees = st.floats(-720, 720)
axes = st.sampled_from(["normal", "side", "up", "x", "y", "z"])


@st.composite
def planes(draw: st.DrawFn) -> Plane:
    """A plane anywhere, turned anyhow."""
    normal = draw(vectors.filter(lambda v: np.linalg.norm(v) > 0.1))
    up = draw(vectors.filter(lambda v: np.linalg.norm(np.cross(normal, v)) > 0.1))
    return plane(center=draw(vectors), normal=normal, up=up, width=draw(sizes), height=draw(sizes))


def plane(**keys: Any) -> Plane:
    return Plane.model_validate(keys)


def frame(placed: Placed) -> Floats:
    """Its unit vectors as rows: side, up, normal."""
    return np.array([placed.side, placed.up, placed.normal])


def rotation(axis: Floats, angle: float) -> Floats:
    """The rotation matrix as the exponential of the cross product's matrix, by its eigenvectors: for columns."""
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    values, vectors_ = np.linalg.eigh(1j * skew)
    turned: Floats = (vectors_ @ np.diag(np.exp(-1j * np.radians(angle) * values)) @ vectors_.conj().T).real
    return turned


def close(a: npt.ArrayLike, b: npt.ArrayLike, *, at: float = 1e-9) -> None:
    np.testing.assert_allclose(np.asarray(a, float), np.asarray(b, float), atol=at, rtol=1e-9)


class TestWhereItLies:
    def test_by_default_it_is_the_floor_seen_from_above(self) -> None:
        placed = plane().placed
        close(frame(placed), np.eye(3))
        assert (placed.center, placed.width, placed.height) == ((0, 0, 0), 4, 4)

    @given(planes())
    def test_its_frame_is_right_handed_and_of_length_one(self, some: Plane) -> None:
        vectors_ = frame(some.placed)
        close(vectors_ @ vectors_.T, np.eye(3))
        assert np.linalg.det(vectors_) == pytest.approx(1)
        close(np.cross(some.normal, some.placed.normal), np.zeros(3))
        assert np.dot(some.normal, some.placed.normal) > 0
        assert some.up is not None
        assert np.dot(some.up, some.placed.up) > 0
        assert np.dot(some.up, some.placed.side) == pytest.approx(0, abs=1e-9)

    @pytest.mark.parametrize(
        ("normal", "up"),
        [((0, 0, 1), (0, 1, 0)), ((1, 0, 0), (0, 1, 0)), ((0, 1, 0), (0, 0, 1)), ((0, -2, 0), (0, 0, 1))],
    )
    def test_up_where_none_is_given(self, normal: tuple[float, ...], up: tuple[float, ...]) -> None:
        close(plane(normal=normal).placed.up, up)

    @given(planes())
    def test_corners_tell_the_same(self, some: Plane) -> None:
        placed = some.placed
        corners = [placed.at(0, 0), placed.at(1, 0), placed.at(0, 1)]
        again = plane(corners=corners).placed
        close(again.center, placed.center)
        close(frame(again), frame(placed), at=1e-7)
        assert again.width == pytest.approx(placed.width)
        assert again.height == pytest.approx(placed.height)
        close(again.at(1, 1), placed.at(1, 1))

    def test_corners_of_a_wall(self) -> None:
        placed = plane(corners=[[0, 1, 0], [0, 3, 0], [0, 1, 5]]).placed
        assert placed == Placed((0, 2, 2.5), (0, 1, 0), (0, 0, 1), (1, 0, 0), 2, 5)


class TestMovingAbout:
    @given(planes(), axes, degrees)
    def test_rotations_are_those_of_matrices(self, some: Plane, axis: Axis, angle: float) -> None:
        before = some.placed
        after = rotated(before, axis, angle)
        own = axis not in AXES
        matrix = rotation(np.array(getattr(before, axis) if own else AXES[axis]), angle)
        close(frame(after), frame(before) @ matrix.T)
        close(after.center, before.center if own else matrix @ np.array(before.center))
        assert (after.width, after.height) == (before.width, before.height)

    @pytest.mark.parametrize("axis", AXES)
    def test_a_quarter_turn_about_an_axis_is_exact(self, axis: Axis) -> None:
        vectors_ = frame(rotated(plane().placed, axis, 90))
        assert set(np.abs(vectors_).ravel().tolist()) == {0.0, 1.0}

    def test_the_right_hand_rule(self) -> None:
        assert rotated(plane().placed, "x", 90).normal == (0, -1, 0)
        assert rotated(plane().placed, "side", 90).normal == (0, -1, 0)
        assert rotated(plane().placed, "y", 90).normal == (1, 0, 0)
        assert rotated(plane().placed, "up", 90).normal == (1, 0, 0)
        assert rotated(plane().placed, "normal", 90).side == (0, 1, 0)
        assert rotated(moved(plane().placed, side=1), "z", 90).center == (0, 1, 0)

    @given(planes(), coordinates, coordinates, coordinates)
    def test_moves_go_along_its_own_axes(self, some: Plane, x: float, y: float, z: float) -> None:
        before = some.placed
        after = moved(before, side=x, up=y, normal=z)
        close(np.array(after.center) - before.center, np.array([x, y, z]) @ frame(before))
        close(frame(after), frame(before))
        close(moved(after, side=-x, up=-y, normal=-z).center, before.center)

    @given(planes(), st.floats(0.01, 100))
    def test_scaling_keeps_the_middle(self, some: Plane, factor: float) -> None:
        before = some.placed
        after = scaled(before, factor)
        assert after.center == before.center
        close([after.width, after.height], factor * np.array([before.width, before.height]))

    @given(planes(), axes, degrees)
    def test_a_plane_of_a_scene_stays_one(self, some: Plane, axis: Axis, angle: float) -> None:
        after = moved(scaled(rotated(some, axis, angle), 2), up=1)
        assert isinstance(after, Plane)
        wanted = moved(scaled(rotated(some.placed, axis, angle), 2), up=1)
        close(frame(after.placed), frame(wanted))
        close(after.placed.center, wanted.center)
        assert after.transform == ()


steps = st.one_of(
    st.builds(
        lambda name, x: {name: x}, st.sampled_from(["move_normal", "move_side", "move_up"]), coordinates
    ),
    st.builds(lambda axis, x: {f"rotate_{axis}": x}, axes, degrees),
    st.builds(lambda x: {"scale": x}, st.floats(0.5, 2)),
)


def applied(some: Plane, step: dict[str, float]) -> Plane:
    """One step of `transform` by the Python function of the same name."""
    ((key, value),) = step.items()
    kind, _, axis = key.partition("_")
    if kind == "scale":
        return scaled(some, value)
    return moved(some, **{axis: value}) if kind == "move" else rotated(some, axis, value)  # type: ignore[arg-type]


class TestTransform:
    @given(planes(), st.lists(steps, max_size=6))
    def test_keys_are_the_functions_one_after_the_other(
        self, some: Plane, chosen: list[dict[str, float]]
    ) -> None:
        by_keys = plane(**some.model_dump(exclude={"transform", "corners"}), transform=chosen).placed
        by_functions = reduce(applied, chosen, some).placed
        close(frame(by_keys), frame(by_functions), at=1e-7)
        close(by_keys.center, by_functions.center, at=1e-6)
        assert by_keys.width == pytest.approx(by_functions.width)


def scene_text(plane_text: str, colors: str = "{}") -> str:
    return (
        "version: 1\nformula: {name: hast}\ncamera: {}\n"
        f"renderer:\n  type: cut_plane\n  plane: {plane_text}\n  colors: {colors}\n"
    )


REFUSED = {
    "{normal: [0, 0, 0]}": "scene:6:19: renderer.plane.normal: must not be zero",
    "{up: [0, 0, 0]}": "scene:6:15: renderer.plane.up: must not be zero",
    "{normal: [0, 1, 0], up: [0, -3, 0]}": "renderer.plane.up: must not be parallel to the normal",
    "{width: 0}": "renderer.plane.width: must be above 0, got 0",
    "{height: -1}": "renderer.plane.height: must be above 0, got -1",
    "{width: 1e7}": "renderer.plane.width: must be at most 1000000, got 10000000.0",
    "{center: [0, 0]}": "renderer.plane.center: must be a list of 3 numbers, got a list of 2",
    "{corners: [[0, 0, 0], [1, 1, 1], [2, 2, 2]]}": "renderer.plane.corners: must not lie on one line",
    "{corners: [[0, 0, 0], [0, 0, 0], [0, 1, 0]]}": "renderer.plane.corners: must not lie on one line",
    "{corners: [[1, 0, 0], [1, 0, 1e-17], [1, 1, 0]]}": "renderer.plane.corners: must not lie on one line",
    "{corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0]]}": (
        "renderer.plane.corners: must have a right angle at the first corner, the lower left one"
    ),
    "{corners: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], width: 2}": (
        "renderer.plane.width: is already given by corners; remove width or corners"
    ),
    "{corners: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], center: [0, 0, 0], up: [0, 0, 1]}": (
        "renderer.plane.up: is already given by corners; remove up or corners"
    ),
    "{transform: [{scale: 2, move_up: 1}]}": "renderer.plane.transform.0: must have exactly one key of scale,",
    "{transform: [{}]}": "renderer.plane.transform.0: must have exactly one key of scale,",
    "{transform: [{scale: 0}]}": "renderer.plane.transform.0.scale: must be above 0, got 0",
    "{transform: [{rotate: 1}]}": "renderer.plane.transform.0: unknown key 'rotate'",
    "{transform: [{move_up: 1e6}, {move_up: 1e6}]}": (
        "renderer.plane.transform.1: must leave the plane's coordinates below 1,000,000"
    ),
    "{transform: [{scale: 1e6}]}": "renderer.plane.transform.0: must leave the plane at most 1,000,000 wide",
    "{transform: [{scale: 1e-12}, {scale: 1e-12}]}": (
        "renderer.plane.transform.1: must leave the plane at least 1e-18 wide and high"
    ),
    "{corners: [[0, 0, 0], [1e-19, 0, 0], [0, 1e-19, 0]]}": (
        "renderer.plane.corners: must leave the plane at least 1e-18 wide and high"
    ),
    "{height: 1e-19}": "renderer.plane.height: must leave the plane at least 1e-18 wide and high",
    "{width: 1e-19}": "renderer.plane.width: must leave the plane at least 1e-18 wide and high",
}


@pytest.mark.parametrize(("text", "message"), REFUSED.items(), ids=range(len(REFUSED)))
def test_what_is_refused(text: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(scene_text(text))
    assert message in str(caught.value)
