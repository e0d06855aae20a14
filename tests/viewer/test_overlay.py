"""What is told over the picture: the figures of known scenes, messages that come and go, and the help."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from imgui_bundle import imgui, imgui_ctx

from clfractal.camera.views import scene_view
from clfractal.files.document import read_document
from clfractal.scene.load import SceneText, load_scene
from clfractal.scene.model import Scene
from clfractal.stereo import eyes as geometry
from clfractal.viewer import zoom_box
from clfractal.viewer.actions import ACTIONS
from clfractal.viewer.keys import KeyMap
from clfractal.viewer.panels import all_panels, messages, overlay, theme
from clfractal.viewer.panels import help as help_panel
from clfractal.viewer.panels.ui import Speed, Ui
from clfractal.viewer.studio import MESSAGE_SECONDS, Message
from tests.viewer.panel_harness import Stage, headless, make_ui

BULB = "version: 1\nformula: {name: mandelbulb, iterations: 9}\ncamera: {}\n"
VOLUME = (
    BULB + "renderer: {type: volume, resolution: 64, zoom: [{center: [0, 0, 0], scale: 4},"
    " {center: [0.1, 0, 0], scale: 3}]}\n"
)
PLANE = BULB + "renderer: {type: cut_plane, plane: {height: 2.5}}\n"
STEREO = BULB + (
    "stereo: {mode: split_half, screen_width: 0.5, screen_distance: 0.7, interpupillary_distance: 0.06, swap: true}\n"
)


def ui_of(text: str) -> Ui:
    """What panels are given for a scene's text."""
    return make_ui(scene(text))[0]


def scene(text: str) -> Scene:
    """The scene of a text."""
    return load_scene(SceneText(read_document(text), Path()))


def told(ui: Ui) -> dict[str, str]:
    """All figures by their labels, each of which is there once."""
    pairs = [pair for row in overlay.lines(ui) for pair in row]
    assert len({label for label, _ in pairs}) == len(pairs)
    return dict(pairs)


def frame(ui: Ui, **changes: Any) -> None:
    """Gives the session a frame."""
    values = {
        "seconds": 2.5,
        "frame_seconds": 0.0123,
        "divider": 1,
        "samples": 3,
        "finished": False,
        "job": SimpleNamespace(samples=16, precision="float32"),
        "is_draft": False,
        "arrangement": SimpleNamespace(size=lambda look: (640, 360)),
        **changes,
    }
    ui.studio.session.frame = SimpleNamespace(**values)  # type: ignore[assignment]
    ui.studio.session.paused = False


FRAME = {"frames": None, "device": "Processor of the tests", "number": "float32"}
SHARED = {"frames": "30/s", "picture": "shared", "samples": "3 of 16", "size": "640 x 360", "render": "2.5 s"}


@pytest.mark.parametrize(
    ("changes", "paused", "speed", "figures"),
    [
        ({}, False, Speed(29.6, "shared"), {**FRAME, **SHARED}),
        ({"divider": 4, "samples": 1}, False, None, {**FRAME, "size": "640 x 360, 1/4", "render": "12 ms"}),
        ({}, True, None, {**FRAME, "samples": "3 of 16, paused"}),
        ({"samples": 16, "finished": True}, True, None, {**FRAME, "samples": "16 of 16"}),
    ],
    ids=["moving", "coarse", "paused", "finished"],
)
def test_a_picture_s_figures(
    changes: dict[str, Any], paused: bool, speed: Speed | None, figures: dict[str, str | None]
) -> None:
    ui = ui_of(BULB)
    if speed is not None:
        ui.speed = speed
    frame(ui, **changes)
    ui.studio.session.paused = paused
    assert {name: told(ui).get(name) for name in figures} == figures


