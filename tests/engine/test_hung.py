"""Devices that do not answer: they are left out, the others do their tiles, and what they make too late is not used."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device, choose
from clfractal.engine import several, sharing
from clfractal.engine.device_workers import DeviceWorkers
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import Result, WorkItem
from clfractal.engine.several import SeveralExecutor
from clfractal.engine.sharing import Shared
from clfractal.files.exr import read_exr
from tests.engine.offers import Clock, offer
from tests.engine.small_pictures import SCENE, same
from tests.halves import halves_of
from tests.long_renders import LIMIT_SECONDS
from tests.shell import Running, has_tiles

pytestmark = pytest.mark.usefixtures("interrupts_are_not_ignored")


@dataclass
class Hang:
    """How a device hangs: after so many tiles, until it is freed."""

    after: int = 10
    began: threading.Event = field(default_factory=threading.Event)
    lasts: threading.Event = field(default_factory=threading.Event)
    freed: threading.Event = field(default_factory=threading.Event)
    ended: threading.Event = field(default_factory=threading.Event)


class Hanging(LocalExecutor):
    """A device that stops to answer, with tiles that it has taken; its thread waits as one that is in a driver."""

    hang: Hang

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: clfractal.CancelToken | None = None
    ) -> Generator[Result]:
        hang, left = self.hang, self.hang.after
        try:
            for result in super().execute(job, items, token):
                left -= len(result.tiles)
                if left <= 0:
                    hang.began.set()
                    hang.lasts.set()
                    hang.freed.wait()
                yield result
        finally:
            hang.ended.set()


class Waiting(LocalExecutor):
    """A device that goes on when the other one hangs: otherwise it might have done all before that."""

    hang: Hang

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: clfractal.CancelToken | None = None
    ) -> Generator[Result]:
        for result in super().execute(job, items, token):
            assert self.hang.began.wait(200)
            yield result


def hanging(engine: clfractal.Engine, *hangs: Hang) -> SeveralExecutor:
    """Gives an engine two devices of which the first one hangs, or both."""
    shared = engine.executor
    assert isinstance(shared, SeveralExecutor)
    for executor, hang, kind in zip(
        shared.executors, (*hangs, *hangs), (Hanging, Hanging if len(hangs) > 1 else Waiting), strict=False
    ):
        executor.__class__ = kind
        executor.hang = hang  # type: ignore[attr-defined]
    return shared


@pytest.fixture(scope="module")
def whole(device: Device) -> clfractal.Framebuffer:
    with clfractal.Engine(device) as engine:
        return engine.render(SCENE)


class Lenient(DeviceWorkers):
    """A device that hangs is given up soon, and no other: on a loaded machine it may be late."""

    def __init__(self, executors: Sequence[LocalExecutor], jobs: Sequence[Job], shared: Shared) -> None:
        super().__init__(executors, jobs, shared)

        def patience(device: int) -> float:
            executor = executors[device]
            return 1.0 if isinstance(executor, Hanging) and executor.hang.lasts.is_set() else 1000.0

        shared.patience = patience  # type: ignore[method-assign]


@pytest.fixture
def hang(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hang]:
    """For a device that is given up soon."""
    monkeypatch.setattr(several, "DeviceWorkers", Lenient)
    found = Hang()
    yield found
    found.freed.set()


def test_a_hung_device_is_left_out(device: Device, whole: clfractal.Framebuffer, hang: Hang) -> None:
    said: list[str] = []
    with clfractal.Engine(halves_of(device), budget_seconds=0.01, tell=said.append) as engine:
        shared = hanging(engine, hang)
        framebuffer = engine.render(SCENE)
        assert same(framebuffer, whole)
        assert list(shared.failures) == [0]
        line = f"{halves_of(device)}#1 {device.info.name} is left out, others do its work: "
        line += f"{device.info.name}: the device has not answered for "
        assert [each for each in said if each.startswith(line)]
        assert [each for each in framebuffer.remarks if each.startswith(line)]
        assert not hang.ended.is_set()
        again = engine.render(SCENE)
        assert same(again, whole)
        assert [each["index"] for each in again.stats["devices"]] == [f"{halves_of(device)}#2"]


def test_a_device_that_comes_back_late_does_no_harm(
    device: Device, whole: clfractal.Framebuffer, hang: Hang, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It comes back while the other one still has its tiles to do."""
    execute = LocalExecutor.execute
    late: list[bool] = []

    def slow(own: LocalExecutor, *arguments: object) -> Generator[Result]:
        for result in execute(own, *arguments):  # type: ignore[arg-type]
            if own.device.info.index.endswith("#2") and hang.freed.is_set() and not late:
                late.append(hang.ended.wait(200))
            yield result

    monkeypatch.setattr(LocalExecutor, "execute", slow)

    def tell(line: str) -> None:
        if "is left out" in line:
            hang.freed.set()

    with clfractal.Engine(halves_of(device), budget_seconds=0.01, tell=tell) as engine:
        shared = hanging(engine, hang)
        framebuffer = engine.render(SCENE)
        assert late == [True]
        assert same(framebuffer, whole)
        assert framebuffer.done.all()
        assert sum(each["tiles"] for each in framebuffer.stats["devices"]) == framebuffer.grid.count
        assert framebuffer.stats["rays"] == whole.stats["rays"]
        assert list(shared.failures) == [0]
        assert same(engine.render(SCENE), whole)


