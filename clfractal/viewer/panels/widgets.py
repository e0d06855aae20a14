"""Widgets bound to dotted paths of a scene, and what panels are laid out with.

A panel is mostly a list of paths: kind, bounds, choices, default and tooltip come from the schema (`metadata`). All edits
go through the studio, so that each can be undone; a drag is one step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from clfractal.schema.mapped import Map
from clfractal.viewer.editing import plain
from clfractal.viewer.panels import metadata, theme
from clfractal.viewer.panels.buttons import (
    Line,
    beside,
    button,
    choose,
    clipped,
    icon_button,
    menu,
    segments,
    text_box,
    tip,
    toggle,
    wrapped,
)
from clfractal.viewer.panels.color_button import color_button
from clfractal.viewer.panels.layout import (
    boxes,
    columns,
    filtering,
    found,
    group,
    header,
    hint,
    in_labels,
    in_row,
    label_of,
    problem,
    row,
    search,
    word,
)
from clfractal.viewer.panels.metadata import Meta, Target, differs, find, first_value, has_default
from clfractal.viewer.panels.number_box import Change, Scale, number_box
from clfractal.viewer.panels.ui import Ui

__all__ = [
    "Change",
    "Line",
    "Scale",
    "act",
    "apply",
    "beside",
    "boxes",
    "button",
    "choose",
    "clipped",
    "color_button",
    "columns",
    "copy_and_remove",
    "field",
    "fields",
    "filtering",
    "first_value",
    "found",
    "group",
    "header",
    "hint",
    "icon_button",
    "in_labels",
    "in_row",
    "label_of",
    "listed",
    "menu",
    "number",
    "number_box",
    "numbers",
    "optional",
    "pick",
    "plain",
    "problem",
    "put",
    "reading",
    "row",
    "search",
    "section",
    "segments",
    "set_entries",
    "switch",
    "text_box",
    "tip",
    "toggle",
    "value",
    "value_tip",
    "word",
    "wrapped",
]

T = TypeVar("T")

AUTO = "automatic"


def value(ui: Ui, path: str) -> Any:
    """The value at a dotted path, as the scene holds it; None if there is none."""
    found = find(ui.studio.scene, path)
    return found.value if found is not None else None


def put(ui: Ui, path: str, new: Any) -> bool:
    """Sets one value, as a step of undo of its own; whether it was valid."""
    return ui.studio.edit({path: plain(new)})


def value_tip(ui: Ui, path: str) -> str:
    """What the schema says of a value; of a section that it does not describe, the first sentence about its class."""
    found = find(ui.studio.scene, path)
    meta = found.meta if found is not None else None
    if meta is None or meta.description or not meta.sections:
        return meta.description if meta is not None else ""
    return (meta.sections[0].__doc__ or "").split("\n\n")[0].strip()


def apply(ui: Ui, path: str, change: Change, make: Callable[[float], Any] = lambda number: number) -> None:
    """Does what a number box returned to the value at a path; `make` turns the number into the value."""
    if change.value is not None:
        ui.studio.edit({path: make(change.value)}, path if change.dragging else None)
    if boxes(ui).refused:
        ui.studio.problems[path], boxes(ui).refused = boxes(ui).refused, ""
    if change.ended:
        ui.studio.end_gesture()


def reading(ui: Ui, label: str, text: str, color: theme.Rgba = theme.TEXT) -> None:
    """A row that only tells something."""
    if row(ui, label) is not None:
        beside(text, color)


def pick(
    ui: Ui,
    label: str,
    words: Mapping[T, str],
    current: T,
    *,
    path: str,
    name: str = "",
    listed: bool = False,
    **options: Any,
) -> T | None:
    """A row with choices that the schema does not know by itself; the one that was clicked, if it is another.

    Args:
        words: the choices.
        name: of the widget; else the path.
        listed: in a list instead of side by side.
        options: see `row`.
    """
    width = row(ui, label, path=path, **options)
    if width is None:
        return None
    found = (choose if listed else segments)(name or path, words, current, width)
    problem(ui, path)
    return found


def switch(ui: Ui, label: str, on: bool, *, path: str, name: str = "", **options: Any) -> bool:
    """A row with a switch; whether it was clicked. For `name` and `options` see `pick`."""
    return row(ui, label, path=path, **options) is not None and toggle(name or path, on)


def optional(ui: Ui, path: str, label: str, first: Any, *, tip: str = "", keeps: bool = True) -> bool:
    """The switch of a section that may be null; whether it is there.

    Args:
        first: its values when it is switched on.
        tip: what it means, if the schema does not tell it.
        keeps: whether the values that it had come back when it is switched on again.
    """
    given, kept = value(ui, path) is not None, ui.memory.setdefault("kept", {})
    about = tip or value_tip(ui, path)
    if switch(ui, label, given, path=path, tip=about, differs=given, reset=lambda: put(ui, path, None)):
        if given and keeps:
            kept[path] = ui.studio.value(path)
        put(ui, path, None if given else kept.get(path, first))
    problem(ui, path)
    return value(ui, path) is not None


def act(
    ui: Ui,
    action: str,
    icon: str,
    about: str,
    *,
    text: str = "",
    on: bool = False,
    enabled: bool = True,
    **options: Any,
) -> bool:
    """A button that does an action of the table of keys, with its key in the tooltip; whether it was clicked.

    Args:
        text: its words; without any it is a square one.
        on, enabled, options: see `icon_button` and `button`.
    """
    told = ui.with_key(about, action) if about else ui.keys.hint(action)
    if text:
        clicked = button(text, icon=icon, about=told, enabled=enabled, **options)
    else:
        clicked = icon_button(icon, told, name=action, on=on, enabled=enabled)
    if clicked:
        ui.act(action)
    return clicked


# Lists


def listed(ui: Ui, key: str, count: int, line: Callable[[int, bool], bool]) -> int:
    """The lines of a list; the number of the one that is chosen, which is kept in `ui.memory[key]`.

    Args:
        line: draws one, by its number and whether it is chosen; whether it was clicked.
    """
    chosen = min(int(ui.memory.get(key, 0)), max(count - 1, 0))
    for index in range(count):
        if line(index, index == chosen):
            chosen = index
    ui.memory[key] = chosen
    return chosen


def set_entries(ui: Ui, path: str, entries: Sequence[Any], key: str, chosen: int) -> bool:
    """Sets a list of the scene, of which another entry is chosen then; whether it was valid."""
    done = put(ui, path, entries)
    if done:
        ui.memory[key] = chosen
    return done


def copy_and_remove(ui: Ui, path: str, entries: Sequence[Any], key: str, room: bool, **other: Any) -> None:
    """Buttons that copy and remove the chosen entry of a list; `other`: values that a copy has instead."""
    chosen, there = ui.memory[key], bool(entries)
    in_row(4)
    if icon_button(theme.COPY, "Duplicate", enabled=there and room):
        set_entries(ui, path, [*entries, {**entries[chosen], **other}], key, len(entries))
    in_row(4)
    if icon_button(theme.TRASH, "Remove", enabled=there):
        set_entries(ui, path, [*entries[:chosen], *entries[chosen + 1 :]], key, max(chosen - 1, 0))


# Fields


def fields(ui: Ui, prefix: str, names: Sequence[str], **options: Mapping[str, Any]) -> None:
    """Several fields of one section; `options` of a name go to `field`."""
    for name in names:
        field(ui, f"{prefix}.{name}", **options.get(name, {}))


def section(
    ui: Ui,
    path: str,
    *,
    depth: int = 0,
    of_map: Callable[[Ui, str, Map], None] | None = None,
) -> None:
    """Every field of a section that widgets are known for, in the schema's order, sections within it as groups.

    `of_map` draws what is left of a value that differs from place to place, below its fields.
    """
    found = find(ui.studio.scene, path)
    if found is None or not hasattr(type(found.value), "model_fields"):
        return
    for name in type(found.value).model_fields:
        inner = find(ui.studio.scene, f"{path}.{name}")
        meta = inner.meta if inner is not None else None
        if meta is not None and meta.kind == "section" and inner is not None and depth < 3:
            if inner.value is not None:
                group(ui, label_of(name))
                section(ui, f"{path}.{name}", depth=depth + 1, of_map=of_map)
        else:
            field(ui, f"{path}.{name}")
            if inner is not None and isinstance(inner.value, Map):
                fields(ui, f"{path}.{name}", inner.value.used_keys)
                if of_map is not None:
                    of_map(ui, f"{path}.{name}", inner.value)


def field(
    ui: Ui,
    path: str,
    label: str = "",
    *,
    unit: str = "",
    factor: float = 1.0,
    step: float | None = None,
    usual: tuple[float, float] | None = None,
    start: Any = None,
    auto: str = AUTO,
    segmented: bool = False,
    words: Mapping[str, str] | None = None,
    keep: Mapping[str, Any] | None = None,
) -> bool:
    """The widget of one value, with its label; whether the value was changed in this frame.

    Args:
        label: in front of it; else its name.
        unit, factor, step, usual: see `Scale`, in the place of what the schema tells.
        start: for one that may be null (or a word), its first value when it is set.
        auto: shown where it is null (or that word).
        segmented: choices side by side instead of in a list, as two always are.
        words: other words for choices.
        keep: values at other paths that are set along with this one.
    """
    target = find(ui.studio.scene, path)
    meta = target.meta if target is not None else None
    if target is None or meta is None:
        return False
    drawer = _DRAWERS.get(meta.kind)
    if drawer is None:
        return False
    before = ui.studio.scene
    label = label or label_of(meta.name)
    width = row(
        ui,
        label,
        path=path,
        tip=meta.description,
        differs=differs(target, meta),
        reset=(lambda: put(ui, path, meta.default)) if has_default(meta) else None,
    )
    if width is None:
        return False
    if isinstance(target.value, Map):
        beside(target.value.told)
        problem(ui, path)
        return False
    options = {
        "unit": unit,
        "factor": factor,
        "step": step,
        "usual": usual,
        "segmented": segmented,
        "words": words or {},
        "keep": keep or {},
    }
    given = target.value is not None and target.value != (meta.alternative or None)
    if meta.optional or meta.alternative:
        width = _optional(ui, path, meta, width, given, start, auto, keep or {})
    if given or not (meta.optional or meta.alternative):
        drawer(ui, path, target, meta, width, options)
    problem(ui, path)
    return ui.studio.scene is not before


def number(
    ui: Ui,
    path: str,
    label: str,
    current: float,
    scale: Scale,
    *,
    default: float | None,
    tip: str,
    endless: bool = False,
) -> None:
    """A number that the schema does not know of by itself (a formula's parameter): as `field`.

    With `endless` its highest value stands for none, which is written as null.
    """

    def written(value: float) -> float | None:
        if endless and scale.high is not None and value >= scale.high:
            return None
        return int(value) if scale.whole else value

    different = default is not None and current != default
    reset = (lambda: put(ui, path, written(default))) if default is not None else None
    width = row(ui, label, path=path, tip=tip, differs=different, reset=reset)
    if width is not None:
        apply(ui, path, number_box(boxes(ui), path, current, width, scale), written)
        problem(ui, path)


def scale_of(meta: Meta, **options: Any) -> Scale:
    """How a field is dragged and shown."""
    given: tuple[float, float] | None = options.get("usual")
    usual = given or meta.usual
    log = meta.log if given is None else metadata.by_magnitude(given)
    return Scale(
        meta.low,
        meta.high,
        usual,
        log,
        meta.kind == "whole",
        options.get("unit", ""),
        options.get("factor", 1.0),
        options.get("step"),
        meta.open,
    )


def _optional(
    ui: Ui,
    path: str,
    meta: Meta,
    width: float,
    given: bool,
    start: Any,
    auto: str,
    keep: Mapping[str, Any],
) -> float:
    """The switch of a value that may be null, or a word in its place; the width that is left for the value."""
    if toggle(f"{path}.given", given, "Set it by hand" if not given else f"Back to {auto}"):
        empty: dict[str, Any] = {path: meta.alternative or None}
        ui.studio.edit(empty if given else {**keep, path: first_value(meta, start)})
    in_row(6)
    if not given:
        beside(auto, theme.FAINT)
    return width - (28.0 + 6)


Options = Mapping[str, Any]


def _number(ui: Ui, path: str, target: Target, meta: Meta, width: float, options: Options) -> None:
    scale = scale_of(meta, **{name: options[name] for name in ("unit", "factor", "step", "usual")})
    change = number_box(boxes(ui), path, float(target.value), width, scale)
    apply(ui, path, change, (lambda each: int(each)) if meta.kind == "whole" else (lambda each: each))


def _flag(ui: Ui, path: str, target: Target, meta: Meta, width: float, options: Options) -> None:
    if toggle(path, bool(target.value), ""):
        ui.studio.edit({**options["keep"], path: not target.value})


def _choice(ui: Ui, path: str, target: Target, meta: Meta, width: float, options: Options) -> None:
    words = {each: options["words"].get(each, word(str(each))) for each in meta.choices}
    show = segments if options["segmented"] or len(words) <= 2 else choose
    found = show(path, words, target.value, width)
    if found is not None:
        ui.studio.edit({**options["keep"], path: found})


def _text(ui: Ui, path: str, target: Target, meta: Meta, width: float, options: Options) -> None:
    found = text_box(ui, path, target.value or "", width)
    if found is not None:
        ui.studio.edit({path: found})


def _vector(ui: Ui, path: str, target: Target, meta: Meta, width: float, options: Options) -> None:
    # Three numbers need the whole width of a dock, below the label.
    wide = columns(len(target.value))
    scale = scale_of(meta, unit=options["unit"], factor=options["factor"], step=options["step"])
    numbers(ui, path, target.value, wide, scale)


def numbers(
    ui: Ui,
    path: str,
    before: Sequence[float],
    width: float,
    scale: Scale,
    *,
    marked: bool = True,
    make: Callable[[list[float]], Any] = list,
) -> None:
    """Boxes side by side for the numbers of a list.

    Args:
        marked: whether they have the colours of x, y and z.
        make: turns the numbers into the value.
    """
    for index, each in enumerate(before):
        if index:
            in_row(4)
        mark = theme.AXES[index] if marked and index < 3 else None
        change = number_box(boxes(ui), f"{path}.{index}", float(each), width, scale, mark=mark)
        apply(ui, path, change, lambda new, at=index: make([*before[:at], new, *before[at + 1 :]]))  # type: ignore[misc]


def _color(ui: Ui, path: str, target: Target, meta: Meta, width: float, options: Options) -> None:
    color_button(ui, path, target.value, width)


_DRAWERS: dict[str, Callable[[Ui, str, Target, Meta, float, Options], None]] = {
    "number": _number,
    "whole": _number,
    "flag": _flag,
    "choice": _choice,
    "text": _text,
    "vector": _vector,
    "color": _color,
}
