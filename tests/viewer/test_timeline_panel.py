"""The timeline as it is used: buttons, scrubbing, keys and curves that are dragged, the inspector; without a window."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from clfractal.scene.animation import Animation, Key, Track
from clfractal.scene.load import load_scene
from clfractal.viewer import timeline_edits as t
from clfractal.viewer import timeline_view
from clfractal.viewer.panels import (
    overlay,
    right_dock,
    theme,
    timeline_area,
    timeline_inspector,
    timeline_rows,
    widgets,
)
from clfractal.viewer.panels import timeline as panel
from clfractal.viewer.playing import Player
from tests.viewer.films import MOVING, STILL, keys
from tests.viewer.panel_clicks import Seen
from tests.viewer.panel_harness import Stage, make_ui

pytestmark = pytest.mark.usefixtures("drawing_context")

ROWS = ("camera.position", "formula.parameters.power", "camera.fov")


class Film:
    """A timeline over a scene."""

    def __init__(self, text: str = MOVING, size: tuple[float, float] = (1280, 720)) -> None:
        self.ui, self.done = make_ui(text)
        self.ui.size = size
        self.player = self.ui.memory["player"] = Player(self.ui.studio)
        self.ui.studio.go_to_frame(0.0)
        self.stage = Stage(self.ui, panel.draw, window=False)
        self.view = timeline_view.of(self.ui.memory)

    @property
    def left(self) -> float:
        return timeline_area.left_of(self.ui) + 8 + timeline_area.LEFT

    @property
    def width(self) -> float:
        whole = self.ui.size[0] - timeline_area.left_of(self.ui) - theme.MARGIN
        return whole - 16 - panel._INSPECTOR - 8 - timeline_area.LEFT - timeline_area.BAR

    def x(self, frame: float) -> float:
        return self.view.x_of(frame, self.left, self.width)

    @property
    def ruler(self) -> float:
        return self.ui.size[1] - theme.MARGIN - timeline_area.HEIGHT + 21 + float(imgui.get_frame_height())

    def y(self, name: str) -> float:
        """The middle of a track's row."""
        return self.ruler - 9 + panel._RULER + timeline_rows.ROW * (ROWS.index(name) + 0.5)

    def keys(self, name: str = "camera.fov") -> dict[float, Any]:
        return keys(self.ui.studio, name)

    @property
    def frame(self) -> Any:
        return self.ui.studio.frame_number


def test_other_panels_make_room(monkeypatch: pytest.MonkeyPatch) -> None:
    film = Film()
    film.ui.show.add("history")
    top = film.ui.size[1] - theme.MARGIN - timeline_area.HEIGHT
    _, above, _, height = right_dock.place(film.ui, "history")
    assert above + height < top
    calls: list[tuple[float, float]] = []
    monkeypatch.setattr(overlay, "_state", lambda ui, left, bottom: calls.append((left, bottom)))
    Stage(film.ui, overlay.draw, window=False)
    assert calls[-1][1] < top


def test_every_button_does_its_action(monkeypatch: pytest.MonkeyPatch) -> None:
    film = Film()
    seen = Seen(monkeypatch)
    seen.fresh(film.stage)
    actions = ["film_first", "key_back", "frame_back", "play", "frame_forward", "key_forward", "film_last"]
    actions += ["play_repeat", "record_flight", "auto_keys", "set_keys", "timeline"]
    for action in actions:
        seen.click(film.stage, action)
    assert film.done == actions
    assert not seen.enabled["delete_keys"]
    seen.click(film.stage, "timeline.curves")
    assert film.view.curves


# Scrubbing


def test_a_drag_on_the_ruler_scrubs() -> None:
    film = Film()
    film.stage.drag((film.x(5), film.ruler), (film.x(30), film.ruler))
    assert film.frame == 30
    requests = film.ui.studio.session.requests  # type: ignore[attr-defined]
    assert len({scene.camera.position for scene, moving in requests if moving}) > 3
    assert not film.ui.studio.unsaved
    assert film.ui.studio.history.depth("scene") == (0, 0)


def test_a_drag_with_shift_on_the_ruler_chooses_what_is_played() -> None:
    film = Film()
    shown = film.ui.studio.frame_number
    film.stage.hold(imgui.Key.mod_shift, True)
    film.stage.drag((film.x(25), film.ruler), (film.x(8), film.ruler))
    film.stage.hold(imgui.Key.mod_shift, False)
    player = film.ui.memory["player"]
    assert player.span == (8, 25)
    assert film.ui.studio.frame_number == shown
    film.stage.drag((film.x(5), film.ruler), (film.x(30), film.ruler))
    assert player.span == (8, 25)
    assert film.ui.studio.frame_number == 30


