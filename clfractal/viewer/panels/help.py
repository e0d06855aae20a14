"""The help over the picture: every key by what it does, and what the pointer does."""

from __future__ import annotations

from itertools import groupby

from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.buttons import wrapped
from clfractal.viewer.panels.ui import Ui

POINTER_ROWS: tuple[tuple[str, str], ...] = (
    ("drag", "turn about the point under the pointer"),
    ("right or middle drag", "move; the point follows the pointer"),
    ("wheel", "nearer, farther, to the pointer; Shift: finer"),
    ("double click", "centre on what is under the pointer"),
    ("Shift+drag", "drag the nearest light"),
    ("Ctrl+click", "make sharp what is under the pointer"),
    ("Alt+drag", "refine a rectangle alone"),
    ("cut plane: drag", "move the plane; right: turn, middle: tilt"),
    ("zoom cube: drag, wheel", "move it, change its size"),
)
"""Gestures of the pointer and what they do; `docs/window.md` has the same."""

Row = tuple[str, str]


def blocks(ui: Ui) -> list[tuple[str, list[Row]]]:
    """Headings and their rows: (keys, what they do)."""
    rows = ui.keys.help_rows()
    found = [
        (group, [(keys, told) for _, keys, told in each]) for group, each in groupby(rows, lambda row: row[0])
    ]
    return [("Pointer", list(POINTER_ROWS)), *found]


def columns_of(found: list[tuple[str, list[Row]]], count: int) -> list[list[tuple[str, list[Row]]]]:
    """The blocks in columns of about the same height, in their order."""
    total = sum(map(_height, (rows for _, rows in found)))
    columns: list[list[tuple[str, list[Row]]]] = [[]]
    used = 0
    for title, rows in found:
        height = _height(rows)
        if columns[-1] and len(columns) < count and used + height / 2 > total * len(columns) / count:
            columns.append([])
        columns[-1].append((title, rows))
        used += height
    return columns


def _height(rows: list[Row]) -> int:
    """About how many lines a block takes up, with its heading: long texts are wrapped."""
    return 2 + sum(max(-(-len(keys) // 22), -(-len(told) // 46)) for keys, told in rows)


def draw(ui: Ui) -> None:
    """Draws the help, if it is open."""
    if "help" not in ui.show:
        return
    margin = 2 * theme.MARGIN
    wide, high = (side - 2 * margin for side in ui.size)
    imgui.set_next_window_bg_alpha(0.93)
    with theme.window("help", (margin, margin), (wide, high)):
        with theme.font("bold", 18.0):
            imgui.text("Keys and pointer")
        hint = f"{ui.keys.hint('help')} or {ui.keys.hint('cancel')} closes"
        imgui.same_line(imgui.get_window_width() - imgui.calc_text_size(hint).x - 20)
        imgui.text_colored(theme.vec(theme.DIM), hint)
        imgui.dummy(imgui.ImVec2(0, 4))
        count = max(1, min(4, int(wide // 380)))
        if imgui.begin_table("##keys", count):
            for column in columns_of(blocks(ui), count):
                imgui.table_next_column()
                for title, rows in column:
                    _block(title, rows)
            imgui.end_table()


def _block(title: str, rows: list[Row]) -> None:
    with theme.font("bold", 13.5):
        imgui.text_colored(theme.vec(theme.ACCENT), title)
    with theme.font(size=12.5), theme.measures(item_spacing=(6.0, 3.0)):
        keys_width = 138.0
        for keys, told in rows:
            start = imgui.get_cursor_pos()
            wrapped(keys, start.x + keys_width - 8)
            after = imgui.get_cursor_pos_y()
            imgui.set_cursor_pos(imgui.ImVec2(start.x + keys_width, start.y))
            wrapped(told, color=theme.DIM)
            imgui.set_cursor_pos(imgui.ImVec2(start.x, max(after, imgui.get_cursor_pos_y())))
    imgui.dummy(imgui.ImVec2(0, 5))
