"""Saves a scene from the window: as the text that it came from, with what has changed."""

from __future__ import annotations

from pathlib import Path

from clfractal.errors import FileError, Where
from clfractal.files.atomic import atomic_writer, check_output
from clfractal.scene.load import check_scene
from clfractal.scene.model import Scene
from clfractal.viewer.formula_texts import FormulaTexts
from clfractal.viewer.named import carried, data_files, formula_files, renamed
from clfractal.viewer.own_files import is_own
from clfractal.viewer.rewriting import formula_as_written, rewritten
from clfractal.viewer.sources import (
    SceneSource,
    is_picture,
    is_protected,
    open_source,
    same_file,
    suggested_name,
)

__all__ = ["SceneSource", "is_protected", "open_source", "save_scene", "scene_text", "suggested_name"]

EXTENSIONS = (".yaml", ".yml")


def scene_text(source: SceneSource, present: Scene, texts: FormulaTexts | None = None) -> str:
    """The present scene as YAML text: that of its source, with what has changed.

    It loads to an equal scene from the scene's folder. A formula file stays named if it still holds the formula that
    is shown; otherwise the formula is written into the text.
    """
    return rewritten(source, present, present.folder, {}, texts)[0]


def save_scene(
    source: SceneSource,
    present: Scene,
    target: Path,
    *,
    even_if_changed: bool = False,
    texts: FormulaTexts | None = None,
) -> SceneSource:
    """Writes the present scene into a file, which appears complete or not at all.

    In another folder than the scene's, formula files, maps and grids that it names are copied beside the file, unless
    they are below that folder anyway. If another file there has the name of a map or grid, the copy gets a free name,
    and so the saved scene differs from `present` in that name: the window goes on with `loaded` of the result.

    Args:
        texts: of formulas that were typed in the window.
        even_if_changed: replace the source's own file even if its text has changed since it was read.

    Returns:
        the new source: this file, its text, and the scene that it stands for.

    Raises:
        FileError: the target is protected, is named by the scene, has changed, is no YAML file, or cannot be written;
            or a file that the scene names cannot go along.
        SceneError: the scene contradicts itself, so no text would load.
    """
    check_scene(present)
    _check_target(source, present, target, even_if_changed)
    folder = target.parent
    elsewhere = not same_file(present.folder, folder)
    data = data_files(present) if elsewhere else []
    formula = None if same_file(source.folder, folder) else formula_as_written(source, present)
    files = carried(formula, source.folder, data, present.folder, target)
    saved = renamed(present, {name: new for name in data if (new := files.names[name]) is not None})
    files.copy()
    try:
        text, inline = rewritten(source, saved, folder, files.names, texts)
        with atomic_writer(target) as beside:
            beside.write_bytes(text.encode())
    except BaseException:
        files.undo()
        raise
    if inline:
        files.undo(formulas=True)
    return SceneSource("scene", target, text, saved.placed(folder) if elsewhere else saved)


def _check_target(source: SceneSource, present: Scene, target: Path, even_if_changed: bool) -> None:
    where = Where(str(target))
    own = source.kind == "scene" and source.path is not None and same_file(source.path, target)
    # A scene file may have been given any extension; it keeps it.
    check_output(target, (*EXTENSIONS, target.suffix.lower()) if own else EXTENSIONS)
    if is_own(target):
        raise FileError("comes with the program and is never overwritten; choose another name", where)
    if is_picture(target):
        raise FileError("is no scene file and is never overwritten; choose another name", where)
    named = [*formula_files(source.formula, source.folder), *data_files(present)]
    folders = {source.folder, present.folder}
    if any(same_file(folder / name, target) for folder in folders for name in named):
        raise FileError("is a file that the scene names; choose another name", where)
    if own and source.changed_on_disk and target.exists() and not even_if_changed:
        raise FileError("has changed on the disk since it was read; reload it, or choose another name", where)
