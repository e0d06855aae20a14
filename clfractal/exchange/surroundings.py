"""The picture behind the set of a settings file, as a scene's environment.

Files name pictures by paths of whoever wrote them. They are looked for beside the settings file and among the pictures of
the program that is installed, and nowhere else.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from clfractal.exchange.parameters import rotation
from clfractal.exchange.placing import placing_of
from clfractal.exchange.program_folder import SHARED, pictures_folder
from clfractal.exchange.settings import Section, Settings
from clfractal.exchange.view import is_mirrored
from clfractal.files.map_directions import Doubles, lying

SHARED_DIR = "$SHARED_DIR/"
_DEFAULT = f"{SHARED_DIR}textures/background.jpg"
TEXTURES = "textures"
_MAPPINGS = ("equirectangular", "double hemisphere", "flat")
_LONGEST = 500


def environment_of(
    settings: Settings, amount: Callable[[float], float], remarks: list[str]
) -> dict[str, Any] | None:
    """The section `environment`, which lights nothing; None if there is no picture, or it was not found.

    Args:
        amount: an amount of light of theirs as one of ours.

    Raises:
        FileError: a value is none of its kind.
    """
    main = settings.main
    own = [*main.beginning("background_texture_", "textured_background", "file_background")]
    own += ["background_rotation", "background_h_scale", "background_v_scale"]
    main.without(own)
    if not main.flag("textured_background", False):
        return None
    mapping = _mapping(main)
    if mapping != _MAPPINGS[0]:
        remarks.append(
            f"textured_background_map_type: a picture behind the set that is {mapping} is not taken over"
        )
        return None
    text = main.text("file_background", _DEFAULT).strip()
    file = picture_named(text, Path(settings.file).parent)
    if file is None:
        remarks.append(
            f"file_background: {text[:_LONGEST]!r} was not found beside the file, nor among the program's pictures"
        )
        return None
    across = main.number("background_texture_offset_x", 0.0)
    for key, usual in (("h_scale", 1.0), ("v_scale", 1.0), ("texture_offset_y", 0.0)):
        value = main.number(f"background_{key}", usual)
        if value != usual:
            remarks.append(f"background_{key}: {value:g} is not taken over; the picture is around once")
    # A part of the width is an angle about the picture's own z; angles are about z, x and y, as their pictures show.
    first, second, third = main.vector("background_rotation")
    turned = np.linalg.multi_dot(
        [
            np.array(rotation(angles))
            for angles in ((0.0, 0.0, first - 360 * across), (second, 0.0, 0.0), (0.0, third, 0.0))
        ]
    )
    return {
        "file": file,
        "stretch": True,
        "intensity": amount(main.number("background_brightness", 1.0)),
        **lying_there(settings, turned),
        "rays": 0,
    }


def lying_there(settings: Settings, matrix: Doubles | None = None) -> dict[str, Any]:
    """The keys of an environment that say how it lies around the set of our scene.

    Args:
        matrix: from directions in their space to those in the picture; None: they are the same.
    """
    whole = np.eye(3) if matrix is None else matrix
    placing = placing_of(settings)
    if placing is not None:
        whole = whole @ np.array(placing.turn).T
    if is_mirrored(settings):
        whole = whole @ np.diag([1.0, 1.0, -1.0])
    up, angle, mirrored = lying(whole)
    found: dict[str, Any] = {}
    top = [round(each, 9) + 0.0 for each in up]
    if top != [0.0, 0.0, 1.0]:
        found["up"] = top
    if round(angle, 6):
        found["rotation"] = round(angle, 6)
    if mirrored:
        found["mirrored"] = True
    return found


def picture_named(text: str, folder: Path) -> str | None:
    """How a scene in a folder names the picture that a settings file there names; None if it was not found.

    A path in the folder or below is that, and of any other the name: beside the settings file, in `textures` there, or
    among the pictures of the program that is installed.
    """
    path = PurePosixPath(text.replace("\\", "/"))
    shared = text.startswith(SHARED_DIR)
    name = path.name
    if not name or len(text) > _LONGEST or not text.isprintable():
        return None
    beside = [PurePosixPath(name), PurePosixPath(TEXTURES) / name]
    if not (shared or path.is_absolute() or ".." in path.parts or ":" in path.parts[0]):
        beside.insert(0, path)
    installed = pictures_folder()
    there = installed is not None and _is_file(installed / name, installed)
    found = next((str(each) for each in beside if _is_file(folder / each, folder)), None)
    if there and (shared or found is None):
        return SHARED + name
    return found


def _is_file(path: Path, folder: Path) -> bool:
    """Whether there is such a file; scenes do not follow links out of their folders."""
    try:
        return path.is_file() and path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        return False


def _mapping(main: Section) -> str:
    key = "textured_background_map_type"
    words = {word.split()[-1]: number for number, word in enumerate(_MAPPINGS)}
    word = main.text(key).strip().rpartition("_")[2].lower()
    number = words[word] if word in words else main.whole(key, 0)
    return _MAPPINGS[number] if 0 <= number < len(_MAPPINGS) else str(number)
