"""Films that are rendered from the window, one after the other, each by a process of its own.

The process is `clfractal animate`: so a film of the window is the shell's film, is continued as the shell continues it, and
neither waits for the window nor lets it wait.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from clfractal.errors import FileError, Where
from clfractal.files.film_kinds import CONTAINERS

PARTIAL = ".partial"
"""What a film's name gets for the folder with its frames, until it is whole."""

_PATIENCE = 3.0
# Seconds between two looks at how far a film is.
_LOOK_SECONDS = 0.5
# How much a film gives way to the window where both want the same processor.
_NICE = 10
_TOLD = 300


@dataclass(frozen=True, slots=True)
class FilmOrder:
    """What is wanted.

    Attributes:
        text: the scene, as YAML.
        folder: from which the scene names files.
        output: the film; or pictures, with # in the name for the frame's number. It is absolute.
        first, last: the frames, counted from 0.
        device: an index, as `--device` takes it.
        size: pixels; None: the scene's.
        samples: for a pixel; None: the scene's.
        options: more of `clfractal animate`, such as the codec.
    """

    text: str
    folder: Path
    output: Path
    first: int
    last: int
    device: str
    size: tuple[int, int] | None = None
    samples: int | None = None
    options: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """How many frames."""
        return self.last - self.first + 1

    def frame(self, number: int) -> Path:
        """The file of a frame: of a film the one that is kept until the film is whole."""
        if self.output.suffix.lower() in CONTAINERS:
            return self.output.with_name(self.output.name + PARTIAL) / f"{number:06d}.png"
        head, _, tail = self.output.name.rpartition("#")
        signs = len(head) - len(head.rstrip("#")) + 1
        return self.output.with_name(f"{head.rstrip('#')}{number:0{signs}d}{tail}")

    def done(self) -> int:
        """How many of its frames are there."""
        # One look at the folder: a film may have tens of thousands.
        try:
            there = {entry.name for entry in os.scandir(self.frame(self.first).parent)}
        except OSError:
            return 0
        return sum(self.frame(number).name in there for number in range(self.first, self.last + 1))

    def command(self, *, resume: bool) -> list[str]:
        """The shell's command; the scene comes from standard input."""
        found = [sys.executable, "-P", "-m", "clfractal", "animate", "-", "-o", str(self.output)]
        found += ["--frames", f"{self.first}-{self.last}", "--device", self.device, *self.options]
        if self.size is not None:
            found += ["--size", f"{self.size[0]}x{self.size[1]}"]
        if self.samples is not None:
            found += ["--samples", str(self.samples)]
        return [*found, "--resume"] if resume else found


class RenderedFilm:
    """A film that is rendered, or waits for its turn.

    Attributes:
        order: what is wanted.
        done: frames that are there.
        remaining: seconds that are left; None: it is not known yet.
        problem: why it failed, or empty.
        written: whether it is whole.
        cancelled: whether it was ended before; what is done is kept, and continued if it is ordered again.
    """

    def __init__(self, order: FilmOrder, *, resume: bool = False) -> None:
        self.order, self._resume = order, resume
        self.done = 0
        self.remaining: float | None = None
        self.problem = ""
        self.written = self.cancelled = False
        self._process: subprocess.Popen[bytes] | None = None
        self._told: IO[bytes] | None = None
        self._looked = 0.0
        self._since: tuple[float, int] | None = (
            None  # when the first frame of this run was there, and how many then were
        )

    @property
    def finished(self) -> bool:
        """Whether nothing more happens to it."""
        return self.written or self.cancelled or bool(self.problem)

    @property
    def running(self) -> bool:
        """Whether its process runs."""
        return self._process is not None

    def start(self) -> None:
        """Starts its process."""
        self._told = tempfile.TemporaryFile()  # noqa: SIM115 (until the process has ended)
        low = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
        try:
            self._process = subprocess.Popen(
                self.order.command(resume=self._resume),
                cwd=self.order.folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=self._told,
                creationflags=low,
            )
            assert self._process.stdin is not None
            with suppress(BrokenPipeError):
                self._process.stdin.write(self.order.text.encode())
                self._process.stdin.close()
        except OSError as error:
            self._end(str(FileError(f"cannot be rendered: {error.strerror}", Where(str(self.order.output)))))
            return
        if hasattr(os, "setpriority"):
            with suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, self._process.pid, _NICE)

    def look(self, now: float) -> None:
        """Looks how far it is, now and then; `now` in seconds."""
        process = self._process
        if process is None:
            return
        status = process.poll()
        if status is None and now - self._looked < _LOOK_SECONDS:
            return
        self._looked = now
        if status is None:
            self._count(now)
        elif status == 0:
            self.done, self.written = self.order.count, True
            self._end("")
        else:
            self.done = self.order.done()
            self._end(
                "" if self.cancelled else self._last_line() or f"the process ended with status {status}"
            )

    def cancel(self) -> None:
        """Ends it; frames that are done are kept."""
        if self.finished:
            return
        self.cancelled = True
        if self._process is not None:
            self._process.terminate()

    def close(self) -> str:
        """Ends it because the window ends; what to say of that."""
        if self.finished and self._process is None:
            return ""
        self.cancel()
        if self._process is not None:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_PATIENCE)
            if self._process.poll() is None:
                self._process.kill()
                self._process.wait()
        if self.written:
            return ""
        done = self.order.done()
        self._end("")
        return (
            f"{self.order.output}: interrupted with {done} of {self.order.count} frames done; they are kept"
        )

    def _count(self, now: float) -> None:
        done = self.order.done()
        if self._since is None and done > self.done:
            self._since = (now, done)
        self.done = done
        if self._since is not None and done > self._since[1]:
            each = (now - self._since[0]) / (done - self._since[1])
            self.remaining = each * (self.order.count - done)

    def _last_line(self) -> str:
        """What the process has told last."""
        if self._told is None:
            return ""
        self._told.seek(0)
        lines = [line for line in self._told.read().decode(errors="replace").splitlines() if line.strip()]
        return lines[-1].strip()[:_TOLD].replace("standard input: ", "") if lines else ""

    def _end(self, problem: str) -> None:
        self.problem = problem
        if self._told is not None:
            self._told.close()
        self._process = self._told = None
        self.remaining = None


class FilmQueue:
    """The films of a window: one is rendered at a time, in the order in which they were ordered.

    Attributes:
        films: the newest last.
    """

    def __init__(self) -> None:
        self.films: list[RenderedFilm] = []

    @property
    def busy(self) -> bool:
        """Whether any is rendered, or waits."""
        return any(not film.finished for film in self.films)

    def order(self, order: FilmOrder, *, resume: bool = False) -> RenderedFilm:
        """Adds a film; one of the same name that had ended gives way to it."""
        self.films[:] = [
            film for film in self.films if not (film.finished and film.order.output == order.output)
        ]
        film = RenderedFilm(order, resume=resume)
        self.films.append(film)
        self.look(time.perf_counter())
        return film

    def look(self, now: float) -> None:
        """Looks how far they are, and starts the next."""
        for film in self.films:
            film.look(now)
        if not any(film.running for film in self.films):
            waiting = next((film for film in self.films if not film.finished), None)
            if waiting is not None:
                waiting.start()

    def cancel(self) -> bool:
        """Ends all; whether there was any."""
        busy = self.busy
        for film in self.films:
            film.cancel()
        return busy

    def close(self) -> list[str]:
        """Ends all because the window ends; lines for the user."""
        waiting = [film for film in self.films if not film.running]
        for film in waiting:
            film.cancel()
        return [line for film in self.films if (line := film.close()) and film not in waiting]
