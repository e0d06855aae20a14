"""A cache folder of the tests' own, and children that find the tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from clfractal.device import cache
from clfractal.device.select import Device


@pytest.fixture
def empty_cache(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder that holds nothing yet, and a device that has no program in memory."""
    device.loaded.clear()
    folder = tmp_path / "cache"
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(folder))
    return folder


@pytest.fixture(autouse=True)
def _children_find_the_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    """Child processes import jobs from this folder, wherever the program itself is installed."""
    root = str(Path(__file__).resolve().parents[2])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), root])))
