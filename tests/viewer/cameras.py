"""Cameras, places in pictures and comparisons for tests of moves."""

from __future__ import annotations

from math import cos, isclose, pi, radians, sin
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

from clfractal.camera.views import camera_view
from clfractal.elements.lights.directional import DirectionalLight
from clfractal.elements.lights.point import PointLight
from clfractal.scene.parts import OrthographicCamera, PerspectiveCamera
from clfractal.scene.rectangle import Plane
from clfractal.viewer import navigation
from clfractal.viewer.navigation import project
from clfractal.viewer.pose import pose_of

AnyCamera: TypeAlias = PerspectiveCamera | OrthographicCamera
SIZE = (640, 360)


def perspective(**values: object) -> PerspectiveCamera:
    """A camera with an eye; keys that are not given have their defaults."""
    return PerspectiveCamera.model_validate(values)


def orthographic(**values: object) -> OrthographicCamera:
    """A camera of parallel rays."""
    return OrthographicCamera.model_validate(values)


def directional(**values: object) -> DirectionalLight:
    """A light from infinitely far away."""
    return DirectionalLight.model_validate(values)


def point_light(**values: object) -> PointLight:
    """A light from a point."""
    return PointLight.model_validate(values)


def plane_of(**values: object) -> Plane:
    """A plane as a scene gives it."""
    return Plane.model_validate(values)


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Finite numbers in a range."""
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


@st.composite
def cameras(draw: st.DrawFn, steep: float = 80.0) -> AnyCamera:
    """Level cameras of both projections, at most `steep` degrees above or below the horizon."""
    azimuth, elevation = draw(numbers(-pi, pi)), radians(draw(numbers(-steep, steep)))
    distance = 10 ** draw(numbers(-3, 2))
    target = np.array([draw(numbers(-10, 10)) for _ in range(3)])
    back = np.array([cos(azimuth) * cos(elevation), sin(azimuth) * cos(elevation), sin(elevation)])
    place = {"position": tuple((target + distance * back).tolist()), "target": tuple(target.tolist())}
    if draw(st.booleans()):
        return OrthographicCamera.model_validate({**place, "height": distance * draw(numbers(0.01, 3))})
    return PerspectiveCamera.model_validate({**place, "fov": draw(numbers(5, 120))})


def places() -> st.SearchStrategy[tuple[float, float]]:
    """Places in the picture, pixels."""
    return st.tuples(numbers(0, SIZE[0]), numbers(0, SIZE[1]))


def seen(camera: AnyCamera, point: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """x, y and depth of a point in a camera's picture."""
    return np.array(project(camera_view(camera, *SIZE), point, SIZE))


def assert_same_pixel(found: npt.ArrayLike, expected: npt.ArrayLike) -> None:
    """x and y agree to 1e-9 of the picture's width."""
    np.testing.assert_allclose(np.asarray(found)[:2], np.asarray(expected)[:2], rtol=0, atol=1e-9 * SIZE[0])


def assert_same_place(found: npt.ArrayLike, expected: npt.ArrayLike) -> None:
    """As `assert_same_pixel`, and the depths agree to 1e-9 of themselves."""
    assert_same_pixel(found, expected)
    assert isclose(np.asarray(found)[2], np.asarray(expected)[2], rel_tol=1e-9)


def assert_valid(camera: AnyCamera) -> None:
    """The camera's values are allowed in a scene, and it makes a finite view."""
    type(camera).model_validate(camera.model_dump())
    view = camera_view(camera, *SIZE)
    frame = np.stack([view.side, view.up, view.axis])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)


def point_under(camera: AnyCamera, place: tuple[float, float], share: float) -> npt.NDArray[np.float64]:
    """The point under a place at a part of the target's distance."""
    depth = share * pose_of(camera).distance
    return navigation.point_at(camera_view(camera, *SIZE), *place, SIZE, depth)
