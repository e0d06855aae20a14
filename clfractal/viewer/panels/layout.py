"""What panels are laid out with: rows with labels, headings, explanations, the search for settings."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui, imgui_ctx

from clfractal.viewer.panels import buttons, theme
from clfractal.viewer.panels.buttons import Line, clipped, wrapped
from clfractal.viewer.panels.number_box import Boxes
from clfractal.viewer.panels.ui import Ui

GUTTER = 11.0
"""Points left of labels, for the dot of values that are not the default."""
LABELS = 0.42
"""Part of a panel's width that labels take up."""
PROBLEM_SECONDS = 6.0

_NAMES = {
    "fov": "Field of view",
    "f_number": "f-number",
    "png_bits": "PNG bits",
    "min_samples": "Least samples",
    "max_steps": "Most steps",
    "at": "Place",
    "by": "Colour by",
    "center": "Centre",
    "color": "Colour",
    "colors": "Colours",
}


def label_of(name: str) -> str:
    """A field's name as its label."""
    return _NAMES.get(name, name.replace("_", " ").capitalize())


def word(text: str) -> str:
    """A word of the schema (`inverse_square`) as it is shown."""
    return text.replace("_", " ").capitalize()


def boxes(ui: Ui) -> Boxes:
    """The memory of all number boxes."""
    return ui.kept("boxes", Boxes)


# Searching


def filtering(ui: Ui) -> str:
    """What is searched for, in lower case; empty if nothing is, and in a panel that is found as a whole."""
    return "" if ui.memory.get("filter.whole") else searched(ui)


def searched(ui: Ui) -> str:
    """What is searched for, in lower case, whichever panel is drawn."""
    return str(ui.memory.get("filter", "")).strip().lower()


def found(ui: Ui, label: str, path: str = "") -> bool:
    """Whether a row, or something else such as an editor, is to be drawn: nothing is searched for, or it."""
    wanted = filtering(ui)
    if not wanted:
        return True
    heading, name = ui.memory.get("heading", ("", "")), str(ui.memory.get("group", ""))
    matches = all(each in f"{label} {path} {heading[1]} {name}".lower() for each in wanted.split())
    if matches:
        ui.memory.setdefault("hits", {})[heading[0]] = True
        ui.memory.setdefault("filter.drawn", set()).add(path)
        if name and not ui.memory.get("group.drawn"):
            title(name)
            ui.memory["group.drawn"] = True
    return matches


def search(ui: Ui, key: str, prompt: str, width: float = -1.0) -> str:
    """A line to search with; its text is kept in `ui.memory[key]`."""
    imgui.set_next_item_width(width if width > 0 else imgui.get_content_region_avail().x)
    corner = imgui.get_cursor_screen_pos()
    with theme.measures(frame_padding=(25.0, 4.0)):
        _, text = imgui.input_text_with_hint(f"##{key}", prompt, str(ui.memory.get(key, "")))
    imgui.get_window_draw_list().add_text(
        imgui.ImVec2(corner.x + 8, corner.y + 4), theme.packed(theme.DIM), theme.SEARCH
    )
    if text and imgui.is_item_active() and imgui.is_key_pressed(imgui.Key.escape):
        text = ""
    ui.memory[key] = text
    return str(text)


# Rows


def row(
    ui: Ui,
    label: str,
    *,
    path: str = "",
    tip: str = "",
    differs: bool = False,
    reset: Callable[[], object] | None = None,
) -> float | None:
    """Draws a label and goes to the place of its widget; the width that this has, points.

    None where the row is hidden because something else is searched for.

    Args:
        path: of the value, for the tooltip and for searching.
        tip: what the value means.
        differs: whether it is not the default; then a dot is shown, which sets it back.
        reset: sets it back.
    """
    if not found(ui, label, path):
        return None
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    whole = imgui.get_content_region_avail().x
    wide = max(whole * LABELS - GUTTER, 20.0)
    draw = imgui.get_window_draw_list()
    with imgui_ctx.push_id(path or label):
        wanted = imgui.invisible_button("##dot", imgui.ImVec2(GUTTER, height)) and differs
        if differs:
            middle = imgui.ImVec2(corner.x + 3.5, corner.y + height / 2)
            radius = 3.6 if imgui.is_item_hovered() else 2.6
            draw.add_circle_filled(middle, radius, theme.packed(theme.ACCENT))
            buttons.tip("Not the default: click to set it back")
        imgui.same_line(0, 0)
        imgui.invisible_button("##label", imgui.ImVec2(wide, height))
        if reset is not None and (wanted or (imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0))):
            reset()
        _describe(label, path, tip, differs)
    color = theme.TEXT if imgui.is_item_hovered() else theme.DIM
    text = clipped(label, wide - 4)
    top = corner.y + (height - imgui.get_font_size()) / 2
    draw.add_text(imgui.ImVec2(corner.x + GUTTER, top), theme.packed(color, imgui.get_style().alpha), text)
    imgui.same_line(0, 0)
    return float(whole - GUTTER - wide)


