"""Scenes told from another place: the picture is the same, exactly, and numbers keep their digits."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clfractal
from clfractal.errors import SceneError
from clfractal.scene import deeper
from clfractal.scene.bookmarks import view_of
from clfractal.scene.deep import Deep
from clfractal.scene.model import Scene

NUMBERS = st.floats(-1, 1, allow_nan=False)
POINTS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
DIRECTIONS = POINTS.filter(lambda each: math.hypot(each[0], each[1]) > 0.1)
DEPTHS = st.floats(0, 100).map(lambda exponent: 10.0**exponent)
EXACT = st.tuples(*3 * (st.fractions(-1, 1, max_denominator=10**40),))


def scene_of(camera: dict[str, Any], **more: Any) -> Scene:
    return clfractal.load_scene(
        {"version": 1, "formula": {"name": "mandelbulb"}, "camera": camera, **more}, overrides=()
    )


BULB = scene_of({})


def with_position(scene: Scene, position: tuple[float, ...]) -> Scene:
    return scene.model_copy(update={"camera": scene.camera.model_copy(update={"position": position})})


def eye(scene: Scene) -> tuple[deeper.Exact, deeper.Exact]:
    """Where the camera stands and what it looks at, in the formula's space."""
    camera = scene.camera
    return deeper.exact_point(camera.position, scene.deep), deeper.exact_point(camera.target, scene.deep)


def farthest(one: deeper.Exact, other: deeper.Exact) -> Fraction:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


@given(number=st.fractions(), places=st.integers(0, 60))
def test_decimal_text_is_the_nearest(number: Fraction, places: int) -> None:
    text = deeper.decimal_text(number, places)
    assert abs(Fraction(text) - number) <= Fraction(1, 2 * 10**places)
    assert "." not in text or not text.endswith(("0", "."))
    assert text != "-0"
    # What has so few digits is itself, and keeps its text.
    assert deeper.decimal_text(Fraction(text), places) == text


@given(centers=st.tuples(EXACT, EXACT), depths=st.tuples(DEPTHS, DEPTHS), point=POINTS)
def test_points_come_back(
    centers: tuple[Any, Any], depths: tuple[float, float], point: tuple[float, float, float]
) -> None:
    """Told from two places that are as deep as each other they differ by rounding alone."""
    one, other = (deeper.deep_at(center, depth) for center, depth in zip(centers, depths, strict=True))
    seen = deeper.told_anew(point, one, other)
    error = farthest(deeper.exact_point(seen, other), deeper.exact_point(point, one))
    size = max(map(abs, seen)) / other.magnification
    assert error <= Fraction(2.0**-52) * Fraction(size) + Fraction(5e-324)


@given(offset=DIRECTIONS, target=POINTS, depth=st.floats(-9, -5))
def test_a_scene_that_goes_over_shows_the_same(
    offset: tuple[float, float, float], target: tuple[float, float, float], depth: float
) -> None:
    near = tuple(t + 10**depth * o for t, o in zip(target, offset, strict=True))
    scene = BULB.model_copy(update={"camera": {"position": near, "target": target}})
    found = deeper.settled(scene)
    assert found.deep is not None
    assert math.dist(found.camera.position, found.camera.target) == pytest.approx(deeper.STANDS)
    assert deeper.magnified(found) == pytest.approx(deeper.magnified(scene), rel=1e-12)
    distance = math.dist(near, target)
    for one, other in zip(eye(found), eye(scene), strict=True):
        assert farthest(one, other) <= 1e-12 * distance
    # Once is enough, and it goes back to where it was.
    assert deeper.settled(found) is found
    back = deeper.rebased(found, None)
    assert back.camera.position == pytest.approx(scene.camera.position, abs=1e-15)


