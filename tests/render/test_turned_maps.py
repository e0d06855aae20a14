"""Environments that lean, are turned or mirrored: what a direction shows, by the closed form and on the device."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.files.map_directions import in_picture, lying
from clfractal.scene.environment import EnvironmentMap
from clfractal.scene.lighting import Environment
from clfractal.scene.turned_maps import upright
from clfractal.shading.environment import packed_map
from tests.environment_maps import blended, place
from tests.render.environment_kernel import ask

UPS = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda up: np.hypot(*up[:2]) + abs(up[2]) > 0.1)


@given(UPS, st.floats(-360, 360), st.booleans())
@settings(max_examples=200, deadline=None)
def test_how_a_picture_lies_and_back(up: tuple[float, float, float], rotation: float, mirrored: bool) -> None:
    matrix = in_picture(up, rotation, mirrored)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(matrix @ np.array(up) / np.linalg.norm(up), [0, 0, 1], atol=1e-7)
    found = lying(matrix)
    assert found[2] is mirrored
    np.testing.assert_allclose(in_picture(*found), matrix, atol=1e-6)


def test_what_the_keys_say() -> None:
    # As the window's `rotation` always was: from x towards y.
    np.testing.assert_allclose(in_picture((0, 0, 1), 90, False) @ [-1, 0, 0], [0, 1, 0], atol=1e-12)
    # The picture's middle stays ahead when its top falls back by a right angle, and is then above.
    np.testing.assert_allclose(in_picture((0, -2, 0), 0, False) @ [0, 0, 1], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(in_picture((0, 0, -1), 0, False) @ [1, 2, 3], [1, -2, -3], atol=1e-12)
    np.testing.assert_allclose(in_picture((0, 0, 1), 0, True) @ [1, 2, 3], [-1, 2, 3], atol=1e-12)


@pytest.mark.parametrize(
    ("up", "rotation", "mirrored"),
    [
        ((0, 0, 1), 40, True),
        ((0, 0, -1), 180, True),
        ((0, 0, -2), 25, False),
        ((1, 0.4, 0.2), -70, False),
        ((-0.3, 2, -0.7), 130, True),
    ],
)
def test_directions_show_what_lies_there(
    up: tuple[float, float, float], rotation: float, mirrored: bool
) -> None:
    rows, columns = np.mgrid[0:128, 0:256]
    elevation, azimuth = (0.5 - (rows + 0.5) / 128) * np.pi, ((columns + 0.5) / 256 - 0.5) * 2 * np.pi
    axes = np.cos(elevation) * np.sin(azimuth), np.cos(elevation) * np.cos(azimuth), np.sin(elevation)
    pixels = np.stack([1 + axis for axis in axes], axis=-1).astype(np.float32)
    environment = Environment.model_validate(
        {"name": "studio", "up": up, "rotation": rotation, "mirrored": mirrored}
    )
    directions = np.random.default_rng(5).normal(size=(160, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen = directions @ in_picture(up, rotation, mirrored).T
    turned = upright(pixels, environment)
    assert turned.shape == pixels.shape
    found = ask(packed_map(EnvironmentMap(turned)), directions, settings=environment).color
    # The light is 1 and the direction in the picture: what is lost to pixels is their width's square.
    np.testing.assert_allclose(found, 1 + seen, atol=2e-3)
    np.testing.assert_allclose(found, blended(pixels, *place(seen)), atol=2e-3)


def test_upside_down_and_mirrored_keeps_every_pixel() -> None:
    """As files of an old coordinate system need it."""
    pixels = np.random.default_rng(6).random((16, 32, 3)).astype(np.float32)
    keys = {"name": "studio", "up": (0, 0, -1), "rotation": 180, "mirrored": True}
    turned = upright(pixels, Environment.model_validate(keys))
    # It is turned once more by its rotation.
    np.testing.assert_allclose(np.roll(turned, 16, axis=1), pixels[::-1], atol=1e-6)
