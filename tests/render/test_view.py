"""The View: rays through pixel centres, and the matrices that picture files carry."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.render.shots import BALL, rays, view_of
from tests.scenes import scene_of

CAMERAS: dict[str, dict[str, Any]] = {
    "perspective": {"position": [1.5, -2.5, 1.2], "target": [0.1, 0.05, 0], "up": [0.1, 0, 1], "fov": 48},
    "wide": {"position": [0.3, 0.2, 1.7], "target": [0.3, 0.1, 0], "up": [0, 1, 0.4], "fov": 100},
    "orthographic": {
        "projection": "orthographic",
        "position": [1, -2, 1.5],
        "target": [0, 0.1, 0],
        "up": [0.3, 0.1, 1],
        "height": 2.6,
    },
}
SIZES = [(64, 64), (90, 40), (33, 70)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("camera", CAMERAS)
def test_axes(camera: str, size: tuple[int, int]) -> None:
    """Right-handed: side, up and the way back to the viewer; the target is in the middle; pixels are square."""
    scene = scene_of(BALL, CAMERAS[camera], size)
    view = view_of(scene)
    frame = np.stack([view.side, view.up, -view.axis])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert view.up @ np.array(scene.camera.up) > 0
    to_target = np.array(scene.camera.target) - view.origin
    assert np.linalg.norm(np.cross(to_target, view.axis)) == pytest.approx(0, abs=1e-12)
    assert view.width / size[0] == pytest.approx(view.height / size[1])
    assert view.pixel_size(size[1]) == pytest.approx(view.height / size[1])


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("camera", CAMERAS)
def test_world_to_camera(camera: str, size: tuple[int, int]) -> None:
    """OpenEXR: left-handed, x right, y up, z along the view; the origin is the camera."""
    view = view_of(scene_of(BALL, CAMERAS[camera], size))
    matrix = view.world_to_camera()
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(-1)  # from right-handed to left-handed space
    for point, expected in (
        (view.origin, [0, 0, 0, 1]),
        (view.origin + 2 * view.axis, [0, 0, 2, 1]),
        (view.origin + view.side, [1, 0, 0, 1]),
        (view.origin + view.up, [0, 1, 0, 1]),
    ):
        np.testing.assert_allclose([*point, 1] @ matrix, expected, atol=1e-12)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("camera", CAMERAS)
def test_world_to_ndc(camera: str, size: tuple[int, int]) -> None:
    """OpenEXR: (0, 0) is the upper left, (1, 1) the lower right of the display window: every point of a pixel's ray
    comes to that pixel's centre."""
    scene = scene_of(BALL, CAMERAS[camera], size)
    matrix = view_of(scene).world_to_ndc()
    origin, direction, _ = rays(scene)
    width, height = size
    for distance in (0.3, 1.0, 7.0):
        points = origin + distance * direction
        projected = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1) @ matrix
        where = projected[..., :2] / projected[..., 3:]
        expected = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
        np.testing.assert_allclose(where, np.stack(expected, axis=-1), atol=1e-12)
