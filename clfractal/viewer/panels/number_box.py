"""A box with a number: dragged, or typed; in double precision, over any range.

Dear ImGui's own drag boxes hold 32-bit floats, which are too coarse for places deep in a fractal, and their logarithmic
ones do not go on beyond a usual range. This box is drawn with an invisible button and a line of text.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.buttons import area

FINE, COARSE = 0.1, 10.0
"""Factors on a drag with Shift and with Control."""
_STILL = 2.0
_PER_POINT = 0.01


@dataclass(frozen=True, slots=True)
class Scale:
    """How a number is shown and dragged.

    Attributes:
        low, high: bounds; None: none.
        open: whether the bounds themselves are not allowed: (low, high).
        usual: the range of the bar; None: no bar, a drag changes the number by parts of its size.
        log: whether the bar is divided by magnitudes.
        whole: whether it is a whole number.
        unit: shown behind it.
        factor: what is shown is the value times this.
        step: for a box without a bar, the change by a point of drag; None: by the size of the value.
    """

    low: float | None = None
    high: float | None = None
    usual: tuple[float, float] | None = None
    log: bool = False
    whole: bool = False
    unit: str = ""
    factor: float = 1.0
    step: float | None = None
    open: tuple[bool, bool] = (False, False)


@dataclass(frozen=True, slots=True)
class Change:
    """What became of a number in a frame.

    Attributes:
        value: the new one; None: it stays.
        dragging: whether it is part of a drag that goes on.
        ended: whether a drag ended.
    """

    value: float | None = None
    dragging: bool = False
    ended: bool = False


NOTHING = Change()


@dataclass(slots=True)
class Boxes:
    """What all boxes of a window remember: which is typed into, and where a drag began.

    Attributes:
        typing: the box that is typed into; "" if none is.
        text: what has been typed.
        fresh: whether typing begins in this frame.
        wants_next: whether the next box that is drawn is to be typed into.
        start: the value at the drag's beginning.
        travel: of the drag, points of normal speed.
        moved: whether the pointer has moved in this drag.
        all_selected: whether the whole text is to be selected, as a double click on a box asks for.
        typed: the box that was typed into last, to which the keyboard comes back.
        refused: why what was typed last is no number; empty once somebody has told it.
    """

    typing: str = ""
    text: str = ""
    fresh: bool = False
    wants_next: bool = False
    start: float = 0.0
    travel: float = 0.0
    moved: bool = False
    all_selected: bool = False
    typed: str = ""
    refused: str = ""


def number_box(
    boxes: Boxes, name: str, value: float, width: float, scale: Scale, *, mark: theme.Rgba | None = None
) -> Change:
    """Draws a box and returns what the user did to its number.

    Args:
        boxes: the memory of all boxes.
        name: of this box, unlike any other.
        mark: a colour for its left edge (that of an axis).
    """
    if boxes.wants_next:
        _begin_typing(boxes, name, value, scale)
    if boxes.typing == name:
        return _typed(boxes, name, width, scale)
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    if boxes.typed == name:
        boxes.typed = ""
        if imgui.get_io().config_flags & imgui.ConfigFlags_.nav_enable_keyboard:
            imgui.set_keyboard_focus_here()
    area(f"##{name}", (width, height))
    change = _dragged(boxes, name, value, width, scale)
    shown = value if change.value is None else change.value
    _draw(corner, width, height, shown, scale, mark)
    if imgui.is_item_hovered() or imgui.is_item_active():
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
    return change


def text_of(value: float, scale: Scale, digits: int = 6) -> str:
    """The number as it is shown, with its unit and a true minus sign."""
    shown = value * scale.factor
    whole = scale.whole or (abs(shown) < 1e6 and shown == round(shown))
    text = f"{round(shown)}" if whole else f"{shown:.{digits}g}"
    return text.replace("-", "\u2212") + scale.unit


def typed_number(text: str, scale: Scale) -> float | None:
    """The value that a text stands for: a number, or a sum of numbers with + - * / ** ( ), pi, e and sqrt().

    None if it is no number.
    """
    cleaned = text.strip().replace("\u2212", "-").removesuffix(scale.unit.strip()).strip()
    if "." not in cleaned and cleaned.count(",") == 1:
        cleaned = cleaned.replace(",", ".")
    try:
        found = _value(ast.parse(cleaned[:200], mode="eval").body) / scale.factor
    except (SyntaxError, ValueError, ArithmeticError, TypeError, RecursionError, MemoryError):
        return None
    return None if not math.isfinite(found) else float(round(found)) if scale.whole else found


def moved_by(start: float, travel: float, width: float, scale: Scale) -> float:
    """A number after a drag.

    Args:
        start: before the drag.
        travel: of the pointer to the right, points; a box with a bar is `width` points wide.
    """
    if scale.usual is None:
        found = _moved_freely(start, travel, scale)
    else:
        low, high = scale.usual
        if scale.log:
            place = math.log(max(start, low) / low) + travel / width * math.log(high / low)
            found = low * math.exp(min(place, 600.0))
            # Magnitudes never come to 0; the bar's left end does where 0 is allowed.
            if place < 0 and scale.low == 0:
                found = 0.0 if place < -0.02 * math.log(high / low) and not scale.whole else low
            found = _digits(found, 3)
        else:
            found = start + travel / width * (high - low)
            found = _decimals(found, (high - low) / width)
    if scale.whole:
        found = float(round(found))
    return _within(found, scale)


def _moved_freely(start: float, travel: float, scale: Scale) -> float:
    positive = scale.low is not None and scale.low >= 0 and start > 0
    if scale.step is not None:
        return _decimals(start + travel * scale.step, scale.step)
    if positive and not scale.whole:
        return _digits(start * math.exp(min(travel * _PER_POINT, 100.0)), 4)
    step = max(abs(start), 1.0) * _PER_POINT if not scale.whole else max(abs(start) * _PER_POINT, 0.2)
    return _decimals(start + travel * step, step)


def _within(value: float, scale: Scale) -> float:
    beside = 1e-3 * (scale.usual[1] - scale.usual[0] if scale.usual is not None else 1e-3)
    if scale.low is not None and value <= scale.low:
        value = scale.low + scale.open[0] * beside
    if scale.high is not None and value >= scale.high:
        value = scale.high - scale.open[1] * beside
    return value


def _decimals(value: float, step: float) -> float:
    """Rounded so that a step still shows, and no further."""
    return round(value, max(math.ceil(-math.log10(max(step, 1e-300))) + 1, 0)) if step < 10 else round(value)


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def _dragged(boxes: Boxes, name: str, value: float, width: float, scale: Scale) -> Change:
    io = imgui.get_io()
    if imgui.is_item_activated():
        boxes.start, boxes.travel, boxes.moved = value, 0.0, False
        if io.key_ctrl or imgui.is_mouse_double_clicked(0):
            _begin_typing(boxes, name, value, scale)
            return NOTHING
    if imgui.is_item_active():
        drag = imgui.get_mouse_drag_delta(0, 0.0)
        if not boxes.moved and max(abs(drag.x), abs(drag.y)) <= _STILL:
            return NOTHING
        boxes.moved = True
        speed = FINE if io.key_shift else COARSE if io.key_ctrl else 1.0
        if io.mouse_delta.x == 0:
            return NOTHING
        boxes.travel += io.mouse_delta.x * speed
        fine = replace(scale, step=scale.step * FINE) if scale.step and io.key_shift else scale
        found = moved_by(boxes.start, boxes.travel, width, fine)
        return Change(found, dragging=True) if found != value else NOTHING
    if imgui.is_item_deactivated() and boxes.typing != name:
        if boxes.moved:
            return Change(ended=True)
        if imgui.is_item_hovered():
            _begin_typing(boxes, name, value, scale)
    return NOTHING


def _begin_typing(boxes: Boxes, name: str, value: float, scale: Scale) -> None:
    boxes.typing, boxes.fresh, boxes.wants_next = name, True, False
    shown = value * scale.factor
    boxes.text = f"{round(shown)}" if scale.whole else f"{shown:.12g}"


def _typed(boxes: Boxes, name: str, width: float, scale: Scale) -> Change:
    imgui.set_next_item_width(width)
    began = boxes.fresh
    if began:
        imgui.set_keyboard_focus_here()
        boxes.fresh = False
    # Tab goes to the next box: as a character it is seen here, instead of going where Dear ImGui sends it.
    flags = imgui.InputTextFlags_.auto_select_all | imgui.InputTextFlags_.allow_tab_input
    flags |= imgui.InputTextFlags_.callback_always
    before = boxes.text

    def select(data: Any) -> int:
        if boxes.all_selected:
            boxes.all_selected = False
            data.select_all()
        return 0

    _, boxes.text = imgui.input_text(f"##{name}.text", boxes.text, flags, select)
    # The first click of two has begun to type; the second would select a word of the number.
    boxes.all_selected |= imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0)
    tab = "\t" in boxes.text
    ended = imgui.is_item_deactivated() or (not began and not imgui.is_item_active() and before == boxes.text)
    if not (tab or ended):
        return NOTHING
    boxes.typing, boxes.typed = "", "" if tab else name
    boxes.wants_next = tab
    if imgui.is_key_pressed(imgui.Key.escape):
        return NOTHING
    text = boxes.text.replace("\t", "").strip()
    found = typed_number(text, scale)
    if found is None:
        boxes.refused = f"{text[:40]!r} is no number" if text else "a number is missing"
        return NOTHING
    return Change(found)


def _draw(
    corner: Any, width: float, height: float, value: float, scale: Scale, mark: theme.Rgba | None
) -> None:
    draw = imgui.get_window_draw_list()
    hovered, active = imgui.is_item_hovered(), imgui.is_item_active()
    back = theme.FRAME_ACTIVE if active else theme.FRAME_HOVERED if hovered else theme.FRAME
    low, high = corner, imgui.ImVec2(corner.x + width, corner.y + height)
    draw.add_rect_filled(low, high, theme.packed(back), 5.0)
    part = bar_part(value, scale)
    if part is not None and part > 0:
        end = imgui.ImVec2(corner.x + width * part, high.y)
        draw.push_clip_rect(low, end, True)
        draw.add_rect_filled(
            low, high, theme.packed(theme.ACCENT, 0.42 if active else 0.34 if hovered else 0.27), 5.0
        )
        if part < 1:
            draw.add_line(
                imgui.ImVec2(end.x - 1, low.y),
                imgui.ImVec2(end.x - 1, end.y),
                theme.packed(theme.ACCENT, 0.75),
                2.0,
            )
        draw.pop_clip_rect()
    if mark is not None:
        draw.add_rect_filled(low, imgui.ImVec2(corner.x + 3, high.y), theme.packed(mark), 2.0)
    text, size = _fitting(value, scale, width - 8)
    draw.push_clip_rect(low, high, True)
    place = imgui.ImVec2(corner.x + max((width - size.x) / 2, 6.0), corner.y + (height - size.y) / 2)
    draw.add_text(place, theme.packed(theme.TEXT, imgui.get_style().alpha), text)
    draw.pop_clip_rect()


def _fitting(value: float, scale: Scale, width: float) -> tuple[str, Any]:
    """The text with as many digits as fit into a width, and its size."""
    for digits in (6, 5, 4, 3):
        text = text_of(value, scale, digits)
        size = imgui.calc_text_size(text)
        if size.x <= width:
            break
    return text, size


def bar_part(value: float, scale: Scale) -> float | None:
    """The part of a box that is filled, 0 to 1; None for a box without a bar."""
    if scale.usual is None:
        return None
    low, high = scale.usual
    if scale.log:
        part = math.log(value / low) / math.log(high / low) if value > 0 else 0.0
    else:
        part = (value - low) / (high - low)
    return min(max(part, 0.0), 1.0)


_TWO: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def _value(node: ast.expr) -> float:
    """The value of a parsed sum of numbers; ValueError for anything else."""
    if isinstance(node, ast.Constant):
        if isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
            return float(node.value)
        raise ValueError("no number")
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        return -_value(node.operand) if isinstance(node.op, ast.USub) else _value(node.operand)
    if isinstance(node, ast.BinOp) and type(node.op) in _TWO:
        return _TWO[type(node.op)](_value(node.left), _value(node.right))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
        return math.pow(_value(node.left), _value(node.right))
    if isinstance(node, ast.Name) and node.id in ("pi", "e"):
        return math.pi if node.id == "pi" else math.e
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "sqrt":
        return math.sqrt(_value(*node.args))
    raise ValueError("no number")
