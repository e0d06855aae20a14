"""The files that a scene names, and which of them go along when the scene is saved in another folder."""

from __future__ import annotations

import filecmp
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any

from clfractal.errors import ClfractalError, FileError, Where
from clfractal.exchange.program_folder import SHARED
from clfractal.files.atomic import atomic_writer
from clfractal.files.document import read_document
from clfractal.files.regular import read_bytes, read_text_file
from clfractal.formulas.own import safe_path
from clfractal.scene.layout import LayoutView
from clfractal.scene.lighting import Environment
from clfractal.scene.model import Scene
from clfractal.scene.named_files import (
    grid_files,
    light_files,
    texture_files,
    with_grids,
    with_light_files,
    with_textures,
)
from clfractal.scene.volume import VolumeRenderer

_DEEPEST = 3
_HEADER_BYTES = 65_536
_DATA_FILE = re.compile(rb"^data ?file:[ \t]*(.+?)[ \t]*\r?$", re.IGNORECASE | re.MULTILINE)


def formula_files(formula: Any, folder: Path, *, depth: int = 0) -> list[str]:
    """Names of the formula files in a formula section as it was written, and of those that these files name.

    All are relative to the scene's folder. A file that cannot be read names no others.
    """
    found = list(_files_of(formula))
    if depth < _DEEPEST:
        for name in tuple(found):
            found += formula_files(_formula_in(name, folder), folder, depth=depth + 1)
    return list(dict.fromkeys(found))


def data_files(scene: Scene) -> list[str]:
    """Names of the maps, grids, textures and tables of lights of a scene and its views, relative to the scene's folder."""
    parts: list[Scene | LayoutView] = [scene, *(scene.layout.views if scene.layout is not None else ())]
    found = []
    for part in parts:
        if part.environment is not None and part.environment.file is not None:
            found.append(part.environment.file)
        if isinstance(part.renderer, VolumeRenderer) and part.renderer.file is not None:
            found.append(part.renderer.file)
        found += [file for _, file in light_files(part.lights or ())]
    return list(dict.fromkeys([*found, *texture_files(scene.materials), *grid_files(scene.objects)]))


def renamed(scene: Scene, names: Mapping[str, str]) -> Scene:
    """The scene with other names of its maps, grids, textures and tables of lights."""
    changes = _renamed_parts(scene, names)
    for key, change in (("materials", with_textures), ("objects", with_grids)):
        changed = change(getattr(scene, key), names)
        if changed != getattr(scene, key):
            changes[key] = changed
    if scene.layout is not None:
        views = tuple(
            view.model_copy(update=parts) if (parts := _renamed_parts(view, names)) else view
            for view in scene.layout.views
        )
        if views != scene.layout.views:
            changes["layout"] = scene.layout.model_copy(update={"views": views})
    return scene.model_copy(update=changes) if changes else scene


@dataclass
class Carried:
    """How the files that a scene names are reached from another folder.

    Attributes:
        names: old names -> new ones, of formula files, maps and grids; None for a formula file that cannot go along
            because the files that it names have other names there.
        target: where the scene will be, so that nothing is copied there.
        copies: files to copy -> where to.
        formulas: those of the copies that are formula files.
        made: the copies that `copy` has made.
    """

    target: Path | None = None
    names: dict[str, str | None] = field(default_factory=dict)
    copies: dict[Path, Path] = field(default_factory=dict)
    formulas: set[Path] = field(default_factory=set)
    made: list[Path] = field(default_factory=list)

    def copy(self) -> None:
        """Copies the files; FileError if one cannot be read or written, and then none is left."""
        for source, target in self.copies.items():
            try:
                target.parent.mkdir(parents=True, exist_ok=True)
                with atomic_writer(target) as beside:
                    shutil.copyfile(source, beside)
            except (FileError, OSError) as error:
                self.undo()
                if isinstance(error, FileError):
                    raise
                raise FileError(f"cannot be copied: {error.strerror}", Where(str(source))) from error
            self.made.append(target)

    def undo(self, *, formulas: bool = False) -> None:
        """Removes the copies; with `formulas` only those of formula files: the formula is written into the scene."""
        for target in [each for each in self.made if not formulas or each in self.formulas]:
            with suppress(OSError):
                target.unlink()
            self.made.remove(target)


