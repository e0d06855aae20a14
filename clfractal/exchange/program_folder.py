"""Where the Mandelbulber 2 that the user has installed is, and the pictures that come with it."""

from __future__ import annotations

from pathlib import Path

PLACES = (
    "/usr/share/mandelbulber2",
    "/usr/local/share/mandelbulber2",
    "/Applications/mandelbulber2.app/Contents/Resources",
    "C:/Program Files/Mandelbulber v2",
)
"""Where its installers put it."""
SHARED = "mandelbulber:"
"""What names of pictures begin with, in scenes, that come with it."""


def program_folder() -> Path | None:
    """The program's folder; None if it is not installed."""
    return next((Path(place) for place in PLACES if (Path(place) / "formula").is_dir()), None)


def pictures_folder() -> Path | None:
    """The folder of its pictures; None if there is none."""
    program = program_folder()
    pictures = None if program is None else program / "textures"
    return pictures if pictures is not None and pictures.is_dir() else None
