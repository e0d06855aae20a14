"""GLFW windows: made for OpenGL 3.3, placed on monitors, and asked for their events."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import glfw

from clfractal.errors import STATUS_DEVICE_FAILED, DeviceError
from clfractal.viewer.recording import Event

TITLE = "clfractal"
_SMALLEST = (320, 200)


@dataclass(frozen=True, slots=True)
class Monitor:
    """A screen of the desktop.

    Attributes:
        number: from 1, as `--monitors` counts.
        name: the driver's.
        x, y, width, height: its place on the desktop, screen coordinates.
        metres: its physical width; 0 if it is unknown.
    """

    number: int
    name: str
    x: int
    y: int
    width: int
    height: int
    metres: float


def start() -> None:
    """Connects to the display.

    Raises:
        DeviceError: status 3, there is none.
    """
    problems: list[str] = []
    glfw.set_error_callback(lambda _, text: problems.append(_text(text)))
    glfw.init_hint(glfw.COCOA_CHDIR_RESOURCES, False)
    if not glfw.init():
        told = f" ({problems[-1]})" if problems else ""
        raise DeviceError(
            f"clfractal view needs a display, and there is none{told}", status=STATUS_DEVICE_FAILED
        )
    # PyOpenGL has to look for functions where GLFW makes the context. It guesses when it is imported, from variables
    # that GLFW need not follow.
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl" if _platform_is_wayland() else "glx")


def stop() -> None:
    """Leaves the display; all windows are gone."""
    glfw.set_error_callback(None)
    glfw.terminate()


def _platform_is_wayland() -> bool:
    ask = getattr(glfw, "get_platform", None)
    return ask is not None and ask() == getattr(glfw, "PLATFORM_WAYLAND", -1)


def _text(text: Any) -> str:
    return " ".join((text.decode(errors="replace") if isinstance(text, bytes) else str(text)).split())[:200]


def monitors() -> list[Monitor]:
    """The screens of the desktop, from left to right."""
    found = []
    for each in glfw.get_monitors():
        mode = glfw.get_video_mode(each)
        x, y = glfw.get_monitor_pos(each)
        wide, _ = glfw.get_monitor_physical_size(each)
        found.append((x, y, _text(glfw.get_monitor_name(each)), mode.size.width, mode.size.height, wide))
    return [
        Monitor(number, name, x, y, width, height, 1e-3 * wide)
        for number, (x, y, name, width, height, wide) in enumerate(sorted(found), start=1)
    ]


class Window:
    """One window with an OpenGL context of its own.

    Args:
        size: of its content, screen coordinates.
        on_event: given every event.
        share: another window whose textures it can use.
        quad: whether to ask for a buffer for each eye.
        visible: whether it is shown at once.

    Raises:
        DeviceError: status 3, there is no OpenGL 3.3.
    """

    def __init__(
        self,
        size: tuple[int, int],
        on_event: Callable[[Event], None],
        *,
        share: Window | None = None,
        quad: bool = False,
    ) -> None:
        self.on_event = on_event
        self._before: tuple[int, int, int, int] | None = None
        self._leaving: tuple[int, int] | None = None
        problems: list[str] = []
        glfw.set_error_callback(lambda _, text: problems.append(_text(text)))
        self.handle = self._made(size, share, quad) or (quad and self._made(size, share, False)) or None
        glfw.set_error_callback(lambda _, text: None)
        if self.handle is None:
            told = f" ({problems[-1]})" if problems else ""
            raise DeviceError(
                f"clfractal view needs OpenGL 3.3, and this display has none{told}",
                status=STATUS_DEVICE_FAILED,
            )
        glfw.make_context_current(self.handle)
        glfw.set_window_size_limits(self.handle, *_SMALLEST, glfw.DONT_CARE, glfw.DONT_CARE)
        self._listen()
        self.look()

    def _made(self, size: tuple[int, int], share: Window | None, quad: bool) -> Any:
        glfw.default_window_hints()
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, 3),
            (glfw.CONTEXT_VERSION_MINOR, 3),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, True),
            (glfw.DEPTH_BITS, 0),
            (glfw.STENCIL_BITS, 0),
            (glfw.SCALE_TO_MONITOR, True),
            (glfw.STEREO, quad),
            (glfw.FOCUS_ON_SHOW, share is None),
        ):
            glfw.window_hint(hint, value)
        for hint, text in ((glfw.X11_CLASS_NAME, TITLE), (glfw.X11_INSTANCE_NAME, TITLE)):
            glfw.window_hint_string(hint, text)
        return glfw.create_window(*size, TITLE, None, share.handle if share is not None else None)

    def _listen(self) -> None:
        window, tell = self.handle, self.on_event
        for listen, kind in (
            (glfw.set_key_callback, "key"),
            (glfw.set_char_callback, "char"),
            (glfw.set_mouse_button_callback, "button"),
            (glfw.set_cursor_pos_callback, "move"),
            (glfw.set_scroll_callback, "scroll"),
            (glfw.set_framebuffer_size_callback, "resize"),
            (glfw.set_window_refresh_callback, "refresh"),
        ):
            listen(window, lambda _, *values, kind=kind: tell(Event(kind, values)))
        glfw.set_window_focus_callback(window, lambda _, on: tell(Event("focus", (int(bool(on)),))))
        glfw.set_cursor_enter_callback(window, lambda _, entered: entered or tell(Event("leave")))
        glfw.set_drop_callback(window, lambda _, paths: tell(Event("drop", tuple(map(str, paths)))))

    def use(self) -> None:
        """Makes its OpenGL context current."""
        glfw.make_context_current(self.handle)

    @property
    def framebuffer(self) -> tuple[int, int]:
        """Size in pixels; (0, 0) while it is minimised. As of the last `look`."""
        return self._framebuffer

    @property
    def size(self) -> tuple[int, int]:
        """Size in screen coordinates, as of the last `look`."""
        return self._size

    def look(self) -> None:
        """Asks the system for what may have changed; once for each round of the loop.

        Each question to GLFW may wait for another thread's turn of the interpreter, so nothing is asked twice.
        """
        width, height = glfw.get_framebuffer_size(self.handle)
        self._framebuffer = (int(width), int(height))
        width, height = glfw.get_window_size(self.handle)
        self._size = (int(width), int(height))
        if self._leaving is not None and self._size != self._leaving:
            self._leaving = None
        self._iconified = bool(glfw.get_window_attrib(self.handle, glfw.ICONIFIED))

    @property
    def scale(self) -> float:
        """Framebuffer pixels for a point of the panels."""
        if _platform_is_wayland() or self.framebuffer != self.size:
            return max(self.framebuffer[0] / max(self.size[0], 1), 0.5)
        return float(max(glfw.get_window_content_scale(self.handle)[0], 0.5))

    @property
    def minimised(self) -> bool:
        """Whether nothing of it can be seen."""
        return self._iconified or 0 in self.framebuffer

    @property
    def closing(self) -> bool:
        """Whether the user asked to close it."""
        return bool(glfw.window_should_close(self.handle))

    @closing.setter
    def closing(self, wanted: bool) -> None:
        glfw.set_window_should_close(self.handle, wanted)

    def title(self, text: str) -> None:
        """Sets the text after the program's name."""
        glfw.set_window_title(self.handle, f"{TITLE} - {text}" if text else TITLE)

    def swap(self) -> None:
        """Shows what was drawn."""
        glfw.swap_buffers(self.handle)

    def close(self) -> None:
        """Destroys it."""
        glfw.destroy_window(self.handle)

    def monitor(self) -> Monitor | None:
        """The screen that holds most of it."""
        try:
            x, y = glfw.get_window_pos(self.handle)
        except glfw.GLFWError:
            x = y = 0  # Wayland does not tell
        width, height = self.size

        def overlap(each: Monitor) -> int:
            across = min(x + width, each.x + each.width) - max(x, each.x)
            down = min(y + height, each.y + each.height) - max(y, each.y)
            return int(max(across, 0) * max(down, 0))

        return max(monitors(), key=overlap, default=None)

    @property
    def fullscreen(self) -> bool:
        """Whether it fills a screen."""
        return self._before is not None

    @property
    def filling(self) -> bool:
        """Whether its size is that of screens: also for the moment in which it is on its way back from them."""
        return self.fullscreen or self._leaving is not None

    def fill(self, wanted: Sequence[Monitor]) -> None:
        """Becomes a borderless window over all of some screens."""
        if self._before is None:
            try:
                self._before = (*glfw.get_window_pos(self.handle), *self.size)
            except glfw.GLFWError:
                self._before = (0, 0, *self.size)
        left, top = min(each.x for each in wanted), min(each.y for each in wanted)
        right, bottom = (
            max(each.x + each.width for each in wanted),
            max(each.y + each.height for each in wanted),
        )
        if len(wanted) == 1 and _platform_is_wayland():
            # There a window has no place of its own.
            size = (wanted[0].width, wanted[0].height)
            glfw.set_window_monitor(self.handle, _handle_of(wanted[0]), 0, 0, *size, glfw.DONT_CARE)
            return
        glfw.set_window_attrib(self.handle, glfw.DECORATED, False)
        glfw.set_window_attrib(self.handle, glfw.FLOATING, True)
        glfw.set_window_monitor(self.handle, None, left, top, right - left, bottom - top, glfw.DONT_CARE)
        self.look()

    def unfill(self) -> None:
        """Becomes the window that it was before `fill`."""
        if self._before is None:
            return
        x, y, width, height = self._before
        self._before = None
        self._leaving = self._size if self._size != (width, height) else None
        glfw.set_window_attrib(self.handle, glfw.FLOATING, False)
        glfw.set_window_attrib(self.handle, glfw.DECORATED, True)
        glfw.set_window_monitor(self.handle, None, x, y, width, height, glfw.DONT_CARE)
        self.look()

    def show(self, shown: bool) -> None:
        """Takes it from the screen, or brings it back."""
        if bool(glfw.get_window_attrib(self.handle, glfw.VISIBLE)) != shown:
            (glfw.show_window if shown else glfw.hide_window)(self.handle)

    def hide_pointer(self, hidden: bool) -> None:
        """While flying the pointer is neither shown nor stopped by rims."""
        glfw.set_input_mode(self.handle, glfw.CURSOR, glfw.CURSOR_DISABLED if hidden else glfw.CURSOR_NORMAL)

    def clipboard(self, text: str) -> None:
        """Puts a text into the clipboard."""
        glfw.set_clipboard_string(self.handle, text)

    def from_clipboard(self) -> str:
        """The text in the clipboard; empty if there is none."""
        found = glfw.get_clipboard_string(self.handle)
        return found.decode("utf-8", "replace") if found else ""

    def raise_to_front(self) -> None:
        """Asks for the keyboard."""
        glfw.focus_window(self.handle)


