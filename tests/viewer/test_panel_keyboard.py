"""Panels by the keyboard alone: Tab into them and on, Enter to press, open and type, and back."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from clfractal.viewer.panels import keyboard, scene_dock
from tests.viewer.panel_harness import Stage, headless, make_ui

SCENE = "version: 1\nformula: {name: quaternion_julia, julia: [0, 0, 0, 0], iterations: 12}\ncamera: {}\n"


@pytest.fixture
def stage() -> Iterator[Stage]:
    with headless():
        ui, _ = make_ui(SCENE)
        found = Stage(ui, scene_dock.draw, window=False)
        found.move(1000, 300)
        keyboard.enter(ui)
        for _ in range(3):
            found.frame()
        yield found


def tab(stage: Stage, count: int) -> None:
    for _ in range(count):
        stage.press(imgui.Key.tab)


def test_it_begins_with_the_search(stage: Stage) -> None:
    assert keyboard.inside(stage.ui)
    stage.type("bail")
    assert stage.ui.memory["filter"] == "bail"


def test_a_number_is_reached_typed_and_left(stage: Stage) -> None:
    """The heading, the list, two buttons, and the formula's power; after Enter Tab goes on to the next number."""
    tab(stage, 5)
    stage.press(imgui.Key.enter)
    assert stage.ui.memory["boxes"].typing.endswith("power")
    stage.type("3")
    stage.press(imgui.Key.enter)
    assert stage.ui.studio.value("formula.parameters.power") == 3
    tab(stage, 1)
    stage.press(imgui.Key.enter)
    stage.type("0.25")
    stage.press(imgui.Key.enter)
    assert stage.ui.studio.value("formula.parameters.offset") == 0.25


def test_a_switch_is_pressed(stage: Stage) -> None:
    tab(stage, 7)
    stage.press(imgui.Key.space)
    assert stage.ui.studio.value("formula.julia") is None


def test_outside_of_panels_the_keys_are_the_pictures(stage: Stage) -> None:
    keyboard.leave(stage.ui)
    assert not keyboard.inside(stage.ui)
    stage.frame()
    tab(stage, 7)
    stage.press(imgui.Key.space)
    assert stage.ui.studio.value("formula.julia") == [0, 0, 0, 0]
    assert not imgui.get_io().nav_active