def test_the_wheel_on_the_ruler_shows_fewer_frames() -> None:
    film = Film()
    film.stage.move(film.x(20), film.ruler)
    film.stage.io.add_mouse_wheel_event(0, 2)
    film.stage.frame()
    film.stage.frame()
    assert film.view.last - film.view.first < 35
    # (Pointers are at whole points.)
    assert film.x(20) == pytest.approx(imgui.get_mouse_pos().x, abs=1)


# Keys in rows


def test_a_key_is_dragged_in_time() -> None:
    film = Film()
    y = film.y("camera.fov")
    film.stage.drag((film.x(10), y), (film.x(25), y))
    assert film.keys() == {0: 30, 25: 60}
    assert film.view.selection == {("camera.fov", 1)}
    assert film.ui.studio.history.depth("scene") == (1, 0)
    assert film.ui.studio.undo("scene")
    assert film.ui.studio.document == load_scene(MOVING)


def test_several_keys_are_moved_and_stretched() -> None:
    film = Film()
    film.stage.click(film.x(0), film.y("camera.position"))
    film.stage.hold(imgui.Key.mod_shift, True)
    film.stage.click(film.x(10), film.y("camera.fov"))
    film.stage.hold(imgui.Key.mod_shift, False)
    assert film.view.selection == {("camera.position", 0), ("camera.fov", 1)}
    film.stage.drag((film.x(10), film.y("camera.fov")), (film.x(14), film.y("camera.fov")))
    assert list(film.keys()) == [0, 14]
    assert list(film.keys("camera.position")) == [4, 40]
    film.stage.hold(imgui.Key.mod_alt, True)
    film.stage.drag((film.x(14), film.y("camera.fov")), (film.x(28), film.y("camera.fov")))
    film.stage.hold(imgui.Key.mod_alt, False)
    assert list(film.keys()) == [0, 28]
    assert list(film.keys("camera.position")) == [8, 40]


def test_a_box_chooses_keys_and_delete_removes_them() -> None:
    film = Film()
    film.stage.drag((film.x(-0.7), film.y("camera.position") - 8), (film.x(12), film.y("camera.fov") + 8))
    assert film.view.selection == {("camera.position", 0), ("camera.fov", 0), ("camera.fov", 1)}
    film.view.delete(film.ui.studio)
    film.stage.frame()
    assert set(film.ui.studio.document.animation.tracks) == {"camera.position", "formula.parameters.power"}  # type: ignore[union-attr]
    film.stage.click(film.x(20), film.y("camera.position"))
    assert film.view.selection == t.NONE


def test_a_double_click_adds_a_key_that_changes_nothing() -> None:
    film = Film()
    before = film.ui.studio.document
    film.stage.double_click(film.x(5), film.y("camera.fov"))
    assert film.keys()[5] == pytest.approx(30 * 2**0.5)
    film.stage.double_click(film.x(20), film.y("formula.parameters.power"))
    assert film.ui.studio.document.animation.tracks["formula.parameters.power"].keys is None  # type: ignore[union-attr]
    assert film.ui.studio.document != before


def test_a_drag_that_leads_out_of_a_range_is_taken_back() -> None:
    film = Film(MOVING.replace("frames: 41", "frames: 41\n  loop: true"))
    before = film.ui.studio.document
    y = film.y("camera.fov")
    film.view.last = 80
    film.stage.drag((film.x(10), y), (film.x(60), y))
    assert film.ui.studio.document == before or max(film.keys()) < 41


# Curves


def curved(name: str) -> Film:
    film = Film()
    film.view.curves, film.view.track = True, name
    film.stage.frame()
    return film


def place(film: Film, frame: float, value: float) -> tuple[float, float]:
    """Where a value is in the curves of the chosen track."""
    document = film.ui.studio.document
    assert document.animation is not None
    curve = timeline_view.curve_of(film.ui.studio, film.view.track, film.view.first, film.view.last)
    values = [key.values for key in document.animation.tracks[film.view.track].keys or ()]
    low, high = timeline_view.bounds_of(curve, values)
    top, bottom = film.ruler - 9 + panel._RULER + 4, film.ui.size[1] - theme.MARGIN - 7 - 6
    return film.x(frame), bottom - (value - low) / (high - low) * (bottom - top)


