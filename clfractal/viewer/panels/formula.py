"""The formula: which one, its parameters, iterations, a Julia set's constant, members of a chain."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

from clfractal.formulas import catalog
from clfractal.formulas.chain import MAX_COUNT, MAX_LINKS, Link
from clfractal.formulas.definition import BoundFormula, Parameter
from clfractal.formulas.turns import MAX_START
from clfractal.viewer.panels import formula_library, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

_FAR = 1e6
"""Bounds of a parameter beyond this are no range for a slider."""


def summary(ui: Ui) -> str:
    """For the heading."""
    return ui.studio.scene.chain.title


def draw(ui: Ui) -> None:
    """Draws the panel."""
    chain = ui.studio.scene.chain
    root = chain_path(ui)
    if not w.filtering(ui):
        _choice(ui)
    w.problem(ui, "formula")
    if root is not None:
        _members(ui, root)
    elif len(chain.links) == 1:
        parameters(ui, "formula", chain.first)
        _julia(ui, "formula", chain.first)
    elif not w.filtering(ui):
        w.hint(ui, "A chain of the library. Edit a copy to change its members.")
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
        if w.button("Edit a copy", icon=theme.PENCIL, width=-1):
            _open_chain(ui)
            return
    w.group(ui, "Iteration")
    w.field(ui, "formula.iterations")
    radius = ui.studio.scene.chain.bailout
    w.field(ui, "formula.bailout", start=radius, auto=f"{radius:.4g}, its own")
    far = ui.studio.scene.chain.distance_bailout
    w.field(ui, "formula.distance_bailout", start=far, auto=f"{far:.4g}, its own")


def chain_path(ui: Ui) -> str | None:
    """Where the scene holds the members of its chain; None for a formula that is none, or a chain of the library."""
    formula = ui.studio.scene.formula
    if formula.chain is not None:
        return "formula.chain"
    if formula.inline is not None and "chain" in formula.inline:
        return "formula.inline.chain"
    return None


def _choice(ui: Ui) -> None:
    """The button with the formula's title that opens the library, and the editor's."""
    formula = ui.studio.scene.formula
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
    wide, height = imgui.get_content_region_avail().x, imgui.get_frame_height()
    text = formula_library.titles().get(formula.name or "", ui.studio.scene.chain.title or "Own formula")
    about = ui.studio.scene.chain.first.formula.description if len(ui.studio.scene.chain.links) == 1 else ""
    with theme.measures(button_text_align=(0.0, 0.5)):
        if w.button(
            f"{text}##formula", width=wide - 2 * (height + 4), about=about or "Choose another formula"
        ):
            imgui.open_popup("##library")
    w.in_row(4)
    on = "formula_editor" in ui.show
    hint = ui.keys.hint("formula")
    if w.icon_button(theme.CODE, f"Edit it as text ({hint})", on=on):
        ui.act("formula")
    w.in_row(4)
    if w.icon_button(theme.LINK, "Make a chain of it: formulas in turn", enabled=chain_path(ui) is None):
        _open_chain(ui)
    name = formula_library.chosen(ui, "##library", formula.name or "", single=False)
    if name is not None:
        # Parameters and constants are those of the formula before; how far it is iterated is not.
        formula_library.take(ui.studio, {"name": name, "iterations": formula.iterations})


# Parameters


def parameters(ui: Ui, path: str, bound: BoundFormula) -> None:
    """The sliders of a formula's parameters; `path` leads to what has `parameters`."""
    for parameter in bound.formula.parameters:
        place = f"{path}.parameters.{parameter.name}"
        current = bound.values[parameter.name]
        if parameter.choices is not None:
            _choices(ui, place, parameter, current)
        else:
            label, scale = w.label_of(parameter.name), scale_of(parameter)
            w.number(ui, place, label, current, scale, default=parameter.default, tip=parameter.description)


def scale_of(parameter: Parameter) -> w.Scale:
    """How a parameter is dragged and shown."""
    low, high = parameter.minimum, parameter.maximum
    usual = None
    if low is not None and high is not None and high - low <= _FAR:
        usual = (low, high)
    log = usual is not None and usual[0] > 0 and usual[1] / usual[0] > 2000
    return w.Scale(low, high, usual, log, parameter.type == "int")


def _choices(ui: Ui, path: str, parameter: Parameter, current: float) -> None:
    assert parameter.choices is not None
    width = w.row(
        ui,
        w.label_of(parameter.name),
        path=path,
        tip=parameter.description,
        differs=current != parameter.default,
        reset=lambda: _put(ui, path, parameter.default),
    )
    if width is None:
        return
    words = {each: f"{each:g}" for each in parameter.choices}
    show = w.segments if len(words) <= 5 else w.choose
    found = show(path, words, current, width)
    if found is not None:
        _put(ui, path, int(found) if parameter.type == "int" else found)
    w.problem(ui, path)