@pytest.mark.parametrize(
    ("text", "figures"),
    [
        (BULB, {"method": "distance, gradient", "step": "1 px", "iterations": "9", "render": None}),
        (
            BULB + "renderer: {search: steps, step: 0.02, normal: least_squares}\n",
            {"method": "steps, least squares", "step": "0.02"},
        ),
        # The step is null: the hundredth part of the bounds' radius.
        (BULB + "renderer: {search: steps, bounds: {radius: 3.5}}\n", {"step": "0.035"}),
        (VOLUME, {"method": "volume, inside, gradient"}),
        (PLANE, {"method": "cut plane"}),
    ],
)
def test_a_scene_s_figures(text: str, figures: dict[str, str | None]) -> None:
    found = told(ui_of(text))
    assert {name: found.get(name) for name in figures} == figures
    assert text != PLANE or "2.5" in found["plane"]


def test_depth_and_place_under_the_pointer() -> None:
    ui = ui_of(BULB)
    found = [told(ui)]
    for point, depth in (((0.5, -1.25, 0.125), 1.75), (None, float("inf"))):
        pick_at(ui, point, depth)
        found.append(told(ui))
    assert [each["depth"] for each in found] == ["-", "1.75", "-"]
    assert [each.get("point") for each in found[1:]] == ["0.5, -1.25, 0.125", None]


def test_a_volume_tells_its_zoom_and_the_next_one() -> None:
    ui = ui_of(VOLUME)
    assert told(ui)["zoom"] == "12x"
    assert "new zoom" not in told(ui)
    box = zoom_box.ZoomBox((0.1, 0.0, 0.0), 5.0)
    ui.memory["controls"] = SimpleNamespace(box=box, marking=True)
    assert told(ui)["new zoom"] == "60x"
    ui.memory["controls"].marking = False
    assert "new zoom" not in told(ui)


def pick_at(ui: Ui, point: tuple[float, float, float] | None, depth: float) -> None:
    """Puts the pointer over a point of the scene."""
    view = SimpleNamespace(scene=ui.studio.scene)
    ui.pick = SimpleNamespace(point=point, depth=depth, view=view)  # type: ignore[assignment]


def test_stereo_tells_mode_distances_and_parallax() -> None:
    ui = ui_of(STEREO)
    found = told(ui)
    assert found["stereo"] == "split half, swapped"
    assert "0.5" in found["screen"]
    assert "0.7" in found["screen"]
    assert "0.06" in found["eyes"]
    assert not {"stereo", "screen", "eyes", "parallax"} & set(told(ui_of(BULB)))


@given(st.floats(0.3, 8.0))
def test_parallax_is_that_of_the_thesis(distance: float) -> None:
    """e (1 - d / z) for a point at depth z on the middle eye's axis, screen at depth d (section 3.3.1)."""
    ui = ui_of(STEREO)
    shown = ui.studio.shown_scene
    assert shown.stereo is not None
    middle = geometry.eye_views(shown)["middle"]
    assert middle.eye is not None
    screen = geometry.eye_distance(middle)
    point = middle.eye + middle.axis * screen * distance
    x, y, z = point.tolist()
    pick_at(ui, (x, y, z), distance)
    on_screen = float(told(ui)["parallax"].split(",")[0])
    assert on_screen == pytest.approx(0.06 * (1 - 1 / distance), abs=6e-5, rel=1e-3)


def test_the_point_that_cameras_look_at_lies_on_the_screen() -> None:
    ui = ui_of(STEREO)
    target = ui.studio.scene.camera.target
    assert np.allclose(scene_view(ui.studio.scene).center, target)
    pick_at(ui, target, 3.0)
    assert abs(float(told(ui)["parallax"].split(",")[0])) < 1e-9


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 ms"),
        (0.0421, "42 ms"),
        (0.999, "999 ms"),
        (1.0, "1.0 s"),
        (59.94, "59.9 s"),
        (600, "10.0 min"),
    ],
)
def test_times(seconds: float, text: str) -> None:
    assert overlay.seconds_text(seconds) == text


@pytest.mark.parametrize("text", [BULB, VOLUME, PLANE, STEREO])
@pytest.mark.parametrize("size", [(1280.0, 720.0), (640.0, 400.0), (2560.0, 1440.0)])
def test_rows_fit_into_the_window(text: str, size: tuple[float, float]) -> None:
    ui = ui_of(text)
    frame(ui)
    with headless():
        ui.size = size
        stage = Stage(ui, overlay.draw, window=False)
        stage.frame()
        room = size[0] - 340
        imgui.new_frame()
        rows = overlay._wrapped(overlay.lines(ui), room)
        widths = [sum(overlay._width(pair) for pair in row) for row in rows if len(row) > 1]
        imgui.end_frame()
    assert all(width <= room for width in widths)
    assert [pair for row in rows for pair in row] == [pair for row in overlay.lines(ui) for pair in row]


