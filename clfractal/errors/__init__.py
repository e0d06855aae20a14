"""Errors a user can act on: one line each, with the place of the mistake and the shell's exit status."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

# Exit statuses of the shell (not sysexits: scripts only need to distinguish "fix the input" from "fix the machine").
STATUS_BAD_INPUT = 2
STATUS_DEVICE_FAILED = 3
STATUS_INTERRUPTED = 130
# And the number of the signal, as shells have it; STATUS_INTERRUPTED is that of Ctrl-C.
STATUS_SIGNALLED = 128


@dataclass(frozen=True, slots=True)
class Where:
    """A place in the user's input: a file (or option), a position in it (both counted from 1), and a dotted path."""

    file: str | None = None
    line: int | None = None
    column: int | None = None
    path: str | None = None

    def prefix(self) -> str:
        """The place as `scene.yaml:12:9: camera.fov: `; empty when nothing is known."""
        column = self.column if self.line is not None else None
        place = ":".join(str(part) for part in (self.file, self.line, column) if part is not None)
        return "".join(f"{part}: " for part in (place, self.path) if part)


class Stopped(Exception):  # noqa: N818
    """The work was cancelled, by its token or by the caller that waited. This is not an error, so nothing is printed."""


class NotReady(Exception):  # noqa: N818
    """Something would have to be made first that takes long, and the caller did not want to wait for it."""


class ClfractalError(Exception):
    """Base of every error meant for the user.

    `message` is one line; `details` may hold more (a compiler's log, an excerpt) and is shown by `--verbose`.
    """

    status = STATUS_BAD_INPUT

    def __init__(
        self, message: str, where: Where | None = None, *, details: str = "", status: int | None = None
    ) -> None:
        self.message = " ".join(message.split())
        self.where = where or Where()
        self.details = details
        if status is not None:
            self.status = status
        super().__init__(self.where.prefix() + self.message)


class SceneError(ClfractalError):
    """A scene file, or an override of one of its keys, is wrong."""


@contextmanager
def speaking_of(file: str) -> Iterator[None]:
    """Adds the scene file's name to errors that are found only while the scene is rendered."""
    try:
        yield
    except SceneError as error:
        if error.where.file is not None:
            raise
        raise SceneError(error.message, replace(error.where, file=file), details=error.details) from error


class FormulaError(ClfractalError):
    """A formula, one of its expressions, or a parameter of it is wrong."""


class FileError(ClfractalError):
    """A file cannot be read or written."""

    def inside(self, file: str) -> str:
        """What it says, for a message about another place that names this file: with its line and field, if it has them."""
        named = self.where.file or file
        if self.where.line is None and self.where.path is None:
            return f"{named} {self.message}"
        return f"{replace(self.where, file=named).prefix()}{self.message}"


class CacheWarning(UserWarning):
    """The cache cannot be where it should be, or takes nothing more; the work is done all the same."""


class DeviceError(ClfractalError):
    """No device, an unknown one (status 2), or one that failed while running (status 3)."""

    status = STATUS_DEVICE_FAILED


class UntriedError(DeviceError):
    """What a device can do was not found out, for a reason that lies elsewhere, and may be gone the next time."""


class KernelBuildError(ClfractalError):
    """A generated program does not compile: status 2 if the user's formula is at fault, 3 if our own kernel is."""

    status = STATUS_DEVICE_FAILED


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known name that is most similar to `word`, or None."""
    import difflib  # only for mistakes: every start of the program would pay for it

    candidates = sorted(set(known))
    folded = {candidate.casefold(): candidate for candidate in candidates}
    close = difflib.get_close_matches(word.casefold(), folded, n=1, cutoff=0.5)
    return folded[close[0]] if close else None


def unknown_name(kind: str, word: str, known: Iterable[str]) -> str:
    """Message text for an unknown name: `unknown key 'fow'; did you mean 'fov'?`, else the names that exist."""
    candidates = sorted(set(known))
    guess = nearest(word, candidates)
    shown = word if len(word) <= 60 else word[:57] + "..."
    if guess:
        return f"unknown {kind} {shown!r}; did you mean {guess!r}?"
    listing = ", ".join(candidates[:40]) if candidates else "none"
    return f"unknown {kind} {shown!r}; known: {listing}"
