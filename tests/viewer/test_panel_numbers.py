"""A number that is changed among several changes alone."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("imgui_bundle")

from clfractal.scene.load import load_scene
from clfractal.viewer.panels import scene_dock
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.number_box import Change
from tests.viewer.panel_harness import Stage, make_ui

pytestmark = pytest.mark.usefixtures("drawing_context")

SCENE: dict[str, Any] = {
    "version": 1,
    "formula": {"name": "mandelbulb"},
    "camera": {},
    "renderer": {"type": "volume", "box": {"center": [0.1, 0.2, 0.3], "size": [1.0, 2.0, 3.0]}},
}


@pytest.mark.parametrize("index", [0, 1, 2])
def test_one_side_of_a_box_changes_alone(index: int, monkeypatch: pytest.MonkeyPatch) -> None:
    ui, _ = make_ui(load_scene(SCENE))
    ui.size = (1280, 4000)
    ui.memory["open"] = dict.fromkeys(scene_dock.KEYS, True)
    plain, changes = w.number_box, {f"renderer.box.size.{index}": Change(value=2.5)}

    def number_box(boxes: Any, name: str, *arguments: Any, **options: Any) -> Change:
        usual: Change = plain(boxes, name, *arguments, **options)
        return changes.pop(name, usual)

    monkeypatch.setattr(w, "number_box", number_box)
    Stage(ui, scene_dock.draw, window=False)
    assert not changes
    expected = [1.0, 2.0, 3.0]
    expected[index] = 2.5
    renderer: Any = ui.studio.scene.renderer
    assert list(renderer.box.size) == expected
    assert renderer.box.center == (0.1, 0.2, 0.3)
    assert ui.studio.problems == {}
