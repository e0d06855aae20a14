"""What a window works with: screens, the studio, panels, and what lies under the pointer."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections import deque
from typing import Any

from imgui_bundle import imgui

from clfractal.device import gl_sharing
from clfractal.device.select import Device
from clfractal.errors import ClfractalError
from clfractal.scene.stereo import Mode, Stereo
from clfractal.viewer import gl, window
from clfractal.viewer.aim import Aim, aimed
from clfractal.viewer.begin import Begun
from clfractal.viewer.controls import Controls
from clfractal.viewer.motion import Motion
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.panels import theme
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.picking import Pick
from clfractal.viewer.playing import Player
from clfractal.viewer.recording import Event
from clfractal.viewer.screens import Outputs
from clfractal.viewer.settings import Settings
from clfractal.viewer.speed import Meter
from clfractal.viewer.studio import Studio
from clfractal.viewer.ui_renderer import UiRenderer
from clfractal.viewer.viewport import image_of
from clfractal.viewer.window import Window
from clfractal.viewer.window_picture import Surface
from clfractal.viewer.window_places import Places, places_of


class Workspace(ABC):
    """The parts of a window, for what acts on them: keys, events, and the loop.

    Args:
        begun: the options, the scene, the device, and a display.
        settings: the user's.

    Attributes:
        events: of the window, that are not handled yet.
        pointer: framebuffer pixels from the window's top left.
        remark: why textures are not shared, if that is a surprise; else empty.

    Raises:
        DeviceError: no OpenGL 3.3.
        ClfractalError: there is no such monitor.
    """

    def __init__(self, begun: Begun, settings: Settings) -> None:
        self.options, self.settings, self.files = begun.options, settings, begun.files
        scene = begun.scene
        self.events: deque[Event] = deque()
        self.pointer = (-1.0, -1.0)
        self.window = Window(begun.size, self.events.append)
        gl_version = gl.version()
        if gl_version < (3, 3):
            raise window.no_opengl(f"{gl_version[0]}.{gl_version[1]}")
        self._context = imgui.create_context()
        imgui.get_io().set_ini_filename("")
        theme.setup()
        self.renderer = UiRenderer(self.window.handle)
        self.outputs = Outputs(self.window, self.events.append)
        # The screens that are filled come before the first picture, which is theirs.
        self.outputs.begin(self.options)
        self.pacing = Pacing(settings.frame_rate, settings.used_coarsest)
        device, self.shared, self.remark = self._opened(begun.device)
        self.studio = Studio(scene, device, self.pacing, window.wake)
        self.motion = Motion(self.studio)
        self._set_motion(settings)
        self.player = Player(self.studio)
        self.controls = Controls(self.studio, settings, self.motion)
        self.studio.screens = self.outputs.shown_stereo
        self.studio.resize(*self.outputs.picture_size(scene.stereo))
        self.meter = Meter()
        self.small = gl.SmallTextures()
        self.surface = self._new_surface()
        self.ui = Ui(self.studio, settings, settings.key_map, self.small, self.act)
        self.ui.memory |= {"controls": self.controls, "player": self.player, "files": self.files}
        self.places: Places = places_of(scene.stereo, self.window.framebuffer)

    @abstractmethod
    def act(self, name: str) -> None:
        """Does an action of the table of keys."""

    @property
    def now(self) -> float:
        """Seconds, of the loop's clock."""
        return time.perf_counter()

    def set_settings(self, settings: Settings) -> None:
        """The user's settings have changed."""
        self.settings = self.ui.settings = self.controls.settings = settings
        self.ui.keys = settings.key_map
        self._set_motion(settings)
        self.pacing.rate, self.pacing.coarsest = settings.frame_rate, settings.used_coarsest

    def _set_motion(self, settings: Settings) -> None:
        self.motion.sensitivity = settings.mouse
        self.motion.level = settings.orbit == "turntable"
        self.motion.fly.factor = settings.fly_speed

    def use_device(self, device: Device) -> None:
        """Goes on with another device."""
        self.surface.close()
        device, self.shared, self.remark = self._opened(device)
        self.studio.use_device(device)
        self.surface = self._new_surface()
        if self.remark:
            self.studio.tell(self.remark)
        self.studio.tell(f"device: {device.info.name}")

    def _opened(self, device: Device) -> tuple[Device, bool, str]:
        """The device with a context for this window, whether textures are shared, and why not if that is a surprise."""
        if self.options.share and device.info.gl_sharing:
            try:
                handles = gl_sharing.current_handles()
                if gl_sharing.shares_with(device, handles):
                    return gl_sharing.opened_with(device, handles), True, ""
            except ClfractalError as error:
                return device.reopened(), False, f"pictures are copied, not shared: {error.message}"
        return device.reopened(), False, ""

    def _new_surface(self) -> Surface:
        session = self.studio.session
        return Surface(
            session.device,
            session.pool,
            shared=self.shared,
            woken=window.wake,
            remark=lambda line: self.studio.tell(line, wrong=True),
        )

    def screen(self, mode: Mode) -> dict[str, Any]:
        """The width of one eye's picture where the window is, for a scene that names none."""
        stereo = self.outputs.shown_stereo(Stereo(mode=mode))
        part = image_of(stereo, self.outputs.picture_size(stereo))[0] / max(self.window.framebuffer[0], 1)
        wide = window.physical_width(self.window.monitor(), round(part * self.window.size[0]))
        return {} if wide is None else {"screen_width": round(wide, 4)}

    def aim(self) -> Aim | None:
        """What is under the pointer; else, or where a panel is there, under the middle of the picture."""
        found = None if imgui.get_io().want_capture_mouse else self.aim_at(*self.pointer)
        if found is not None:
            return found
        width, height = self.window.framebuffer
        return self.aim_at(width / 2, height / 2)

    def aim_at(self, x: float, y: float) -> Aim | None:
        """What lies at a place of the window, framebuffer pixels from the top left."""
        pick = self.pick_at(x, y)
        return aimed(self.studio.shown_scene, pick) if pick is not None else None

    def pick_at(self, x: float, y: float) -> Pick | None:
        """The same of the picture that is shown, which may be older than the scene."""
        shown = self.surface.shown
        if shown is None:
            return None
        width, height = self.surface.size
        wide, high = self.window.framebuffer
        if width < 1 or height < 1 or wide < 1 or high < 1:
            return None
        across, down = self.outputs.to_picture(x, y, (width, height))
        return self.studio.pick(across, down, shown)

    def close(self) -> None:
        """Ends everything; the order matters: OpenCL's images before OpenGL's textures, and those before the window."""
        self.surface.close()
        self.studio.close()
        self.small.close()
        self.renderer.shutdown()
        imgui.destroy_context(self._context)
        self.outputs.close()
        window.stop()