@settings(max_examples=10)
@given(factor=st.sampled_from([0.5, 0.1, 0.9]), toward=POINTS, offset=DIRECTIONS)
def test_zooming_goes_on_to_any_depth_and_back(
    factor: float, toward: tuple[float, float, float], offset: tuple[float, float, float]
) -> None:
    """Homotheties about one point, told anew at every step, in place of exact ones."""
    point = tuple(map(Fraction, toward))
    place = tuple(t + o for t, o in zip(toward, offset, strict=True))
    scene = BULB.model_copy(update={"camera": {"position": place, "target": toward}})
    begun = eye(scene)
    exact = Fraction(1)
    while deeper.magnified(scene) < 1e30:
        seen = deeper.seen_point(point, scene.deep)  # type: ignore[arg-type]
        camera = scene.camera
        # (The target is that point, but for rounding.)
        moved = tuple(p + factor * (q - p) for p, q in zip(seen, camera.position, strict=True))
        scene = deeper.settled(with_position(scene, moved))
        exact *= Fraction(factor)
    stands, _ = eye(scene)
    for axis in range(3):
        wanted = point[axis] + exact * (begun[0][axis] - point[axis])
        assert abs(stands[axis] - wanted) <= 1e-9 * exact
    assert scene.deep is not None
    assert scene.deep.magnification > 1e28
    while scene.deep is not None:
        camera, seen = scene.camera, deeper.seen_point(point, scene.deep)  # type: ignore[arg-type]
        away = tuple(p + 10 * (q - p) for p, q in zip(seen, camera.position, strict=True))
        scene = deeper.settled(with_position(scene, away))
    assert 1e-3 < math.dist(scene.camera.position, scene.camera.target) < 1


def test_a_camera_that_wanders_off_takes_its_place_along() -> None:
    deep = {"center": ["0.1", "0.2", "0.3"], "magnification": 1e50}
    scene = scene_of({"position": [100, 97, 0], "target": [100, 100, 0]}, deep=deep)
    found = deeper.settled(scene)
    assert found.deep is not None
    assert found.deep.magnification == 1e50
    assert found.camera.target == pytest.approx((0, 0, 0), abs=1e-9)
    for one, other in zip(eye(found), eye(scene), strict=True):
        assert farthest(one, other) <= Fraction(1e-12) / Fraction(1e50)


def test_the_point_that_comes_nearer_says_how_far_one_looks() -> None:
    """A target that stays behind is taken along; the picture stays."""
    deep = {"center": ["0", "0", "0"], "magnification": 1e9}
    scene = scene_of({"position": [0, -3000, 0], "target": [0, -2997, 0]}, deep=deep)
    assert deeper.settled(scene, (0.0, 0.0, 0.0)).deep == Deep(magnification=1e6)
    assert deeper.settled(scene, (0.0, -9000.0, 0.0)).deep == deeper.settled(scene).deep  # behind the camera


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ({"fog": {"density": 1.0}}, "fog"),
        ({"lights": [{"type": "point", "position": [0, 0, 3]}]}, "lights"),
        ({"renderer": {"type": "volume"}}, "surface renderer"),
        ({"camera": {"position": [0, -1e-6, 0], "projection": "orthographic"}}, "perspective"),
        ({"renderer": {"type": "surface", "bounds": {"center": [0, 0, 0], "radius": 2}}}, "renderer.bounds"),
        ({"animation": {"frames": 10}}, "a film"),
        ({}, ""),
    ],
)
def test_what_does_not_come_along_keeps_a_scene(more: dict[str, Any], why: str) -> None:
    scene = scene_of(more.pop("camera", {"position": [0, -1e-6, 0]}), **more)
    told = deeper.why_it_stays(scene)
    assert why in told
    assert bool(told) == bool(why)
    assert (deeper.settled(scene) is scene) == bool(why)


def test_bookmarks_keep_their_place() -> None:
    center = ["0.1234567890123456789012345678901", "0", "0"]
    deep = {"center": center, "magnification": 1e25}
    marks = {
        "here": {"camera": {"position": [0, -2, 0]}, "deep": deep},
        "framed": {"camera": {"frame": "all"}, "deep": {"magnification": 1e9}},
        "whole": {"frame": "all"},
    }
    scene = scene_of({"position": [0, -3, 0]}, deep=deep, bookmarks=marks)
    assert clfractal.load_scene(clfractal.dump_scene(scene)) == scene
    camera, place = view_of(scene.bookmarks["here"])
    assert (camera.position, place) == ((0, -2, 0), Deep.checked(deep))
    # What is framed is the set, or as much around a place as the set is large.
    whole = scene_of({"frame": "all"}).camera
    assert view_of(scene.bookmarks["whole"]) == (whole, None)
    assert view_of(scene.bookmarks["framed"])[0].position == pytest.approx(whole.position)
    with pytest.raises(SceneError, match=r"bookmarks\.a\.camera: is missing"):
        scene_of({}, bookmarks={"a": {"deep": {}}})
