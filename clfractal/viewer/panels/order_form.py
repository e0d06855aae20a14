"""What panels that order pictures and films are made of: labels, sizes, whole numbers, bars."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from imgui_bundle import imgui, imgui_ctx

from clfractal.scene.parts import MAX_SIDE
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

Size = tuple[int, int]
T = TypeVar("T")
_MOST_SAMPLES = 65_536


@dataclass(slots=True)
class Wanted:
    """What a panel remembers of what is ordered next.

    Attributes:
        size: pixels; None: the usual one.
        samples: for a pixel; None: as many as the scene says.
        kind: of the files, a word of the panel.
        name: of the files, without ending, relative to the current folder; empty: a usual one.
        problem: why the last one could not begin, or empty.
    """

    kind: str
    size: Size | None = None
    samples: int | None = None
    name: str = ""
    problem: str = ""


class Ordered(Protocol):
    """What is rendered, or was."""

    @property
    def problem(self) -> str:
        """Why it failed, or empty."""

    @property
    def written(self) -> object:
        """Whether it is whole, or its files."""

    @property
    def cancelled(self) -> bool:
        """Whether it was ended before."""


def label(text: str) -> float:
    """A label, then the place of its widget; the width that this has, points."""
    wide = imgui.get_content_region_avail().x
    start = imgui.get_cursor_pos_x()
    w.beside(text, theme.DIM)
    left = 0.27 * wide
    imgui.same_line(start + left)
    return float(wide - left)


def number(ui: Ui, name: str, value: int, width: float, most: int, least: int = 1) -> int | None:
    """A box with a whole number; the new one, if it was changed."""
    # A drag over some hundred points reaches every usual size.
    scale = w.Scale(least, most, None, False, True, "", 1.0, 1.0, (False, False))
    change = w.number_box(w.boxes(ui), name, float(value), width, scale)
    return None if change.value is None else round(change.value)


def size(
    ui: Ui, name: str, presets: Mapping[str, Size | None], chosen: Size | None, usual: Size
) -> Size | None:
    """A size of a list or of two numbers; the new choice.

    Args:
        presets: by their titles; None: `usual`.
        chosen: the present choice.
    """
    used = chosen or usual
    words = {}
    for title, each in presets.items():
        wide, high = each or usual
        words[title] = title if title.startswith("Square") else f"{title}, {wide} x {high}"
    present = next((title for title, each in presets.items() if each == chosen), "free")
    found = w.choose(f"{name}.preset", {**words, "free": "Free"}, present, label("Size"))
    if found is not None:
        chosen = presets.get(found, used)
    label("")
    each_width = (imgui.get_content_region_avail().x - 20) / 2
    width = number(ui, f"{name}.width", used[0], each_width, MAX_SIDE)
    w.in_row(5)
    w.beside("x", theme.FAINT)
    w.in_row(5)
    height = number(ui, f"{name}.height", used[1], each_width, MAX_SIDE)
    return (width or used[0], height or used[1]) if width is not None or height is not None else chosen


def samples(ui: Ui, name: str, chosen: int | None) -> int | None:
    """How many samples a pixel gets; None: as many as the scene says."""
    width, usual = label("Samples"), ui.studio.scene.renderer.samples
    found = number(ui, f"{name}.samples", chosen or usual, width - 30, _MOST_SAMPLES)
    w.in_row(4)
    about = f"As the scene says: {usual}"
    if w.icon_button(theme.RESET, about, name=f"{name}.samples.reset", enabled=chosen is not None):
        return None
    return chosen if found is None else found


def files(state: Wanted, name: str, kinds: Mapping[str, str], suggestion: Callable[[], str]) -> None:
    """The kind of the files, of several with their words, and their name.

    Args:
        suggestion: the name that is used if none is given.
    """
    chosen = w.choose(f"{name}.kind", kinds, state.kind, label("Format"))
    if chosen is not None:
        state.kind, state.problem = chosen, ""
    imgui.set_next_item_width(label("Name"))
    _, text = imgui.input_text_with_hint(f"##{name}.name", suggestion(), state.name)
    if text != state.name:
        state.name, state.problem = text, ""
    w.tip(f"Without ending; in {Path.cwd()} unless a folder is given")


def scene_name(ui: Ui, otherwise: str) -> str:
    """The name of the scene's file without ending; another one if it has none."""
    files: Any = ui.memory.get("files")
    path = files.source.path if files is not None else None
    return str(path.stem) if path is not None else otherwise


def head(each: Ordered, icon: str, text: str, about: str, *, button: bool) -> None:
    """The first line of what was ordered: how it stands, and its name; then the place of a button, if it has one."""
    color = theme.ACCENT
    if each.problem:
        icon, color = theme.WARN, theme.WARNING
    elif each.written:
        icon, color = theme.CHECK, theme.GOOD
    elif each.cancelled:
        icon, color = theme.CROSS, theme.FAINT
    w.beside(icon, color)
    w.in_row(7)
    side = imgui.get_frame_height()
    w.beside(w.clipped(text, imgui.get_content_region_avail().x - (side + 6 if button else 0)))
    w.tip(about)
    if button:
        imgui.same_line(imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - side)


def foot(each: Ordered, text: str, share: float | None) -> None:
    """What is below: a bar while something is done of it, and how it stands in words."""
    if share is not None:
        bar(share, imgui.get_content_region_avail().x)
    with theme.font(size=12.5):
        w.wrapped(text, color=theme.WARNING if each.problem else theme.FAINT)
    imgui.dummy(imgui.ImVec2(0, 2))


def listed(each: Sequence[T], draw: Callable[[T], None], *, ended: bool) -> bool:
    """What was ordered, the newest first; whether those that have ended are to be forgotten."""
    imgui.dummy(imgui.ImVec2(0, 2))
    for one in reversed(each):
        with imgui_ctx.push_obj_id(one):
            draw(one)
    return ended and w.button("Clear the list", about="Forgets what has ended; the files stay")


def bar(share: float, width: float) -> None:
    """How much is done, 0 to 1."""
    corner, high = imgui.get_cursor_screen_pos(), 5.0
    draw_list = imgui.get_window_draw_list()
    far = imgui.ImVec2(corner.x + width, corner.y + high)
    draw_list.add_rect_filled(corner, far, theme.packed(theme.FRAME), high / 2)
    if share > 0:
        filled = imgui.ImVec2(corner.x + max(share * width, high), far.y)
        draw_list.add_rect_filled(corner, filled, theme.packed(theme.ACCENT), high / 2)
    imgui.dummy(imgui.ImVec2(width, high))


def time_text(seconds: float) -> str:
    """A time that is left, for people."""
    if seconds < 90:
        return f"{max(round(seconds), 1)} s"
    if seconds < 90 * 60:
        return f"{round(seconds / 60)} min"
    return f"{seconds / 3600:.1f} h"
