"""The look of all panels: colours, fonts, icons and the measures of Dear ImGui's style.

Everything is in points; Dear ImGui draws fonts and corners at the framebuffer's own resolution.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from imgui_bundle import __path__ as _bundle
from imgui_bundle import imgui

Rgba = tuple[float, float, float, float]
"""Red, green, blue and opacity as a screen has them, 0 to 1."""


def _rgb(code: str, alpha: float = 1.0) -> Rgba:
    red, green, blue = bytes.fromhex(code)
    return red / 255, green / 255, blue / 255, alpha


ACCENT = _rgb("f2ad4e")
ACCENT_DIM = _rgb("f2ad4e", 0.30)
ACCENT_FAINT = _rgb("f2ad4e", 0.14)
SECOND = _rgb("4fbfb0")
WARNING = _rgb("ff8d6b")
GOOD = _rgb("7fd18a")
TEXT = _rgb("e9e7e2")
DIM = _rgb("9aa0ab")
FAINT = _rgb("9aa0ab", 0.55)
PANEL = _rgb("15171c", 0.955)
PANEL_SOLID = _rgb("191b21")
FRAME = _rgb("262a32")
FRAME_HOVERED = _rgb("303540")
FRAME_ACTIVE = _rgb("39404d")
HEADER = _rgb("1f2229")
LINE = _rgb("ffffff", 0.075)
AXES = (_rgb("d8696b"), _rgb("8fbf62"), _rgb("6f9fe0"))
"""Colours of x, y and z."""

FONT_SIZE = 14.0
ROUNDING = 6.0
DOCK_LEFT = 300.0
DOCK_RIGHT = 280.0
MARGIN = 8.0

ICON_FONT = "fontawesome-webfont.ttf"
PLUS, MINUS, TRASH, COPY = "\uf067", "\uf068", "\uf014", "\uf24d"
UP, DOWN, LEFT, RIGHT = "\uf077", "\uf078", "\uf053", "\uf054"
OPENED, CLOSED = "\uf0d7", "\uf0da"
RESET, SEARCH, CROSS, CHECK = "\uf0e2", "\uf002", "\uf00d", "\uf00c"
TARGET, EXCHANGE, CROP, MAGIC = "\uf05b", "\uf0ec", "\uf125", "\uf0d0"
SLIDERS, CAMERA, CUBE, CUBES = "\uf1de", "\uf030", "\uf1b2", "\uf1b3"
LIGHT, BRUSH, CHIP, CLOUD = "\uf0eb", "\uf1fc", "\uf2db", "\uf0c2"
EYE, EYE_CLOSED, SCISSORS = "\uf06e", "\uf070", "\uf0c4"
PICTURE, CODE, COG = "\uf03e", "\uf121", "\uf013"
BOOKMARK, HISTORY, SAVE, FOLDER = "\uf02e", "\uf1da", "\uf0c7", "\uf07c"
HELP, REFRESH, WARN, GRID = "\uf059", "\uf021", "\uf071", "\uf00a"
RANDOM, FILM, DOWNLOAD = "\uf074", "\uf008", "\uf019"
EXPAND, COMPRESS, ARROWS, PALETTE = "\uf065", "\uf066", "\uf047", "\uf1fb"
UNDO, REDO = "\uf0e2", "\uf01e"
FIRST, KEY_BACK, KEY_NEXT, LAST = "\uf049", "\uf048", "\uf051", "\uf050"
PLAY, PAUSE, REPEAT = "\uf04b", "\uf04c", "\uf079"
KEY, CURVE, RECORD = "\uf084", "\uf201", "\uf111"
BARS, LIST, PENCIL, LINK = "\uf0c9", "\uf03a", "\uf040", "\uf0c1"
"""Icons are characters of Font Awesome 4.7, which all fonts of panels have."""


@cache
def packed(color: Rgba, alpha: float = 1.0) -> int:
    """A colour as draw lists take it; `alpha` is a factor on its opacity."""
    red, green, blue, own = (round(min(max(part, 0.0), 1.0) * 255) for part in (*color[:3], color[3] * alpha))
    return red | green << 8 | blue << 16 | own << 24


def vec(color: Rgba, alpha: float = 1.0) -> Any:
    """A colour as an `imgui.ImVec4`."""
    return imgui.ImVec4(*color[:3], color[3] * alpha)


def setup() -> None:
    """Gives the current Dear ImGui context its fonts and its style; once for a context, before its first frame."""
    _load_fonts()
    style = imgui.get_style()
    style.font_size_base = FONT_SIZE
    for name, value in _MEASURES.items():
        setattr(style, name, imgui.ImVec2(*value) if isinstance(value, tuple) else value)
    for name, color in _COLORS.items():
        style.set_color_(getattr(imgui.Col_, name), vec(color))
    io = imgui.get_io()
    io.config_windows_move_from_title_bar_only = True
    io.config_input_text_cursor_blink = False  # a caret that blinks would need new frames for ever


def _load_fonts() -> None:
    """Regular (with icons), bold (with icons) and fixed-width fonts, in this order, from the files of imgui-bundle."""
    fonts = imgui.get_io().fonts
    if len(fonts.fonts) > 0:
        return
    folder = Path(next(iter(_bundle))) / "assets" / "fonts"
    for name in ("Roboto/Roboto-Regular.ttf", "Roboto/Roboto-Bold.ttf", "Inconsolata-Medium.ttf"):
        if (folder / name).is_file():
            fonts.add_font_from_file_ttf(str(folder / name), FONT_SIZE)
        else:
            fonts.add_font_default()
        if (folder / ICON_FONT).is_file():
            merged = imgui.ImFontConfig()
            merged.merge_mode = True
            merged.extra_size_scale = 0.92
            fonts.add_font_from_file_ttf(str(folder / ICON_FONT), FONT_SIZE, merged)


@contextmanager
def font(kind: str = "regular", size: float = FONT_SIZE) -> Iterator[None]:
    """Text in another font (`regular`, `bold` or `fixed`) or size, points."""
    number = {"regular": 0, "bold": 1, "fixed": 2}[kind]
    fonts = imgui.get_io().fonts.fonts
    imgui.push_font(fonts[number] if number < len(fonts) else None, size)
    try:
        yield
    finally:
        imgui.pop_font()


@contextmanager
def colors(**changes: Rgba) -> Iterator[None]:
    """Other colours of Dear ImGui's style: `with colors(text=DIM): ...`."""
    for name, color in changes.items():
        imgui.push_style_color(getattr(imgui.Col_, name), vec(color))
    try:
        yield
    finally:
        imgui.pop_style_color(len(changes))


