"""Two projectors that nobody sees: an X server whose driver has several monitors without cables (Xorg's `dummy`)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.window.display import Display, Pixels, needed

PROJECTOR = (720, 405)
"""Of each of the two, pixels; the right one begins where the left one ends."""

_CONFIGURATION = """Section "ServerFlags"
  Option "DontVTSwitch" "true"
  Option "AllowMouseOpenFail" "true"
  Option "AutoAddDevices" "false"
  Option "AutoAddGPU" "false"
EndSection
Section "Device"
  Identifier "card"
  Driver "dummy"
  VideoRam 65536
EndSection
Section "Monitor"
  Identifier "monitor"
  HorizSync 5-1000
  VertRefresh 5-200
EndSection
Section "Screen"
  Identifier "screen"
  Device "card"
  Monitor "monitor"
  DefaultDepth 24
EndSection
"""
_LEFT, _RIGHT = "DUMMY0", "DUMMY1"


class Projectors(Display):
    """A desktop over two monitors of `PROJECTOR` pixels beside each other, without a window manager."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, (2 * PROJECTOR[0], PROJECTOR[1]))

    def plug(self, *, right: bool) -> None:
        """Plugs the right projector in, or pulls its cable; the left one stays."""
        mode = "x".join(map(str, PROJECTOR))
        if right:
            self.ask("xrandr", "--output", _RIGHT, "--mode", mode, "--pos", f"{PROJECTOR[0]}x0", check=True)
        else:
            self.ask("xrandr", "--output", _RIGHT, "--off", check=True)
        self.ask("xrandr", check=True)  # the driver looks for cables when it is asked

    def pixels(self) -> Pixels:
        """The desktop as it is now, shape (height, width, 3)."""
        from PIL import ImageGrab

        return np.asarray(ImageGrab.grab(xdisplay=self.name).convert("RGB"))

    def _server_command(self, folder: Path) -> list[str]:
        needed("Xorg", "xrandr")
        (folder / "xorg.conf").write_text(_CONFIGURATION)
        command = ["Xorg", "-config", str(folder / "xorg.conf"), "-logfile", str(folder / "xorg.log")]
        return [*command, "-novtswitch", "-sharevts"]

    def _set_up(self, folder: Path) -> None:
        mode = "x".join(map(str, PROJECTOR))
        self.ask("xrandr", "--output", _LEFT, "--mode", mode, "--pos", "0x0", check=True)
        self.ask("xrandr", "--addmode", _RIGHT, mode, check=True)
        self.plug(right=True)
