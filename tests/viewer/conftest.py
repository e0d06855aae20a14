"""The device that pictures are rendered on, with a context of its own, since a session has a thread; and a screen."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator

import pytest

from clfractal.device.select import Device, choose


@pytest.fixture(scope="session")
def device() -> Device:
    return choose().reopened()


@pytest.fixture(scope="session")
def screen() -> Iterator[None]:
    """A display in the environment: the one that is there, or an Xvfb."""
    if os.environ.get("DISPLAY"):
        yield
        return
    if shutil.which("Xvfb") is None:
        assert os.environ.get("CLFRACTAL_EXPECT_WINDOWS") != "1", "Xvfb is missing"
        pytest.skip("missing for a real window: Xvfb (Debian: xvfb)")
    reading, writing = os.pipe()
    command = [
        "Xvfb",
        "-displayfd",
        str(writing),
        "-screen",
        "0",
        "2600x1500x24",
        "-nolisten",
        "tcp",
        "+extension",
        "GLX",
    ]
    server = subprocess.Popen(
        command, pass_fds=(writing,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(writing)
    with os.fdopen(reading) as pipe, pytest.MonkeyPatch.context() as patch:
        patch.setenv("DISPLAY", f":{pipe.readline().strip()}")
        yield
    server.terminate()
    server.wait()