@contextmanager
def measures(**changes: float | tuple[float, float]) -> Iterator[None]:
    """Other measures of Dear ImGui's style: `with measures(item_spacing=(4, 4)): ...`."""
    for name, value in changes.items():
        given = imgui.ImVec2(*value) if isinstance(value, tuple) else value
        imgui.push_style_var(getattr(imgui.StyleVar_, name), given)
    try:
        yield
    finally:
        imgui.pop_style_var(len(changes))


@contextmanager
def window(
    name: str,
    place: tuple[float, float],
    size: tuple[float, float] | None = None,
    *,
    flags: int = 0,
    pivot: tuple[float, float] = (0.0, 0.0),
    **changes: float | tuple[float, float],
) -> Iterator[None]:
    """A window that stays where it is, without a title.

    Args:
        place, size: points; without a size it is as large as what is in it needs.
        flags: more of Dear ImGui's.
        pivot: the part of the window that is at the place.
        changes: of its own measures, as `window_padding`.
    """
    imgui.set_next_window_pos(imgui.ImVec2(*place), imgui.Cond_.always, imgui.ImVec2(*pivot))
    if size is not None:
        imgui.set_next_window_size(imgui.ImVec2(*size))
    with measures(**changes):
        imgui.begin(f"##{name}", None, _IN_ITS_PLACE | flags)
    # (After a mistake in a panel Dear ImGui ends what is open: see `Viewer._draw_panels`.)
    yield
    imgui.end()