def _handle_of(wanted: Monitor) -> Any:
    there = (each for each in glfw.get_monitors() if glfw.get_monitor_pos(each) == (wanted.x, wanted.y))
    return next(there, None) or glfw.get_primary_monitor()


def chosen_monitors(text: str) -> list[Monitor]:
    """The screens that `--monitors 1,2` names.

    Raises:
        ClfractalError: status 2, a number that is no screen's.
    """
    there = monitors()
    found = []
    for part in text.split(","):
        number = int(part) if part.strip().isdecimal() else 0
        if not 1 <= number <= len(there):
            listed = ", ".join(f"{each.number} {each.name} {each.width}x{each.height}" for each in there)
            raise DeviceError(f"--monitors: no monitor {part.strip()[:40]!r}; available: {listed}", status=2)
        found.append(there[number - 1])
    return found


def physical_width(here: Monitor | None, pixels: int) -> float | None:
    """Width of so many pixels on a screen, metres; None if the screen does not tell its size."""
    if here is None or here.metres <= 0 or here.width <= 0:
        return None
    return here.metres * pixels / here.width


def wake() -> None:
    """Makes a waiting main loop go on; from any thread."""
    glfw.post_empty_event()


def poll(timeout: float) -> None:
    """Handles events; waits for the first at most so many seconds."""
    if timeout > 0:
        glfw.wait_events_timeout(timeout)
    else:
        glfw.poll_events()


