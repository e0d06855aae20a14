"""Frames of a film that are kept, without loss, until the film is whole."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from clfractal.commands.order import PARTIAL
from clfractal.commands.shell import Shell
from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.files.atomic import file_error

if TYPE_CHECKING:
    from clfractal.files.moving import Plan

_OWN = re.compile(r"\d{6,}\.png(\..*)?|\..*\.tmp", re.ASCII)


class Kept:
    """A folder with the frames of films, beside the first of them; without films there is none.

    After an exception it stays, unless it is empty. When the films are whole it is removed.

    Args:
        films: what is written of the frames.
        shell: prints a message if earlier work is discarded.
        resume: whether frames of an earlier run stay.

    Raises:
        FileError: the folder cannot be made, or holds something else.
    """

    def __init__(self, films: Sequence[Plan], shell: Shell, *, resume: bool) -> None:
        self._films, self._shell, self._resume = tuple(films), shell, resume
        self._folder: Path | None = None
        if films:
            first = films[0].path
            self._folder = first.with_name(first.name + PARTIAL)

    @property
    def pattern(self) -> Path | None:
        """The name of the frames, with # for their numbers."""
        return self._folder / "######.png" if self._folder is not None else None

    def __enter__(self) -> Self:
        if self._folder is None:
            return self
        try:
            if self._folder.exists() and not self._resume:
                self._shell.say(
                    f"{self._folder}: earlier work is discarded; --resume would have continued it"
                )
                self._clear(self._folder)
            self._folder.mkdir(exist_ok=True)
        except OSError as error:
            raise file_error(self._folder, "cannot be used", error) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._folder is None:
            return
        if kind is None:
            self._clear(self._folder)
        if not any(self._folder.iterdir()):
            self._folder.rmdir()

    def write(self, pictures: Sequence[Path]) -> None:
        """Makes the films of the kept pictures.

        Raises:
            FileError: a film cannot be written.
        """
        from clfractal.files.moving import write_film

        for film in self._films:
            with doing(f"writing {film.path}"):
                write_film(film, pictures)

    def _clear(self, folder: Path) -> None:
        files = list(folder.iterdir())
        for file in files:
            if not _OWN.fullmatch(file.name):
                raise FileError("holds a file that is no frame of a film; move it away", Where(str(file)))
        for file in files:
            file.unlink()