def test_all_devices_hang(device: Device, hang: Hang) -> None:
    other = Hang(after=15, freed=hang.freed)
    with clfractal.Engine(halves_of(device), budget_seconds=0.01) as engine:
        hanging(engine, hang, other)
        with pytest.raises(
            clfractal.DeviceError, match=r"no device is left: .* has not answered for"
        ) as caught:
            engine.render(SCENE)
        assert caught.value.status == 3


def test_passes_of_a_hung_device_begin_again(
    device: Device, whole: clfractal.Framebuffer, hang: Hang
) -> None:
    """It hangs when it has some samples of tiles, which nobody else has."""
    with clfractal.Engine(halves_of(device), budget_seconds=0.01) as engine:
        shared = hanging(engine, hang)
        hang.after = 10_000
        hang.began.set()
        framebuffers = []
        for framebuffer in engine.refine(SCENE):
            framebuffers.append(framebuffer)
            if framebuffer.stage.startswith("2 of"):
                hang.after = 1
        assert same(framebuffers[-1], whole)
        assert list(shared.failures) == [0]


def test_a_device_that_does_not_end_is_left_out(
    device: Device, whole: clfractal.Framebuffer, hang: Hang
) -> None:
    """The caller stops; the hung device is waited for no longer than usual, and used no more."""
    with clfractal.Engine(halves_of(device), budget_seconds=0.01) as engine:
        shared = hanging(engine, hang)
        hang.after = 0

        def progress(_: object) -> None:
            raise KeyError("stop")

        with pytest.raises(KeyError):
            engine.render(SCENE, progress)
        assert hang.began.is_set()
        assert list(shared.failures) == [0]
        assert same(engine.render(SCENE), whole)


def test_patience_follows_the_measured_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    """20 times what the launches should take, and at least 30 s."""
    clock = Clock()
    monkeypatch.setattr(sharing, "time", clock)
    shared = Shared([offer(100)], [1.0, 1.0])
    for device in (0, 1):
        shared._workers[device].offer = shared._offers[0]
        assert not shared.owes(device)  # it is not ready yet: nobody knows how long compiling takes
        assert not len(shared.take(device, 0))
        assert not shared.owes(device)
    tiles = shared.take(0, 2)
    assert shared.owes(0)
    assert shared.patience(0) == 30.0
    clock.now = 10.0
    assert shared.done(0, tiles)  # a tile takes 5 s
    assert not shared.owes(0)
    shared.take(0, 3)
    assert shared.patience(0) == pytest.approx(20 * 3 * 5.0)
    # Of the other one nothing is known but that it should be as fast.
    shared.take(1, 1)
    assert shared.patience(1) == pytest.approx(20 * 5.0)


def test_what_a_lost_device_tells_does_not_count() -> None:
    shared = Shared([offer(10)], [1.0, 1.0])
    for device in (0, 1):
        shared._workers[device].offer = shared._offers[0]
    tiles = shared.take(0, 4)
    signs = shared.signs(0)
    assert len(tiles)
    shared.lose(0)
    assert not shared.done(0, tiles)
    assert not len(shared.take(0, 4))
    assert list(shared.items(0)) == []
    assert not shared.owes(0)
    assert shared.signs(0) == signs + 1  # it has asked
    left: deque[int] = deque()
    for _ in shared.items(1):
        while len(found := shared.take(1, 4)):
            left.extend(found.tolist())
            assert shared.done(1, found)
    assert sorted(left) == list(range(10))


# The program with a device that hangs for ever, as one whose driver does not return.
PROGRAM = """
import os, sys, time
from clfractal.engine import sharing
from clfractal.engine.local_executor import LocalExecutor
from clfractal.cli import main

execute = LocalExecutor.execute

def hanging(own, *arguments):
    for result in execute(own, *arguments):
        if own.device.info.index.endswith("#1"):
            open("hangs", "w").close()
            time.sleep(10_000)
        while not os.path.exists("hangs"):
            time.sleep(0.01)
        yield result

LocalExecutor.execute = hanging
# Of a device that does not hang nobody loses patience, however late it is.
soon = float(sys.argv.pop(1))
sharing.Shared.patience = lambda own, place: soon if place == 0 and os.path.exists("hangs") else 1000.0
main()
"""


def started(folder: Path, patience: float) -> Running:
    (folder / "scene.yaml").write_text(SCENE)
    given = ["render", "scene.yaml", "-o", "out.exr", "--device", halves_of(choose())]
    return Running(folder, words=[sys.executable, "-P", "-c", PROGRAM, str(patience), *given])


def test_the_program_ends_although_a_thread_hangs(whole: clfractal.Framebuffer, tmp_path: Path) -> None:
    status, told = started(tmp_path, 1.0).ended_by()
    assert status == 0, told
    assert "is left out, others do its work: " in told
    planes = read_exr(tmp_path / "out.exr")[0]
    np.testing.assert_array_equal(planes["Z"], whole["Z"])
    assert not (tmp_path / "out.exr.partial").exists()


def test_ctrl_c_while_a_device_hangs(tmp_path: Path) -> None:
    seconds = []
    for _ in range(3):
        running = started(tmp_path, 1000.0)
        running.wait_until((tmp_path / "hangs").exists)
        running.wait_until(has_tiles(tmp_path / "out.exr.partial", 5))
        time.sleep(1.0)  # the other one has done all that it can
        begin = time.monotonic()
        status, told = running.ended_by(signal.SIGINT)
        seconds.append(time.monotonic() - begin)
        assert status == 130, told
        assert (tmp_path / "out.exr.partial").exists()
        (tmp_path / "hangs").unlink()
    assert max(seconds) < LIMIT_SECONDS
