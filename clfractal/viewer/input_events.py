"""Events of the window, brought to the panels, the keys and the pointer's controls; recorded and played."""

from __future__ import annotations

import math
from typing import Any

from imgui_bundle import imgui

from clfractal.viewer import window
from clfractal.viewer.flying import Key
from clfractal.viewer.keys import KEYS, PRINTABLE, Context, KeyEvent
from clfractal.viewer.operators import HELD, Operators
from clfractal.viewer.panels import keyboard
from clfractal.viewer.recording import Event, Player, Recorder, Recording
from clfractal.viewer.workspace import Workspace

RELEASE, PRESS, REPEAT = 0, 1, 2
# Degrees that the head turns for a pixel of the mouse.
_LOOK = 0.15
# Actions that a held key repeats.
_REPEATED = (
    "orbit_",
    "pan_",
    "zoom_in",
    "zoom_out",
    "move_",
    "turn_",
    "spin_",
    "exposure_",
    "eyes_",
    "screen_",
    "frame_back",
    "frame_forward",
)
_RECORDED = ("key", "char", "button", "move", "scroll", "resize", "focus", "leave", "drop")


class Inputs:
    """Handles events one by one.

    Args:
        recording: events to play; None: none.
    """

    def __init__(self, workspace: Workspace, operators: Operators, recording: Recording | None) -> None:
        self.workspace, self.operators = workspace, operators
        self._before: tuple[float, float] | None = None
        self._held: dict[int, Key] = {}
        self._player: Player | None = None
        self._recorder: Recorder | None = None
        # Recordings count from the first picture on: what a pointer does depends on what is under it.
        self._start: float | None = None
        options = workspace.options
        workspace.ui.keys.layout = window.layout(PRINTABLE)
        if recording is not None:
            self._player = Player(recording)
        if options.record is not None:
            self._recorder = Recorder(options.record, workspace.window.size)

    @property
    def next_due(self) -> float | None:
        """When the next event of a recording is due, seconds of the loop's clock."""
        if self._player is None or self._start is None or self._player.next_seconds is None:
            return None
        return self._start + self._player.next_seconds

    @property
    def played(self) -> bool:
        """Whether nothing of a recording is left."""
        return self._player is None or self._player.done

    def play(self, now: float) -> None:
        """Queues the events of a recording whose time has come."""
        if self._start is None and self.workspace.surface.shown is not None:
            self._start = now
        if self._player is not None and self._start is not None:
            for event in self._player.due(now - self._start):
                # The window has its own size now.
                if event.kind != "resize":
                    self.workspace.events.append(event)

    def close(self) -> None:
        """Ends a recording."""
        if self._recorder is not None:
            self._recorder.close()

    def handle(self, event: Event, now: float) -> None:
        """One event."""
        work = self.workspace
        if self._recorder is not None and event.kind in _RECORDED:
            self._recorder.add(event, now - self._start if self._start is not None else 0.0)
        handler: Any = getattr(self, f"_{event.kind}", None)
        if handler is not None:
            with work.studio.telling():
                handler(now, *event.values)

    def _move(self, now: float, x: float, y: float) -> None:
        work = self.workspace
        size, framebuffer = work.window.size, work.window.framebuffer
        work.pointer = (x * framebuffer[0] / max(size[0], 1), y * framebuffer[1] / max(size[1], 1))
        before, self._before = self._before, (x, y) if self.operators.flying else None
        if self.operators.flying:
            if before is not None:
                speed = _LOOK * work.settings.mouse
                work.motion.turn(speed * (x - before[0]), speed * (y - before[1]))
            return
        across, down = work.places.to_ui(*work.pointer)
        imgui.get_io().add_mouse_pos_event(across / work.ui.scale, down / work.ui.scale)
        if work.controls.dragging:
            work.controls.move(self._in_picture())

    def _leave(self, now: float) -> None:
        if not self.workspace.controls.dragging:
            imgui.get_io().add_mouse_pos_event(-1e6, -1e6)

    def _button(self, now: float, button: int, action: int, mods: int) -> None:
        work, io = self.workspace, imgui.get_io()
        if action == RELEASE and work.controls.dragging:
            work.controls.release(self._in_picture())
        # Panels see every release, and what was not pressed in the picture.
        over_panels = io.want_capture_mouse and not self.operators.flying
        if 0 <= button < 5:
            io.add_mouse_button_event(button, action == PRESS)
        if action == PRESS and not over_panels and not self.operators.flying:
            imgui.set_window_focus(None)
            keyboard.leave(work.ui)
            aim = work.aim_at(*self.workspace.pointer)
            work.controls.press(button, mods, self._in_picture(), aim, now)

    def _scroll(self, now: float, dx: float, dy: float) -> None:
        work, io = self.workspace, imgui.get_io()
        if self.operators.flying:
            work.motion.fly.faster(dy)
        elif io.want_capture_mouse:
            io.add_mouse_wheel_event(dx, dy)
        else:
            work.controls.wheel(dy, _mods(), work.aim_at(*work.pointer), now)

    def _key(self, now: float, key: int, scancode: int, action: int, mods: int) -> None:
        work, io = self.workspace, imgui.get_io()
        name = window.key_name(key, scancode)
        # Dear ImGui's own keys (Ctrl+A, Ctrl+C) are by what is printed, too.
        typed = KEYS.get(name.upper(), key) if name is not None else key
        work.renderer.keyboard_callback(work.window.handle, typed, scancode, action, mods)
        if action == RELEASE:
            if key in self._held:
                work.motion.keys.discard(self._held.pop(key))
            return
        typing = io.want_text_input or keyboard.inside(work.ui)
        context: Context = "text" if typing else "fly" if self.operators.flying else "picture"
        work.ui.keys.layout = layout = window.layout(PRINTABLE)
        event = KeyEvent(key, scancode, mods, name, frozenset(map(str.lower, layout.values())))
        found = work.ui.keys.matches(event, context)
        if found is None:
            return
        if found.name in HELD:
            self._held[key] = HELD[found.name]
            work.motion.keys.add(HELD[found.name])
        elif action == PRESS or found.name.startswith(_REPEATED):
            work.act(found.name)

    def _char(self, now: float, code: int) -> None:
        if 0 < code < 0x110000:
            imgui.get_io().add_input_character(code)

    def _focus(self, now: float, focused: int) -> None:
        imgui.get_io().add_focus_event(bool(focused))
        if not focused:
            self._held.clear()
            self.workspace.motion.keys.clear()
            self.workspace.motion.fly.stop()

    def _drop(self, now: float, *paths: str) -> None:
        if paths:
            self.workspace.act(f"open:{paths[0]}")

    def _in_picture(self) -> tuple[float, float]:
        work = self.workspace
        size = work.surface.size
        if 0 in size:
            return self.workspace.pointer
        x, y = work.outputs.to_picture(*self.workspace.pointer, size)
        return (x, y) if math.isfinite(x) and math.isfinite(y) else (0.0, 0.0)


def _mods() -> int:
    """GLFW's bits of the modifiers that are down."""
    io = imgui.get_io()
    return int(io.key_shift) | int(io.key_ctrl) << 1 | int(io.key_alt) << 2
