"""Textures that OpenCL and OpenGL share: the real code, on PoCL, through a layer that shares by copying and is strict."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from clfractal.device import gl_sharing, select
from clfractal.device.gl_sharing import GLHandles
from clfractal.errors import DeviceError
from tests.variants import combinations, every
from tests.viewer import gl_layer
from tests.viewer.sharing_mistakes import MISTAKES

ROOT = Path(__file__).absolute().parents[2]  # not resolved: tests of the installed package are linked to
DEBIAN_POCL = Path("/etc/OpenCL/vendors/pocl.icd")
APIS = ("glx", "egl")
RUNTIMES = ("pthread", "debian") if DEBIAN_POCL.exists() else ("pthread",)
"""What CLFRACTAL_DEVICE has to be for the PoCL of pyopencl's wheel, and for the system's if it is there."""


@dataclass(frozen=True, slots=True)
class Screen:
    """A screen that nobody sees, and the layer, ready to be loaded."""

    display: str
    layer: Path
    folder: Path

    def run(self, script: str, *arguments: str, runtime: str = "pthread", **layer: Any) -> Outcome:
        """Runs a script in a process of its own."""
        log = self.folder / "mistakes"
        vendors = self.folder / "vendors"
        vendors.mkdir()
        if runtime == "debian":
            shutil.copy(DEBIAN_POCL, vendors)
        environment = {
            **os.environ,
            **gl_layer.environment(self.layer, log, **layer),
            "DISPLAY": self.display,
            "OCL_ICD_VENDORS": str(vendors),
            "CLFRACTAL_DEVICE": runtime,
        }
        environment.pop("WAYLAND_DISPLAY", None)
        done = subprocess.run(
            [sys.executable, "-m", f"tests.viewer.{script}", *arguments],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return Outcome(json.loads(done.stdout.splitlines()[-1]), log.read_text() if log.exists() else "")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a script printed, and what the layer found wrong, one line for each mistake."""

    result: Mapping[str, Any]
    mistakes: str


def _missing() -> str:
    if sys.platform != "linux":
        return "the layer is for Linux"
    if shutil.which("Xvfb") is None:
        return "no Xvfb"
    for module in ("glfw", "OpenGL"):
        if find_spec(module) is None:
            return f"no Python package {module}"
    return gl_layer.missing()


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """A screen without a monitor. CLFRACTAL_EXPECT_WINDOWS=1 says that there has to be one."""
    if missing := _missing():
        assert not os.environ.get("CLFRACTAL_EXPECT_WINDOWS"), missing
        pytest.skip(missing)
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "640x480x24", "+extension", "GLX"]
    server = subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL)
    os.close(writing)
    with os.fdopen(reading) as number:
        yield f":{number.readline().strip()}"
    server.terminate()
    server.wait()


