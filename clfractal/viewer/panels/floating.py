"""Windows of panels that float over the picture: sheets in its middle, and boxes in a column at its right."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from imgui_bundle import imgui

from clfractal.viewer.panels import buttons, theme
from clfractal.viewer.panels.ui import Ui

GAP = 8.0
_FLAGS = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_collapse
    | imgui.WindowFlags_.no_saved_settings
)


def again(ui: Ui, seconds: float) -> None:
    """Asks for another frame within so many seconds, though nothing may happen until then.

    The shortest wait of a frame is `ui.memory["again"]`; the window's loop takes it out when it has drawn.
    """
    ui.memory["again"] = min(ui.memory.get("again", seconds), seconds)


def free_area(ui: Ui) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of what the dock and the toolbar leave free, points."""
    shown = "panels" in ui.show
    left = theme.MARGIN + (theme.DOCK_LEFT + theme.MARGIN if shown else 0.0)
    if ui.size[0] - left < 420:
        left = theme.MARGIN
    top = theme.MARGIN + (38.0 if shown else 0.0)
    return left, top, ui.size[0] - theme.MARGIN, ui.size[1] - theme.MARGIN


@contextmanager
def sheet(ui: Ui, name: str, title: str, about: str, size: tuple[float, float]) -> Iterator[None]:
    """A large window in the middle of what the dock leaves free; what is drawn within is its content.

    Args:
        name: of the part in `ui.show`, which a click on its cross takes out.
        about: a line beside the title.
        size: wanted, points; it becomes smaller where there is no room.
    """
    left, _, right, bottom = free_area(ui)
    top = theme.MARGIN
    width, height = min(size[0], right - left), min(size[1], bottom - top)
    middle = imgui.ImVec2((left + right) / 2, (top + bottom) / 2)
    imgui.set_next_window_pos(middle, imgui.Cond_.always, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size(imgui.ImVec2(width, height))
    with theme.measures(window_padding=(16.0, 14.0)):
        imgui.begin(f"##{name}", None, _FLAGS | imgui.WindowFlags_.no_scrollbar)
    _head(ui, name, title, about, 17.0)
    try:
        yield
    finally:
        imgui.end()


@contextmanager
def box(ui: Ui, name: str, title: str, height: float = 0.0) -> Iterator[None]:
    """A box at the right, below those that this frame has drawn before.

    Args:
        height: at most, points; it takes as much as it needs.
    """
    _, top, right, bottom = free_area(ui)
    frame, y = ui.memory.get("boxes.below", (-1, top))
    if frame != imgui.get_frame_count():
        y = top
    width = min(theme.DOCK_RIGHT, ui.size[0] - 2 * theme.MARGIN)
    imgui.set_next_window_pos(imgui.ImVec2(right - width, y))
    most = max(min(height or bottom, bottom - y), 120.0)
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, most))
    imgui.begin(f"##{name}", None, _FLAGS | imgui.WindowFlags_.always_auto_resize)
    _head(ui, name, title, "", 15.0)
    try:
        yield
    finally:
        ui.memory["boxes.below"] = (imgui.get_frame_count(), y + imgui.get_window_height() + GAP)
        imgui.end()


def _head(ui: Ui, name: str, title: str, about: str, size: float) -> None:
    with theme.font("bold", size):
        imgui.align_text_to_frame_padding()
        imgui.text(title)
    if about:
        imgui.same_line(0, 12)
        imgui.align_text_to_frame_padding()
        room = imgui.get_content_region_avail().x - 30
        imgui.text_colored(theme.vec(theme.DIM), buttons.clipped(about, room))
    imgui.same_line(imgui.get_window_width() - imgui.get_style().window_padding.x - imgui.get_frame_height())
    with theme.colors(button=(0.0, 0.0, 0.0, 0.0)):
        if buttons.icon_button(theme.CROSS, f"Close ({ui.keys.hint('cancel')})", name=f"close {name}"):
            ui.show.discard(name)
    imgui.dummy(imgui.ImVec2(0, 2))


def picture_card(
    texture: object | None, size: tuple[float, float], name: str, *, chosen: bool, problem: str = ""
) -> bool:
    """A small picture that can be clicked, with rounded corners; whether it was clicked.

    Args:
        texture: None while it is rendered; then a faint sign is shown.
        size: points.
        name: unlike that of the others.
        chosen: whether it has a bright rim.
        problem: why there is no picture; shown in its place.
    """
    corner = imgui.get_cursor_screen_pos()
    clicked = imgui.invisible_button(f"##{name}", imgui.ImVec2(*size))
    far = imgui.ImVec2(corner.x + size[0], corner.y + size[1])
    draw = imgui.get_window_draw_list()
    zero, one = imgui.ImVec2(0, 0), imgui.ImVec2(1, 1)
    if texture is not None:
        draw.add_image_rounded(texture, corner, far, zero, one, theme.packed((1, 1, 1, 1)), theme.ROUNDING)
    else:
        draw.add_rect_filled(corner, far, theme.packed(theme.HEADER), theme.ROUNDING)
        sign = theme.WARN if problem else theme.PICTURE
        tint = theme.WARNING if problem else theme.FAINT
        with theme.font(size=22.0):
            extent = imgui.calc_text_size(sign)
            place = imgui.ImVec2(corner.x + (size[0] - extent.x) / 2, corner.y + (size[1] - extent.y) / 2)
            draw.add_text(place, theme.packed(tint, 0.6), sign)
    if chosen or imgui.is_item_hovered():
        tint = theme.ACCENT if chosen else theme.DIM
        draw.add_rect(corner, far, theme.packed(tint), theme.ROUNDING, 2.0)
    else:
        draw.add_rect(corner, far, theme.packed(theme.LINE), theme.ROUNDING, 1.0)
    return bool(clicked)
