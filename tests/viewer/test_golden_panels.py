"""Panels look as they did: compared with golden pictures at a quarter of the size, the picture behind them masked out.

A quarter of the size, and means instead of pixels, because another version of the font's renderer moves edges a little. A
panel that is empty, moved, or has lost its colours differs by far more than the tolerance. To renew them after a wanted
change: `CLFRACTAL_RENEW=1 pytest tests/viewer/test_golden_panels.py`, and look at the result.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clfractal.viewer.panels import help, scene_dock, theme
from clfractal.viewer.panels.ui import Ui
from tests.viewer.panel_harness import Pixels, screenshot

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "panels"
SIZE = (1280, 720)
# Mean difference of a pixel of the small pictures, and the share of these that may differ clearly, of 255.
MEAN, CLEAR, SHARE = 3.0, 28.0, 0.03


def opened(*keys: str) -> Callable[[Ui], None]:
    """Opens some panels of the dock alone."""

    def prepare(ui: Ui) -> None:
        ui.memory["open"] = {key: key in keys for key in scene_dock.KEYS}

    return prepare


def with_objects(ui: Ui) -> None:
    opened("objects")(ui)
    ball = {"type": "sphere", "position": [0, 0, -1.5], "radius": 0.4, "material": "steel"}
    sea = {"type": "water", "position": [0, 0, -1.3]}
    steel = {"base": {"color": [0.6, 0.6, 0.65], "metalness": 1}}
    assert ui.studio.edit({"materials.steel": steel, "objects": {"sea": sea, "ball": ball}})
    ui.memory["object"] = "ball"


def with_help(ui: Ui) -> None:
    ui.show.add("help")


def draw_help(ui: Ui) -> None:
    help.draw(ui)


CASES: dict[str, tuple[str, Callable[[Ui], None], Callable[[Ui], None] | None]] = {
    "dock": ("mandelbulb", scene_dock.draw, None),
    "colouring": ("mandelbulb", scene_dock.draw, opened("coloring", "material")),
    "lights": ("mandelbulb", scene_dock.draw, opened("lights", "camera")),
    "cut_planes": ("figure9", scene_dock.draw, opened("cut_planes", "stereo")),
    "objects": ("mandelbulb", scene_dock.draw, with_objects),
    "volume": ("volume_alabaster", scene_dock.draw, opened("volume", "renderer")),
    "help": ("mandelbulb", draw_help, with_help),
}


def small(pixels: Pixels) -> Pixels:
    """The left part of a screenshot, where the dock is (all of it for the help), at a quarter of the size."""
    height, width = (side // 4 * 4 for side in pixels.shape[:2])
    blocks = pixels[:height, :width].astype(np.float64).reshape(height // 4, 4, width // 4, 4, 3)
    return np.asarray(np.rint(blocks.mean(axis=(1, 3))), np.uint8)


@pytest.mark.usefixtures("screen")
@pytest.mark.parametrize("name", CASES)
def test_a_panel_looks_as_before(name: str) -> None:
    scene, draw, prepare = CASES[name]
    found = screenshot(f"scenes/{scene}.yaml", draw, SIZE, prepare=prepare)
    if name != "help":
        found = found[:, : int(theme.DOCK_LEFT + theme.MARGIN)]
    now = small(found)
    path = GOLDEN / f"{name}.png"
    if os.environ.get("CLFRACTAL_RENEW"):
        path.parent.mkdir(exist_ok=True)
        Image.fromarray(now).save(path, optimize=True)
    golden = np.asarray(Image.open(path).convert("RGB"))
    assert golden.shape == now.shape
    difference = np.abs(golden.astype(float) - now)
    assert difference.mean() <= MEAN
    assert (difference.max(axis=2) > CLEAR).mean() <= SHARE


def test_the_comparison_can_fail() -> None:
    """Another panel in the place of one is found."""
    one, other = (
        np.asarray(Image.open(GOLDEN / f"{name}.png").convert("RGB"), float)
        for name in ("lights", "colouring")
    )
    difference = np.abs(one - other)
    assert difference.mean() > MEAN or (difference.max(axis=2) > CLEAR).mean() > SHARE