def _julia(ui: Ui, path: str, bound: BoundFormula) -> None:
    """The constant that is added instead of the point, with a slider for each variable."""
    if bound.formula.add == "none":
        return
    given = w.value(ui, f"{path}.julia")
    place = f"{path}.julia"
    first = [0.0] * len(bound.formula.variables)
    own = bound.formula.julia
    width = w.row(
        ui,
        "Julia set",
        path=place,
        tip="a constant is added instead of the point",
        differs=given is not None,
        reset=lambda: _put(ui, place, None),
    )
    if width is not None:
        kept = ui.memory.setdefault("julia.kept", {})
        if w.toggle(place, given is not None, "" if own is None else "Instead of the formula's own constant"):
            if given is not None:
                kept[path] = list(given)
            start = kept.get(path, list(own or first))
            _put(ui, place, None if given is not None else start if len(start) == len(first) else first)
    given = w.value(ui, place)
    before = list(given or ())
    for index, number in enumerate(before):
        name = bound.formula.variables[index]
        width = w.row(ui, f"Constant {name}", path=f"{place}.{index}", tip="what is added to this variable")
        if width is None:
            continue
        mark = theme.AXES[index] if index < 3 else theme.SECOND
        scale = w.Scale(-1e6, 1e6, (-2, 2))
        change = w.number_box(w.boxes(ui), f"{place}.{index}", float(number), width, scale, mark=mark)
        w.apply(ui, place, change, lambda new, at=index: [*before[:at], new, *before[at + 1 :]])  # type: ignore[misc]
    w.problem(ui, place)


# Chains


def _open_chain(ui: Ui) -> None:
    """Turns the formula into a chain whose members can be edited."""
    spec = ui.studio.value("formula")
    common = {name: spec[name] for name in ("iterations", "bailout", "distance_bailout") if name in spec}
    if spec.get("name") and catalog.is_chain(spec["name"]):
        inline = dict(catalog.description(spec["name"]))
        julia = {"julia": spec["julia"]} if "julia" in spec else {}
        ui.studio.edit({"formula": {"inline": inline, **common, **julia}})
        return
    member = {name: value for name, value in spec.items() if name not in common}
    ui.studio.edit({"formula": {"chain": [{**member, "count": 1}], **common}})


def _members(ui: Ui, root: str) -> None:
    links = ui.studio.scene.chain.links
    members = list(ui.studio.value(root))
    for index, link in enumerate(links):
        if not w.filtering(ui):
            edited = _member_line(ui, root, members, index, link.bound.formula.title)
            if edited is not None:
                ui.studio.edit({root: edited})
                return
        path = f"{root}.{index}"
        scale = w.Scale(1, MAX_COUNT, (1, 10), whole=True)
        about = "number of applications before the next formula's turn"
        w.number(ui, f"{path}.count", "Times", float(link.count), scale, default=1.0, tip=about)
        _range(ui, path, link)
        imgui.push_id(index)
        parameters(ui, path, link.bound)
        _julia(ui, path, link.bound)
        imgui.pop_id()
    w.problem(ui, root)
    if w.filtering(ui):
        return
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
    if w.button("Add a formula", icon=theme.PLUS, width=-1, enabled=len(members) < MAX_LINKS):
        imgui.open_popup("##member")
    name = formula_library.chosen(ui, "##member", "", single=True)
    if name is not None:
        ui.studio.edit({root: [*members, {"name": name, "count": 1}]})


def _range(ui: Ui, path: str, link: Link) -> None:
    """The applications in which a member takes part."""
    scale = w.Scale(0, MAX_START, (0, 20), whole=True)
    about = "first application, counted from 0, in which it takes part"
    w.number(ui, f"{path}.start", "From", float(link.start), scale, default=0.0, tip=about)
    scale = w.Scale(1, MAX_START, (1, 20), whole=True)
    about = f"first application in which it no longer takes part; {MAX_START}: it goes on to the end"
    stop = float(MAX_START if link.stop is None else link.stop)
    w.number(ui, f"{path}.stop", "Until", stop, scale, default=float(MAX_START), tip=about, endless=True)


def _member_line(ui: Ui, root: str, members: list[Any], index: int, title: str) -> list[Any] | None:
    """The heading of a member, with buttons to move and remove it; the new list, if one was clicked."""
    imgui.push_id(f"{root}.{index}")
    imgui.dummy(imgui.ImVec2(0, 1))
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    wide = imgui.get_content_region_avail().x
    far = imgui.ImVec2(corner.x + wide, corner.y + height)
    draw = imgui.get_window_draw_list()
    draw.add_rect_filled(corner, far, theme.packed(theme.HEADER), 5.0)
    y = corner.y + (height - imgui.get_font_size()) / 2
    with theme.font("bold"):
        draw.add_text(imgui.ImVec2(corner.x + 11, y), theme.packed(theme.TEXT), f"{index + 1}  {title}")
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + wide - 3 * height - 6)
    found = None
    if w.icon_button(theme.UP, "Earlier", enabled=index > 0):
        found = _exchanged(members, index, index - 1)
    w.in_row(3)
    if w.icon_button(theme.DOWN, "Later", enabled=index + 1 < len(members)):
        found = _exchanged(members, index, index + 1)
    w.in_row(3)
    if w.icon_button(theme.TRASH, "Remove", enabled=len(members) > 1):
        found = [*members[:index], *members[index + 1 :]]
    imgui.pop_id()
    return found


def _exchanged(members: list[Any], one: int, other: int) -> list[Any]:
    found = list(members)
    found[one], found[other] = found[other], found[one]
    return found


def _put(ui: Ui, path: str, value: Any) -> None:
    ui.studio.edit({path: value})
