"""A driver that aborts, hangs or prints takes nothing with it; a child ends with its parent; forked processes."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from clfractal.device import child, children, isolate
from clfractal.device.children import Children
from clfractal.device.program import build, math_flags
from clfractal.device.select import Device
from clfractal.errors import DeviceError, FormulaError, Stopped, UntriedError
from tests.calls import failure
from tests.shell import SCENE, environment, has_bytes, wait_until

_HERE = "tests.device.test_isolate"


def echo_job(request: dict[str, Any]) -> list[Any]:
    """Jobs must be importable, so the tests' own live here."""
    print("noise on stdout")
    return [request["number"] + 1, os.getpid()]


def sleep_job(request: dict[str, Any]) -> None:
    (Path(request["mark"])).write_text(str(os.getpid()))
    time.sleep(600)


def signalled_job(request: dict[str, Any]) -> str:
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            os.kill(os.getpid(), getattr(signal, name))
    return "done"


def slow_echo_job(request: dict[str, Any]) -> list[Any]:
    time.sleep(0.1)
    return echo_job(request)


def impatient_job(request: dict[str, Any]) -> None:
    """From now on the child waits for no other job."""
    sys.modules["__main__"].IDLE_S = 0.0  # type: ignore[attr-defined]


def raise_job(request: dict[str, Any]) -> None:
    raise FormulaError("wrong formula", details="why")


def fail_job(request: dict[str, Any]) -> None:
    raise RuntimeError("a fault of ours")


def kill_job(request: dict[str, Any]) -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def _run(
    device: Device,
    job: str,
    timeout_s: float = 200.0,
    stopped: Callable[[], bool] | None = None,
    **arguments: Any,
) -> Any:
    return isolate.run(
        f"{_HERE}:{job}", device, arguments, doing="testing", timeout_s=timeout_s, stopped=stopped
    )


@pytest.fixture
def pool(monkeypatch: pytest.MonkeyPatch) -> Iterator[Children]:
    """A pool of two children of this test's own."""
    isolate.end_children()  # so that none of the usual pool ends meanwhile
    found = Children(2)
    monkeypatch.setattr(children, "pool", found)
    yield found
    found.close()