def test_several_keys_of_a_curve_are_dragged_together() -> None:
    film = curved("camera.fov")
    assert film.view.change(film.ui.studio, lambda a: t.with_key(a, "camera.fov", 20.0, 45.0))
    film.stage.frame()
    # A box around the second and the third.
    film.stage.drag((film.x(7), place(film, 0, 62)[1]), (film.x(22), place(film, 0, 43)[1]))
    assert film.view.selection == {("camera.fov", 1), ("camera.fov", 2)}
    before = film.ui.studio.document
    film.stage.drag(place(film, 10, 60), place(film, 16, 50))
    assert list(film.keys()) == [0, 16, 26]
    assert film.keys()[16] == pytest.approx(50, abs=0.7)
    assert film.keys()[26] == pytest.approx(film.keys()[16] - 15)
    assert film.view.selection == {("camera.fov", 1), ("camera.fov", 2)}
    # They go no farther than the first of them may: to the end of the film, and beside the key that stays.
    film.stage.drag(place(film, 16, film.keys()[16]), place(film, 39, film.keys()[16]))
    assert list(film.keys()) == [0, 30, 40]
    film.stage.drag(place(film, 40, film.keys()[40]), place(film, 3, film.keys()[40]))
    assert list(film.keys()) == [0, 1, 11]
    for _ in range(3):
        assert film.ui.studio.undo("scene")
    assert film.ui.studio.document == before


def test_shift_chooses_keys_of_a_curve_and_drags_values_alone() -> None:
    film = curved("camera.fov")
    film.stage.click(*place(film, 0, 30))
    film.stage.hold(imgui.Key.mod_shift, True)
    film.stage.click(*place(film, 10, 60))
    assert film.view.selection == {("camera.fov", 0), ("camera.fov", 1)}
    film.stage.drag(place(film, 10, 60), place(film, 14, 50))
    assert list(film.keys()) == [0, 10]
    assert film.keys()[10] == pytest.approx(50, abs=0.7)
    assert film.keys()[0] == pytest.approx(film.keys()[10] - 30)
    film.stage.click(*place(film, 10, film.keys()[10]))
    assert film.view.selection == {("camera.fov", 0)}
    film.stage.hold(imgui.Key.mod_shift, False)
    film.stage.click(film.x(30), place(film, 0, film.keys()[0])[1])
    assert film.view.selection == t.NONE


def test_handles_are_dragged() -> None:
    film = curved("camera.fov")
    film.view.selection = frozenset({("camera.fov", 0)})
    assert film.view.change(film.ui.studio, lambda a: t.with_way(a, film.view.selection, "bezier"))
    film.stage.frame()
    film.stage.drag(place(film, 20 / 3, 50), place(film, 3, 40))
    animation = film.ui.studio.scene.animation
    assert animation is not None
    handles = t.key_of(animation, ("camera.fov", 0)).handles
    assert handles == pytest.approx((1 / 3, 1 / 3, 0.3, 1 / 3), abs=0.03)


