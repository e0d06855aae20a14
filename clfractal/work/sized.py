"""The same picture with another number of pixels."""

from __future__ import annotations

from typing import Any

from clfractal import arguments
from clfractal.errors import SceneError, Where
from clfractal.scene.checks import check_parts
from clfractal.scene.model import Scene
from clfractal.scene.parts import MAX_PIXELS, MAX_SIDE


def with_size(scene: Scene, size: Any) -> Scene:
    """The scene at another size; it shows what its own size shows (see `Image.resized`).

    Args:
        size: width and height of the picture, pixels.

    Raises:
        SceneError: the size is none, too large, or one that the scene's stereo mode or layout cannot have.
    """
    width, height = arguments.numbers("size", size, 2, "width and height in pixels")
    if not (min(width, height) >= 1 and max(width, height) <= MAX_SIDE and width * height <= MAX_PIXELS):
        limits = f"must be from 1 to {MAX_SIDE} pixels a side, and {MAX_PIXELS:,} in all"
        raise SceneError(f"{limits}; got {width} x {height}", Where(path="size"))
    found = scene.model_copy(update={"image": scene.image.resized(width, height)})
    try:
        check_parts(found)
    except SceneError as error:
        if error.where.path and error.where.path.startswith("image"):
            raise SceneError(error.message, Where(path="size")) from error
        raise
    return found
