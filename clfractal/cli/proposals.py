"""Scenes that a command proposes to choose from: numbered files with small pictures, or a sheet of all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.cli.pipes import refuse_stream
from clfractal.errors import FileError, SceneError, Where
from clfractal.exchange.program_folder import SHARED
from clfractal.files.atomic import atomic_writer, check_output, naming
from clfractal.files.document import write_document
from clfractal.files.inputs import refuse_overwriting
from clfractal.scene.model import Scene
from clfractal.scene.named_files import rename_files

if TYPE_CHECKING:
    from clfractal.images.framebuffer import Framebuffer

Pixels: TypeAlias = npt.NDArray[np.uint8]

CHANNELS = ("R", "G", "B", "A")
"""Of small pictures."""

# Pixels along a picture's longer side, if no size is given.
_LONGER_SIDE = 320


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposals:
    """Where scenes to choose from go.

    `output` is a folder for scenes and their pictures; or a picture, a sheet of all of them, with the scenes beside it.
    """

    output: Path = Path()
    sheet: Path | None = None
    count: int = 12

    @property
    def is_sheet(self) -> bool:
        """Whether the output is a picture of all of them."""
        return bool(self.output.suffix) and not self.output.is_dir()

    @property
    def folder(self) -> Path:
        """Where the scenes go."""
        return self.output.parent if self.is_sheet else self.output

    @property
    def sheets(self) -> tuple[Path, ...]:
        """The pictures of all of them that are wanted."""
        wanted = (self.output if self.is_sheet else None, self.sheet)
        return tuple(path for path in wanted if path is not None)

    def check(self, things: str, most: int) -> None:
        """Raises ClfractalError for a count out of range, and for standard output, which takes one file."""
        refuse_stream(self.output, f"{things} are several files; name a folder, or a file for the sheet")
        refuse_stream(self.sheet, "the sheet needs a file")
        if not 1 <= self.count <= most:
            raise SceneError(f"must be from 1 to {most}, got {self.count}", Where("--count"))

    def names(self, source: Path) -> list[str]:
        """The names of all files, without their endings, after that of the scene."""
        digits = max(2, len(str(self.count)))
        return [f"{source.stem}-{number:0{digits}d}" for number in range(1, self.count + 1)]

    def check_files(self, scene: Scene, names: Sequence[str]) -> None:
        """Refuses files that exist, and a folder that cannot be made, before anything is rendered."""
        suffixes = (".yaml",) if self.is_sheet else (".yaml", ".png")
        files = [self.folder / f"{name}{suffix}" for name in names for suffix in suffixes]
        refuse_existing((*self.sheets, *files), self.sheets)
        self.check_sheets()
        with self.folder_made():
            check_output(files[0], (".yaml",))
        refuse_overwriting([*files, *self.sheets], scene.files)

    @contextmanager
    def folder_made(self) -> Iterator[None]:
        """Makes the folder if it is missing; where nothing was written to it, it is gone again at the end."""
        missing = not self.folder.exists()
        with naming(self.folder, "cannot be made"):
            self.folder.mkdir(exist_ok=True)
        try:
            yield
        finally:
            if missing:
                with suppress(OSError):  # it holds something
                    self.folder.rmdir()

    def check_sheets(self) -> None:
        """Raises FileError for pictures of all that cannot be written."""
        from clfractal.images.formats import check_output as check_picture

        for sheet in self.sheets:
            check_picture(sheet)

    def write(self, name: str, text: str, heading: Sequence[str], framebuffer: Framebuffer) -> Path:
        """Writes a scene, and its small picture if there is no sheet of all; gives the scene's file.

        Args:
            text: the scene's.
            heading: lines of comments above it.
            framebuffer: the small picture.
        """
        if not self.is_sheet:
            # The picture holds the scene itself, rather than what made the picture small and quick.
            framebuffer.tell("scene", text)
            framebuffer.save(self.folder / f"{name}.png")
        path = self.folder / f"{name}.yaml"
        write_scene(path, text, heading)
        return path

    def save_sheets(self, pictures: Sequence[Pixels]) -> list[str]:
        """Writes the pictures of all; gives a line about each."""
        from clfractal.images.sheet import sheet_of

        for sheet in self.sheets:
            sheet_of(pictures, [str(number) for number in range(1, len(pictures) + 1)]).save(sheet)
        return [f"{sheet}: {len(pictures)} pictures, each with its number" for sheet in self.sheets]


def write_scene(path: Path, text: str, heading: Sequence[str]) -> None:
    """Writes a scene file with lines of comments above it."""
    comments = "".join(f"# {line if line.isprintable() else ascii(line)}\n" for line in heading)
    with atomic_writer(path) as beside:
        beside.write_bytes((comments + text).encode())


def refuse_existing(files: Sequence[Path], named: Sequence[Path]) -> None:
    """Raises FileError for files that exist; those among `named` were named as they are."""
    for file in files:
        if file.exists() or file.is_symlink():
            other = "name" if file in named else "folder with -o"
            raise FileError(f"exists already and is not replaced; choose another {other}", Where(str(file)))


def small_size(scene: Scene) -> tuple[int, int]:
    """The size of a small picture with the scene's proportions, pixels."""
    width, height = scene.image.width, scene.image.height
    shrink = _LONGER_SIDE / max(width, height)
    return max(1, round(width * shrink)), max(1, round(height * shrink))


class Moved:
    """Scene files for another folder: files that the scene names are named from there.

    Raises:
        FileError: a file is not in that folder or below, where the scene could not use it.
    """

    def __init__(self, source: Path, scene: Scene, folder: Path, things: str) -> None:
        self.source, self.base, self.folder, self.things = source, scene.folder, folder, things
        self._renamed(scene.resolved())

    def text(self, scene: Scene) -> str:
        """A scene as a file there has it."""
        return write_document(self.plain(scene))

    def plain(self, scene: Scene) -> dict[str, Any]:
        """The keys that were given or changed; they load to an equal scene."""
        given = scene.model_dump(mode="json", exclude_unset=True)
        given["formula"] = scene.formula.mapping()
        short = {name: value for name, value in given.items() if value not in (None, {}) or name == "formula"}
        plainest = Scene.model_validate({"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}})
        for name in ("lights", "cut_planes"):
            if getattr(scene, name) == getattr(plainest, name):
                short.pop(name, None)
        self._renamed(short)
        return short

    def _renamed(self, data: dict[str, Any]) -> None:
        layout = data.get("layout") or {}
        for part in (data, *layout.get("views", ())):
            for name in ("environment", "renderer", "lights"):
                rename_files(part.get(name), self._from_there)
            for name in ("materials", "objects"):  # whose names are the user's
                rename_files(list((part.get(name) or {}).values()), self._from_there)

    def _from_there(self, file: str) -> str:
        if file.startswith(SHARED):
            return file
        whole = (self.base / file).resolve()
        try:
            return whole.relative_to(self.folder.resolve()).as_posix()
        except ValueError:
            raise FileError(
                f"uses {file[:80]!r}, which must lie in the {self.things}' folder or below; write them to {self.base}"
                " with -o",
                Where(str(self.source)),
            ) from None
