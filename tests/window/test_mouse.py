"""Each move of mouse and wheel, once, in a real window: over a unit sphere, what lies under a pixel is known."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.scene.parts import OrthographicCamera, PerspectiveCamera
from tests.window.display import Display
from tests.window.driver import RIGHT, Window
from tests.window.scenes import SPHERE

pytestmark = pytest.mark.quiet

WIDTH, HEIGHT = 480, 360
START = (200.0, 150.0)
WHEEL = 0.88  # factor of the distance for a step of the wheel
# Depths are found by marching: a part of a pixel off.
CLOSE = 0.02

Vector = npt.NDArray[np.float64]
Camera = PerspectiveCamera | OrthographicCamera


class Eye:
    """A pinhole camera, written down anew from the documentation of scenes."""

    def __init__(self, camera: Camera) -> None:
        assert isinstance(camera, PerspectiveCamera)
        self.position = np.array(camera.position, float)
        self.target = np.array(camera.target, float)
        self.ahead = _unit(self.target - self.position)
        self.side = _unit(np.cross(self.ahead, np.array(camera.up, float)))
        self.up = np.cross(self.side, self.ahead)
        self.tangent = math.tan(math.radians(camera.fov) / 2)

    def ray(self, x: float, y: float) -> Vector:
        """The direction through a place of the picture, not of length 1."""
        across = (2 * x - WIDTH) / HEIGHT * self.tangent
        rise = (1 - 2 * y / HEIGHT) * self.tangent
        return self.ahead + across * self.side + rise * self.up

    def sphere(self, x: float, y: float) -> Vector:
        """The point of the unit sphere that is seen at a place."""
        ray = _unit(self.ray(x, y))
        half = self.position @ ray
        return self.position + ray * (-half - math.sqrt(half**2 - self.position @ self.position + 1))

    def place(self, point: Vector) -> tuple[float, float]:
        """Where a point is seen."""
        offset = point - self.position
        scale = HEIGHT / (2 * self.tangent * (offset @ self.ahead))
        return WIDTH / 2 + scale * (offset @ self.side), HEIGHT / 2 - scale * (offset @ self.up)


def _unit(vector: Vector) -> Vector:
    return vector / np.linalg.norm(vector)


def near(found: object, expected: object, tolerance: float) -> bool:
    """Whether two places or vectors are close."""
    return bool(np.abs(np.asarray(found, float) - np.asarray(expected, float)).max() <= tolerance)


@pytest.fixture(scope="module")
def opened(display: Display, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Window]:
    """One window for all tests of this module."""
    folder = tmp_path_factory.mktemp("mouse")
    (folder / "sphere.yaml").write_text(SPHERE)
    with Window(display, folder, "sphere.yaml", "--size", f"{WIDTH}x{HEIGHT}", "--no-panels") as window:
        yield window
        assert window.process.poll() is None, window.told


@pytest.fixture
def window(opened: Window) -> Window:
    """The window with the camera that it began with."""
    opened.keys(*["alt+z"] * 4)
    opened.still()
    eye = Eye(opened.scene().camera)
    assert near(eye.position, (0, -3, 0), 1e-9)
    assert near(eye.target, (0, 0, 0), 1e-9)
    return opened


def eye_of(window: Window) -> Eye:
    window.still()
    return Eye(window.scene().camera)


def test_a_drag_turns_about_the_point_under_the_pointer(window: Window) -> None:
    before = Eye(window.scene().camera)
    pivot = before.sphere(*START)
    window.drag(START, (START[0] + 60, START[1]))
    after = eye_of(window)
    # A drag across the smaller side is half a turn: 60 pixels of 360 are 30 degrees.
    angle = math.acos(np.clip(before.ahead @ after.ahead, -1, 1))
    assert near(math.degrees(angle), 30, 0.01)
    assert near(np.linalg.norm(after.position - pivot), np.linalg.norm(before.position - pivot), CLOSE)
    assert near(after.place(pivot), START, 3)
    assert near(after.side[2], 0, 1e-6)  # level
    # What is in front follows the pointer: the camera goes the other way.
    assert after.position[0] < before.position[0]


def test_the_right_button_moves_along(window: Window) -> None:
    before = Eye(window.scene().camera)
    held = before.sphere(*START)
    window.drag(START, (260, 190), RIGHT)
    after = eye_of(window)
    assert near(after.ahead, before.ahead, 1e-9)
    assert near(after.place(held), (260, 190), 1)
    assert near((after.position - before.position) @ before.ahead, 0, 1e-9)


def test_the_wheel_zooms_to_the_pointer(window: Window) -> None:
    before = Eye(window.scene().camera)
    point = before.sphere(*START)
    window.wheel(*START, 3)
    after = eye_of(window)
    assert near(after.place(point), START, 1)
    shorter = np.linalg.norm(after.position - point) / np.linalg.norm(before.position - point)
    assert near(shorter, WHEEL**3, 0.01)
    window.wheel(*START, -3)
    assert near(eye_of(window).position, before.position, CLOSE)


def test_a_double_click_centres_on_what_is_under_it(window: Window) -> None:
    before = Eye(window.scene().camera)
    point = before.sphere(*START)
    window.click(*START, count=2)
    after = eye_of(window)
    assert near(after.target, point, CLOSE)
    assert near(after.place(point), (WIDTH / 2, HEIGHT / 2), 1.5)
    assert near(after.ahead, before.ahead, 1e-6)
