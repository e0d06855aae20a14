"""The steps that can be undone, of the scene and of the camera, and the bookmarks of cameras."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from imgui_bundle import imgui, imgui_ctx

from clfractal.scene.bookmarks import bookmark, view_of
from clfractal.viewer.history import Kind, Step
from clfractal.viewer.panels import right_dock, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.buttons import area
from clfractal.viewer.panels.ui import Ui

_NAMES: dict[Kind, tuple[str, str, str]] = {
    "scene": ("Scene", "undo", "redo"),
    "camera": ("Camera", "undo_camera", "redo_camera"),
}
_MOST_PATHS = 2
_MOST_NAMES = 3


def draw(ui: Ui) -> None:
    """Draws the panel, if it is open."""
    if "history" not in ui.show:
        return
    with (
        right_dock.window(ui, "history", "Steps and bookmarks", theme.HISTORY),
        imgui_ctx.begin_child("##history", imgui.ImVec2(0, 0)),
    ):
        for kind in _NAMES:
            _stack(ui, kind)
        _bookmarks(ui)


# Steps


def _stack(ui: Ui, kind: Kind) -> None:
    done, undone = ui.studio.history.depth(kind)
    with theme.font("bold", 13.0):
        w.beside(_NAMES[kind][0])
    w.in_row(8)
    w.beside(f"{done} back, {undone} forth", theme.FAINT)
    imgui.same_line(
        imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - 2 * imgui.get_frame_height() - 3
    )
    buttons(ui, kind)
    steps, now = ui.studio.history.steps(kind)
    _steps(ui, kind, steps, now)
    imgui.dummy(imgui.ImVec2(0, 3))


def buttons(ui: Ui, kind: Kind) -> None:
    """The buttons that undo and redo steps of a stack."""
    (done, undone), (_, undo, redo) = ui.studio.history.depth(kind), _NAMES[kind]
    w.act(ui, undo, theme.UNDO, "Undo", enabled=done > 0)
    w.in_row(3)
    w.act(ui, redo, theme.REDO, "Redo", enabled=undone > 0)


def _steps(ui: Ui, kind: Kind, steps: list[Step], now: int) -> None:
    """All steps in their order, the present state marked; a click goes to the state after a step."""
    line = imgui.get_text_line_height() + 6
    high = min(max(len(steps) + 1, 2), 5) * line + 8
    with theme.colors(child_bg=theme.HEADER), theme.measures(window_padding=(6.0, 4.0)):
        imgui.begin_child(f"##{kind}", imgui.ImVec2(0, high), imgui.ChildFlags_.always_use_window_padding)
    key = f"history.{kind}"
    moved = ui.memory.get(key) != (len(steps), now)
    ui.memory[key] = (len(steps), now)
    for number in range(len(steps) + 1):
        first = "As it was opened" if len(steps) < 500 else "Earlier"
        if not imgui.is_rect_visible(imgui.ImVec2(10, line)) and number != now:
            imgui.dummy(imgui.ImVec2(1, line - 5))
            continue
        text = _label(ui, steps[number - 1]) if number else first
        if _row(f"{kind}.{number}", text, number == now, faint=number > now):
            go_to(ui, kind, number)
        if number == now and moved:
            imgui.set_scroll_here_y(0.5)
    imgui.end_child()


def _row(name: str, text: str, here: bool, *, faint: bool) -> bool:
    wide, high = imgui.get_content_region_avail().x, imgui.get_text_line_height() + 1
    corner = imgui.get_cursor_screen_pos()
    clicked = area(f"##{name}", (wide, high))
    hovered = imgui.is_item_hovered()
    draw_list = imgui.get_window_draw_list()
    if hovered or here:
        far = imgui.ImVec2(corner.x + wide, corner.y + high + 1)
        back = theme.ACCENT_FAINT if here else theme.FRAME_HOVERED
        draw_list.add_rect_filled(imgui.ImVec2(corner.x - 2, corner.y - 1), far, theme.packed(back), 4.0)
    color = theme.ACCENT if here else theme.FAINT if faint else theme.TEXT
    draw_list.add_text(imgui.ImVec2(corner.x + 4, corner.y), theme.packed(color), w.clipped(text, wide - 8))
    return bool(clicked)


def go_to(ui: Ui, kind: Kind, number: int) -> None:
    """Undoes or repeats steps of a stack until so many are done."""
    while ui.studio.history.depth(kind)[0] > number and ui.studio.undo(kind):
        pass
    while ui.studio.history.depth(kind)[0] < number and ui.studio.redo(kind):
        pass


def _label(ui: Ui, step: Step) -> str:
    """A step in few words; made once for what a step is at the moment."""
    kept: dict[int, tuple[Any, str]] = ui.memory.setdefault("history.labels", {})
    if kept.get(id(step), (None, ""))[0] is not step.after:
        if len(kept) > 2000:
            kept.clear()
        kept[id(step)] = (step.after, label(step))
    return kept[id(step)][1]


def label(step: Step) -> str:
    """What a step has changed, in few words: the last parts of the paths, and a value that is new."""
    if set(step.after) == {"bookmarks"}:
        return _bookmark_label(step.before["bookmarks"], step.after["bookmarks"])
    found: list[tuple[str, Any]] = []
    for name in step.after:
        found += changes(name, w.plain(step.before[name]), w.plain(step.after[name]))
    if len(found) > _MOST_PATHS:
        return _listed([_section(name) for name in step.after])
    return ", ".join(f"{_place(path)}{_value(value)}" for path, value in found)


def _bookmark_label(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    gone, new = [n for n in before if n not in after], [n for n in after if n not in before]
    if len(gone) == len(new) == 1:
        return f"Bookmark {gone[0]}: now {new[0]}"
    return f"Bookmark {new[0]}" if new else f"Bookmark {gone[0]} deleted" if gone else "Bookmarks"


def _section(name: str) -> str:
    return "Colouring" if name == "coloring" else w.label_of(name)


def _listed(names: list[str]) -> str:
    """`Formula, camera, lights and 2 more`."""
    shown = [name if not place else name.lower() for place, name in enumerate(names[:_MOST_NAMES])]
    more = len(names) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")


def changes(path: str, before: Any, after: Any) -> Iterator[tuple[str, Any]]:
    """Dotted paths and new values of what differs in two plain values; lists of another length differ as a whole."""
    if isinstance(before, Mapping) and isinstance(after, Mapping) and set(before) == set(after):
        for name in after:
            yield from changes(f"{path}.{name}", before[name], after[name])
    elif _sections(before) and _sections(after) and len(before) == len(after):
        for number, (old, new) in enumerate(zip(before, after, strict=True)):
            yield from changes(f"{path}.{number}", old, new)
    elif before != after:
        yield path, after


def _sections(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], Mapping)


def _place(path: str) -> str:
    """`lights.0.intensity` as `Lights 1: intensity`."""
    first, *parts = [part for part in path.split(".") if part != "parameters"]
    names = [part for part in parts if not part.isdigit()]
    number = next((f" {int(part) + 1}" for part in parts if part.isdigit()), "")
    where = f"{_section(first)}{number}"
    return f"{where}: {w.label_of(names[-1]).lower()}" if names else where


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return " on" if value else " off"
    if isinstance(value, (int, float)):
        return f" {value:.4g}".replace("-", "\u2212")
    if isinstance(value, str):
        return f" {value.replace('_', ' ')}"
    if isinstance(value, Mapping):  # a section of another kind, or one that was switched on
        kind = value.get("type") or value.get("mode")
        return f": {kind.replace('_', ' ')}" if isinstance(kind, str) else ""
    return " off" if value is None else ""


# Bookmarks


def _bookmarks(ui: Ui) -> None:
    marks = dict(ui.studio.scene.bookmarks)
    with theme.font("bold", 13.0):
        imgui.text("Bookmarks")
    w.in_row(8)
    imgui.text_colored(theme.vec(theme.FAINT), f"{len(marks)}")
    for number, name in enumerate(marks, 1):
        _bookmark(ui, number, name)
    _add(ui, marks)
    w.problem(ui, "bookmarks")


def _bookmark(ui: Ui, number: int, name: str) -> None:
    about = ui.with_key("Go there", f"bookmark_{number}") if number <= 9 else "Go there"
    with imgui_ctx.push_id(f"bookmark.{number}"):
        if w.icon_button(theme.BOOKMARK, about, name="go"):
            go_to_bookmark(ui, number, name)
        w.in_row(4)
        width = imgui.get_content_region_avail().x - imgui.get_frame_height() - 4
        new = w.text_box(ui, f"bookmark.{name}", name, width)
        w.tip("Its name: click to change it")
        if new is not None:
            rename(ui, name, new)
        w.in_row(4)
        if w.icon_button(theme.TRASH, "Delete it", name="delete"):
            delete(ui, name)


def _add(ui: Ui, marks: Mapping[str, Any]) -> None:
    key, side = "history.name", imgui.get_frame_height()
    imgui.set_next_item_width(imgui.get_content_region_avail().x - side - 4)
    done, text = imgui.input_text_with_hint(
        "##new", free_name(marks), str(ui.memory.get(key, "")), imgui.InputTextFlags_.enter_returns_true
    )
    ui.memory[key] = text
    w.in_row(4)
    hint = ui.keys.hint("bookmark_add")
    about = f"Keep the present camera under this name ({hint}: a free name)"
    wanted = w.icon_button(theme.PLUS, about, name="add") or done
    if wanted and add(ui, text.strip() or free_name(marks)):
        ui.memory[key] = ""


def free_name(marks: Mapping[str, Any]) -> str:
    """A name that no bookmark has."""
    return next(name for n in range(1, len(marks) + 2) if (name := f"view {n}") not in marks)


def go_to_bookmark(ui: Ui, number: int, name: str) -> None:
    """Moves the camera to a bookmark; the first nine have keys and actions."""
    if number <= 9:
        ui.act(f"bookmark_{number}")
    else:
        ui.studio.set_view(*view_of(ui.studio.scene.bookmarks[name]))


def add(ui: Ui, name: str) -> bool:
    """Keeps the present camera under a name; whether that was possible."""
    marks = _plain_marks(ui)
    scene = ui.studio.scene
    return _is_free(ui, name) and _put(ui, {**marks, name: w.plain(bookmark(scene.camera, scene.deep))})


def rename(ui: Ui, old: str, new: str) -> bool:
    """Gives a bookmark another name; its place in the order stays."""
    marks, new = _plain_marks(ui).items(), new.strip()
    renamed = {new if name == old else name: camera for name, camera in marks}
    return (new == old or _is_free(ui, new)) and _put(ui, renamed)


def delete(ui: Ui, name: str) -> bool:
    """Forgets a bookmark."""
    return _put(ui, {each: camera for each, camera in _plain_marks(ui).items() if each != name})


def _is_free(ui: Ui, name: str) -> bool:
    free = name not in ui.studio.scene.bookmarks
    if not free:
        ui.studio.problems["bookmarks"] = f"there is a bookmark {name!r} already"
    return free


def _plain_marks(ui: Ui) -> dict[str, Any]:
    return dict(ui.studio.value("bookmarks") or {})


def _put(ui: Ui, marks: dict[str, Any]) -> bool:
    return ui.studio.edit({"bookmarks": marks})
