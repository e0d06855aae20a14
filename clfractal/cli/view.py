"""`clfractal view`: the window."""

from __future__ import annotations

import os
import sys

from clfractal.cli import interrupt
from clfractal.cli.render import numbers_of
from clfractal.cli.shell import Shell
from clfractal.errors import DeviceError, SceneError, Where
from clfractal.viewer.window_options import Options

_EXTRA = "clfractal view needs the viewer's libraries; install them with: pip install 'clfractal[viewer]'"


def size_of(text: str | None) -> tuple[int, int] | None:
    """The size that `--size` names.

    Raises:
        SceneError: it is no size of a window.
    """
    if text is None:
        return None
    width, height = numbers_of("--size", text, "x", 2, "WIDTHxHEIGHT, such as 1280x720")
    if not (64 <= width <= 16_384 and 64 <= height <= 16_384):
        raise SceneError(f"must be from 64 to 16384 pixels each, got {width}x{height}", Where("--size"))
    return width, height


def view(options: Options, shell: Shell) -> None:
    """Opens the window, and returns when it is closed.

    Raises:
        DeviceError: status 3, no display, no OpenGL 3.3, or the libraries are not installed.
        ClfractalError: a wrong scene or option.
    """
    # PyOpenGL logs to standard error, where only messages for the user belong.
    os.environ.setdefault("PYOPENGL_USE_ACCELERATE", "0")
    try:
        import glfw  # noqa: F401
        import imgui_bundle  # noqa: F401
        import OpenGL  # noqa: F401
    except ImportError as error:
        raise DeviceError(f"{_EXTRA} (missing: {error.name})") from error
    from clfractal.viewer import window
    from clfractal.viewer.begin import begin
    from clfractal.viewer.settings import load_settings

    settings, remark = load_settings()
    if remark:
        shell.say(remark)
    sys.setswitchinterval(0.0002)  # the window's thread must not wait long for the others
    begun = begin(options)
    interrupt.wake = window.wake
    from clfractal.viewer.app import Viewer

    Viewer(begun, settings, remark, shell.say).run()
