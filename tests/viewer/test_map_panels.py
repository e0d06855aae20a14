"""What differs from place to place in a material, in the window: palettes, curves and traps of maps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("imgui_bundle")

from clfractal.schema.mapped import NumberMap
from clfractal.viewer.panels import maps, scene_dock
from clfractal.viewer.panels.ui import Ui
from tests.viewer.panel_harness import Stage, make_ui

pytestmark = pytest.mark.usefixtures("drawing_context")

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 6}
camera: {position: [0, -3, 0]}
lighting: {mode: path}
materials:
  gold:
    base:
      color: {by: trap, palette: ["#ffffff", "#884400"], trap: {shape: sphere}}
      metalness: {by: height, curve: [[0, 0], [0.5, 1], [1, 0.5]]}
    specular: {roughness: {by: iterations}}
material: {name: gold}
"""


def opened() -> Ui:
    ui, _ = make_ui(SCENE)
    ui.size = (1280, 6000)
    ui.memory["open"] = dict.fromkeys(scene_dock.KEYS, True)
    return ui


def test_palettes_and_curves_are_edited() -> None:
    ui = opened()
    path = "materials.gold.base"
    assert ui.studio.edit({f"{path}.color.palette": "opal", f"{path}.metalness.curve.1.1": 0.25})
    assert ui.studio.edit({f"{path}.color.palette.0.color": [1, 0, 0]}) is False, "a name has no stops"
    metalness = ui.studio.scene.materials["gold"].base.metalness
    assert isinstance(metalness, NumberMap)
    assert metalness.curve == ((0, 0), (0.5, 0.25), (1, 0.5))
    assert not ui.studio.edit({f"{path}.metalness.curve.1.0": 2.0})
    Stage(ui, scene_dock.draw, window=False)


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(-5, 5)), min_size=2, max_size=20))
def test_one_more_point_is_on_the_curve(points: list[tuple[float, float]]) -> None:
    given_points = [list(point) for point in sorted(points)]
    more = maps.with_point(given_points)
    widest = 1 + int(np.argmax(np.diff([at for at, _ in given_points])))
    assert [*more[:widest], *more[widest + 1 :]] == given_points
    np.testing.assert_allclose(
        more[widest], np.mean(given_points[widest - 1 : widest + 1], axis=0), atol=1e-5
    )
