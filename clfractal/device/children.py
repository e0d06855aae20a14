"""The processes that `isolate` sends jobs to: one pool of them for the whole process.

A child takes one job after another, from any thread, and ends by itself when it has had none for some seconds. There are
at most as many children as processors; a caller waits if none is free. All of them end with this process.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from clfractal.device import drivers_folder
from clfractal.device.child import DONE
from clfractal.errors import Stopped, UntriedError

POLL_S = 0.01
"""Seconds between checks whether a waiting caller should stop."""
_KILLED = -getattr(signal, "SIGKILL", 9)
_PATIENCE_S = 0.1  # of a wait that Ctrl-C does not end on Windows
_SWEEP_S = 1.0  # how often children that have ended by themselves are looked for


class EndedError(Exception):
    """A child ended before it could take the job, by itself or because it was killed; another child can take the job."""


class Child:
    """A process that waits for jobs, with one pipe for sending jobs and one for their completion."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.environment = dict(environment)
        self.jobs = 0
        self.process: subprocess.Popen[bytes] = subprocess.Popen(
            # -P: nothing is imported from the current folder.
            [sys.executable, "-P", "-m", "clfractal.device.child", str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=self.environment,
            bufsize=0,
            # Ctrl-C at the terminal must reach only this process, which then decides about its children. On Windows that is
            # a group, and without the other flag each child would open a console.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
            | getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        # A thread waits for answers, because Windows has no way to wait for a pipe and a time together.
        self._answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        threading.Thread(target=self._listen, name="clfractal-answers", daemon=True).start()

    def _listen(self) -> None:
        """Passes on what the child writes; nothing, once, when it has ended."""
        assert self.process.stdout is not None
        while True:
            try:
                answer = self.process.stdout.read(len(DONE))
            except (OSError, ValueError):  # the pipe was closed here
                answer = b""
            self._answers.put(answer)
            if not answer:
                return

    def ask(self, folder: Path, timeout_s: float, stopped: Callable[[], bool] | None) -> int | None:
        """Send the job in `folder` and wait until it is done.

        Returns:
            0 when the job is done; else the child's exit status, negative for a signal; None if it takes too long.

        Raises:
            EndedError: the child had ended before.
            Stopped: `stopped` returned True.
        """
        self.jobs += 1
        sent = self._send(os.fsencode(folder) + b"\n")
        end = time.monotonic() + timeout_s
        while True:
            left = end - time.monotonic()
            if left <= 0:
                return None
            if stopped is not None and stopped():
                raise Stopped
            with contextlib.suppress(queue.Empty):
                answer = self._answers.get(timeout=min(left, _PATIENCE_S if stopped is None else POLL_S))
                break
        if answer:
            return 0
        status = self.process.wait()
        # It had just waited long enough (0), or somebody ended it (SIGKILL): no driver does either. A new child that
        # ends before its first job is a fault, and the next one would do the same.
        if self.jobs > 1 and (not sent or status in (0, _KILLED)):
            raise EndedError
        return status

    def _send(self, line: bytes) -> bool:
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(line)
        except OSError:  # a pipe without a reader: EPIPE, or EINVAL on Windows
            return False
        return True

    def has_ended(self) -> bool:
        """Whether it takes no more jobs."""
        return self.process.poll() is not None

    def kill(self) -> None:
        """End it, whatever it does; a thread that waits for its answer then gets an error."""
        if not self.has_ended():
            if sys.platform == "win32":
                self.process.kill()
            else:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()

    def end(self) -> None:
        """End it, close its pipes and remove what it left; the caller must be the only one to use it."""
        self.kill()
        self.close()
        drivers_folder.drop_nested(self.process.pid)

    def close(self) -> None:
        """Close the pipes. A second call does nothing."""
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()


class Lease:
    """A caller's hold on a child. The pool fills it in, so that an interrupt cannot lose a child."""

    def __init__(self) -> None:
        self.child: Child | None = None
        self.failure: Exception | None = None


class Children:
    """The pool. Every method may be called from any thread."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._changed = threading.Condition()
        self._idle: list[Child] = []
        self._leases: set[Lease] = set()  # with a child, or waiting until one has started for them
        self._orders: queue.SimpleQueue[tuple[Lease, Mapping[str, str]]] = queue.SimpleQueue()
        self._keeper: threading.Thread | None = None

    def take(self, lease: Lease, environment: Mapping[str, str], stopped: Callable[[], bool] | None) -> Child:
        """Put a child into `lease` that was started with `environment`; wait for one if none is free.

        `give_back` must be called afterwards, whatever happens here.

        Raises:
            UntriedError: no process can be started.
            Stopped: `stopped` answered True.
        """
        with self._changed:
            while lease.child is None:
                if stopped is not None and stopped():
                    raise Stopped
                if lease.failure is not None:
                    raise UntriedError(f"the process for compiling cannot be started: {lease.failure}")
                self._drop_useless(environment)
                if lease not in self._leases and len(self._leases) < self._most:
                    self._leases.add(lease)
                    if self._idle:
                        lease.child = self._idle[-1]
                        self._idle.remove(lease.child)
                        break
                    self._order(lease, environment)
                self._changed.wait(None if stopped is None else POLL_S)
            return lease.child

    def give_back(self, lease: Lease, *, usable: bool) -> None:
        """Let others have the lease's child, or end it."""
        with self._changed:
            self._leases.discard(lease)
            child, lease.child = lease.child, None
            if child is not None and child in self._idle:
                self._idle.remove(child)
            if child is not None and usable:
                self._idle.append(child)
                child = None
            self._changed.notify_all()
        if child is not None:
            child.end()

    def close(self) -> None:
        """End all children, whatever they do. The pool can be used again."""
        with self._changed:
            idle, self._idle = self._idle, []
            busy = [lease.child for lease in self._leases if lease.child is not None]
        for child in idle:
            child.end()
        for child in busy:
            child.kill()

    def forget(self) -> None:
        """Close the pipes in a forked process, because the children belong to its parent."""
        for child in [*self._idle, *(lease.child for lease in self._leases if lease.child is not None)]:
            child.close()

    def _drop_useless(self, environment: Mapping[str, str]) -> None:
        """Remove children that have ended, or that were started with another environment."""
        useless = [each for each in self._idle if each.has_ended() or each.environment != dict(environment)]
        for child in useless:
            self._idle.remove(child)
            child.end()

    def _order(self, lease: Lease, environment: Mapping[str, str]) -> None:
        """Children are started by one thread that stays: the system ends them with the thread that started them."""
        if self._keeper is None or not self._keeper.is_alive():
            self._keeper = threading.Thread(target=self._keep, name="clfractal-children", daemon=True)
            self._keeper.start()
        self._orders.put((lease, environment))

    def _keep(self) -> None:
        """Start children that are ordered, and clear away those that have ended by themselves."""
        while True:
            try:
                with self._changed:
                    some = self._idle or self._leases
                lease, environment = self._orders.get(timeout=_SWEEP_S if some else None)
            except queue.Empty:
                with self._changed:
                    for ended in [each for each in self._idle if each.has_ended()]:
                        self._idle.remove(ended)
                        ended.end()
                continue
            child: Child | None = None
            try:
                child = Child(environment)
            except Exception as error:
                lease.failure = error
            with self._changed:
                if child is not None and lease in self._leases:
                    lease.child = child
                elif child is not None:  # the caller that ordered it no longer waits
                    self._idle.append(child)
                self._changed.notify_all()


def processors() -> int:
    """How many this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


pool = Children(processors())


def _after_fork() -> None:
    global pool
    pool.forget()
    pool = Children(processors())


@atexit.register
def _close() -> None:
    pool.close()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
