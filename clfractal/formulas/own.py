"""Formulas of one's own, found by name: beside a scene, and in the folders of CLFRACTAL_FORMULAS.

The library's names win, then the folder beside the scene, then the folders of the variable in their order.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from clfractal.errors import FileError, FormulaError, Where, unknown_name
from clfractal.files.resources import folder

FOLDERS_VARIABLE = "CLFRACTAL_FORMULAS"
FOLDER = "formulas"
_ENDINGS = (".yaml", ".yml")


def library_names() -> tuple[str, ...]:
    """All names of the library, sorted: nobody else's formulas may have them."""
    return tuple(sorted(path.stem for path in folder("formulas/library").glob("*.yaml")))


def own_files(beside: Path | None) -> Mapping[str, Path]:
    """The files by name, sorted; no name of the library is among them.

    `beside` is the folder of the scene, whose folder `formulas` is looked into; None: that of the variable alone.

    Raises:
        FileError: a folder of the variable is not there, or a folder cannot be read.
    """
    found: dict[str, Path] = {}
    folders = [beside / FOLDER] if beside is not None and os.path.isdir(beside / FOLDER) else []
    for text in filter(None, os.environ.get(FOLDERS_VARIABLE, "").split(os.pathsep)):
        if not os.path.isdir(text):
            raise FileError(f"there is no folder {text!r}", Where(FOLDERS_VARIABLE))
        folders.append(Path(text))
    for each in folders:
        try:
            inside = sorted(os.listdir(each))
        except OSError as error:
            raise FileError(f"cannot be read: {error.strerror}", Where(str(each))) from error
        for path in map(each.joinpath, inside):
            if path.suffix in _ENDINGS and os.path.isfile(path):
                found.setdefault(path.stem, path)
    return {name: found[name] for name in sorted(found.keys() - {*library_names()})}


def find_own(name: str, beside: Path | None, where: Where) -> Path | None:
    """The file of a formula that is not in the library; None for one that is.

    A file in the folder beside the scene must lie within the scene's folder, links followed.

    Raises:
        FormulaError: there is none of that name, with the nearest name over all.
        FileError: a folder of the variable is not there, a folder cannot be read, or the file leads out of the scene's
            folder.
    """
    library = library_names()
    if name in library:
        return None
    try:
        files = own_files(beside)
    except FileError as error:
        raise FileError(f"{error}; {unknown_name('formula', name, library)}", where) from error
    if name not in files:
        raise FormulaError(unknown_name("formula", name, (*library, *files)), where)
    path = files[name]
    if beside is not None and path.parent == beside / FOLDER:
        check_inside(path, beside, str(path)[:200], where)
    return path


def check_inside(path: Path, folder: Path, shown: str, where: Where) -> None:
    """Refuses a file that a link leads out of a scene's folder; `shown` is the path as the user knows it.

    Raises:
        FileError: it lies elsewhere, or its links cannot be followed.
    """
    try:
        real, base = path.resolve(), folder.resolve()
    except (OSError, RuntimeError) as error:
        raise FileError(f"cannot be read: {shown}", where) from error
    if not real.is_relative_to(base):
        raise FileError(f"leads out of the scene's folder: {shown!r}", where)


def safe_path(text: str, base_folder: Path, where: Where) -> Path:
    """The path of a file named in a scene, which must stay inside the scene's folder.

    Raises:
        FileError: an absolute path, one that leads out of the folder, by `..` or by a link.
    """
    path = Path(text)
    if not text or "\0" in text or path.is_absolute() or ".." in path.parts or path.drive:
        raise FileError(f"must be a path inside the scene's folder, got {text[:80]!r}", where)
    full = base_folder / path
    check_inside(full, base_folder, text[:80], where)
    return full
