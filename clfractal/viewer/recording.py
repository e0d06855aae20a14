"""Recordings of what a user did in the window: events with their times, one line of JSON each.

The first line tells the version and the window's size. Places are in the window's own units, screen coordinates.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeAlias

from clfractal.errors import FileError, Where, unknown_name
from clfractal.files.atomic import file_error
from clfractal.files.regular import read_text_file

VERSION = 1
_FORMAT = "clfractal events"
# Numbers of JSON that every reader keeps exactly.
_LARGEST = 2**53
# Until a recording is on the disk, seconds: what it may lack after a crash.
_FLUSHED_EVERY = 1.0
# Of a recording: some hours of movements.
_MOST_BYTES = 256 << 20

Value: TypeAlias = int | float | str

KINDS: Mapping[str, tuple[type, ...] | type] = {
    "key": (int, int, int, int),
    "char": (int,),
    "button": (int, int, int),
    "move": (float, float),
    "scroll": (float, float),
    "resize": (int, int),
    "focus": (int,),
    "leave": (),
    "refresh": (),
    "drop": str,
    "monitor": (int, int),
    "close": (),
}
"""By kind of event: the types of its values in order; one type: any number of them.

`key`: GLFW's key, scancode, action, modifiers. `char`: a character's code. `button`: button, action, modifiers. `move`:
x, y from the window's top left. `scroll`: dx, dy. `resize`: width, height of the framebuffer, pixels. `focus`: 1 got, 0
lost. `leave`: the pointer left. `refresh`: the window has to be drawn anew. `drop`: paths of files. `monitor`: number,
1 connected or 0 disconnected. `close`: the user asked to close it.
"""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to the window: a kind of `KINDS`, and values of its types."""

    kind: str
    values: tuple[Value, ...] = ()


@dataclass(frozen=True, slots=True)
class Timed:
    """An event and when it happened, in seconds since the recording began."""

    seconds: float
    event: Event


@dataclass(frozen=True, slots=True)
class Recording:
    """All events in order, and the window's size when they began, screen coordinates."""

    size: tuple[int, int]
    events: tuple[Timed, ...]

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return self.events[-1].seconds if self.events else 0.0


class Recorder:
    """Writes events to a file as they come; a file that exists is replaced.

    Args:
        path: the recording.
        size: of the window, screen coordinates.

    Raises:
        FileError: it cannot be written.
    """

    def __init__(self, path: str | Path, size: tuple[int, int]) -> None:
        self.path = path
        self._last = 0.0
        self._flushed = 0.0
        with self._writing():
            self._file = open(path, "w", encoding="utf-8")  # noqa: SIM115 (closed by `close`)
        self._write({"format": _FORMAT, "version": VERSION, "size": list(size)}, flush=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def add(self, event: Event, seconds: float) -> None:
        """Adds an event at a time since the recording began; times never go back.

        Raises:
            FileError: it cannot be written.
            ValueError: the event is none of `KINDS`, or its values do not fit.
        """
        problem = _problem(event.kind, event.values)
        if problem:
            raise ValueError(problem)
        self._last = max(self._last, seconds)
        flush = self._last - self._flushed >= _FLUSHED_EVERY
        self._write({"at": round(self._last, 6), event.kind: list(event.values)}, flush=flush)
        if flush:
            self._flushed = self._last

    def close(self) -> None:
        """Ends the recording.

        Raises:
            FileError: the last events cannot be written.
        """
        with self._writing():
            self._file.close()

    def _write(self, line: Mapping[str, Any], *, flush: bool) -> None:
        with self._writing():
            self._file.write(json.dumps(line, allow_nan=False) + "\n")
            if flush:
                self._file.flush()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError) as error:
            raise file_error(self.path, "cannot be written", error) from error


