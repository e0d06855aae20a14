"""Standard input as a scene, and standard output as a file: the name `-`.

Both go through temporary files: so a picture is sent only when it is whole, and commands know nothing of pipes. The shell's
messages call these files by what they stand for.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

from clfractal.cli.shell import OUTPUT, Shell
from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.files.atomic import naming
from clfractal.files.file_kinds import kind_of_start
from clfractal.files.regular import MAX_BYTES

INPUT = "standard input"
STREAM = "-"

_PIECE = 1 << 20
_LARGEST = 1 << 32  # bytes of a picture that holds a scene, or of a grid


@dataclass(frozen=True, slots=True)
class Piped:
    """What a command reads and writes.

    Attributes:
        source: the scene's file; of standard input, a temporary one.
        folder: where files that the scene names are looked for; None: beside it.
        outputs: the files to write, in their order; in the place of standard output a temporary one.
        streamed: that one; None if nothing goes to standard output.
    """

    source: str
    folder: Path | None
    outputs: tuple[Path, ...]
    streamed: Path | None = None


def is_stream(path: Path | None) -> bool:
    """Whether a file's name means standard output: `-`, or with its format `-.exr`."""
    return path is not None and re.fullmatch(r"-(\.\w+)?", str(path), re.ASCII) is not None


def refuse_stream(path: Path | None, reason: str) -> None:
    """Raises FileError if a file's name means standard output, where a command cannot write to it."""
    if is_stream(path):
        raise FileError(f"cannot be written to: {reason}", Where(OUTPUT))


@contextmanager
def piped(shell: Shell, source: str, outputs: Sequence[tuple[Path, str]]) -> Iterator[Piped]:
    """Files in the place of standard input and output. What was written is sent at the end, unless an error is raised.

    Args:
        source: the scene's file, or `-`.
        outputs: every file that is written, each with the extension that `-` alone stands for.

    Raises:
        FileError: standard input holds too much, or cannot be read; several files are meant for standard output; it is
            closed, or a terminal that would show bytes; it cannot be written.
    """
    named = tuple(path for path, _ in outputs)
    wanted = [path for path in named if is_stream(path)]
    if source != STREAM and not wanted:
        yield Piped(source, None, named)
        return
    if len(wanted) > 1:
        raise FileError(f"takes one file, but {len(wanted)} are meant for it; name the others", Where(OUTPUT))
    with TemporaryDirectory(prefix="clfractal-") as made:
        folder, streamed = Path(made), None
        used = []
        for path, extension in outputs:
            if is_stream(path):
                # A path of its own folder, as names of further files may be made of it.
                streamed = folder / f"output{Path('x' + str(path)[1:]).suffix or extension}"
                shell.keep_output(is_text=streamed.suffix == ".json")
                shell.names[str(streamed)] = OUTPUT
            used.append(streamed if is_stream(path) and streamed is not None else path)
        if source == STREAM:
            scene = folder / "scene"
            shell.names[str(scene)] = INPUT
            with doing(f"reading {INPUT}"):
                _spool(scene)
            yield Piped(str(scene), Path(), tuple(used), streamed)
        else:
            yield Piped(source, None, tuple(used), streamed)
        if streamed is not None:
            with open(streamed, "rb") as stream:
                shell.send(stream)


def _spool(path: Path) -> None:
    """Copies standard input to a file: the text of a scene, or a picture or grid."""
    if sys.stdin is None:
        raise FileError("is closed", Where(INPUT))
    stream: BinaryIO = sys.stdin.buffer
    size, limit = 0, MAX_BYTES
    with naming(INPUT, "cannot be read"), open(path, "wb") as file:
        while piece := stream.read(_PIECE):
            if size == 0 and kind_of_start(piece) is not None:
                limit = _LARGEST
            size += len(piece)
            if size > limit:
                raise FileError(f"is too large: at most {limit:,} bytes", Where(INPUT))
            file.write(piece)
    if size == 0:
        raise FileError("holds no scene: it is empty", Where(INPUT))
