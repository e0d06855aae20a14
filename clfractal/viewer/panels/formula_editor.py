"""The formula as text: checked while it is typed, and taken over when it is right.

The check reads and binds the formula as a scene's is, but compiles nothing. What is wrong never reaches the scene, which
keeps its last good formula and picture.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from imgui_bundle import imgui
from imgui_bundle.imgui_color_text_edit import TextEditor

from clfractal.errors import ClfractalError, FormulaError, Where
from clfractal.files.document import read_document, read_text_file, write_document
from clfractal.files.fragments import same
from clfractal.files.resources import folder
from clfractal.formulas import catalog
from clfractal.scene.formula import FormulaSpec
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

PAUSE_SECONDS = 0.3
"""The text is checked when nothing was typed for so long."""
_WIDTH, _HEIGHT = 520.0, 420.0
_TITLE = "Formula editor"
_FILE = "##formula.file"


@dataclass(slots=True)
class Editing:
    """What the editor remembers.

    Attributes:
        editor: Dear ImGui's text editor.
        source: the part of the scene's formula that the text stands for.
        text: as it was when it was checked last.
        changed: when it was changed last, seconds; None: it is checked.
        error: what is wrong with it.
    """

    editor: Any = field(default_factory=TextEditor)
    source: Any = None
    text: str = ""
    changed: float | None = None
    seen: str = ""
    error: ClfractalError | None = None


def read_formula(text: str) -> dict[str, Any]:
    """The formula (or chain) that a text describes, as a scene's `inline`, checked by the real loader.

    Raises:
        FormulaError: at its line and column.
    """
    document = read_document(text, error=FormulaError)
    data = document.plain()
    if not isinstance(data, dict):
        raise FormulaError("must be a mapping, a formula's keys", Where(line=1, column=1))
    try:
        catalog.resolve({"inline": data}, None, Where())
    except FormulaError as error:
        path = (error.where.path or "").removeprefix("inline").removeprefix(".")
        inner = type(error)(error.message, replace(error.where, path=path), details=error.details)
        raise document.locate(inner) from None
    return data


def text_of(spec: FormulaSpec) -> str:
    """The text of a scene's formula: a library's file with its comments, or what the scene holds."""
    if spec.name is not None:
        return read_text_file(folder("formulas/library") / f"{spec.name}.yaml")
    if spec.inline is not None:
        return write_document(spec.inline)
    return write_document({"chain": spec.mapping().get("chain", [])})


def applied(spec: FormulaSpec, inline: dict[str, Any]) -> dict[str, Any]:
    """The scene's `formula` with another text: values of parameters that the text still has stay, as far as they fit."""
    kept = spec.mapping()
    found: dict[str, Any] = {
        name: kept[name] for name in ("iterations", "bailout", "distance_bailout") if name in kept
    }
    known = inline.get("parameters")
    values = {
        name: value
        for name, value in kept.get("parameters", {}).items()
        if isinstance(known, dict) and name in known
    }
    for more in ({"parameters": values, "julia": kept.get("julia")}, {"julia": kept.get("julia")}, {}):
        given = {name: value for name, value in more.items() if value}
        try:
            catalog.resolve({"inline": inline, **given}, None, Where())
        except ClfractalError:
            continue
        return {"inline": inline, **given, **found}
    return {"inline": inline, **found}


def draw(ui: Ui) -> None:
    """Draws the editor's window, if it is open."""
    if "formula_editor" not in ui.show:
        return
    state: Editing = ui.memory.setdefault("formula.editor", Editing())
    _follow(ui, state)
    wide, high = min(_WIDTH, ui.size[0] - 40), min(_HEIGHT, ui.size[1] - 40)
    left = min(theme.DOCK_LEFT + 3 * theme.MARGIN, ui.size[0] - wide - theme.MARGIN)
    imgui.set_next_window_pos(imgui.ImVec2(left, ui.size[1] - high - theme.MARGIN), imgui.Cond_.appearing)
    imgui.set_next_window_size(imgui.ImVec2(wide, high), imgui.Cond_.appearing)
    shown, still_open = imgui.begin(
        _TITLE, True, imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_collapse
    )
    if not still_open:
        ui.show.discard("formula_editor")
    if shown:
        _edit(ui, state)
    imgui.end()


def _follow(ui: Ui, state: Editing) -> None:
    """Takes over a formula that was changed elsewhere: chosen, undone, or of another scene."""
    spec = ui.studio.scene.formula
    source = _source(spec)
    if source == state.source:
        return
    state.source = source
    with suppress(ClfractalError):
        if spec.inline is not None and state.text and read_formula(state.text) == spec.inline:
            return  # it is what was typed here: comments and cursor stay
    with ui.studio.telling():
        state.text = _typed(ui, spec) or text_of(spec)
        _fill(state)


def _typed(ui: Ui, spec: FormulaSpec) -> str | None:
    """The formula's text as it was typed, here or in the scene's file; None if it was not."""
    if spec.inline is None:
        return None
    files = ui.memory.get("files")
    written = [files.source.formula_text, files.source.formula_file_text] if files is not None else []
    for each in written:
        if each is not None and same(each[0], spec.inline):
            return str(each[1])
    return ui.studio.formula_texts.text_of(spec.inline)


def _source(spec: FormulaSpec) -> Any:
    """The part of a scene's formula that the text stands for; not parameters, iterations and radii beside it."""
    return (spec.name, spec.file, spec.inline, spec.chain)


def _fill(state: Editing) -> None:
    editor = state.editor
    editor.set_language(TextEditor.Language.python())
    editor.set_tab_size(2)
    editor.set_insert_spaces_on_tabs(True)
    editor.set_show_whitespaces_enabled(False)
    editor.set_show_scrollbar_mini_map_enabled(False)
    editor.set_complete_paired_glyphs(False)
    editor.set_text(state.text)
    state.seen, state.changed, state.error = editor.get_text(), None, None
    _mark(state)


