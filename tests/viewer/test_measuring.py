"""A window's device is measured when nothing else is wanted of it, and at no other time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from clfractal.device.cancel import CancelToken
from clfractal.errors import DeviceError, Stopped
from clfractal.viewer import measuring
from clfractal.viewer.background import do_some
from clfractal.viewer.measuring import REST_SECONDS, Measuring
from clfractal.viewer.window_options import Options

DEVICE = SimpleNamespace(info=SimpleNamespace(key="a device"))


class Window:
    """What a window has of a session; `measures` gives what a measurement does."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, options: Options | None = None) -> None:
        view = SimpleNamespace(plan=SimpleNamespace(precision="float32"))
        self.tasks: list[Any] = []
        self.session = SimpleNamespace(
            idle=True,
            frame=SimpleNamespace(job=SimpleNamespace(views=[view, view])),
            device=DEVICE,
            add=self.tasks.append,
        )
        self.measuring = Measuring(options or Options())
        self.outcome: Exception | None = None
        self.measured = False
        monkeypatch.setattr(measuring, "march_reports", self._march)
        monkeypatch.setattr(measuring, "is_measured", lambda device, precision: self.measured)

    def _march(self, device: object, precision: str, **more: object) -> None:
        assert device is DEVICE
        assert precision == "float32"
        if self.outcome is not None:
            raise self.outcome
        self.measured = True

    def look(self, *times: float) -> int:
        """Turns at some times; how many measurements have begun until then."""
        for now in times:
            self.measuring.look(self, now)  # type: ignore[arg-type]
        return len(self.tasks)

    def work(self) -> None:
        do_some(self.tasks[-1], SimpleNamespace(device=DEVICE), CancelToken(), print)  # type: ignore[arg-type]
        assert self.tasks[-1].finished


@pytest.mark.parametrize("outcome", [None, DeviceError("nothing works")])
def test_once_at_rest(monkeypatch: pytest.MonkeyPatch, outcome: Exception | None) -> None:
    """After the first picture; a device that fails is left alone."""
    window = Window(monkeypatch)
    window.outcome = outcome
    first, window.session.frame = window.session.frame, None
    assert window.look(5.0, 8.0) == 0
    window.session.frame = first
    assert window.look(100.0) == 1
    window.work()
    assert window.measured == (outcome is None)
    assert window.look(200.0, 300.0) == 1


def test_not_while_something_is_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    window = Window(monkeypatch)
    window.session.idle = False
    assert window.look(10.0) == 0
    window.session.idle = True
    assert window.look(10.0 + 0.9 * REST_SECONDS) == 0
    assert window.look(10.0 + 1.1 * REST_SECONDS) == 1


def test_what_was_interrupted_begins_again(monkeypatch: pytest.MonkeyPatch) -> None:
    window = Window(monkeypatch)
    window.outcome = Stopped()
    assert window.look(10.0) == 1
    window.work()
    assert window.look(10.0 + 0.5 * REST_SECONDS) == 1
    assert window.look(10.0 + 1.5 * REST_SECONDS) == 2


def test_not_in_a_window_that_ends_by_itself(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    for options in (Options(shot=tmp_path / "a.png"), Options(play=tmp_path / "a.json")):
        assert Window(monkeypatch, options).look(10.0, 20.0) == 0
