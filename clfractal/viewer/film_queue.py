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
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from clfractal.errors import FileError, Where
from clfractal.files.frame_names import frames_there, is_film, kept_patterns, namer
from clfractal.images.outputs import output_files
from clfractal.scene.stereo import Stereo

# Seconds that a process has to end by itself.
_PATIENCE = 3.0
# Seconds between two looks at how far a film is.
_LOOK_SECONDS = 0.5
# How much a film gives way to the window where both want the same processor.
_NICE = 10
_TOLD = 300

Stamp = tuple[int, ...]
"""When a frame's files were written, nanoseconds: it tells them from others of the same names."""


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
        stereo: how the scene shows two eyes: some ways have a picture of each.
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
    stereo: Stereo | None = None

    @property
    def count(self) -> int:
        """How many frames."""
        return self.last - self.first + 1

    @property
    def patterns(self) -> list[Path]:
        """The files of a frame, with # for its number: of a film the one that is kept until the film is whole."""
        if is_film(self.output):
            return [kept_patterns(self.output)[0]]
        return output_files(self.stereo, self.output)

    @property
    def numbers(self) -> range:
        """The numbers of its frames."""
        return range(self.first, self.last + 1)

    def there(self) -> set[int]:
        """The numbers of the frames that are there."""
        return frames_there(self.patterns, self.numbers)

    def stamps(self, numbers: Iterable[int]) -> Iterator[Stamp | None]:
        """When the files of each frame were written; None: one of them is not there."""
        namers = [namer(pattern) for pattern in self.patterns]
        for number in numbers:
            try:
                yield tuple(os.stat(name(number)).st_mtime_ns for name in namers)
            except OSError:
                yield None

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
        done: frames of it that are there; of an earlier run only if that is continued.
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
        self._end_by: float | None = None  # when a process that is to end is killed
        # What this run makes, in order: the frames; how they were before; how many are made.
        self._numbers: Sequence[int] = order.numbers
        self._old: dict[int, Stamp | None] = {}
        self._made = 0
        self._looked = 0.0
        self._since: tuple[float, int] | None = (
            None  # when the first frame of this run was there, and how many then were
        )

    @property
    def under_way(self) -> bool:
        """Whether it waits or is rendered, and is to become whole."""
        return not (self.written or self.cancelled or self.problem)

    @property
    def finished(self) -> bool:
        """Whether nothing more happens to it: a film that was cancelled still writes until its process has ended."""
        return not (self.under_way or self.running)

    @property
    def running(self) -> bool:
        """Whether its process runs."""
        return self._process is not None

    def start(self) -> None:
        """Starts its process."""
        there = self.order.there()
        if self._resume:
            self._numbers = [number for number in self.order.numbers if number not in there]
            self.done = self._frames_done()
        else:
            self._old = dict(zip(there, self.order.stamps(there), strict=True))
        try:
            self._told = tempfile.TemporaryFile()  # noqa: SIM115 (until the process has ended)
            # A file: a pipe would be full after some pages of text, and the window would wait for the process to read.
            with tempfile.TemporaryFile() as text:
                text.write(self.order.text.encode())
                text.seek(0)
                self._process = subprocess.Popen(
                    self.order.command(resume=self._resume),
                    cwd=self.order.folder,
                    stdin=text,
                    stdout=subprocess.DEVNULL,
                    stderr=self._told,
                    # On Windows it would open a console.
                    creationflags=getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
                    | getattr(subprocess, "CREATE_NO_WINDOW", 0),
                )
        except OSError as error:
            self._end(str(FileError(f"cannot be rendered: {error.strerror}", Where(str(self.order.output)))))
            return
        if sys.platform != "win32":  # where the flag above does it
            with suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, self._process.pid, _NICE)

    def look(self, now: float) -> None:
        """Looks how far it is, now and then; `now` in seconds."""
        process = self._process
        if process is None:
            return
        status = process.poll()
        if status is not None:
            self._ended(status)
        elif now - self._looked >= _LOOK_SECONDS:
            self._looked = now
            self._count(now)
            if self.cancelled:
                self._end_by = now + _PATIENCE if self._end_by is None else self._end_by
                if now > self._end_by:
                    process.kill()

    def cancel(self) -> None:
        """Ends it; frames that are done are kept. It is finished when its process has ended."""
        if self.under_way:
            self.cancelled = True
            if self._process is not None:
                self._process.terminate()

    def close(self) -> str:
        """Ends it because the window ends; what to say of that."""
        process = self._process
        if process is None:
            self.cancel()
            return ""
        if process.poll() is None:
            self.cancel()
            try:
                process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
        self._ended(process.wait())
        if self.written or self.problem:
            return self.problem
        done, count = self.done, self.order.count
        return f"{self.order.output}: interrupted with {done} of {count} frames done; they are kept"

    def _ended(self, status: int) -> None:
        """Takes the exit status of its process."""
        self.written = status == 0
        self.done = self.order.count if self.written else self._frames_done()
        well = self.written or self.cancelled
        self._end("" if well else self._last_line() or f"the process ended with status {status}")

    def _frames_done(self) -> int:
        # Frames are made in order: only the next ones need a look, however many there are.
        coming = self._numbers[self._made :]
        for number, stamp in zip(coming, self.order.stamps(coming), strict=True):
            if stamp is None or stamp == self._old.get(number):
                break
            self._made += 1
        return self.order.count - len(self._numbers) + self._made

    def _count(self, now: float) -> None:
        done = self._frames_done()
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
        self._leaving: list[RenderedFilm] = []  # no longer shown, but their processes have not ended yet

    @property
    def busy(self) -> bool:
        """Whether any is rendered, or waits."""
        return any(not film.finished for film in self._all)

    def under_way(self, output: Path) -> bool:
        """Whether a film of that name waits or is rendered."""
        return any(film.under_way and film.order.output == output for film in self.films)

    def clear(self, output: Path | None = None) -> None:
        """Forgets films that are no longer under way, or those of a name; the files stay."""
        for film in list(self.films):
            if not film.under_way and output in (None, film.order.output):
                self.films.remove(film)
                self._leaving += [film] if film.running else []

    def order(self, order: FilmOrder, *, resume: bool = False) -> RenderedFilm:
        """Adds a film; one of the same name that had ended gives way to it, and its process ends before this begins."""
        self.clear(order.output)
        film = RenderedFilm(order, resume=resume)
        self.films.append(film)
        self.look(time.perf_counter())
        return film

    def look(self, now: float) -> None:
        """Looks how far they are, and starts the next."""
        for film in self._all:
            film.look(now)
        self._leaving = [film for film in self._leaving if film.running]
        if not any(film.running for film in self._all):
            waiting = next((film for film in self.films if film.under_way), None)
            if waiting is not None:
                waiting.start()

    def cancel(self) -> bool:
        """Ends all; whether there was any to end."""
        under_way = [film for film in self.films if film.under_way]
        for film in under_way:
            film.cancel()
        return bool(under_way)

    def close(self) -> list[str]:
        """Ends all because the window ends; lines for the user."""
        return [line for film in self._all if (line := film.close())]

    @property
    def _all(self) -> list[RenderedFilm]:
        return [*self._leaving, *self.films]
