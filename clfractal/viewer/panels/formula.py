"""The formula: which one, its parameters, iterations, a Julia set's constant, members of a chain."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui, imgui_ctx

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
    if chain.alone:
        if not w.filtering(ui):
            w.hint(ui, "There is no formula: the scene shows its objects.")
        return
    if root is not None:
        _members(ui, root)
    elif len(chain.links) == 1:
        parameters(ui, "formula", chain.first)
        _julia(ui, "formula", chain.first)
    elif not w.filtering(ui):
        w.hint(ui, "A chain of the library. Edit a copy to change its members.")
        w.in_labels()
        if w.button("Edit a copy", icon=theme.PENCIL, width=-1):
            _open_chain(ui)
            return
    w.group(ui, "Iteration")
    w.field(ui, "formula.iterations")
    for name in ("bailout", "distance_bailout"):
        radius = getattr(ui.studio.scene.chain, name)
        w.field(ui, f"formula.{name}", start=radius, auto=f"{radius:.4g}, its own")


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
    w.in_labels()
    wide, height = imgui.get_content_region_avail().x, imgui.get_frame_height()
    text = formula_library.titles().get(formula.name or "", ui.studio.scene.chain.title or "Own formula")
    about = ui.studio.scene.chain.first.formula.description if len(ui.studio.scene.chain.links) == 1 else ""
    with theme.measures(button_text_align=(0.0, 0.5)):
        if w.button(
            f"{text}##formula", width=wide - 2 * (height + 4), about=about or "Choose another formula"
        ):
            imgui.open_popup("##library")
    w.in_row(4)
    w.act(ui, "formula", theme.CODE, "Edit it as text", on="formula_editor" in ui.show)
    w.in_row(4)
    can_open = chain_path(ui) is None and not ui.studio.scene.chain.alone
    if w.icon_button(theme.LINK, "Make a chain of it: formulas in turn", enabled=can_open):
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
    usual = (low, high) if low is not None and high is not None and high - low <= _FAR else None
    log = usual is not None and usual[0] > 0 and usual[1] / usual[0] > 2000
    return w.Scale(low, high, usual, log, parameter.type == "int")


def _choices(ui: Ui, path: str, parameter: Parameter, current: float) -> None:
    assert parameter.choices is not None
    words = {each: f"{each:g}" for each in parameter.choices}
    found = w.pick(
        ui,
        w.label_of(parameter.name),
        words,
        current,
        path=path,
        listed=len(words) > 5,
        tip=parameter.description,
        differs=current != parameter.default,
        reset=lambda: w.put(ui, path, parameter.default),
    )
    if found is not None:
        w.put(ui, path, int(found) if parameter.type == "int" else found)


def _julia(ui: Ui, path: str, bound: BoundFormula) -> None:
    """The constant that is added instead of the point, with a slider for each variable."""
    if bound.formula.add == "none":
        return
    place = f"{path}.julia"
    given = w.value(ui, place)
    first = [0.0] * len(bound.formula.variables)
    own, on = bound.formula.julia, given is not None
    width = w.row(
        ui,
        "Julia set",
        path=place,
        tip="a constant is added instead of the point",
        differs=on,
        reset=lambda: w.put(ui, place, None),
    )
    about = "" if own is None else "Instead of the formula's own constant"
    if width is not None and w.toggle(place, on, about):
        kept = ui.memory.setdefault("julia.kept", {})
        if on:
            kept[path] = list(given)
        start = kept.get(path, list(own or first))
        w.put(ui, place, None if on else start if len(start) == len(first) else first)
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
        with imgui_ctx.push_id(f"{index}"):
            parameters(ui, path, link.bound)
            _julia(ui, path, link.bound)
    w.problem(ui, root)
    if w.filtering(ui):
        return
    w.in_labels()
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
    left = [*members[:index], *members[index + 1 :]]
    found = None
    with imgui_ctx.push_id(f"{root}.{index}"):
        for icon, about, way in ((theme.UP, "Earlier", -1), (theme.DOWN, "Later", 1)):
            if w.icon_button(icon, about, enabled=0 <= index + way < len(members)):
                found = [*left[: index + way], members[index], *left[index + way :]]
            w.in_row(3)
        if w.icon_button(theme.TRASH, "Remove", enabled=len(members) > 1):
            found = left
    return found