_IN_ITS_PLACE = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_collapse
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
)
BACK = (
    imgui.WindowFlags_.no_scrollbar
    | imgui.WindowFlags_.no_scroll_with_mouse
    | imgui.WindowFlags_.no_bring_to_front_on_focus
    | imgui.WindowFlags_.no_focus_on_appearing
)
"""Flags of windows that lie below others, and neither scroll nor take the keyboard."""

_MEASURES: dict[str, float | tuple[float, float]] = {
    "window_padding": (10, 10),
    "frame_padding": (7, 4),
    "item_spacing": (6, 5),
    "item_inner_spacing": (5, 4),
    "cell_padding": (4, 3),
    "indent_spacing": 12,
    "scrollbar_size": 9,
    "grab_min_size": 10,
    "window_rounding": 8,
    "child_rounding": ROUNDING,
    "frame_rounding": 5,
    "popup_rounding": ROUNDING,
    "scrollbar_rounding": 6,
    "grab_rounding": 4,
    "tab_rounding": 5,
    "window_border_size": 1,
    "child_border_size": 1,
    "popup_border_size": 1,
    "frame_border_size": 0,
    "window_title_align": (0.0, 0.5),
    "separator_text_border_size": 1,
    "hover_delay_normal": 0.45,
    "hover_delay_short": 0.2,
    "disabled_alpha": 0.42,
}

_COLORS: dict[str, Rgba] = {
    "text": TEXT,
    "text_disabled": DIM,
    "window_bg": PANEL,
    "child_bg": _rgb("000000", 0.0),
    "popup_bg": _rgb("1c1f26", 0.985),
    "border": _rgb("ffffff", 0.085),
    "border_shadow": _rgb("000000", 0.0),
    "frame_bg": FRAME,
    "frame_bg_hovered": FRAME_HOVERED,
    "frame_bg_active": FRAME_ACTIVE,
    "title_bg": PANEL_SOLID,
    "title_bg_active": PANEL_SOLID,
    "title_bg_collapsed": PANEL_SOLID,
    "menu_bar_bg": PANEL_SOLID,
    "scrollbar_bg": _rgb("000000", 0.0),
    "scrollbar_grab": _rgb("ffffff", 0.14),
    "scrollbar_grab_hovered": _rgb("ffffff", 0.22),
    "scrollbar_grab_active": _rgb("ffffff", 0.30),
    "check_mark": ACCENT,
    "slider_grab": ACCENT,
    "slider_grab_active": ACCENT,
    "button": FRAME,
    "button_hovered": FRAME_HOVERED,
    "button_active": FRAME_ACTIVE,
    "header": FRAME,
    "header_hovered": FRAME_HOVERED,
    "header_active": FRAME_ACTIVE,
    "separator": LINE,
    "separator_hovered": ACCENT_DIM,
    "separator_active": ACCENT,
    "resize_grip": _rgb("ffffff", 0.06),
    "resize_grip_hovered": ACCENT_DIM,
    "resize_grip_active": ACCENT,
    "tab": HEADER,
    "tab_hovered": FRAME_HOVERED,
    "tab_selected": FRAME,
    "tab_selected_overline": ACCENT,
    "plot_lines": SECOND,
    "plot_histogram": ACCENT,
    "table_header_bg": HEADER,
    "table_border_light": LINE,
    "table_border_strong": LINE,
    "table_row_bg_alt": _rgb("ffffff", 0.02),
    "text_selected_bg": ACCENT_DIM,
    "text_link": SECOND,
    "input_text_cursor": ACCENT,
    "nav_cursor": ACCENT_DIM,
    "drag_drop_target": ACCENT,
    "modal_window_dim_bg": _rgb("08090b", 0.55),
}
