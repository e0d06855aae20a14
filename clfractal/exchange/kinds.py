"""The files of other programs that are scenes, each read by its own module."""

from __future__ import annotations

from pathlib import Path

from clfractal.errors import FileError, Where
from clfractal.exchange.look import Look
from clfractal.exchange.mandelbulber import Imported, import_settings
from clfractal.files.file_kinds import kind_of


def import_file(
    path: Path, look: Look = "same", formulas: Path | None = None, preset: str | None = None
) -> Imported:
    """Reads a file of another program as a scene: settings of Mandelbulber 2, or a fragment of FragM.

    Args:
        look, formulas: for settings, see `import_settings`.
        preset: for fragments, see `import_fragment`.

    Raises:
        FileError: the file cannot be read, is none of these, or has what has no counterpart.
    """
    if kind_of(path) == "fragment":
        # Here, as settings need nothing of it.
        from clfractal.exchange.fragm import import_fragment

        if look != "same" or formulas is not None:
            raise FileError("is for settings of Mandelbulber", Where("--formulas" if formulas else "--look"))
        return import_fragment(path, preset)
    if preset is not None:
        raise FileError("is for fragments of FragM (.frag)", Where("--preset"))
    return import_settings(path, look, formulas)
