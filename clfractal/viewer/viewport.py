"""The size of pictures in a window, and which changes of a scene need new rays."""

from __future__ import annotations

from clfractal.images.modes import BELOW, BESIDE
from clfractal.scene.model import Scene
from clfractal.scene.parts import Output
from clfractal.scene.stereo import APART, Mode, Stereo

# Modes that show both eyes' pictures in full size: changing from one to another needs no new rays.
_WHOLE: tuple[Mode, ...] = (
    "left",
    "right",
    "pair",
    "multi_view",
    "split",
    "over_under",
    "rows",
    "columns",
    "checkerboard",
    "anaglyph_chessboard",
    "anaglyph",
)


def image_of(stereo: Stereo | None, viewport: tuple[int, int]) -> tuple[int, int]:
    """The size of a scene's `image` that fills a viewport, pixels.

    Squeezed modes need even sizes; a pixel of the window may then stay empty.
    """
    width, height = viewport
    if stereo is None:
        return width, height
    if stereo.mode in APART or stereo.mode == "split":
        width //= 2
    elif stereo.mode == "over_under":
        height //= 2
    elif stereo.mode in BESIDE:
        width -= width % 2
    elif stereo.mode in BELOW:
        height -= height % 2
    return max(width, 1), max(height, 1)


def render_key(scene: Scene) -> Scene:
    """The scene without what only concerns showing and saving: pictures of scenes with equal keys have the same rays."""
    # (An exposure that has to be measured is measured with the picture.)
    exposure = scene.output.exposure if isinstance(scene.output.exposure, str) else 0.0
    update: dict[str, object] = {"output": Output.model_validate({"exposure": exposure}), "bookmarks": {}}
    if scene.animation is not None and (scene.animation.frame is None or scene.animation.shutter == 0):
        update["animation"] = None  # only a shutter makes it a part of the picture
    if scene.stereo is not None:
        plain = Stereo.model_validate({})
        shown = {name: getattr(plain, name) for name in ("swap", "method", "glasses", "colors")}
        mode = "pair" if scene.stereo.mode in _WHOLE else scene.stereo.mode
        update["stereo"] = scene.stereo.model_copy(update={**shown, "mode": mode})
    return scene.model_copy(update=update)
