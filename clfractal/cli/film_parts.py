"""Which frames of a film are asked for, which are there, and their numbers as text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path

from clfractal.errors import FileError, SceneError, Where
from clfractal.files.frame_names import is_film, split_pattern
from clfractal.files.whole import is_whole

_MOST_DIGITS = 12
_MOST_RANGES = 8


def frames_of(part: str | None, count: int) -> range:
    """The frames of a film of `count` frames that are to be rendered: `--frames A-B:STEP`, `A-B`, `A` or all of them.

    Raises:
        SceneError: the text has another form, or names a frame that the film does not have.
    """
    if part is None:
        return range(count)
    found = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9})(?::(\d{1,9}))?)?", part.strip(), re.ASCII)
    if found is None:
        raise SceneError(
            f"must be A-B, A-B:STEP or a number, such as 0-119:2; got {part[:60]!r}", Where("--frames")
        )
    first = int(found[1])
    last, step = int(found[2] or first), int(found[3] or 1)
    if step < 1 or last < first:
        raise SceneError(f"must go upwards, got {part[:60]!r}", Where("--frames"))
    if last >= count:
        raise SceneError(f"must be frames 0 to {count - 1} of the film, got {last}", Where("--frames"))
    return range(first, last + 1, step)


def check_pattern(path: Path) -> None:
    """Raises FileError if a file that is no film has no place for the frame's number."""
    where = Where(str(path))
    if is_film(path):
        return
    if "#" not in path.name:
        example = f"{path.stem}_####{path.suffix}"
        raise FileError(f"must have # where the frame's number goes, such as {example}", where)
    if len(split_pattern(path.name)[1]) > _MOST_DIGITS:
        raise FileError(f"must have at most {_MOST_DIGITS} # in a row", where)


def missing(numbers: Iterable[int], files: Iterable[Sequence[Path]]) -> list[int]:
    """The frames of which a file is not there, or is not whole.

    Args:
        numbers: of the frames.
        files: of each frame.

    Raises:
        FileError: a file cannot be read.
    """
    return [
        number
        for number, paths in zip(numbers, files, strict=True)
        if not all(is_whole(path) for path in paths)
    ]


def ranges(numbers: Sequence[int]) -> Iterator[str]:
    """Numbers in order, as `--frames` takes them: `3`, `5-9`."""
    # (In a row, numbers and their places rise together.)
    for _, row in groupby(enumerate(numbers), lambda each: each[1] - each[0]):
        run = [number for _, number in row]
        yield str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}"


def shown_ranges(numbers: Sequence[int]) -> str:
    """The same in one line, which names only the first of many."""
    found = list(ranges(numbers))
    left = f" and {len(found) - _MOST_RANGES} more" if len(found) > _MOST_RANGES else ""
    return ", ".join(found[:_MOST_RANGES]) + left