def in_labels() -> None:
    """The next item begins where the labels of rows do."""
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + GUTTER)


def columns(count: int, spacing: float = 4.0) -> float:
    """Goes to a new line for several widgets side by side over the whole width; the width of each, points."""
    imgui.new_line()
    in_labels()
    return float(imgui.get_content_region_avail().x - spacing * (count - 1)) / count


def in_row(spacing: float = 6.0) -> None:
    """The next widget stands beside the last one."""
    imgui.same_line(0, spacing)


def problem(ui: Ui, path: str) -> None:
    """What was wrong with the value that was last tried at a path, for some seconds."""
    text = ui.studio.problems.get(path)
    times: dict[str, tuple[str | None, float]] = ui.memory.setdefault("problem.times", {})
    if times.get(path, (None, 0.0))[0] != text:
        times[path] = (text, imgui.get_time())
    if text is not None and imgui.get_time() - times[path][1] <= PROBLEM_SECONDS:
        warn(text)
    else:
        ui.studio.problems.pop(path, None)


def warn(text: str) -> None:
    """A line that tells what is wrong."""
    in_labels()
    wrapped(text, color=theme.WARNING)


def hint(ui: Ui, text: str) -> None:
    """A line of explanation; hidden while something is searched for."""
    if not filtering(ui):
        in_labels()
        wrapped(text, color=theme.DIM)


def group(ui: Ui, name: str) -> None:
    """A small heading within a panel; while something is searched for it comes with the first row that is found."""
    ui.memory["group"], ui.memory["group.drawn"] = name, False
    if not filtering(ui):
        title(name)


def title(text: str) -> None:
    """Draws a small heading."""
    imgui.dummy(imgui.ImVec2(0, 1))
    corner = imgui.get_cursor_screen_pos()
    with theme.font("bold", 12.0):
        text = text.upper()
        size = imgui.calc_text_size(text)
        draw = imgui.get_window_draw_list()
        draw.add_text(imgui.ImVec2(corner.x + GUTTER, corner.y), theme.packed(theme.FAINT), text)
        right = corner.x + imgui.get_content_region_avail().x
        y = corner.y + size.y / 2
        draw.add_line(
            imgui.ImVec2(corner.x + GUTTER + size.x + 8, y), imgui.ImVec2(right, y), theme.packed(theme.LINE)
        )
    imgui.dummy(imgui.ImVec2(0, size.y))


def header(ui: Ui, key: str, title: str, icon: str = "", *, summary: str = "", opened: bool = False) -> bool:
    """A heading that opens and closes what is below it; whether that is open.

    Args:
        key: of the panel, under which it is remembered whether it is open.
        summary: shown at its right, in few words.
        opened: whether it is open at first.
    """
    ui.memory["heading"], ui.memory["group"] = (key, title), ""
    wanted = searched(ui)
    # A panel that is called what is searched for is shown with all its editors.
    whole = ui.memory["filter.whole"] = bool(wanted) and all(each in title.lower() for each in wanted.split())
    if wanted and not whole:
        scene = (wanted, ui.studio.scene.renderer.type)
        if ui.memory.get("hits.of") != scene:
            ui.memory |= {"hits.of": scene, "hits": {}, "hits.seen": set()}
        seen = ui.memory["hits.seen"]
        if key in seen and not ui.memory["hits"].get(key):
            return False
        seen.add(key)
    states = ui.memory.setdefault("open", {})
    is_open = bool(states.get(key, opened))
    line = Line(f"{key}.heading", None, imgui.get_frame_height() + 3)
    if line.clicked and not wanted:
        is_open = states[key] = not is_open
    back = theme.FRAME_HOVERED if line.hovered else theme.HEADER
    line.draw.add_rect_filled(
        line.corner, line.at(line.wide, line.height), theme.packed(back), theme.ROUNDING
    )
    is_open = is_open or bool(wanted)
    line.write(9, icon, theme.ACCENT if is_open else theme.DIM)
    with theme.font("bold"):
        line.write(31, title)
        used = 31 + imgui.calc_text_size(title).x
    line.write(line.wide - 17, theme.OPENED if is_open else theme.CLOSED, theme.DIM)
    if summary:
        line.write(-25, clipped(summary, line.wide - used - 34), theme.FAINT)
    return is_open


# Text


def _describe(label: str, path: str, text: str, differs: bool) -> None:
    if not imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip) or not imgui.begin_tooltip():
        return
    with theme.font("bold"):
        wrapped(label, 280)
    if text:
        # In files a value is null; here it is switched off.
        wrapped((text[:1].upper() + text[1:]).replace("null:", "off:"), 280)
    if path:
        with theme.font("fixed", 12.5):
            wrapped(path, 280, theme.FAINT)
    if differs:
        wrapped("Double click: back to the default", 280, theme.ACCENT)
    imgui.end_tooltip()