def test_an_expression_is_a_curve_that_stays() -> None:
    film = curved("formula.parameters.power")
    before = film.ui.studio.document
    film.stage.drag(place(film, 10, 9), place(film, 20, 7.5))
    assert film.ui.studio.document == before
    assert before.animation is not None
    why = timeline_view.why_fixed(before.animation, "formula.parameters.power")
    assert "expression" in why
    assert "8 + sin(2*pi*u)" in why
    curve = timeline_view.curve_of(film.ui.studio, "formula.parameters.power", 0, 40)
    assert (curve[0][0], curve[-1][0]) == (0, 40)
    assert curve[len(curve) // 4][1][0] == pytest.approx(9, abs=0.01)


# The inspector


def test_every_setting_of_a_film_is_edited_in_the_timeline() -> None:
    for section, names in timeline_inspector.EDITED.items():
        assert names == frozenset(section.model_fields)
    assert set(timeline_inspector.EDITED) == {Animation, Track, Key}


def test_numbers_of_a_key_are_typed() -> None:
    film = Film()
    film.stage.click(film.x(10), film.y("camera.fov"))
    x = film.ui.size[0] - theme.MARGIN - 60
    top = film.ruler - 9
    for number, text in ((0, "15"), (1, "42")):
        film.stage.double_click(x, top + 36 + 27 * number)
        film.stage.hold(imgui.Key.mod_ctrl, True)
        film.stage.press(imgui.Key.a)
        film.stage.hold(imgui.Key.mod_ctrl, False)
        film.stage.type(text)
        film.stage.press(imgui.Key.enter)
    assert film.keys() == {0: 30, 15: 42}


def test_how_chosen_keys_go_on_is_picked(monkeypatch: pytest.MonkeyPatch) -> None:
    film = Film()
    film.stage.click(film.x(10), film.y("camera.fov"))
    picked = {"key.way": "linear"}
    monkeypatch.setattr(widgets, "choose", lambda name, *rest: picked.get(name))
    film.stage.frame()
    animation = film.ui.studio.scene.animation
    assert animation is not None
    assert [key.interpolation for key in animation.tracks["camera.fov"].keys or ()] == [None, "linear"]


def test_a_key_that_is_dragged_by_its_box_passes_its_neighbour() -> None:
    film = Film()
    film.stage.click(film.x(0), film.y("camera.fov"))
    x, y = film.ui.size[0] - theme.MARGIN - 60, film.ruler - 9 + 36
    film.stage.drag((x, y), (x + 60, y), steps=20)
    (passed,) = film.keys().keys() - {10}
    assert passed > 10, "the drag has to be long enough"
    assert film.keys() == {10: 60, passed: 30}
    assert film.view.selection == {("camera.fov", 1)}
    assert film.ui.studio.history.depth("scene") == (1, 0)
    # The same box goes on with the key that is chosen now.
    film.stage.drag((x, y), (x + 15, y))
    (later,) = film.keys().keys() - {10}
    assert later > passed
    assert film.ui.studio.undo("scene")
    assert film.ui.studio.undo("scene")
    assert film.ui.studio.document == load_scene(MOVING)


def test_the_films_settings_and_new_tracks_open(monkeypatch: pytest.MonkeyPatch) -> None:
    film = Film()
    seen = Seen(monkeypatch)
    seen.fresh(film.stage)
    seen.click(film.stage, "timeline.film")
    assert "Remove the film" in seen.fresh(film.stage)
    seen.click(film.stage, "Remove the film")
    assert film.ui.studio.scene.animation is None
    assert film.ui.studio.undo("scene")
    film.ui.studio.go_to_frame(12.0)
    seen.fresh(film.stage)
    places: dict[str, Any] = {}
    plain = imgui.selectable

    def selectable(text: str, *rest: Any) -> Any:
        places[text] = imgui.get_cursor_screen_pos()
        return plain(text, *rest)

    monkeypatch.setattr(imgui, "selectable", selectable)
    seen.click(film.stage, "timeline.add")
    assert not places.keys() & set(ROWS), "what moves already is no choice"
    film.stage.click(places["camera.target"].x + 20, places["camera.target"].y + 7)
    assert film.keys("camera.target") == {12: (0, 0, 0)}


def test_an_empty_film_tells_what_to_do() -> None:
    film = Film(STILL)
    film.ui.studio.set_animation(t.new_film())
    film.stage.frame()
    film.stage.move(900, 650)
    assert imgui.get_io().want_capture_mouse
    assert film.view.count == 120


@pytest.mark.parametrize("size", [(1280, 720), (640, 400), (360, 240)])
@pytest.mark.parametrize("curves", [False, True])
def test_it_draws_in_windows_of_every_size(size: tuple[float, float], curves: bool) -> None:
    film = Film(size=size)
    film.view.curves = curves
    for name in ROWS:
        film.view.track = name
        film.view.selection = t.keys_between(film.ui.studio.scene.animation, 0, 99, [name])  # type: ignore[arg-type]
        film.stage.frame()
    assert film.ui.studio.document == load_scene(MOVING)
    assert film.ui.studio.messages == []


# The view


def test_marks_of_the_ruler_are_round_and_fit() -> None:
    assert [timeline_view.step_of_marks(span, 10) for span in (5, 10, 15, 120, 2000)] == [1, 1, 2, 20, 200]
    assert timeline_view.marks(-3, 12, 5) == [0, 5, 10]


def test_a_view_zooms_and_pans_within_reason() -> None:
    view = timeline_view.TimelineView(count=100)
    view.show_all()
    view.zoom(50, 1e-9)
    assert view.last - view.first == pytest.approx(4)
    assert view.first < 50 < view.last
    view.zoom(50, 1e9)
    assert view.last - view.first == pytest.approx(200)
    view.pan(1e6)
    assert view.first < 100
    view.pan(-1e6)
    assert view.last > 0
