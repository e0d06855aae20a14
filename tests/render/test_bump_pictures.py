"""Reliefs by pictures: their heights, edges near and far, and codes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import clfractal
from clfractal.scene.load import dump_scene
from clfractal.scene.model import Scene
from tests.environment_maps import write_map
from tests.render.reliefs import displaced, facts, relief
from tests.render.shots import degrees


def waves(folder: Path, count: int = 256) -> None:
    """A picture of one wave to the right, whose numbers are as they are."""
    row = 0.5 + 0.5 * np.sin(2 * np.pi * (np.arange(count) + 0.5) / count)
    write_map(folder / "waves.exr", np.tile(row, (count, 1)))


def floor(folder: Path, scale: float, **sections: Any) -> Scene:
    """A plane from above, with a relief by that picture."""
    height = {"texture": "waves.exr", "scale": scale, "curve": [[0, 0], [1, 0.1]]}
    scene = relief(
        height,
        camera={"position": [0.1, 0.2, 4], "target": [0.1, 0.2, 0], "up": [0, 1, 0], "fov": 30},
        objects={"floor": {"type": "plane", "position": [0, 0, 1.2], "material": "m"}},
        image={"width": 64, "height": 64},
        **sections,
    )
    return clfractal.load_scene(dump_scene(scene.placed(folder)), folder=folder)


def test_a_picture_is_a_relief(tmp_path: Path) -> None:
    """A plane with a wave: its normals in closed form; a footprint is 1/43 of the wave."""
    waves(tmp_path)
    found = facts(floor(tmp_path, 1.0))
    x = found["P"][:, 0]
    gradient = np.stack([0.1 * np.pi * np.cos(2 * np.pi * x), 0 * x, 0 * x], axis=-1)
    expected = displaced(found, gradient, np.array([0.1, 0.2, 4]))
    assert degrees(found["N"], found["normal"]).max() > 16
    assert degrees(expected, found["normal"]).max() < 1.0


def test_near_pictures_have_no_edges(tmp_path: Path) -> None:
    """Their slopes are measured over a pixel of theirs at least: else each pixel would be a step."""
    waves(tmp_path, 8)
    found = facts(floor(tmp_path, 1.0))
    x = found["P"][:, 0]
    steps = np.abs(np.diff(found["normal"][np.argsort(x), 0]))
    assert np.ptp(found["normal"][:, 0]) > 0.4
    assert steps.max() < 0.06


def test_far_pictures_are_flat(tmp_path: Path) -> None:
    """What a pixel cannot show is not seen: nothing shimmers."""
    waves(tmp_path)
    found = facts(floor(tmp_path, 0.01))
    assert degrees(found["N"], found["normal"]).max() < 0.2


def test_codes_of_a_picture_are_heights(tmp_path: Path) -> None:
    """A grey ramp of codes rises evenly."""
    codes = np.tile(np.arange(256, dtype=np.uint8), (64, 1))
    Image.fromarray(codes).save(tmp_path / "ramp.png")
    height = {"texture": "ramp.png", "scale": 4, "curve": [[0, 0], [1, 0.8]]}
    scene = relief(height, objects={"floor": {"type": "plane", "position": [0, 0, -0.8], "material": "m"}})
    scene = clfractal.load_scene(dump_scene(scene.placed(tmp_path)), folder=tmp_path)
    found = facts(scene)
    on_floor = (np.abs(found["P"][:, 2] + 0.8) < 1e-4) & (np.abs((found["P"][:, 0] + 2) % 4 - 2) > 0.3)
    on_floor &= found["P"][:, 1] > -2
    assert on_floor.sum() > 50
    expected = displaced(found, np.tile([0.2, 0.0, 0.0], (len(on_floor), 1)))
    assert np.quantile(degrees(expected, found["normal"])[on_floor], 0.9) < 0.3
