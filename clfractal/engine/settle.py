"""Measures what a scene leaves open before it is rendered: a pair's fit, focus and exposure.

Each is measured by a preview at the whole picture and replaced by what was found. So a region, either eye, a resumed
picture, and the scene in a picture's header all have the same numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import seen_by, shown_views
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.model import Scene
from clfractal.scene.parts import OrthographicCamera, PerspectiveCamera
from clfractal.scene.stereo import Eye

if TYPE_CHECKING:
    from clfractal.engine.preview import Preview
    from clfractal.images.framebuffer import Framebuffer

Floats = npt.NDArray[np.float64]
Camera = PerspectiveCamera | OrthographicCamera

# The linear luminance that the brightest hundredth of what is seen begins at (0.88 of white on a screen), and the least
# mean, two stops below a medium grey. Artists' exposures agree much better in the first than in the mean: over the shipped
# scenes it varies by half a stop, the median by nine tenths.
HIGHLIGHT = 0.75
LEAST_MEAN = 0.045
_BRIGHTEST = 0.99
# What is seen counts, and not the background, if it takes up at least this part of the picture.
_LEAST_SEEN = 0.01
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_FARTHEST = 1e6


def is_settled(scene: Scene) -> bool:
    """Whether nothing is left to be measured."""
    stereo = scene.stereo
    if (stereo is not None and stereo.fit is not None) or isinstance(scene.output.exposure, str):
        return False
    own = [view.camera for view in scene.layout.views] if scene.layout is not None else []
    return not any(_wants_focus(camera) for camera in (scene.camera, *own))


def settled(scene: Scene, preview: Preview) -> Scene:
    """The scene with numbers in the place of what is to be measured; the same scene if that is nothing.

    Raises:
        SceneError: `stereo.fit` finds an empty picture.
        DeviceError, KernelBuildError: as of a render.
    """
    if is_settled(scene):
        return scene
    from clfractal.engine.comfort import fitted

    return exposed(focused(fitted(scene, preview), preview), preview)


def focused(scene: Scene, preview: Preview) -> Scene:
    """The scene with a `focus_distance` for each camera that asks for one.

    A camera that several views of a layout share is focused in the first of them. In an empty picture the default distance
    stays.

    Raises:
        DeviceError, KernelBuildError: as of a render.
    """
    if scene.layout is None:
        return scene.model_copy(update=_focused(scene.camera, _middle_views(scene)[:1], preview))
    shared, changed = [], []
    for own, (view, eye) in zip(scene.layout.views, _middle_views(scene), strict=True):
        if own.camera is None:
            shared.append((view, eye))
            changed.append(own)
        else:
            changed.append(own.model_copy(update=_focused(own.camera, [(view, eye)], preview)))
    layout = scene.layout.model_copy(update={"views": tuple(changed)})
    return scene.model_copy(update={**_focused(scene.camera, shared, preview), "layout": layout})


def exposed(scene: Scene, preview: Preview) -> Scene:
    """The scene with a number for `output.exposure: auto`; unchanged without.

    The brightest hundredth of what is seen comes near white. Where that would leave all the rest in the dark, the rest is
    made visible instead. The background counts only if hardly anything else is there.

    Raises:
        DeviceError, KernelBuildError: as of a render.
    """
    if not isinstance(scene.output.exposure, str):
        return scene
    seen = [preview.framebuffer(view, eye) for view, eye in _middle_views(scene)]
    output = scene.output.model_copy(update={"exposure": exposure_of(seen)})
    return scene.model_copy(update={"output": output})


def exposure_of(framebuffers: Sequence[Framebuffer]) -> float:
    """The exposure that suits pictures with R, G, B and A, stops; 0 if they are black. See `exposed`."""
    colors = np.concatenate(
        [np.stack([framebuffer[name].ravel() for name in "RGB"], axis=-1) for framebuffer in framebuffers]
    )
    cover = np.concatenate([framebuffer["A"].ravel() for framebuffer in framebuffers])
    seen = cover > 0.5
    chosen = colors[seen] if seen.mean() >= _LEAST_SEEN else colors
    bright = chosen.astype(np.float64) @ _LUMINANCE
    bright = bright[np.isfinite(bright) & (bright > 0)]
    if not len(bright):
        return 0.0
    to_white = HIGHLIGHT / float(np.quantile(bright, _BRIGHTEST))
    to_gray = LEAST_MEAN / float(np.exp(np.log(bright).mean()))
    return round(min(max(float(np.log2(max(to_white, to_gray))), -100.0), 100.0), 2)


def _middle_views(scene: Scene) -> list[tuple[Scene, Eye]]:
    """The views of a scene as the eye between both eyes sees them, or as its camera does."""
    if scene.stereo is None:
        return [(view, eye) for view, eye, _ in shown_views(scene)]
    # (What an eye sees, with its size of the picture; then the eye between them.)
    seen, eye = seen_by(scene, "left")
    middle = Eye("middle", eye.wide, eye.high)
    return [(view, own) for view, own, _ in shown_views(seen, middle)]


def _wants_focus(camera: Camera | None) -> bool:
    """Whether a distance has to be measured: a pinhole has none."""
    return (
        isinstance(camera, PerspectiveCamera)
        and camera.f_number is not None
        and camera.measured_focus is not None
    )


def _focused(camera: Camera, views: Sequence[tuple[Scene, Eye]], preview: Preview) -> dict[str, Camera]:
    """The camera of some views as a change of what holds it; empty if there is nothing to measure, or nothing is seen."""
    if not isinstance(camera, PerspectiveCamera) or not _wants_focus(camera):
        return {}
    assert camera.measured_focus is not None
    for view, eye in views:
        if isinstance(view.renderer, CutPlaneRenderer):
            continue
        depth = preview.depth(view, camera.measured_focus, eye)
        if depth is not None and depth <= _FARTHEST:
            measured = {"focus": None, "focus_on": None, "focus_distance": float(f"{depth:.9g}")}
            return {"camera": camera.model_copy(update=measured)}
    return {"camera": camera.model_copy(update={"focus": None, "focus_on": None})}