# Messages


def test_messages_come_fade_and_go() -> None:
    ui = ui_of(BULB)
    ui.studio.messages = [Message("saved", False, 100.0), Message("cannot be read", True, 100.0)]
    assert messages.visible(ui, 100.0) == [("saved", False, 1.0), ("cannot be read", True, 1.0)]
    late = messages.visible(ui, 100.0 + MESSAGE_SECONDS - 0.25)
    assert late[0][0] == "saved"
    assert late[0][2] == pytest.approx(0.5)
    assert [text for text, _, _ in messages.visible(ui, 101.0 + MESSAGE_SECONDS)] == ["cannot be read"]
    assert messages.visible(ui, 100.0 + 3 * MESSAGE_SECONDS) == []


def test_a_repeated_message_is_shown_once_and_begins_anew() -> None:
    ui = ui_of(BULB)
    ui.studio.messages = [Message("nothing more", False, 100.0), Message("nothing more", False, 104.0)]
    assert messages.visible(ui, 104.0) == [("nothing more", False, 1.0)]
    assert messages.visible(ui, 104.0 + MESSAGE_SECONDS - 1) == [("nothing more", False, 1.0)]


def test_the_newest_of_many_messages_are_shown() -> None:
    ui = ui_of(BULB)
    ui.studio.messages = [Message(f"line {number}", False, 100.0) for number in range(30)]
    shown = [text for text, _, _ in messages.visible(ui, 100.0)]
    assert shown == [f"line {number}" for number in range(30 - len(shown), 30)]
    assert 2 <= len(shown) <= 6


def test_a_message_goes_when_its_cause_does() -> None:
    ui = ui_of(BULB)
    waits = [True]
    ui.studio.tell("click what shall be sharp", holds=lambda: waits[0])
    now = ui.studio.messages[0].time
    assert [text for text, _, _ in messages.visible(ui, now)] == ["click what shall be sharp"]
    waits[0] = False
    assert messages.visible(ui, now) == []


def test_a_refused_change_is_told_until_it_is_possible() -> None:
    tracks = "{camera.fov: {keys: [{frame: 0, value: 40}, {frame: 9, value: 50}]}}"
    ui = make_ui(
        load_scene(BULB, overrides=[f"animation={{fps: 10, frames: 10, tracks: {tracks}}}"], posed=False)
    )[0]
    assert not ui.studio.edit({"camera": {"projection": "orthographic"}})
    (message,) = ui.studio.messages
    assert messages.visible(ui, message.time) != []
    assert ui.studio.edit({"camera": {"position": [0.0, -4.0, 0.0]}})
    assert messages.visible(ui, message.time) == []


def test_an_action_that_is_done_again_replaces_what_it_told() -> None:
    """Going through six modes of stereo leaves one line."""
    ui = ui_of(BULB)
    for mode in ("rows", "columns", "split"):
        ui.studio.begin_topic("next_stereo")
        ui.studio.tell(f"stereo: {mode}")
        ui.studio.begin_topic("")
    ui.studio.tell("saved")
    assert [message.text for message in ui.studio.messages] == ["stereo: split", "saved"]


def test_messages_about_another_scene_go() -> None:
    ui = ui_of(BULB)
    ui.studio.tell("the file has changed on the disk", wrong=True)
    ui.studio.open(ui.studio.scene)
    assert ui.studio.messages == []