@pytest.fixture(scope="module")
def layer(display: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return gl_layer.build(tmp_path_factory.mktemp("layer"))


@pytest.fixture
def screen(display: str, layer: Path, tmp_path: Path) -> Screen:
    return Screen(display, layer, tmp_path)


# Every two values of these meet.
WAYS = [
    ("glx", RUNTIMES[0], False),
    ("egl", RUNTIMES[0], True),
    ("glx", RUNTIMES[-1], True),
    ("egl", RUNTIMES[-1], False),
]
OTHER_WAYS = sorted({*product(APIS, RUNTIMES, (False, True))} - {*WAYS})


@pytest.mark.parametrize(("api", "runtime", "events"), [*dict.fromkeys(WAYS), *combinations(OTHER_WAYS)])
def test_kernels_write_what_opengl_shows(screen: Screen, api: str, runtime: str, events: bool) -> None:
    found = screen.run("sharing_child", api, runtime=runtime, events=events)
    assert not found.mistakes
    assert found.result == {"platform": api, "fences": events, "first": True, "drawn": True, "second": True}


def test_a_device_that_could_draw_is_enough(screen: Screen) -> None:
    """Some drivers name no current device."""
    found = screen.run("sharing_child", "glx", answer="list")
    assert found.result["second"]
    assert not found.mistakes


@pytest.mark.parametrize(
    "behaviour", [{"answer": "none"}, {"answer": "missing"}, {"drives": "another driver"}], ids=str
)
def test_other_devices_do_not_share(screen: Screen, behaviour: dict[str, str]) -> None:
    found = screen.run("sharing_child", "glx", **behaviour)
    assert found.result["kind"] == "DeviceError"
    assert found.result["error"].endswith("does not share textures with OpenGL")
    assert not found.mistakes  # it was asked for, not tried


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_textures_that_cannot_be_shared_are_refused_in_one_line(screen: Screen, runtime: str) -> None:
    """With the system's driver, that of the wheel is there too; only the devices of one draw for the window."""
    drives = "debian" if runtime == "debian" else ""
    found = screen.run("sharing_refusals", "glx", runtime=runtime, drives=drives)
    assert [drives in version for version in found.result["sharing"]] == [True]
    refused = found.result["refused"]
    failed = "sharing with OpenGL failed: clCreateFromGLTexture: "
    assert refused["format"] == failed + "INVALID_IMAGE_FORMAT_DESCRIPTOR"
    assert refused["incomplete"] == refused["none"] == failed + "INVALID_GL_OBJECT"
    assert refused["size"].endswith("has a texture of 96 x 40 pixels, not of 97 x 40")
    assert refused["closed"] == "a texture was used that is no longer shared"
    assert all("\n" not in each for each in refused.values())
    assert found.result["again"]


@pytest.mark.parametrize("name", every(3, MISTAKES))
def test_a_mistake_is_caught(screen: Screen, name: str) -> None:
    mistake = MISTAKES[name]
    found = screen.run("sharing_child", "glx", name, **mistake.environment)
    assert mistake.line in found.mistakes
    assert bool(found.mistakes) == bool(mistake.line)
    assert mistake.line or mistake.pixels
    if mistake.pixels:
        assert found.result[mistake.pixels] is False
    assert mistake.error in found.result.get("error", "")
    assert ("error" in found.result) == bool(mistake.error)


@pytest.mark.parametrize("name", ["another display", "another platform's display", "no display"])
def test_a_mistake_with_egl_is_caught(screen: Screen, name: str) -> None:
    found = screen.run("sharing_child", "egl", name)
    assert MISTAKES[name].line in found.mistakes
    assert MISTAKES[name].error in found.result["error"]


def test_without_a_current_context_nothing_is_shared() -> None:
    with pytest.raises(DeviceError, match=r"^no OpenGL context is current$"):
        gl_sharing.current_handles()


def test_a_device_without_the_extension_does_not_share() -> None:
    """PoCL's own."""
    device = select.choose("pthread")
    assert not device.info.gl_sharing
    handles = GLHandles("glx", 0x1000, 0x2000)
    assert not gl_sharing.shares_with(device, handles)
    with pytest.raises(DeviceError, match="does not share textures with OpenGL"):
        gl_sharing.opened_with(device, handles)


@pytest.mark.parametrize(
    ("handles", "properties"),
    [
        (GLHandles("glx", 1, 2), {0x2008: 1, 0x200A: 2}),
        (GLHandles("egl", 1, 2), {0x2008: 1, 0x2009: 2}),
        (GLHandles("wgl", 1, 2), {0x2008: 1, 0x200B: 2}),
        (GLHandles("cgl", 1, 2), {0x10000000: 2}),
    ],
)
def test_properties_are_those_of_the_standard(handles: GLHandles, properties: dict[int, int]) -> None:
    """The numbers of cl_gl.h and, for Apple, cl_gl_ext.h."""
    assert dict(gl_sharing.sharing_properties(handles)) == properties