def _descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def _is_running(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"


def test_a_value_comes_back_and_noise_does_not(device: Device, capfd: pytest.CaptureFixture[str]) -> None:
    number, process = _run(device, "echo_job", number=41)
    assert number == 42
    assert process != os.getpid()
    assert capfd.readouterr() == ("", "")


def test_the_child_stays_for_the_next_job(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    first = _run(device, "echo_job", number=1)[1]
    assert _run(device, "echo_job", number=2) == [3, first]
    with pytest.raises(FormulaError):
        _run(device, "raise_job")
    assert _run(device, "echo_job", number=3) == [4, first]
    # Drivers read the environment when they start.
    monkeypatch.setenv("CLFRACTAL_TEST_OTHER", "1")
    second = _run(device, "echo_job", number=4)[1]
    assert second != first
    wait_until(lambda: not _is_running(first))


def test_a_child_that_ended_meanwhile_is_replaced(device: Device) -> None:
    process = _run(device, "echo_job", number=1)[1]
    os.kill(process, signal.SIGKILL)
    wait_until(lambda: not _is_running(process))
    assert _run(device, "echo_job", number=2)[0] == 3


def test_children_can_be_ended(device: Device) -> None:
    process = _run(device, "echo_job", number=1)[1]
    isolate.end_children()
    assert not _is_running(process)
    assert _run(device, "echo_job", number=2)[1] != process


def test_a_child_ends_by_itself_after_many_jobs(device: Device) -> None:
    first = _run(device, "echo_job", number=1)[1]
    processes = [_run(device, "echo_job", number=number)[1] for number in range(child.MOST_JOBS)]
    assert processes[-1] != first
    assert len(set(processes)) == 2


def test_a_child_without_work_ends_by_itself(device: Device, pool: Children) -> None:
    """It holds much memory; nobody tells it to go."""
    assert 5 <= child.IDLE_S <= 30
    process = _run(device, "echo_job", number=1)[1]
    _run(device, "impatient_job")
    wait_until(lambda: not _is_running(process))
    assert _run(device, "echo_job", number=3)[0] == 4


def test_a_child_stays_when_the_thread_that_started_it_has_ended(device: Device, pool: Children) -> None:
    with ThreadPoolExecutor(1) as other:
        process = other.submit(_run, device, "echo_job", number=1).result()[1]
    time.sleep(0.3)
    assert _is_running(process)
    assert _run(device, "echo_job", number=2) == [3, process]
    with ThreadPoolExecutor(1) as other:
        assert other.submit(_run, device, "echo_job", number=3).result() == [4, process]


def test_many_threads_share_few_children(device: Device, pool: Children) -> None:
    with ThreadPoolExecutor(8) as threads:
        jobs = [threads.submit(_run, device, "slow_echo_job", number=number) for number in range(12)]
        answers = [job.result() for job in jobs]
    assert [number for number, _ in answers] == list(range(1, 13))
    assert len({process for _, process in answers}) == 2


def test_no_descriptors_are_left(device: Device, pool: Children, tmp_path: Path) -> None:
    before = _descriptors()
    for number in range(3):
        process = _run(device, "echo_job", number=number)[1]
        os.kill(process, signal.SIGKILL)
        with pytest.raises(DeviceError):
            _run(device, "kill_job")
        with pytest.raises(DeviceError):
            _run(device, "fail_job")
        with pytest.raises(DeviceError):
            _run(device, "sleep_job", timeout_s=1, mark=str(tmp_path / "mark"))
    pool.close()
    assert _descriptors() == before


def test_a_child_that_ended_by_itself_is_cleared_away(device: Device, pool: Children) -> None:
    before = _descriptors()
    process = _run(device, "echo_job", number=1)[1]
    assert _descriptors() == before + 2
    os.kill(process, signal.SIGKILL)
    wait_until(lambda: _descriptors() == before)


def test_no_process_can_be_started(device: Device, pool: Children, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    for _ in range(3):
        with pytest.raises(DeviceError, match=r"the process for compiling cannot be started: .*No such file"):
            _run(device, "echo_job", number=1)
    monkeypatch.undo()


@pytest.mark.usefixtures("interrupts_are_not_ignored")
def test_an_interrupt_ends_the_child_and_frees_its_place(
    device: Device, pool: Children, tmp_path: Path
) -> None:
    for number in range(3):
        mark = tmp_path / f"mark{number}"

        def interrupt(mark: Path = mark) -> None:
            wait_until(has_bytes(mark, 0))
            os.kill(os.getpid(), signal.SIGINT)

        with ThreadPoolExecutor(1) as other:
            other.submit(interrupt)
            with pytest.raises(KeyboardInterrupt):
                _run(device, "sleep_job", mark=str(mark))
        assert not _is_running(int(mark.read_text()))
    with ThreadPoolExecutor(2) as threads:
        jobs = [threads.submit(_run, device, "echo_job", number=number) for number in range(4)]
        assert [job.result()[0] for job in jobs] == [1, 2, 3, 4]


def test_work_that_is_stopped(device: Device, pool: Children, tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    asked: list[float] = []

    def stopped() -> bool:
        asked.append(time.monotonic())
        return len(asked) > 20 and mark.exists() and mark.read_text() != ""

    with pytest.raises(Stopped):
        _run(device, "sleep_job", stopped=stopped, mark=str(mark))
    # (The least of twenty: a loaded machine may be late with each, but hardly with all of them.)
    assert children.POLL_S <= 0.01
    assert min(b - a for a, b in itertools.pairwise(asked)) < 0.1
    assert not _is_running(int(mark.read_text()))
    assert _run(device, "echo_job", number=1)[0] == 2


def test_who_waits_for_a_child_can_be_stopped(device: Device, pool: Children, tmp_path: Path) -> None:
    marks = [tmp_path / "a", tmp_path / "b"]
    enough = threading.Event()

    def sleep(mark: Path) -> None:
        with pytest.raises(Stopped):
            _run(device, "sleep_job", stopped=enough.is_set, mark=str(mark))

    with ThreadPoolExecutor(2) as threads:
        busy = [threads.submit(sleep, mark) for mark in marks]
        wait_until(lambda: all(has_bytes(mark, 0)() for mark in marks))
        start = time.monotonic()
        with pytest.raises(Stopped):
            _run(device, "echo_job", stopped=lambda: time.monotonic() > start + 0.2, number=1)
        assert time.monotonic() - start < 60  # both work for minutes
        enough.set()
        for each in busy:
            each.result()


def test_a_build_that_is_stopped(device: Device, empty_cache: Path) -> None:
    text = "__kernel void k(__global int *a) { a[0] = 2; }"
    with pytest.raises(Stopped):
        build(device, text, flags=math_flags("float32"), stopped=lambda: True)
    assert not list(empty_cache.rglob("*.bin"))
    assert not build(device, text, flags=math_flags("float32"), stopped=lambda: False).cached
    assert build(device, text, flags=math_flags("float32"), stopped=lambda: True).cached


def test_our_errors_pass_through(device: Device) -> None:
    error = failure(FormulaError, _run, device, "raise_job")
    assert (str(error), error.details) == ("wrong formula", "why")


def test_a_failing_job_shows_its_cause_in_the_details(device: Device) -> None:
    with pytest.raises(UntriedError, match=r": clfractal's own program failed while testing") as caught:
        _run(device, "fail_job")
    assert caught.value.status == 3
    assert "a fault of ours" in caught.value.details
    assert "Traceback" not in str(caught.value)


def test_a_crash_names_its_signal(device: Device) -> None:
    with pytest.raises(DeviceError, match=r"the driver aborted \(signal 11\) while testing"):
        _run(device, "kill_job")


def test_a_child_that_hangs_is_ended(device: Device, tmp_path: Path) -> None:
    process = _run(device, "echo_job", number=1)[1]  # it is the one that gets the next job
    with pytest.raises(DeviceError, match=r"took more than 2 s while testing"):
        _run(device, "sleep_job", timeout_s=2, mark=str(tmp_path / "mark"))
    assert not _is_running(process)


def test_a_driver_that_aborts_while_building(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(child.TEST_ABORT, "building")
    text = "__kernel void k(__global int *a) { a[0] = 1; }"
    with pytest.raises(
        DeviceError, match=r": the driver aborted \(signal 6\) while building a program$"
    ) as caught:
        build(device, text, flags=math_flags("float32"))
    assert caught.value.status == 3
    assert "LLVM ERROR: Cannot select" in caught.value.details
    assert capfd.readouterr() == ("", "")
    monkeypatch.delenv(child.TEST_ABORT)
    assert not build(device, text, flags=math_flags("float32")).cached


@pytest.mark.skipif(os.name != "posix", reason="os.kill ends a process at once on Windows")
def test_the_parent_decides_about_signals(device: Device) -> None:
    """Batch systems send them to every process of a job: a child that they ended would look like a driver that aborts."""
    assert _run(device, "signalled_job") == "done"


_PARENT = """
import sys
from clfractal.device import isolate
from clfractal.device.select import choose
try:
    job = "tests.device.test_isolate:sleep_job"
    isolate.run(job, choose(), {"mark": sys.argv[1]}, doing="x", timeout_s=600)
except KeyboardInterrupt:
    sys.exit(130)
"""


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL, signal.SIGTERM])
def test_the_child_ends_with_its_parent(tmp_path: Path, end: signal.Signals) -> None:
    mark = tmp_path / "mark"
    # A killed process leaves its temporary folder behind: let that be in this test's own.
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", _PARENT, str(mark)]
    parent = subprocess.Popen(command, cwd=Path(__file__).parents[2], env=environment)
    wait_until(has_bytes(mark, 0))
    process = int(mark.read_text())
    assert _is_running(process)
    parent.send_signal(end)
    assert parent.wait(120) == (130 if end == signal.SIGINT else -end)
    wait_until(lambda: not _is_running(process))


# --- forked processes: OpenCL works in them if it was not used before ---


PROGRAM = f"""
import gc, multiprocessing, os
import clfractal

SCENE = {SCENE!r}
context = multiprocessing.get_context("fork")

def told(work):
    try:
        work()
    except clfractal.DeviceError as error:
        return f"status {{error.status}}: {{error}}"
    return "fine"

WORK = {{
    "render": lambda: clfractal.render(SCENE, samples=1),
    "escape": lambda: clfractal.escape("mandelbulb", [[0.1, 0.2, 0.3]], iterations=8),
    "devices": lambda: clfractal.devices(),
    "engine": lambda: engine.render(SCENE),
    "refine": lambda: list(engine.refine(SCENE)),
}}

def in_child(name):
    return told(WORK[name])

# OpenCL has not been used so far.
with context.Pool(1) as pool:
    print("before:", pool.map(in_child, ["render"]))

with clfractal.Engine() as engine:
    print("parent:", told(WORK["engine"]))
    with context.Pool(2) as pool:
        for name, answer in zip(WORK, pool.map(in_child, WORK)):
            print(f"{{name}}: {{answer}}")
    child = os.fork()
    if child == 0:
        with engine:
            pass
        del engine
        gc.collect()
        raise SystemExit(7)
    print("ended:", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    print("parent:", told(WORK["engine"]))
"""


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork")
def test_forked_processes(tmp_path: Path) -> None:
    # A group of its own, so that no child is left if one should wait for ever.
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        cwd=tmp_path,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            out, err = process.communicate(timeout=120)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            pytest.fail(f"a forked process hangs: {process.communicate()}")
    assert process.returncode == 0, (out, err)
    lines = out.splitlines()
    refused = "status 3: OpenCL does not work in a process that was forked from one that has used it; "
    assert lines[0] == "before: ['fine']"
    assert lines[1] == "parent: fine"
    names = ("render", "escape", "devices", "engine", "refine")
    assert [line.split("; ")[0] + "; " for line in lines[2:7]] == [f"{name}: {refused}" for name in names]
    assert "get_context('spawn')" in lines[2]
    assert lines[7:] == ["ended: 7", "parent: fine"]