@pytest.mark.parametrize("size", [(1280, 720), (640, 360), (420, 300)])
def test_messages_never_cover_a_dialog(size: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    ui = ui_of(BULB)
    ui.size = size
    ui.show |= {"close"}
    ui.memory["files"] = SimpleNamespace(
        offered=(), recovered=[], wanted=None, source=SimpleNamespace(path=None)
    )
    boxes: list[tuple[bool, messages.Box]] = []
    plain = messages._line

    def line(canvas: Any, text: str, wrong: bool, alpha: float, box: messages.Box) -> None:
        boxes.append((canvas == imgui.get_foreground_draw_list(), box))
        plain(canvas, text, wrong, alpha, box)

    monkeypatch.setattr(messages, "_line", line)
    for number in range(4):
        ui.studio.tell(
            f"{number}: a line that is so long that it takes three rows of the narrow box " * 2, wrong=True
        )
    with headless():
        stage = Stage(ui, all_panels.draw, window=False)
        boxes.clear()
        stage.frame()
        dialog = imgui.internal.find_window_by_name("##dialog")
        left, top = dialog.pos.x, dialog.pos.y
        right, bottom = left + dialog.size.x, top + dialog.size.y
    assert len(boxes) == 4
    for above, (x0, y0, x1, y1) in boxes:
        apart = x1 <= left or x0 >= right or y1 <= top or y0 >= bottom
        assert apart or not above  # what does not fit beside it lies below
    if size == (1280, 720):
        assert all(above for above, _ in boxes)


def test_a_mistake_in_a_panel_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """As what it is, whatever was open around it; the other frames are drawn."""
    draws = 0

    def wrong(ui: Ui) -> None:
        nonlocal draws
        draws += 1
        with theme.window("wrong", (0, 0), (100, 100)), imgui_ctx.push_id("a"), imgui_ctx.begin_child("##b"):
            imgui.open_popup("c")
            assert imgui.begin_popup("c")
            raise LookupError("no such thing")

    monkeypatch.setattr(messages, "draw", wrong)
    ui = ui_of(BULB)
    with headless():
        Stage(ui, all_panels.draw_safely, window=False).frame()
    assert draws == 3
    assert [each.text for each in ui.studio.messages if "LookupError: no such thing" in each.text] == [
        each.text for each in ui.studio.messages if each.wrong
    ]
    assert len([each for each in ui.studio.messages if each.wrong]) == 1


def test_a_message_that_goes_asks_for_more_frames() -> None:
    """Without them it would stay until the next event."""
    ui = ui_of(BULB)
    with headless():
        stage = Stage(ui, messages.draw, window=False)
        assert "awaited" not in ui.memory
        ui.studio.tell("saved")
        stage.frame()
        assert ui.memory.pop("awaited")
        ui.studio.messages.clear()
        stage.frame()
        assert "awaited" not in ui.memory


# Help


def test_the_help_has_every_key_and_the_pointer() -> None:
    ui = ui_of(BULB)
    blocks = help_panel.blocks(ui)
    assert [title for title, _ in blocks] == [
        "Pointer",
        *dict.fromkeys(action.group for action in ACTIONS.values()),
    ]
    shown = {told for _, rows in blocks for _, told in rows}
    assert {action.help for name, action in ACTIONS.items() if ui.keys.hint(name)} <= shown
    keys = " ".join(keys for _, rows in blocks for keys, _ in rows)
    for chord in ("F1", "F2", "F11", "Ctrl+S", "Ctrl+Z", "Ctrl+Shift+Z", "Escape"):
        assert chord in keys


def test_the_help_has_the_user_s_own_keys() -> None:
    ui = ui_of(BULB)
    ui.keys = KeyMap.from_settings({"help": "Ctrl+F9"})
    rows = dict(help_panel.blocks(ui))["Window"]
    assert ("Ctrl+F9", ACTIONS["help"].help) in rows


@given(st.lists(st.integers(1, 30), min_size=1, max_size=12), st.integers(1, 4))
def test_columns_keep_the_order_and_are_about_equally_high(heights: list[int], count: int) -> None:
    found = [(f"{number}", [("key", "told")] * rows) for number, rows in enumerate(heights)]
    columns = help_panel.columns_of(found, count)
    assert [block for column in columns for block in column] == found
    assert 1 <= len(columns) <= count
    assert all(columns)
    total, largest = sum(heights) + 2 * len(heights), max(heights) + 2
    # The last column takes what is left; no other one is much higher than its share.
    for column in columns[:-1]:
        assert sum(len(rows) + 2 for _, rows in column) <= total / count + 1.5 * largest
