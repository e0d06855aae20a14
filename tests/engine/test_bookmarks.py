"""Bookmarks change neither the picture nor what the tiles of unfinished work must agree in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.engine.prepare import prepare
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

PLAIN = """\
version: 1
formula: {name: mandelbulb, iterations: 5}
camera: {position: [0, -3, 0]}
image: {width: 24, height: 16}
"""
MARKED = (
    PLAIN
    + "bookmarks: {front: {fov: 20}, top: {projection: orthographic, position: [0, 0, 3], up: [0, 1, 0]}}\n"
)


@pytest.mark.parametrize("rest", ["", "stereo: {}\n", "layout: {views: [{}, {fog: {}}]}\n"])
def test_unfinished_work_goes_on_with_other_bookmarks(device: Device, rest: str) -> None:
    plain, marked = (prepare(load_scene(text + rest), device) for text in (PLAIN, MARKED))
    assert "bookmarks" not in plain.identity(0)["scene"]
    for number in range(len(plain.views)):
        assert plain.identity(number) == marked.identity(number)
    other = prepare(load_scene(PLAIN.replace("-3", "-4") + rest), device)
    assert plain.identity(0) != other.identity(0)


def test_the_picture_is_the_same_and_keeps_them(device: Device, tmp_path: Path) -> None:
    plain, marked = (clfractal.render(load_scene(text)) for text in (PLAIN, MARKED))
    for name in plain.channels:
        np.testing.assert_array_equal(plain[name], marked[name])
    marked.save(tmp_path / "marked.exr")
    kept = load_scene(tmp_path / "marked.exr")
    assert isinstance(kept, Scene)
    assert list(kept.bookmarks) == ["front", "top"]
