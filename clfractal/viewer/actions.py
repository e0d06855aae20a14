"""Everything that a key can do in the window, in the order of the help, with the keys it comes with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

Context: TypeAlias = Literal["picture", "fly", "text"]
"""What has the keyboard: the picture, the flight (the pointer is hidden), or a text field of a panel."""

_PICTURE: frozenset[Context] = frozenset(("picture", "fly"))
_EVERYWHERE: frozenset[Context] = frozenset(("picture", "fly", "text"))


@dataclass(frozen=True, slots=True)
class Action:
    """Something a key can do.

    Attributes:
        name: by which settings and the window know it.
        keys: chords, as `Chord.parse` reads them.
        help: what it does; neighbours with the same text are one row of the help.
        group: heading in the help.
        contexts: where it works.
        held: it goes on while the key is down; Shift may be down too.
    """

    name: str
    keys: tuple[str, ...]
    help: str
    group: str
    contexts: frozenset[Context] = _PICTURE
    held: bool = False


# group: (name, keys separated by blanks, help); `*`: also while a text is typed, `~`: as long as the key is down.
_TABLE: Mapping[str, tuple[tuple[str, str, str], ...]] = {
    "Window": (
        ("*help", "F1", "this help"),
        ("*panels", "F2", "show or hide the panels"),
        ("into_panels", "Tab", "into the panels; Escape goes back"),
        ("*overlay", "F3", "show or hide the figures over the picture"),
        ("*gallery", "F4", "gallery of scenes"),
        ("*variations", "F6", "variations of the scene to choose from"),
        ("*formula", "F7", "formula editor"),
        ("*history", "Ctrl+H", "steps to undo, and bookmarks"),
        ("*next_device", "F8", "next device"),
        ("*full_screen", "F11", "full screen"),
        ("*span_monitors", "Shift+F11", "one window over all chosen monitors, for two projectors"),
        ("*window_per_monitor", "Ctrl+F11", "a window for each of two monitors, one eye each"),
        ("*cancel", "Escape", "cancel, close, stop flying"),
        ("*quit", "Ctrl+Q", "quit"),
    ),
    "File": (
        ("*open", "Ctrl+O", "open a scene"),
        ("*save", "Ctrl+S", "save the scene"),
        ("*save_as", "Ctrl+Shift+S", "save the scene under another name"),
        ("*reload", "F5", "load the scene's file again"),
        ("copy", "Ctrl+C", "copy the scene to the clipboard"),
        ("*screenshot", "F12", "save the picture alone as PNG, beside the scene"),
        ("*screenshot_panels", "Shift+F12", "save the picture with the panels over it"),
        ("*export", "Ctrl+E", "save the picture as EXR, with all channels"),
        ("*render_still", "F9", "render a still in the background"),
        ("*render_film", "Shift+F9", "render the film in the background"),
    ),
    "Undo": (
        ("undo", "Ctrl+Z", "undo and redo a change of the scene"),
        ("redo", "Ctrl+Shift+Z Ctrl+Y", "undo and redo a change of the scene"),
        ("undo_camera", "Alt+Z", "camera back and forth"),
        ("redo_camera", "Alt+Shift+Z", "camera back and forth"),
    ),
    "Picture": (
        ("pause", "Space", "pause or go on gathering samples"),
        ("exposure_down", "-", "darker, lighter"),
        ("exposure_up", "=", "darker, lighter"),
        ("exposure_reset", "0", "exposure as in the scene"),
        ("next_renderer", "V", "next renderer: surface, volume, cut plane"),
        ("region", "G", "refine a rectangle alone"),
        ("region_clear", "Shift+G", "refine the whole picture"),
        ("coarse", "H", "allow or forbid coarse pictures while moving"),
        ("lights", "K", "show lights, to drag them"),
        ("focus_pointer", "Shift+C", "make sharp what is under the pointer"),
    ),
    "Camera": (
        ("orbit_left", "Left Num4", "orbit"),
        ("orbit_right", "Right Num6", "orbit"),
        ("orbit_up", "Up Num8", "orbit"),
        ("orbit_down", "Down Num2", "orbit"),
        ("pan_left", "Shift+Left", "pan"),
        ("pan_right", "Shift+Right", "pan"),
        ("pan_up", "Shift+Up", "pan"),
        ("pan_down", "Shift+Down", "pan"),
        ("zoom_in", "NumPlus", "nearer, farther"),
        ("zoom_out", "NumMinus", "nearer, farther"),
        ("~roll_left", "[", "roll"),
        ("~roll_right", "]", "roll"),
        ("level", "\\", "level the horizon"),
        ("center_pointer", "C", "centre on what is under the pointer"),
        ("frame_all", "Home", "show all of the object"),
        ("view_front", "1 Num1", "from the front, the back"),
        ("view_back", "Shift+1 Ctrl+Num1", "from the front, the back"),
        ("view_right", "3 Num3", "from the right, the left"),
        ("view_left", "Shift+3 Ctrl+Num3", "from the right, the left"),
        ("view_top", "7 Num7", "from the top, the bottom"),
        ("view_bottom", "Shift+7 Ctrl+Num7", "from the top, the bottom"),
        ("projection", "5 Num5", "perspective or orthographic"),
        ("orbit_style", "O", "turntable or free orbit"),
        ("copy_place", "Ctrl+Shift+C", "copy this place, with all digits; go to the copied one"),
        ("paste_place", "Ctrl+V", "copy this place, with all digits; go to the copied one"),
        ("bookmark_add", "B", "keep this view as a bookmark"),
        *((f"bookmark_{n}", f"Ctrl+{n}", "go to a bookmark") for n in range(1, 10)),
    ),
    "Fly": (
        ("~fly_forward", "Pos:W", "forward, back"),
        ("~fly_back", "Pos:S", "forward, back"),
        ("~fly_left", "Pos:A", "left, right"),
        ("~fly_right", "Pos:D", "left, right"),
        ("~fly_up", "Pos:E Pos:R", "up, down"),
        ("~fly_down", "Pos:Q Pos:F", "up, down"),
        ("fly", "J", "look around with the mouse while flying"),
    ),
    "Film": (
        ("*timeline", "F10", "the film, or the scene as it stands"),
        ("play", "P", "play, stop"),
        ("play_repeat", "L", "repeat while playing, or play once"),
        ("frame_back", "Alt+,", "one frame back, on"),
        ("frame_forward", "Alt+.", "one frame back, on"),
        ("key_back", "Alt+Shift+,", "to the key before, after"),
        ("key_forward", "Alt+Shift+.", "to the key before, after"),
        ("film_first", "Shift+Home", "to the first frame, the last"),
        ("film_last", "Shift+End", "to the first frame, the last"),
        ("play_from", "Alt+Home", "play from this frame, to this frame"),
        ("play_to", "Alt+End", "play from this frame, to this frame"),
        ("play_all", "Alt+Backspace", "play all of the film"),
        ("set_keys", "Shift+K", "set keys for all that changed at this frame"),
        ("auto_keys", "Ctrl+K", "set keys at once for what moves, or not"),
        ("delete_keys", "Delete", "delete the chosen keys"),
        ("record_flight", "Shift+J", "record a flight as keys of the camera; again: end"),
    ),
    "Plane and zoom cube": (
        ("move_out", "PageUp", "along the normal, or the view"),
        ("move_in", "PageDown", "along the normal, or the view"),
        ("move_left", "Ctrl+Left", "to the side"),
        ("move_right", "Ctrl+Right", "to the side"),
        ("move_up", "Ctrl+Up", "up, down"),
        ("move_down", "Ctrl+Down", "up, down"),
        ("larger", "Shift+PageUp", "larger, smaller"),
        ("smaller", "Shift+PageDown", "larger, smaller"),
        ("turn_left", "Alt+Left", "turn the plane to the left, right"),
        ("turn_right", "Alt+Right", "turn the plane to the left, right"),
        ("turn_up", "Alt+Up", "turn the plane up, down"),
        ("turn_down", "Alt+Down", "turn the plane up, down"),
        ("spin_left", "Alt+PageUp", "turn the plane about its normal"),
        ("spin_right", "Alt+PageDown", "turn the plane about its normal"),
        ("cut", "Y", "cut the object open at the plane, or close it"),
        ("zoom_mark", "U", "show or hide the cube of a volume's next zoom"),
        ("zoom_apply", "Enter NumEnter", "zoom into the cube"),
        ("zoom_back", "Backspace", "step back out of the last zoom"),
    ),
    "Stereo": (
        ("next_stereo", "N", "next, previous mode"),
        ("previous_stereo", "Shift+N", "next, previous mode"),
        ("swap_eyes", "X", "exchange the eyes"),
        ("fit_stereo", "M", "fit the depth to the budget"),
        ("parallax", "I", "show the parallax under the pointer"),
        ("eyes_nearer", ",", "distance between the eyes, smaller, larger"),
        ("eyes_farther", ".", "distance between the eyes, smaller, larger"),
        ("screen_nearer", "Shift+,", "distance from the screen, smaller, larger"),
        ("screen_farther", "Shift+.", "distance from the screen, smaller, larger"),
        ("screen_narrower", "Ctrl+,", "width of the screen, smaller, larger"),
        ("screen_wider", "Ctrl+.", "width of the screen, smaller, larger"),
        ("chart", "T", "alignment chart for projectors"),
    ),
}


def _actions() -> Iterator[Action]:
    for group, rows in _TABLE.items():
        for marked, keys, told in rows:
            name = marked.lstrip("*~")
            contexts = _EVERYWHERE if marked.startswith("*") else _PICTURE
            yield Action(name, tuple(keys.split()), told, group, contexts, held=marked.startswith("~"))


ACTIONS: Mapping[str, Action] = {action.name: action for action in _actions()}
"""All actions by their names."""