def no_wait() -> None:
    """Swaps of the current context do not wait for its screen: another window's do."""
    glfw.swap_interval(0)


def no_opengl(found: str) -> DeviceError:
    """The error of a display whose OpenGL is too old."""
    return DeviceError(
        f"clfractal view needs OpenGL 3.3, and this display has {found}", status=STATUS_DEVICE_FAILED
    )


def key_name(key: int, scancode: int) -> str | None:
    """The letter that the present keyboard layout has on a key."""
    name = glfw.get_key_name(key, scancode)
    return _text(name) if name else None


def layout(codes: Iterable[int]) -> dict[int, str]:
    """What the present keyboard layout prints on keys with these codes, as far as it is one character."""
    names = {code: key_name(code, 0) for code in codes}
    return {code: name for code, name in names.items() if name is not None and len(name) == 1}


class Pads:
    """Gamepads and 3D mice; looked for once a second, and asked only if there are any."""

    def __init__(self) -> None:
        self._looked = -10.0
        self._gamepad: int | None = None
        self._joystick: int | None = None

    @property
    def any(self) -> bool:
        """Whether there are any."""
        return self._gamepad is not None or self._joystick is not None

    def look(self, now: float) -> None:
        """Looks for what was plugged in or out; `now` in seconds."""
        if now - self._looked < 1.0:
            return
        self._looked = now
        there = [n for n in range(glfw.JOYSTICK_1, glfw.JOYSTICK_LAST + 1) if glfw.joystick_present(n)]
        pads = [n for n in there if glfw.joystick_is_gamepad(n)]
        self._gamepad = next(iter(pads), None)
        self._joystick = next((n for n in there if n not in pads), None)

    def gamepad(self) -> tuple[list[float], list[int]] | None:
        """Axes (left x, left y, right x, right y, left and right trigger; -1 to 1) and buttons of the first gamepad."""
        if self._gamepad is None:
            return None
        state = glfw.get_gamepad_state(self._gamepad)
        return (list(state.axes), list(state.buttons)) if state else None

    def six(self) -> list[float] | None:
        """The six axes of a 3D mouse (moves x, y, z; turns x, y, z), which is a joystick without a gamepad's layout."""
        if self._joystick is None:
            return None
        pointer, count = glfw.get_joystick_axes(self._joystick)
        return [float(pointer[index]) for index in range(6)] if count >= 6 else None