def _edit(ui: Ui, state: Editing) -> None:
    footer = 3 * imgui.get_text_line_height_with_spacing() + imgui.get_frame_height_with_spacing() + 10
    room = imgui.get_content_region_avail()
    with theme.font("fixed", 14.5):
        state.editor.render("##formula", imgui.ImVec2(room.x, max(room.y - footer, 60)))
    now, text = imgui.get_time(), state.editor.get_text()
    if text != state.seen:
        state.seen, state.changed = text, now
    if state.changed is not None and now - state.changed >= PAUSE_SECONDS:
        check(ui, state)
    _footer(state)
    if state.error is None and state.changed is None:
        _to_file(ui, state)


def check(ui: Ui, state: Editing) -> None:
    """Checks the text, marks what is wrong, and takes over what is right as a step of undo."""
    state.changed, state.text, state.error = None, state.seen, None
    try:
        inline = read_formula(state.text)
    except ClfractalError as error:
        state.error = error
    _mark(state)
    if state.error is not None:
        return
    ui.studio.formula_texts.remember(inline, state.text)
    spec = ui.studio.scene.formula
    if inline == (catalog.description(spec.name) if spec.name is not None else spec.inline):
        return
    if not ui.studio.edit({"formula": applied(spec, inline)}):
        # The text is a formula, but not for this scene (a zoom beyond its bounds, for example).
        state.error = FormulaError(ui.studio.problems.pop("formula", "does not fit this scene"))
    state.source = _source(ui.studio.scene.formula)


def _to_file(ui: Ui, state: Editing) -> None:
    """A button that writes the formula into a file of its own, under a name that is asked for."""
    ask: dict[str, Any] = ui.memory.setdefault("formula.file", {"name": "", "problem": "", "sure": ""})
    if w.button(
        "Save as a file…", icon=theme.SAVE, about="The scene's file will name it from its next saving on"
    ):
        ask.update(name=_suggested(ui), problem="", sure="")
        imgui.open_popup(_FILE)
    if not imgui.begin_popup(_FILE):
        return
    imgui.set_next_item_width(300)
    if imgui.is_window_appearing():
        imgui.set_keyboard_focus_here()
    done, ask["name"] = imgui.input_text("##name", ask["name"], imgui.InputTextFlags_.enter_returns_true)
    w.in_row()
    if w.button("Save", primary=True) or done:
        save_as_file(ui, state, ask)
        if not ask["problem"]:
            imgui.close_current_popup()
    if ask["problem"]:
        w.wrapped(ask["problem"], 360.0, theme.WARNING)
    imgui.end_popup()


def save_as_file(ui: Ui, state: Editing, ask: dict[str, Any]) -> None:
    """Writes the text into the file that was named; a name that is taken wants to be given twice."""
    name = Path(ask["name"].strip()).expanduser()
    path = ui.studio.scene.folder / (name if name.suffix else name.with_suffix(".yaml"))
    sure = ask["sure"] == str(path)
    ask["sure"], ask["problem"] = str(path) if path.exists() else "", ""
    try:
        content = read_formula(state.text)
        ui.studio.formula_texts.save(content, state.text, path, even_if_there=sure)
        spec = ui.studio.scene.formula
        if spec.inline != content:  # a formula of the library becomes one of the user's
            ui.studio.edit({"formula": applied(spec, content)})
            state.source = _source(ui.studio.scene.formula)
    except ClfractalError as error:
        ask["problem"] = str(error)
        return
    ui.studio.tell(f"saved {path.name}; the scene's file names it once the scene is saved")


def _suggested(ui: Ui) -> str:
    """A name for the formula's file."""
    spec = ui.studio.scene.formula
    title = str((spec.inline or {}).get("title", spec.name or "formula"))
    return "_".join("".join(each if each.isalnum() else " " for each in title.lower()).split()) + ".yaml"


def _mark(state: Editing) -> None:
    editor = state.editor
    editor.clear_markers()
    editor.clear_squiggles()
    error = state.error
    if error is None or error.where.line is None:
        return
    line = min(error.where.line, editor.get_line_count()) - 1
    text = editor.get_line_text(line)
    warning = theme.packed(theme.WARNING)
    editor.add_marker(line, warning, theme.packed(theme.WARNING, 0.16), error.message, error.message)
    first = min((error.where.column or 1) - 1, max(len(text) - 1, 0))
    start, end = TextEditor.DocPos(line, first), TextEditor.DocPos(line, max(len(text.rstrip()), first + 1))
    editor.add_squiggle(start, end, 0, warning, error.message)


def _footer(state: Editing) -> None:
    error = state.error
    if state.changed is not None:
        imgui.text_colored(theme.vec(theme.DIM), "Checking when you pause…")
    elif error is None:
        imgui.text_colored(theme.vec(theme.GOOD), theme.CHECK)
        w.in_row()
        imgui.text_colored(theme.vec(theme.DIM), "Right: the picture shows it.")
    else:
        where = error.where
        place = f"Line {where.line}" if where.line is not None else "Here"
        column = f", column {where.column}" if where.line is not None and where.column is not None else ""
        path = f" ({where.path})" if where.path else ""
        w.wrapped(f"{theme.WARN}  {place}{column}{path}: {error.message}", color=theme.WARNING)
        if imgui.is_item_clicked() and where.line is not None:
            state.editor.set_cursor(TextEditor.DocPos(where.line - 1, (where.column or 1) - 1))
            state.editor.scroll_to_line(where.line - 1, TextEditor.Scroll.align_middle)
            state.editor.set_focus()
        w.tip("Click to go there")
