"""Lights that are dragged, focus by a click, and wireframes over a picture."""

from __future__ import annotations

from math import cos, hypot, inf, isfinite, nan, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.camera.views import View, camera_view, eye_view, middle_view
from clfractal.elements.lights.directional import DirectionalLight
from clfractal.elements.lights.point import PointLight
from clfractal.scene.parts import PerspectiveCamera
from clfractal.scene.stereo import Eye, Stereo
from clfractal.viewer import handles, overlays
from clfractal.viewer.navigation import point_at, project
from clfractal.viewer.zoom_box import box_edges
from tests.viewer.cameras import (
    SIZE,
    AnyCamera,
    assert_same_pixel,
    assert_same_place,
    cameras,
    directional,
    numbers,
    orthographic,
    perspective,
    places,
    point_light,
)

vectors = st.tuples(*[numbers(-1, 1)] * 3)
directions = vectors.filter(lambda vector: np.linalg.norm(vector) > 0.1)
BOUNDS = ((0.0, 0.0, 0.0), 1.5)


@st.composite
def bounds(draw: st.DrawFn) -> handles.Bounds:
    return draw(st.tuples(*[numbers(-10, 10)] * 3)), draw(numbers(0.01, 20))


# Lights from infinitely far away


@given(cameras(), bounds(), numbers(0, 0.999), numbers(-3.2, 3.2), st.booleans(), directions)
def test_a_directional_light_is_where_it_was_dragged(
    camera: AnyCamera,
    ball: handles.Bounds,
    share: float,
    angle: float,
    behind: bool,
    direction: tuple[float, float, float],
) -> None:
    view = camera_view(camera, *SIZE)
    circle = handles.light_circle(view, SIZE, ball)
    place = circle.x + share * circle.radius * cos(angle), circle.y + share * circle.radius * sin(angle)
    light = handles.dragged(directional(direction=direction), view, SIZE, *place, ball, behind=behind)
    found = handles.handle_position(light, view, SIZE, ball)
    assert found is not None
    assert_same_pixel(found, place)
    assert isinstance(light, DirectionalLight)
    assert np.linalg.norm(light.direction) == pytest.approx(np.linalg.norm(direction))
    assert handles.is_behind(light, view) == behind


@given(cameras(), bounds(), directions)
def test_a_handle_dragged_to_where_it_is_changes_no_light(
    camera: AnyCamera, ball: handles.Bounds, direction: tuple[float, float, float]
) -> None:
    view = camera_view(camera, *SIZE)
    light = directional(direction=direction)
    place = handles.handle_position(light, view, SIZE, ball)
    assert place is not None
    again = handles.dragged(light, view, SIZE, *place, ball, behind=handles.is_behind(light, view))
    assert isinstance(again, DirectionalLight)
    # Near the rim a pixel is a large angle.
    np.testing.assert_allclose(again.direction, direction, atol=1e-6)


def test_light_comes_from_where_its_handle_is() -> None:
    view = camera_view(perspective(), *SIZE)
    circle = handles.light_circle(view, SIZE, BOUNDS)
    places = {
        (circle.x, circle.y): (0, 1, 0),
        (circle.x + circle.radius, circle.y): (-1, 0, 0),
        (circle.x, circle.y - 3 * circle.radius): (0, 0, -1),
    }
    for place, expected in places.items():
        light = handles.dragged(directional(direction=(0.0, 0.0, 1.0)), view, SIZE, *place, BOUNDS)
        assert isinstance(light, DirectionalLight)
        np.testing.assert_allclose(light.direction, expected, atol=1e-12)


def test_the_circle_is_the_outline_of_the_ball_where_that_fits() -> None:
    view = camera_view(orthographic(height=3.6), *SIZE)
    circle = handles.light_circle(view, SIZE, ((0.5, 7.0, 0.2), 1.0))
    assert (circle.x, circle.y, circle.radius) == pytest.approx((370, 160, 100))
    eye = camera_view(perspective(), *SIZE)
    circle = handles.light_circle(eye, SIZE, ((0.0, 3.0, 0.0), 1.0))
    x = project(eye, (1.0, 3.0, 0.0), SIZE)[0]
    assert (circle.x, circle.y, circle.radius) == pytest.approx((320, 180, x - 320))