def carried(formula: Any, formula_folder: Path, data: list[str], data_folder: Path, target: Path) -> Carried:
    """Plans how the files that a scene names are reached from the file `target`; nothing is copied yet.

    A file below the target's folder is named there, and a picture of another program where that has it. Any other is
    copied: under its own name, or under a free one if another file has that.

    Args:
        formula: the formula section as it was written, and the folder that its files are relative to.
        data: maps and grids, and the folder that they are relative to.

    Raises:
        FileError: a map or grid is missing, or out of its folder.
    """
    new = target.parent
    plan = Carried(target)
    for name in data:
        shared = name.startswith(SHARED)
        plan.names[name] = (
            name if shared else _place(plan, name, _companions(data_folder, name), data_folder, new)
        )
    for name in _files_of(formula):
        inner = formula_files(_formula_in(name, formula_folder), formula_folder, depth=1)
        try:
            trial = Carried(target, copies=dict(plan.copies))
            if any(_place(trial, other, [], formula_folder, new) != other for other in inner):
                raise FileError("has another name there", Where(name))
            plan.names[name] = _place(trial, name, [], formula_folder, new)
            plan.formulas |= {place for each, place in trial.copies.items() if each not in plan.copies}
            plan.copies = trial.copies
        except FileError:
            plan.names[name] = None
    return plan


def _files_of(formula: Any) -> Iterator[str]:
    """The files that a formula section, or a formula file's mapping, names itself."""
    if not isinstance(formula, Mapping):
        return
    if isinstance(formula.get("file"), str):
        yield formula["file"]
    for inner in (formula.get("inline"), *_links(formula)):
        yield from _files_of(inner)


def _links(formula: Mapping[str, Any]) -> list[Any]:
    links = formula.get("chain")
    return links if isinstance(links, list) else []


def _formula_in(name: str, folder: Path) -> Any:
    try:
        path = safe_path(name, folder, Where())
        return read_document(read_text_file(path), name).plain()
    except ClfractalError:
        return None


def _renamed_parts(part: Scene | LayoutView, names: Mapping[str, str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, kind in (("environment", Environment), ("renderer", VolumeRenderer)):
        section = getattr(part, key)
        if (
            isinstance(section, kind)
            and section.file is not None
            and names.get(section.file, section.file) != section.file
        ):
            found[key] = section.model_copy(update={"file": names[section.file]})
    if part.lights is not None and (lights := with_light_files(part.lights, names)) != part.lights:
        found["lights"] = lights
    return found


def _companions(folder: Path, name: str) -> list[str]:
    """Files that belong to a grid, relative to its own folder: a NRRD's data, what an NPY's numbers mean."""
    path = folder / name
    if path.suffix.lower() == ".npy":
        beside = path.with_name(path.name + ".json")
        return [beside.name] if beside.is_file() else []
    try:
        start = read_bytes(path, prefix=_HEADER_BYTES)
    except FileError:
        return []
    header = re.split(rb"\r?\n\r?\n", start, maxsplit=1)[0]
    found = _DATA_FILE.search(header) if start.startswith(b"NRRD") else None
    if found is None:
        return []
    try:
        data = found[1].decode()
        safe_path(data, path.parent, Where(name))
    except (FileError, UnicodeDecodeError):
        return []
    return [data]


def _place(plan: Carried, name: str, companions: list[str], old: Path, new: Path) -> str:
    """The new name of a file, which is added to the files to copy unless the new folder has it already."""
    source = safe_path(name, old, Where(name))
    if not source.is_file():
        raise FileError("is missing, so it cannot go along with the scene", Where(str(source)))
    with suppress(ValueError):
        return source.resolve().relative_to(new.resolve()).as_posix()
    plain = candidate = Path(name)
    for number in count(2):
        safe_path(candidate.as_posix(), new, Where(name))
        wanted = {source: new / candidate}
        wanted |= {source.parent / each: (new / candidate).parent / each for each in companions}
        if all(_is_free(plan, one, other) for one, other in wanted.items()):
            plan.copies |= {one: other for one, other in wanted.items() if not other.exists()}
            break
        numbered = f"{plain.stem}-{number}"
        # The names of companions stand in the file, so that they need a folder of their own.
        beside = plain.parent / numbered / plain.name if companions else None
        candidate = beside or plain.with_name(f"{numbered}{plain.suffix}")
    return candidate.as_posix()


def _is_free(plan: Carried, source: Path, target: Path) -> bool:
    """Whether a place is empty, or already holds the same file."""
    if target == plan.target or any(
        target == taken and source != other for other, taken in plan.copies.items()
    ):
        return False
    if not target.exists():
        return not target.is_symlink()
    try:
        return target.is_file() and filecmp.cmp(source, target, shallow=False)
    except OSError:
        return False
