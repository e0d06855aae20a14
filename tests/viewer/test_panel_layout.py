"""The dock's buttons have room: none is narrower than its text, lies over another one, or leaves the dock."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from clfractal.files import resources
from clfractal.scene.load import load_scene
from clfractal.viewer.panels import scene_dock
from clfractal.viewer.panels import widgets as w
from tests.viewer.panel_harness import Stage, make_ui

pytestmark = pytest.mark.usefixtures("drawing_context")

# A surface, a volume for two eyes, planes that cut, a cut plane alone, a chain.
SCENES = ("mandelbulb", "stereo_volume", "cut_geode", "cut_mandelbrot", "mengerbulb")


@dataclass(frozen=True)
class Button:
    """A button's text, the corners of its rectangle in points, the width of its text, and the window that it is in."""

    text: str
    left: float
    top: float
    right: float
    bottom: float
    needed: float
    end: float

    def overlaps(self, other: Button) -> bool:
        across = min(self.right, other.right) - max(self.left, other.left)
        return across > 0.5 and min(self.bottom, other.bottom) - max(self.top, other.top) > 0.5


def buttons_of(scene: str, monkeypatch: pytest.MonkeyPatch, **changes: Any) -> list[Button]:
    """All of the dock's buttons, with every panel open; `changes` of the scene by their paths."""
    overrides = [f"{path}={value}" for path, value in changes.items()]
    ui, _ = make_ui(load_scene(resources.folder("scenes") / f"{scene}.yaml", overrides=overrides))
    ui.size = (1280, 4000)
    ui.memory["open"] = dict.fromkeys(scene_dock.KEYS, True)
    found: list[Button] = []

    def noted(plain: Any, is_icon: bool) -> Any:
        def button(text: str, *arguments: Any, **options: Any) -> bool:
            end = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
            clicked: bool = plain(text, *arguments, **options)
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            icon = options.get("icon", "")
            shown = text.partition("##")[0]
            shown = f"{icon}  {shown}" if icon and shown else icon or shown
            needed = imgui.calc_text_size(shown).x
            name = str(arguments[0]) if is_icon and arguments else text
            found.append(Button(name, low.x, low.y, high.x, high.y, needed, end))
            return clicked

        return button

    monkeypatch.setattr(w, "button", noted(w.button, False))
    monkeypatch.setattr(w, "icon_button", noted(w.icon_button, True))
    stage = Stage(ui, scene_dock.draw, window=False)
    found.clear()
    stage.frame()
    return found


@pytest.mark.parametrize("scene", SCENES)
def test_buttons_have_room(scene: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = buttons_of(scene, monkeypatch)
    assert len(found) > 15
    assert {
        each.text: each.right - each.left - each.needed
        for each in found
        if each.right - each.left < each.needed
    } == {}
    assert [each.text for each in found if each.right > each.end + 0.5] == []
    assert [(a.text, b.text) for a, b in combinations(found, 2) if a.overlaps(b)] == []


def test_tips_of_the_steps_of_a_plane(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lengths are told in the plane's height; angles and factors are no lengths."""
    tips: dict[str, str] = {}
    plain = w.row

    def row(ui: Any, label: str, **options: Any) -> Any:
        tips[options.get("path", "")] = options.get("tip", "")
        return plain(ui, label, **options)

    monkeypatch.setattr(w, "row", row)
    buttons_of("cut_geode", monkeypatch)
    amounts = {path: tip for path, tip in tips.items() if tip.startswith("by how much")}
    assert len(amounts) > 1
    for path, tip in amounts.items():
        assert tip.endswith("of the plane's height") == (path == "step.move"), path


def test_few_words_to_choose_from_stand_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a click is enough, nobody opens a list: for the way of a ray's thickness, for one."""
    shown: dict[str, dict[str, int]] = {"segments": {}, "choose": {}}

    def noted(kind: str, plain: Any) -> Any:
        def show(path: str, words: Any, *arguments: Any) -> Any:
            shown[kind][path] = len(words)
            return plain(path, words, *arguments)

        return show

    for kind in shown:
        monkeypatch.setattr(w, kind, noted(kind, getattr(w, kind)))
    buttons_of("mandelbulb", monkeypatch, **{"coloring.by": "thickness"})
    for scene in ("cut_geode", "stereo_volume"):
        buttons_of(scene, monkeypatch)
    assert "coloring.along" in shown["segments"]
    assert {path for path, count in shown["choose"].items() if count <= 2} == set()
