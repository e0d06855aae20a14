"""Where a scene came from, and which files are never overwritten."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any, Literal

from clfractal.errors import ClfractalError, FileError, SceneError
from clfractal.files import embedded
from clfractal.files.document import read_document
from clfractal.files.file_kinds import OF_OTHERS, kind_of
from clfractal.files.inputs import noting
from clfractal.files.regular import read_text_file
from clfractal.scene.load import SceneText, load_scene, read_text
from clfractal.scene.model import Scene
from clfractal.viewer.formula_texts import formula_text_in
from clfractal.viewer.named import formula_files
from clfractal.viewer.own_files import is_own
from clfractal.viewer.shared import Group, groups_of

Kind = Literal["scene", "picture", "shipped", "none"]


@dataclass(frozen=True)
class SceneSource:
    """Where a scene came from.

    Attributes:
        kind: a scene file of the user's; a picture that holds a scene; a scene that comes with the program; nothing.
        path: the file; None for `none`.
        text: what was read, YAML or JSON; empty for `none`.
        loaded: the scene that the text alone stands for, without values of `--set`; None if it stands for none.
    """

    kind: Kind = "none"
    path: Path | None = None
    text: str = ""
    loaded: Scene | None = None

    @property
    def folder(self) -> Path:
        """The folder that the names of files in the text are relative to."""
        return self.path.parent if self.path is not None else Path()

    @property
    def formula(self) -> Any:
        """The formula section as it was written; None if there is none."""
        try:
            section = read_document(self.text).root.child("formula")
        except SceneError:
            return None
        return section.plain() if section is not None else None

    @cached_property
    def formula_text(self) -> tuple[Any, str] | None:
        """The formula that is written out in the text, and how: see `formula_text_in`."""
        return formula_text_in(self.text)

    @cached_property
    def formula_file_text(self) -> tuple[Any, str] | None:
        """The formula of the file that the text names, and the file's text; None if it names none."""
        formula = self.formula
        name = formula.get("file") if isinstance(formula, dict) else None
        if not isinstance(name, str):
            return None
        try:
            text = read_text_file(self.folder / name)
            return read_document(text).root.plain(), text
        except ClfractalError:
            return None

    @cached_property
    def shared(self) -> tuple[Group, ...]:
        """The values that the text names once and uses at several places."""
        return groups_of(self.text)

    @property
    def watched(self) -> tuple[Path, ...]:
        """The files whose change changes the scene's text: its own, and the formula files that it names."""
        if self.path is None:
            return ()
        names = formula_files(self.formula, self.folder)
        return (self.path, *(self.folder / name for name in names))

    @property
    def changed_on_disk(self) -> bool:
        """Whether the file holds another text by now, or none."""
        if self.path is None:
            return False
        try:
            return read_text(self.path) != self.text
        except ClfractalError:
            return True


def open_source(path: str | Path) -> SceneSource:
    """Reads a scene file, or a picture that holds a scene, and the scene in it.

    Raises:
        SceneError, FormulaError: something in the text is wrong.
        FileError: a file cannot be read.
    """
    found = Path(path)
    with noting() as files:
        text = read_text(found)
    loaded = load_scene(SceneText(read_document(text, str(path)), found.parent, tuple(files)), posed=False)
    kind: Kind = "picture" if is_picture(found) else "shipped" if is_own(found) else "scene"
    return SceneSource(kind, found, text, loaded)


def is_protected(path: Path) -> bool:
    """Whether a file must never be overwritten: it comes with the program, is a picture, or another program's.

    Links are followed.
    """
    return is_own(path) or is_picture(path)


def suggested_name(source: SceneSource, folder: Path) -> Path:
    """A free name for a scene that cannot be saved where it came from, such as `mandelbulb-2.yaml`."""
    stem, number = "scene", 1
    if source.path is not None:
        found = re.fullmatch(r"(.+?)(?:-(\d{1,6}))?", source.path.stem)
        if found is not None:
            stem, number = found[1], int(found[2] or 1) + 1
    names = (f"{stem}-{each}.yaml" if each > 1 else f"{stem}.yaml" for each in count(number))
    return next(folder / name for name in names if not os.path.lexists(folder / name))


def is_picture(path: Path) -> bool:
    """Whether a file is a picture of a format that may hold a scene, or a file of another program.

    A scene is read from it, and never saved into it.
    """
    try:
        return embedded.is_picture(path) or kind_of(path) in OF_OTHERS
    except FileError:
        return False


def same_file(one: Path, other: Path) -> bool:
    """Whether two paths lead to the same file; if one does not exist, whether they are the same path."""
    try:
        return one.samefile(other)
    except OSError:
        return one.absolute() == other.absolute()
