"""Panels without the window: driven by events that are made up, or drawn into a hidden window whose pixels are read.

The studio is a real one on a session that renders nothing, so that no test of panels needs OpenCL.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt
from imgui_bundle import imgui

from clfractal.device.select import DeviceInfo
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.viewer import studio as studio_module
from clfractal.viewer.keys import KeyMap
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.panels import scene_dock, theme
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.settings import Settings
from clfractal.viewer.studio import Studio

Pixels = npt.NDArray[np.uint8]
Draw = Callable[[Ui], None]

INFO = DeviceInfo(
    index="0:0",
    name="Processor of the tests",
    platform="Portable Computing Language",
    version="OpenCL 3.0 PoCL",
    driver="1",
    kind="cpu",
    memory=8 << 30,
    max_alloc=2 << 30,
    has_float64=True,
    gl_sharing=False,
    compute_units=2,
    target="",
)


class _Device:
    info = INFO


class _Session:
    """Takes requests, and renders nothing."""

    def __init__(self, device: Any, pacing: Pacing, woken: Callable[[], None]) -> None:
        self.device, self.pacing, self.woken = device, pacing, woken
        self.frame = None
        self.problem = None
        self.progress = ""
        self.requests: list[tuple[Scene, bool]] = []

    def start(self) -> None:
        pass

    def close(self) -> None:
        pass

    def add(self, task: Any) -> None:
        pass

    def request(
        self,
        scene: Scene,
        *,
        moving: bool,
        region: Any = None,
        exposed_in: Scene | None = None,
        follows: bool = False,
    ) -> None:
        self.requests.append((scene, moving))


class _Textures:
    """For windows without OpenGL: every picture is the same texture."""

    def get(self, key: Any, pixels: Pixels) -> Any:
        return imgui.ImTextureRef(1)


def make_ui(scene: Scene | str | Path, textures: Any = None) -> tuple[Ui, list[str]]:
    """What panels are given for a scene (or its file or text), and the list that actions are written to."""
    loaded = scene if isinstance(scene, Scene) else load_scene(scene)
    with patch.object(studio_module, "Session", _Session):
        studio = Studio(loaded, _Device(), Pacing(), lambda: None)  # type: ignore[arg-type]
    done: list[str] = []
    return Ui(studio, Settings(), KeyMap.defaults(), textures or _Textures(), done.append), done


class Stage:
    """Draws frames without a window, and makes up the events between them.

    Args:
        draw: what is drawn in each frame.
        window: whether it is drawn within a window of its own, 300 points wide.
    """

    def __init__(self, ui: Ui, draw: Draw, *, window: bool = True) -> None:
        self.ui, self._draw, self._window = ui, draw, window
        self.places: dict[str, tuple[float, float, float, float]] = {}
        self.io = imgui.get_io()
        self.frame()
        self.frame()

    def quick_click(self, x: float, y: float) -> None:
        """One click in few frames."""
        self.rest()
        self.move(x, y)
        self.button(True)
        self.button(False)

    def frame(self, seconds: float = 1 / 60) -> None:
        """One frame, so many seconds after the one before."""
        self.io.delta_time = seconds
        self.io.display_size = imgui.ImVec2(*self.ui.size)
        imgui.new_frame()
        if self._window:
            imgui.set_next_window_pos(imgui.ImVec2(8, 8))
            imgui.set_next_window_size(imgui.ImVec2(300, 1400))
            imgui.begin("stage", None, imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_saved_settings)
        self._draw(self.ui)
        if self._window:
            imgui.end()
        imgui.render()
        for texture in imgui.get_platform_io().textures:
            texture.status = imgui.ImTextureStatus.ok

    def move(self, x: float, y: float) -> None:
        """The pointer goes to a place, points."""
        self.io.add_mouse_pos_event(x, y)
        self.frame()

    def button(self, down: bool) -> None:
        """The left button goes down or up."""
        self.io.add_mouse_button_event(0, down)
        self.frame()

    def click(self, x: float, y: float) -> None:
        """One click; the time since the last one is long, so that it is none of a double click."""
        self.rest()
        self.move(x, y)
        self.button(True)
        self.button(False)
        for _ in range(3):  # a window draws so many after an event
            self.frame()

    def rest(self) -> None:
        """So long that the next click is none of a double click."""
        self.frame(1.0)

    def double_click(self, x: float, y: float) -> None:
        """Two clicks in a row."""
        self.click(x, y)
        self.button(True)
        self.button(False)
        for _ in range(3):
            self.frame()

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 6) -> None:
        """Presses at a place, moves to another and lets go."""
        self.rest()
        self.move(*start)
        self.button(True)
        for step in range(1, steps + 1):
            part = step / steps
            self.move(start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1]))
        self.button(False)
        self.frame()

    def hold(self, key: Any, down: bool) -> None:
        """A key (`imgui.Key.mod_shift`, ...) goes down or up."""
        self.io.add_key_event(key, down)
        self.frame()

    def press(self, key: Any) -> None:
        """A key goes down and up."""
        self.hold(key, True)
        self.hold(key, False)
        for _ in range(3):
            self.frame()

    def type(self, text: str) -> None:
        """Characters are typed."""
        for each in text:
            self.io.add_input_character(ord(each))
            self.frame()


@contextmanager
def headless() -> Iterator[None]:
    """A Dear ImGui context with the theme, without window or OpenGL."""
    context = imgui.create_context()
    try:
        io = imgui.get_io()
        io.set_ini_filename("")
        io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
        theme.setup()
        yield
    finally:
        imgui.destroy_context(context)


@contextmanager
def hidden_window(size: tuple[int, int]) -> Iterator[Any]:
    """A hidden GLFW window with OpenGL 3.3; needs a display."""
    import glfw

    assert glfw.init(), "there is no display"
    for hint, value in (
        (glfw.VISIBLE, False),
        (glfw.CONTEXT_VERSION_MAJOR, 3),
        (glfw.CONTEXT_VERSION_MINOR, 3),
        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
        (glfw.OPENGL_FORWARD_COMPAT, True),
    ):
        glfw.window_hint(hint, value)
    window = glfw.create_window(*size, "panels", None, None)
    assert window
    glfw.make_context_current(window)
    try:
        yield window
    finally:
        glfw.destroy_window(window)


def background(size: tuple[int, int]) -> Pixels:
    """A plain gradient in the place of a picture, shape (height, width, 4)."""
    width, height = size
    y, x = np.mgrid[0:height, 0:width]
    light = 1 - np.hypot(x / width - 0.55, y / height - 0.5)
    rgb = np.stack([40 + 90 * light, 46 + 84 * light, 60 + 70 * light], axis=-1)
    return np.concatenate([np.clip(rgb, 0, 255), np.full((height, width, 1), 255)], axis=-1).astype(np.uint8)


def screenshot(
    scene: Scene | str | Path,
    draw: Draw,
    size: tuple[int, int] = (1280, 720),
    scale: float = 1.0,
    *,
    prepare: Callable[[Ui], None] | None = None,
    events: Callable[[Callable[[], None], Any], None] | None = None,
    picture: Pixels | None = None,
) -> Pixels:
    """Panels over a picture as the window would show them, shape (height, width, 3).

    Args:
        size: of the window, pixels.
        scale: pixels of a point.
        prepare: changes what panels are given, before the first frame.
        events: given a function that draws a frame and Dear ImGui's io, makes up events.
        picture: behind the panels, of the window's size.
    """
    with hidden_window(size) as window:
        from clfractal.viewer import gl
        from clfractal.viewer.ui_renderer import UiRenderer

        context = imgui.create_context()
        imgui.get_io().set_ini_filename("")
        theme.setup()
        renderer = UiRenderer(window)
        textures, rectangle, upload = gl.SmallTextures(), gl.Rectangle(), gl.Upload()
        upload.fill(background(size) if picture is None else picture)
        ui, _ = make_ui(scene, textures)
        ui.size, ui.scale = (size[0] / scale, size[1] / scale), scale
        if prepare is not None:
            prepare(ui)

        def frame() -> None:
            renderer.begin(ui.size, (scale, scale), 1 / 60)
            imgui.new_frame()
            draw(ui)
            imgui.render()
            gl.clear()
            rectangle.draw(upload.texture, (0, 0, *size))
            renderer.draw(imgui.get_draw_data(), [(0, 0, *size)])

        for _ in range(4):
            frame()
        if events is not None:
            events(frame, imgui.get_io())
            frame()
        pixels = gl.read_pixels(*size)
        gl.check("drawing panels")
        textures.close()
        imgui.destroy_context(context)
        return pixels


def opened(scene: Any, size: tuple[float, float] = (1280, 4000)) -> Ui:
    """A dock with all panels open, high enough for all of them."""
    ui, _ = make_ui(scene)
    ui.size = size
    ui.memory["open"] = dict.fromkeys(scene_dock.KEYS, True)
    return ui
