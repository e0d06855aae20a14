"""The bar of buttons at the top right: what most people look for first, with its key in the tooltip."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

HEIGHT = 36.0
"""Points that the bar is high."""


@dataclass(frozen=True, slots=True)
class _Button:
    """A button: the action that it does, its icon, its tooltip, and the part of `Ui.show` that it opens."""

    action: str
    icon: str
    about: str
    part: str = ""


_GROUPS = (
    (
        _Button("gallery", theme.GRID, "Gallery of scenes", "gallery"),
        _Button("open", theme.FOLDER, "Open a scene", "open"),
        _Button("save", theme.SAVE, "Save the scene", "save"),
    ),
    (
        _Button("undo", theme.UNDO, "Undo"),
        _Button("redo", theme.REDO, "Redo"),
        _Button("history", theme.HISTORY, "Steps and bookmarks", "history"),
    ),
    (
        _Button("variations", theme.RANDOM, "Variations of the scene", "variations"),
        _Button("render_still", theme.CAMERA, "Render a still", "stills"),
        _Button("timeline", theme.FILM, "Film and timeline"),
        _Button("next_stereo", theme.EYE, "Stereo: next mode"),
    ),
    (
        _Button("help", theme.HELP, "Keys and pointer", "help"),
        _Button("full_screen", theme.EXPAND, "Full screen"),
        _Button("panels", theme.EYE_CLOSED, "Hide the panels"),
    ),
)

ACTIONS = tuple(button.action for group in _GROUPS for button in group)
"""The actions of all buttons, in their order."""


def draw(ui: Ui) -> None:
    """Draws the bar, if panels are shown."""
    if "panels" not in ui.show:
        return
    flags = theme.BACK | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_nav
    place = (ui.size[0] - theme.MARGIN, theme.MARGIN)
    with (
        theme.window("menu", place, flags=flags, pivot=(1.0, 0.0), window_padding=(5.0, 5.0)),
        theme.colors(frame_bg=theme.PANEL, border=theme.LINE),
        theme.measures(item_spacing=(2.0, 2.0)),
    ):
        for number, group in enumerate(_GROUPS):
            if number:
                _gap()
            for index, button in enumerate(group):
                if index:
                    w.in_row(2)
                _button(ui, button)


def _gap() -> None:
    w.in_row(5)
    corner = imgui.get_cursor_screen_pos()
    high = imgui.get_frame_height()
    imgui.get_window_draw_list().add_line(
        imgui.ImVec2(corner.x, corner.y + 5),
        imgui.ImVec2(corner.x, corner.y + high - 5),
        theme.packed(theme.FRAME_ACTIVE),
    )
    imgui.dummy(imgui.ImVec2(1, high))
    w.in_row(5)


def _button(ui: Ui, button: _Button) -> None:
    about, on, enabled = button.about, bool(button.part) and button.part in ui.show, True
    stereo = ui.studio.scene.stereo
    if button.action in ("undo", "redo"):
        enabled = ui.studio.history.depth("scene")[button.action == "redo"] > 0
    elif button.action == "next_stereo":
        on = stereo is not None
        mode = stereo.mode.replace("_", " ") if stereo is not None else "off"
        about = f"{about} (now {mode}); right click: the previous one"
    elif button.action == "timeline":
        on = ui.studio.frame_number is not None
    elif button.action == "save" and ui.studio.unsaved:
        about = f"{about}: it has changed"
    elif button.action == "render_still":
        running = sum(1 for still in ui.studio.stills if not still.finished)
        about = f"{about}; {running} under way" if running else about
    clicked = w.act(ui, button.action, button.icon, about, on=on, enabled=enabled)
    if clicked and button.action == "panels" and (hint := ui.keys.hint("panels")):
        ui.studio.tell(f"{hint} shows the panels again")
    if button.action == "next_stereo" and imgui.is_item_clicked(imgui.MouseButton_.right):
        ui.act("previous_stereo")