@given(cameras(), bounds())
def test_the_circle_is_in_the_picture(camera: AnyCamera, ball: handles.Bounds) -> None:
    circle = handles.light_circle(camera_view(camera, *SIZE), SIZE, ball)
    assert 0.1 * min(SIZE) < circle.radius < 0.5 * min(SIZE)
    assert circle.radius <= circle.x <= SIZE[0] - circle.radius
    assert circle.radius <= circle.y <= SIZE[1] - circle.radius


# Lights from a point


@given(cameras(), places(), places(), numbers(0.01, 50))
def test_a_point_light_moves_in_the_plane_at_its_depth(
    camera: AnyCamera, start: tuple[float, float], end: tuple[float, float], depth: float
) -> None:
    view = camera_view(camera, *SIZE)
    position = point_at(view, *start, SIZE, depth)
    light = point_light(position=tuple(position.tolist()))
    place = handles.handle_position(light, view, SIZE, BOUNDS)
    assert place is not None
    np.testing.assert_allclose(place, start, atol=1e-6)
    moved = handles.dragged(light, view, SIZE, *end, BOUNDS)
    assert isinstance(moved, PointLight)
    reach = max(1.0, *(abs(x) for x in moved.position))
    np.testing.assert_allclose(project(view, moved.position, SIZE)[2], depth, atol=1e-13 * reach, rtol=1e-9)
    again = handles.handle_position(moved, view, SIZE, BOUNDS)
    assert again is not None
    np.testing.assert_allclose(again, end, atol=1e-6)


def test_a_point_light_behind_the_eye_has_no_handle_and_comes_to_the_scene() -> None:
    view = camera_view(perspective(), *SIZE)
    light = point_light(position=(0.0, -5.0, 0.0))
    assert handles.handle_position(light, view, SIZE, BOUNDS) is None
    moved = handles.dragged(light, view, SIZE, 100, 100, BOUNDS)
    assert isinstance(moved, PointLight)
    assert_same_place(project(view, moved.position, SIZE), (100, 100, 3))


wild = st.one_of(st.floats(), numbers(-1000, 1000))


@given(cameras(), wild, wild, st.booleans(), directions, bounds())
@settings(max_examples=200)
def test_every_light_is_valid_wherever_it_is_dragged(
    camera: AnyCamera,
    x: float,
    y: float,
    behind: bool,
    vector: tuple[float, float, float],
    ball: handles.Bounds,
) -> None:
    view = camera_view(camera, *SIZE)
    for light in (directional(direction=vector), point_light(position=vector)):
        moved = handles.dragged(light, view, SIZE, x, y, ball, behind=behind)
        type(moved).model_validate(moved.model_dump())


# Focus


def test_a_click_focuses_on_its_depth() -> None:
    camera = perspective(f_number=2.8)
    focused = handles.focus_at(camera, 1.25)
    assert isinstance(focused, PerspectiveCamera)
    assert focused.focus_distance == 1.25
    assert camera_view(focused, *SIZE).focus_distance == 1.25
    for depth in (inf, nan, 0.0, -1.0, 2e6):
        assert handles.focus_at(camera, depth) == camera
    assert handles.focus_at(orthographic(), 1.0) == orthographic()


# Wireframes


def expected_clip(view: View, a: np.ndarray, b: np.ndarray) -> list[tuple[float, float]]:
    """Places of a finely sampled segment that are in the picture."""
    found = []
    for part in np.linspace(0, 1, 2001):
        x, y, depth = project(view, a * (1 - part) + b * part, SIZE)
        if isfinite(x) and depth > 1e-5 and 0 <= x <= SIZE[0] and 0 <= y <= SIZE[1]:
            found.append((x, y))
    return found


