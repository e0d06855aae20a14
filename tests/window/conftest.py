"""Displays and windows for tests; a module's tests share a display."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.window.display import Display


@pytest.fixture(scope="module")
def display(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Display]:
    """A screen without a window manager: windows stand at its top left corner."""
    with Display(tmp_path_factory.mktemp("display")) as found:
        yield found


@pytest.fixture(scope="module")
def desktop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Display]:
    """A screen with a window manager."""
    with Display(tmp_path_factory.mktemp("desktop"), managed=True) as found:
        yield found


@pytest.fixture(autouse=True, scope="session")
def _user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The user's settings are none of a test's business."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CLFRACTAL_SETTINGS", str(tmp_path_factory.mktemp("settings") / "settings.yaml"))
        yield


@pytest.fixture(autouse=True)
def _interrupts_are_not_ignored() -> Iterator[None]:
    """A test run in the background ignores Ctrl-C, and so would the processes it starts."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder for a window's files."""
    return tmp_path
