"""`clfractal import`: a scene file of one of another program, and a line for all that it leaves out."""

from __future__ import annotations

import os
from pathlib import Path

from clfractal.cli.shell import Shell
from clfractal.errors import ClfractalError, FileError, Where, unknown_name
from clfractal.files.atomic import atomic_writer, check_output
from clfractal.files.file_kinds import OF_OTHERS, kind_of
from clfractal.files.inputs import refuse_overwriting

EXTENSIONS = (".yaml", ".yml")


def import_scene(
    source: str, output: Path | None, look: str, formulas: Path | None, preset: str | None, shell: Shell
) -> None:
    """Writes the scene of a file of another program, which was checked as every scene is; pictures that it names go along.

    Args:
        output: the scene file; None: one of the same name in the current folder, which is not there yet.
        look: one of LOOKS.
        formulas: the folder with the texts of formulas; None: where the program is installed.
        preset: the name of a fragment's preset; None: `Default`, else the first one.

    Raises:
        ClfractalError: the file cannot be read or is none, has what has no counterpart, or the scene cannot be written.
    """
    # Here, as other commands do not need it.
    from clfractal.exchange.kinds import import_file
    from clfractal.exchange.look import LOOKS
    from clfractal.scene.load import load_scene
    from clfractal.scene.named_files import rename_files
    from clfractal.viewer.named import carried, data_files

    if look not in LOOKS:
        raise FileError(unknown_name("look", look, LOOKS), Where("--look"))
    path = output or Path(Path(source).stem + EXTENSIONS[0])
    check_output(path, EXTENSIONS)
    if output is None and os.path.lexists(path):
        raise FileError("exists already and is not replaced; name another file by -o", Where(str(path)))
    refuse_overwriting([path], [source])
    found = import_file(Path(source), next(each for each in LOOKS if each == look), formulas, preset)
    folder = Path(source).parent
    try:
        scene = load_scene(found.scene, folder=folder)
    except ClfractalError as error:
        raise type(error)(error.message, Where(source, path=error.where.path)) from error
    along = carried(None, folder, data_files(scene), folder, path)
    for part in ("environment", "materials"):
        rename_files(found.scene.get(part), lambda file: along.names[file] or file)
    along.copy()
    try:
        with atomic_writer(path) as beside:
            beside.write_text(found.text(Path(source).name), encoding="utf-8")
    except BaseException:
        along.undo()
        raise
    for copy in along.made:
        shell.say(f"{copy}: a picture that the scene names, from {folder}")
    for line in (*found.origins, *found.remarks):
        shell.say(f"{source}: {line}")
    shell.say(f"{path}: {_counted(len(found.remarks))} not taken over")


def tell_left(source: str, shell: Shell) -> None:
    """Says how much of a file of another program that is used as a scene was not taken over."""
    path = Path(source)
    if not (path.is_file() and kind_of(path) in OF_OTHERS):
        return
    from clfractal.exchange.kinds import import_file

    count = len(import_file(path).remarks)
    if count:
        shell.say(f"{source}: {_counted(count)} not taken over; `clfractal import` tells what")


def _counted(count: int) -> str:
    return "1 thing is" if count == 1 else f"{count} things are"