class Player:
    """Gives the events of a recording when their time has come."""

    def __init__(self, events: Recording | Iterable[Timed]) -> None:
        self._events: Sequence[Timed] = events.events if isinstance(events, Recording) else tuple(events)
        self._next = 0

    def due(self, now: float) -> list[Event]:
        """The events up to `now`, seconds since the start, that have not been given yet; in order."""
        first = self._next
        while self._next < len(self._events) and self._events[self._next].seconds <= now:
            self._next += 1
        return [each.event for each in self._events[first : self._next]]

    @property
    def done(self) -> bool:
        """Whether all events have been given."""
        return self._next == len(self._events)

    @property
    def next_seconds(self) -> float | None:
        """When the next event is due; None after the last."""
        return None if self.done else self._events[self._next].seconds


def read_recording(path: str | Path) -> Recording:
    """A recording from its file. A last line that was cut off, as by a crash, is left out.

    Raises:
        FileError: it cannot be read, is no recording, or has a wrong line, which is named.
    """
    *whole, rest = read_text_file(Path(path), limit=_MOST_BYTES).split("\n")
    if rest and _is_json(rest):
        whole.append(rest)
    if not whole:
        raise FileError("is no recording of clfractal's window", Where(str(path)))
    size = _header(whole[0], path)
    events: list[Timed] = []
    for number, line in enumerate(whole[1:], start=2):
        events.append(_event(line, Where(str(path), number), events[-1].seconds if events else 0.0))
    return Recording(size, tuple(events))


def _is_json(line: str) -> bool:
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


def _parsed(line: str, where: Where) -> dict[str, Any]:
    try:
        found = json.loads(line, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise FileError("is not a line of JSON", where) from None
    if not isinstance(found, dict):
        raise FileError("must be a mapping", where)
    return found


def _no_constant(word: str) -> float:
    raise ValueError(word)


def _header(line: str, path: str | Path) -> tuple[int, int]:
    where = Where(str(path), 1)
    try:
        data = _parsed(line, where)
    except FileError:
        data = {}
    if data.get("format") != _FORMAT:
        raise FileError("is no recording of clfractal's window", Where(str(path)))
    if data.get("version") != VERSION:
        raise FileError(f"version must be {VERSION}, got {str(data.get('version'))[:20]}", where)
    size = data.get("size")
    if (
        not isinstance(size, list)
        or len(size) != 2
        or not all(_fits(side, int) and side > 0 for side in size)
    ):
        raise FileError("size must be the window's width and height", where)
    return size[0], size[1]


def _event(line: str, where: Where, earliest: float) -> Timed:
    data = _parsed(line, where)
    at = data.pop("at", None)
    if not _fits(at, float) or at < 0:
        raise FileError("`at` must be a time in seconds, at least 0", where)
    if at < earliest:
        raise FileError(f"`at` must not be before the line above, {earliest:g}, got {at:g}", where)
    if len(data) != 1:
        raise FileError(f"must have `at` and one kind of event, got {len(data)}", where)
    ((kind, values),) = data.items()
    problem = (
        _problem(kind, values) if isinstance(values, list) else f"{kind[:40]} must have a list of values"
    )
    if problem:
        raise FileError(problem, where)
    types = KINDS[kind]
    floats = [isinstance(types, tuple) and types[place] is float for place in range(len(values))]
    return Timed(
        float(at),
        Event(kind, tuple(float(v) if real else v for v, real in zip(values, floats, strict=True))),
    )


def _problem(kind: str, values: Sequence[Any]) -> str:
    """What is wrong with an event; empty if nothing is."""
    if kind not in KINDS:
        return unknown_name("event", str(kind), KINDS)
    types = KINDS[kind]
    wanted = types if isinstance(types, tuple) else (types,) * len(values)
    if len(values) != len(wanted):
        return f"{kind} must have {len(wanted)} values, got {len(values)}"
    for value, each in zip(values, wanted, strict=True):
        if not _fits(value, each):
            word = {int: "whole numbers", float: "numbers", str: "texts"}[each]
            return f"{kind} must have {word}, got {str(value)[:40]!r}"
    return ""


def _fits(value: Any, kind: type) -> bool:
    if isinstance(value, bool):
        return False
    if kind is str:
        return isinstance(value, str)
    if isinstance(value, int):
        return abs(value) <= _LARGEST
    return kind is float and isinstance(value, float) and math.isfinite(value)
