"""A cluster of real processes on this machine, whose parts can be killed, stopped and started again."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from tests.shell import Running, environment, has_tiles, wait_until

# Work of some ten seconds of one core, in tiles of a tenth of a second.
HEAVY = """version: 1
formula: {name: mandelbulb, iterations: 60}
image: {width: 256, height: 192}
camera: {position: [0, -2.2, 0.4], fov: 40}
renderer: {type: surface, samples: 400, detail: 0.2}
output:
  channels: [R, G, B, A, Z, N.X, iterations, steps]
  precision: {R: float, G: float, B: float, N.X: float}
"""
FILM = """version: 1
formula: {name: mandelbulb, iterations: 30}
image: {width: 128, height: 96}
camera: {position: [0, -2.6, 0.4], fov: 40}
renderer: {type: surface, samples: 100, detail: 0.4}
animation:
  frames: 12
  tracks:
    camera.position: {keys: [{frame: 0, value: [0, -3, 0.5]}, {frame: 11, value: [1.5, -2.2, 0.9]}]}
"""
FRAMES = 12

# A worker that takes no second bundle before a file `go` is there. (Dask may run this twice.)
HELD = """
import time
from pathlib import Path
from clfractal.engine.local_executor import LocalExecutor

def held(*arguments, execute=LocalExecutor.execute, begun=[]):
    begun.append(arguments)
    while len(begun) > 1 and not Path("go").exists():
        time.sleep(0.005)
    yield from execute(*arguments)

LocalExecutor.execute = held
"""
# One that makes this file when it has rendered a tile.
LETS_GO = """
from pathlib import Path
from clfractal.engine.local_executor import LocalExecutor

def tells(*arguments, execute=LocalExecutor.execute):
    for result in execute(*arguments):
        Path("go").touch()
        yield result

LocalExecutor.execute = tells
"""


def free_port() -> int:
    """A port that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Farm:
    """A scheduler and its workers; all end with the block.

    Args:
        folder: where logs go.
        workers: how many there are at first, named w0, w1, ...
        protocol: tcp or tls.
        options: of the scheduler and of all workers.
    """

    def __init__(
        self, folder: Path, workers: int = 2, protocol: str = "tcp", options: Sequence[str] = ()
    ) -> None:
        self.folder, self.port, self._options = folder, free_port(), list(options)
        self._protocol = protocol
        self.address = f"{protocol}://127.0.0.1:{self.port}"
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: dict[str, subprocess.Popen[bytes]] = {}
        self._first = workers
        self._made = 0

    def __enter__(self) -> Self:
        self.start_scheduler()
        for _ in range(self._first):
            self.add()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in (*self.workers.values(), self.scheduler):
            if process is not None:
                end(process)

    def start_scheduler(self) -> None:
        """Starts the scheduler, at the same address each time."""
        options = ["--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard", "--no-show"]
        options += ["--protocol", self._protocol, *self._options]
        self.scheduler = self._start("distributed.cli.dask_scheduler", options, {}, "scheduler")
        deadline = time.monotonic() + 120
        while time.monotonic() < deadline:
            with suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1):
                return
            time.sleep(0.05)
        raise AssertionError("the scheduler does not start")

    def add(self, extra: Mapping[str, str] | None = None, preload: str = "") -> str:
        """Starts a worker of one thread, without a nanny that would replace it; gives its name.

        Args:
            extra: variables of its environment.
            preload: Python that it runs first.
        """
        name = f"w{self._made}"
        self._made += 1
        options = [self.address, "--name", name, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        options += ["--local-directory", str(self.folder), "--memory-limit", "0"]
        options += self._options
        if preload:
            (self.folder / f"{name}.py").write_text(preload)
            options += ["--preload", str(self.folder / f"{name}.py")]
        # Two workers share the cores of a small machine.
        shared = {"POCL_MAX_PTHREAD_COUNT": "1", **(extra or {})}
        self.workers[name] = self._start("distributed.cli.dask_worker", options, shared, name)
        return name

    def kill(self, name: str) -> None:
        """Ends a worker as a lost machine does."""
        end(self.workers.pop(name))

    def kill_scheduler(self) -> None:
        """Ends the scheduler; its workers end by themselves, sooner or later, and are ended here at once."""
        assert self.scheduler is not None
        end(self.scheduler)
        for name in list(self.workers):
            self.kill(name)

    def log(self, name: str) -> str:
        """What a process has printed."""
        return (self.folder / f"{name}.log").read_text(errors="replace")

    def _start(
        self, module: str, options: list[str], extra: Mapping[str, str], name: str
    ) -> subprocess.Popen[bytes]:
        with (self.folder / f"{name}.log").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", module, *options],
                cwd=self.folder,
                env=environment(extra),
                stdout=log,
                stderr=log,
                start_new_session=True,
            )


def end(process: subprocess.Popen[Any]) -> None:
    """Ends a process at once, and its children with it."""
    with suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait(120)


class Client(Running):
    """A run of the program that goes on while the test does something to the cluster."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        end(self.process)

    def ended(self, seconds: float = 120) -> tuple[int, str]:
        """The status, and what was printed to standard error."""
        return self.ended_by(seconds=seconds)

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self.process.poll() is None


def journal_grows(folder: Path, name: str = "out.exr.partial", least: int = 1, seconds: float = 120) -> None:
    """Waits until so many tiles lie in a journal."""
    wait_until(has_tiles(folder / name, least), seconds=seconds)
