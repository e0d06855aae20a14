"""Steps and bookmarks, the bar of buttons, and the column that panels at the right share."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("imgui_bundle")

from clfractal.scene.load import load_scene
from clfractal.viewer.actions import ACTIONS
from clfractal.viewer.panels import history, menu, right_dock
from clfractal.viewer.panels.ui import Ui
from tests.viewer.panel_clicks import Seen
from tests.viewer.panel_harness import Stage, make_ui

pytestmark = pytest.mark.usefixtures("drawing_context")

SCENE = "scenes/mandelbulb.yaml"
PARTS = ("variations", "stills", "history")


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Seen:
    return Seen(monkeypatch)


def opened() -> tuple[Ui, list[str], Stage]:
    ui, done = make_ui(SCENE)
    ui.size = (1280, 1200)
    ui.show.add("history")
    return ui, done, Stage(ui, history.draw, window=False)


def steps(ui: Ui, count: int) -> None:
    for number in range(count):
        assert ui.studio.edit({"formula.iterations": 20 + number})


# Steps


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 6), min_size=1, max_size=8))
def test_any_step_can_be_gone_to(places: list[int]) -> None:
    ui, _ = make_ui(SCENE)
    first = ui.studio.scene
    steps(ui, 6)
    ui.studio.set_camera(ui.studio.scene.camera.model_copy(update={"fov": 33.0}))
    for place in places:
        history.go_to(ui, "scene", place)
        assert ui.studio.history.depth("scene") == (place, 6 - place)
        expected = first.formula.iterations if place == 0 else 19 + place
        assert ui.studio.scene.formula.iterations == expected
        assert ui.studio.scene.camera.fov == 33.0  # type: ignore[union-attr]


def test_steps_are_told_in_words() -> None:
    ui, _ = make_ui(SCENE)
    camera = ui.studio.value("camera")
    told: dict[str, dict[str, Any]] = {
        "Lights 1: intensity 2.5": {"lights.0.intensity": 2.5},
        "Lights 4: shadow on": {"lights.3.shadow": True},
        "Formula: power 7": {"formula.parameters.power": 7},
        "Renderer: search steps": {"renderer.search": "steps"},
        "Output: exposure \u22120.5": {"output.exposure": -0.5},
        "Bookmark here": {"bookmarks": {"here": camera}},
        "Bookmark here: now there": {"bookmarks": {"there": camera}},
        "Bookmark there deleted": {"bookmarks": {}},
        "Stereo: anaglyph": {"stereo": {"mode": "anaglyph"}},
        "Stereo off": {"stereo": None},
    }
    for words, values in told.items():
        assert ui.studio.edit(values), ui.studio.problems
        assert history.label(ui.studio.history.steps("scene")[0][-1]) == words
    ui.studio.set_scene(load_scene("scenes/lamplit_shells.yaml"))
    words = history.label(ui.studio.history.steps("scene")[0][-1])
    assert words.startswith("Formula, ")
    assert words.endswith("more")


def test_buttons_undo_and_redo(seen: Seen) -> None:
    ui, done, stage = opened()
    seen.fresh(stage)
    assert not any(seen.enabled[name] for name in ("undo", "redo", "undo_camera", "redo_camera"))
    steps(ui, 2)
    ui.studio.undo("scene")
    seen.fresh(stage)
    assert seen.enabled["undo"]
    assert seen.enabled["redo"]
    seen.click(stage, "undo")
    seen.click(stage, "redo")
    assert done == ["undo", "redo"]


# Bookmarks


def test_bookmarks_are_added_renamed_gone_to_and_deleted(seen: Seen) -> None:
    ui, done, stage = opened()
    first = ui.studio.scene
    seen.click(stage, "add")
    assert dict(ui.studio.scene.bookmarks) == {"view 1": first.camera}
    ui.studio.set_camera(first.camera.model_copy(update={"fov": 20.0}))
    assert history.add(ui, "near")
    assert not history.add(ui, "near")
    assert "already" in ui.studio.problems["bookmarks"]
    assert history.rename(ui, "view 1", "far away")
    assert list(ui.studio.scene.bookmarks) == ["far away", "near"]
    assert not history.rename(ui, "far away", "near")
    assert not history.rename(ui, "far away", "  ")
    assert list(ui.studio.scene.bookmarks) == ["far away", "near"]
    seen.fresh(stage)
    seen.click(stage, "go")  # of the last one
    assert done == ["bookmark_2"]
    seen.click(stage, "delete")
    assert list(ui.studio.scene.bookmarks) == ["far away"]
    while ui.studio.undo("scene"):
        pass
    assert ui.studio.scene.bookmarks == first.bookmarks


def test_the_tenth_bookmark_has_no_key_and_is_reached_all_the_same() -> None:
    ui, done, _ = opened()
    for number in range(11):
        ui.studio.set_camera(ui.studio.scene.camera.model_copy(update={"fov": 20.0 + number}))
        assert history.add(ui, f"{number}")
    history.go_to_bookmark(ui, 10, "9")
    assert done == []
    assert ui.studio.scene.camera == ui.studio.scene.bookmarks["9"]


# The bar of buttons


def test_every_button_does_its_action(seen: Seen) -> None:
    ui, done = make_ui(SCENE)
    stage = Stage(ui, menu.draw, window=False)
    steps(ui, 2)
    ui.studio.undo("scene")
    stage.frame()
    for action in menu.ACTIONS:
        assert action in ACTIONS
        seen.click(stage, action)
    assert tuple(done) == menu.ACTIONS
    x = [place[0] for place in seen.places.values()]
    assert max(x) < ui.size[0] - 20
    assert min(x) > ui.size[0] - 364


def test_a_hidden_bar_draws_nothing(seen: Seen) -> None:
    ui, _ = make_ui(SCENE)
    ui.show.discard("panels")
    Stage(ui, menu.draw, window=False)
    assert seen.places == {}


# The column


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.sampled_from(PARTS), unique=True, min_size=1),
    st.floats(300, 3000),
    st.floats(300, 2000),
    st.booleans(),
)
def test_parts_lie_below_each_other_and_within_the_window(
    order: list[str], width: float, height: float, overlay: bool
) -> None:
    ui, _ = make_ui(SCENE)
    ui.size = (width, height)
    ui.show = {"panels", "overlay"} if overlay else {"panels"}
    for part in order:
        ui.show.add(part)
        right_dock.fit(ui)
    assert order[-1] in ui.show
    below = menu.HEIGHT
    places = [right_dock.place(ui, part) for part in PARTS if part in ui.show]
    for left, top, wide, high in places:
        assert left >= 0
        assert left + wide <= width
        assert top >= below
        below = top + high
    assert below <= height or len(places) == 1


def test_the_part_that_was_opened_first_gives_way() -> None:
    ui, _ = make_ui(SCENE)
    ui.size = (1280, 720)
    for part in ("variations", "history", "stills"):
        ui.show.add(part)
        right_dock.fit(ui)
    assert [part for part in PARTS if part in ui.show] == ["stills", "history"]
    ui.size = (2560, 1440)
    ui.show.add("variations")
    right_dock.fit(ui)
    assert ui.show >= set(PARTS)
