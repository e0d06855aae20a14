"""Frames of a film that are kept, without loss, until the film is whole."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from clfractal.cli.shell import Shell
from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.files.atomic import naming
from clfractal.files.frame_names import frame_file, kept_folder, kept_patterns

if TYPE_CHECKING:
    from clfractal.files.moving import Plan

_OWN = re.compile(r"\d{6,}(\.8)?\.png(\..*)?|\..*\.tmp", re.ASCII)


class Kept:
    """A folder with the frames of films, beside the first of them; without films there is none.

    It stays as long as frames are in it: those of the films are removed when these are whole.

    Args:
        films: what is written of the frames.
        shell: prints a message if earlier work is discarded.
        resume: whether frames of an earlier run stay.

    Raises:
        FileError: the folder cannot be made, or holds something else.
    """

    def __init__(self, films: Sequence[Plan], shell: Shell, *, resume: bool) -> None:
        self._films, self._shell, self._resume = tuple(films), shell, resume
        self._folder = kept_folder(films[0].path) if films else None

    @property
    def patterns(self) -> Mapping[int, Path]:
        """The names of the frames, with # for their numbers, by their bits.

        A film of 8 bits has frames of its own: rounded from those of others it would not be what it is alone.
        """
        if self._folder is None:
            return {}
        kinds = sorted({16 if film.bits > 8 else 8 for film in self._films}, reverse=True)
        return dict(zip(kinds, kept_patterns(self._films[0].path), strict=False))

    def at(self, number: int) -> dict[Path, int]:
        """The files of a kept frame, and the bits of each."""
        return {frame_file(pattern, number): bits for bits, pattern in self.patterns.items()}

    def __enter__(self) -> Self:
        if self._folder is None:
            return self
        with naming(self._folder, "cannot be used"):
            if self._folder.exists():
                self._files()
            else:
                self._folder.mkdir()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._folder is not None and not any(self._folder.iterdir()):
            self._folder.rmdir()

    def begin(self) -> None:
        """Removes frames of earlier work, unless it is continued: when nothing in the order can be wrong any more."""
        files = [] if self._folder is None else self._files()
        if files and not self._resume:
            self._shell.say(f"{self._folder}: earlier work is discarded; --resume would have continued it")
        for file in files:
            if not self._resume or file.name.startswith("."):  # what a kill has left of a frame in work
                file.unlink()

    def write(self, numbers: Sequence[int]) -> None:
        """Makes the films of the kept frames with these numbers, which are removed when all films are whole.

        Raises:
            FileError: a film cannot be written.
        """
        from clfractal.files.moving import write_film

        for film in self._films:
            with doing(f"writing {film.path}"):
                pattern = self.patterns[16 if film.bits > 8 else 8]
                write_film(film, [frame_file(pattern, number) for number in numbers])
        for number in numbers:
            for picture in self.at(number):
                picture.unlink(missing_ok=True)

    def _files(self) -> list[Path]:
        """What lies in the folder; FileError if something is no frame."""
        assert self._folder is not None
        files = list(self._folder.iterdir())
        for file in files:
            if not _OWN.fullmatch(file.name):
                raise FileError("is no frame of a film; move it away", Where(str(file)))
        return files
