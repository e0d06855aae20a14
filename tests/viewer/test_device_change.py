"""Another device is used at once, also while the old one does what cannot be told to end."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from clfractal.scene.load import load_scene
from clfractal.viewer import studio as studio_module
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.studio import Studio
from tests.shell import SCENE
from tests.viewer.sessions import wait_for


class Slow:
    """A session whose thread ends when it is let go."""

    def __init__(self, device: Any, pacing: Pacing, woken: Callable[[], None]) -> None:
        self.device, self.frame, self.problem = device, None, None
        self.tasks: list[Any] = []
        self.let_go = threading.Event()

    def start(self) -> None:
        pass

    def request(self, scene: Any, **how: Any) -> int:
        return 1

    def add(self, task: Any) -> None:
        self.tasks.append(task)

    def take_tasks(self) -> list[Any]:
        assert self.let_go.is_set(), "taken while the thread may be working on one"
        found, self.tasks = self.tasks, []
        return found

    def close(self, timeout: float | None = 200.0) -> bool:
        return self.let_go.wait(timeout)


@pytest.fixture
def studio(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> Studio:
    monkeypatch.setattr(studio_module, "Session", Slow)
    (tmp_path / "s.yaml").write_text(SCENE)
    return Studio(load_scene(tmp_path / "s.yaml"), "old", Pacing(), lambda: None)  # type: ignore[arg-type]


def test_the_window_does_not_wait_for_the_old_device(studio: Studio) -> None:
    old: Any = studio.session
    old.tasks = ["thumbnail", "still"]
    start = time.monotonic()
    studio.use_device("new")  # type: ignore[arg-type]
    assert time.monotonic() - start < 60  # it would wait for ever
    new: Any = studio.session
    assert new.device == "new"
    assert new.tasks == []
    old.let_go.set()
    wait_for(lambda: new.tasks == ["thumbnail", "still"])
    new.let_go.set()
    studio.close()


def test_tasks_of_a_device_that_ended_go_on_at_once(studio: Studio) -> None:
    old: Any = studio.session
    old.tasks = ["thumbnail"]
    old.let_go.set()
    studio.use_device("new")  # type: ignore[arg-type]
    new: Any = studio.session
    assert new.tasks == ["thumbnail"]
    new.let_go.set()
    studio.close()
