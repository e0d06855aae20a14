"""The device that pictures are rendered on, with a context of its own, since a session has a thread; a screen; and more."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from clfractal.device import cache, program
from clfractal.device.select import Device, choose
from tests.viewer.scene_files import FORMULA, SCENE
from tests.viewer.slow_compiler import Slow


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


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A folder with a scene and the formula file that it names."""
    (tmp_path / "own.yaml").write_text(FORMULA)
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Slow:
    """Programs are compiled as slowly as it is told."""
    found = Slow()
    monkeypatch.setattr(program, "_compile", found)
    # What is in the cache on the disk is not compiled.
    monkeypatch.setattr(cache, "load_blob", lambda key: None)
    monkeypatch.setattr(cache, "store_blob", lambda key, blob: None)
    return found


@pytest.fixture
def drawing_context() -> Iterator[None]:
    """Panels are drawn into no window."""
    from tests.viewer.panel_harness import headless  # which needs the libraries of a window

    with headless():
        yield