@given(cameras(), st.lists(st.tuples(vectors, vectors), min_size=1, max_size=3))
@settings(max_examples=40)
def test_segments_are_cut_to_what_the_picture_shows(
    camera: AnyCamera, ends: list[tuple[tuple[float, float, float], tuple[float, float, float]]]
) -> None:
    view = camera_view(camera, *SIZE)
    distance = float(np.linalg.norm(np.array(camera.target) - camera.position))
    segments = np.array(camera.target) + 2 * distance * np.array(ends)
    clipped, depths = overlays.clipped_with_depth(view, segments, SIZE)
    assert clipped.shape == (len(ends), 4)
    for (a, b), line, depth in zip(segments, clipped, depths, strict=True):
        inside = expected_clip(view, a, b)
        if np.isnan(line).any():
            assert np.isnan(line).all()
            assert len(inside) <= 1
            continue
        assert (line >= -1e-6).all()
        assert (line[[0, 2]] <= SIZE[0] + 1e-6).all()
        assert (line[[1, 3]] <= SIZE[1] + 1e-6).all()
        # The ends are on the segment, at their depths.
        for (x, y), deep in zip(line.reshape(2, 2), depth, strict=True):
            point = point_at(view, x, y, SIZE, deep)
            along = b - a
            length = np.linalg.norm(along)
            if length > 1e-3 * distance:
                assert np.linalg.norm(np.cross(point - a, along)) / length < 1e-6 * distance
        # Whatever sampling finds inside lies between them.
        start, end = line[:2], line[2:]
        for place in inside[:: max(len(inside) // 10, 1)]:
            to_start, to_end = (hypot(*(np.array(place) - corner)) for corner in (start, end))
            assert to_start + to_end <= hypot(*(end - start)) * (1 + 1e-9) + 1e-5


@given(places(), places(), numbers(0.1, 10), numbers(0.1, 10), st.sampled_from(["left", "right", "middle"]))
def test_a_segment_inside_the_picture_is_projected_as_its_ends_are(
    a: tuple[float, float], b: tuple[float, float], near: float, far: float, name: str
) -> None:
    stereo = Stereo.model_validate({"screen_width": 0.5, "screen_distance": 0.6})
    view = eye_view(middle_view(stereo, perspective(), *SIZE), stereo, Eye(name))  # type: ignore[arg-type]
    segment = np.array([point_at(view, *a, SIZE, near), point_at(view, *b, SIZE, far)])
    clipped, depths = overlays.clipped_with_depth(view, segment, SIZE, margin=1.0)
    assert_same_pixel(clipped[0, :2], a)
    assert_same_pixel(clipped[0, 2:], b)
    np.testing.assert_allclose(depths[0], (near, far), rtol=1e-9)


def test_nothing_and_infinite_segments_are_no_error() -> None:
    view = camera_view(perspective(), *SIZE)
    assert overlays.clipped_with_depth(view, np.zeros((0, 2, 3)), SIZE)[0].shape == (0, 4)
    broken = np.array([[[0, 0, 0], [inf, 0, 0]], [[nan, 0, 0], [0, 0, 1.0]], [[0, 0, 0], [0, 0, 0.1]]])
    clipped, _ = overlays.clipped_with_depth(view, broken, SIZE)
    assert np.isnan(clipped[:2]).all()
    assert np.isfinite(clipped[2]).all()


@pytest.mark.parametrize("camera", [perspective(), orthographic()])
def test_the_back_of_a_box_is_hidden_by_a_wall_through_its_middle(camera: AnyCamera) -> None:
    view = camera_view(camera, *SIZE)
    edges = overlays.split(box_edges((0, 0, 0), (1, 1, 1)), 2)
    assert edges.shape == (24, 2, 3)
    pixels, depths = overlays.clipped_with_depth(view, edges, SIZE)
    wall = np.full((SIZE[1] // 4, SIZE[0] // 4), 3.0)
    dim = overlays.hidden(view, pixels, depths, wall, SIZE)
    np.testing.assert_array_equal(dim, edges.mean(axis=1)[:, 1] > 0)
    assert not overlays.hidden(view, pixels, depths, np.full_like(wall, inf), SIZE).any()
    # Only the left half of the picture has a wall, and a long way in front.
    wall = np.full_like(wall, inf)
    wall[:, : wall.shape[1] // 2] = 0.5
    dim = overlays.hidden(view, pixels, depths, wall, SIZE)
    np.testing.assert_array_equal(dim, (pixels[:, 0] + pixels[:, 2]) / 2 < SIZE[0] / 2 - 1e-9)
