"""How strongly a stereo picture's depth strains the viewer's eyes, and how to reduce that.

Eyes stay focused on a screen while they turn towards points in front of it or behind it. Up to about one degree
of difference that is comfortable (M. Lambooij et al., "Visual discomfort and visual fatigue of stereoscopic displays: a
review", Journal of Imaging Science and Technology 53, 2009).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View, scene_view, seen_by, shown_views
from clfractal.engine.job import Job
from clfractal.engine.preview import Preview, points_of_depth
from clfractal.errors import SceneError, Where
from clfractal.images.tiled import Picture
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.model import Scene
from clfractal.scene.stereo import MIDDLE, Eye, EyeName, Stereo, StereoPlane
from clfractal.stereo.eyes import degrees, eye_distance, eye_views, parallax

Floats = npt.NDArray[np.float64]
Ends = tuple[float, float]
"""The nearest and the farthest of something."""

SIDES: tuple[EyeName, ...] = ("left", "right")

LIMIT_DEGREES = 1.0
"""Parallax past which the viewer is warned."""

# For pictures larger than this, depth is measured by a preview instead of reading all pixels again.
_MOST_PIXELS = 1 << 24
# The preview misses the finest spikes, so depth is fitted to this part of the budget.
_MARGIN = 0.95
# An angle with a large but finite tangent; no viewer's eyes turn so far.
_NEARLY_RIGHT = np.radians(89.9)


@dataclass(frozen=True, slots=True)
class Comfort:
    """The range of parallax in a picture: on the screen, in its unit, and in degrees. Negative: in front of the screen."""

    nearest: float
    farthest: float
    nearest_degrees: float
    farthest_degrees: float

    @classmethod
    def joined(cls, parts: Sequence[Comfort]) -> Comfort | None:
        """The range over several pictures; None of none."""
        if not parts:
            return None
        return cls(
            min(each.nearest for each in parts),
            max(each.farthest for each in parts),
            min(each.nearest_degrees for each in parts),
            max(each.farthest_degrees for each in parts),
        )

    @property
    def worst_degrees(self) -> float:
        """The largest absolute value of both ends."""
        return max(abs(self.nearest_degrees), abs(self.farthest_degrees))

    def sentence(self) -> str:
        """The range as one line."""
        return (
            f"parallax {self.nearest:+.4g} to {self.farthest:+.4g} in the screen's unit, "
            f"{self.nearest_degrees:+.2f} to {self.farthest_degrees:+.2f} degrees"
        )

    def warning(self) -> str:
        """A line for the user where the picture asks for more than is comfortable, else empty."""
        if self.worst_degrees <= LIMIT_DEGREES:
            return ""
        return (
            f"parallax reaches {self.worst_degrees:.2f} degrees, but eyes tire beyond {LIMIT_DEGREES:g}; "
            "stereo.fit: auto, a smaller separation or a plane nearer to the object helps"
        )


def comfort_of(scene: Scene, points: Floats, eye: Eye = MIDDLE) -> Comfort:
    """The range of parallax of points of a stereo scene, shape (n, 3), n at least 1, scene units, seen by an eye."""
    assert scene.stereo is not None
    across = parallax(scene.stereo, eye_views(scene, eye), points)[:, 0]
    nearest, farthest = float(across.min()), float(across.max())
    ends = degrees(scene.stereo, [nearest, farthest])
    return Comfort(nearest, farthest, float(ends[0]), float(ends[1]))


def comfort_of_depth(
    scene: Scene,
    eye: Eye,
    depth: npt.NDArray[np.float32],
    size: tuple[int, int],
    origin: tuple[int, int] = (0, 0),
) -> Comfort | None:
    """The range of parallax in one eye's picture, or in some of its pixels; None if they show nothing.

    Args:
        scene, eye: the stereo scene as that eye sees it.
        depth, size, origin: of the eye's picture, as of `points_of_depth`.
    """
    assert scene.stereo is not None
    view = scene_view(scene, eye)
    if scene.stereo.convergence == "toe_in":
        points = points_of_depth(view, depth, size, origin)
        return comfort_of(scene, points, eye) if len(points) else None
    # If the eyes look straight ahead, parallax follows from depth alone, so two points are enough.
    nearest = float(np.where(depth > 0, depth, np.inf).min())
    farthest = float(np.where(depth < np.inf, depth, 0).max())
    if nearest == np.inf or farthest <= 0:
        return None
    return comfort_of(scene, view.origin + np.array([[nearest], [farthest]]) * view.axis, eye)


def measured(scene: Scene, preview: Preview) -> Comfort | None:
    """The range of parallax in a stereo scene's picture, by a preview from each eye; None if the picture is empty.

    Raises:
        DeviceError, KernelBuildError: as of a render.
    """
    found = []
    for name in SIDES:
        for view, eye, _ in shown_views(*seen_by(scene, name)):
            if isinstance(view.renderer, CutPlaneRenderer):
                found.append(Comfort(0.0, 0.0, 0.0, 0.0))
                continue
            points = preview.points(view, eye)
            if len(points):
                found.append(comfort_of(view, points, eye))
    return Comfort.joined(found)


def comfort_of_job(job: Job, stores: Sequence[Picture], preview: Preview) -> Comfort | None:
    """The range of parallax in a finished job: from all pixels if it has the depth channel, else by previews.

    None without stereo, and for an empty picture.

    Args:
        stores: of the job's views.

    Raises:
        DeviceError, KernelBuildError: a preview failed.
    """
    if job.scene.stereo is None:
        return None
    return comfort_of_framebuffers(job, stores) if _has_depth(job) else measured(job.scene, preview)


def comfort_of_framebuffers(job: Job, stores: Sequence[Picture]) -> Comfort | None:
    """The same without a preview: None also for pictures that lack the depth channel."""
    if job.scene.stereo is None or not _has_depth(job):
        return None
    found = []
    for view, store in zip(job.views, stores, strict=True):
        for row, band in store.bands():
            part = comfort_of_depth(view.scene, view.eye, band["Z"], store.display, (store.region.x, row))
            if part is not None:
                found.append(part)
    return Comfort.joined(found)


def _has_depth(job: Job) -> bool:
    """Whether the depth of everything that a stereo job shows is in its pixels, and these are not too many."""
    scene = job.scene
    return (
        "Z" in job.channels
        and scene.layout is None
        and not scene.renderer.is_flat
        and scene.image.width * scene.image.height <= _MOST_PIXELS
    )


def fitted(scene: Scene, preview: Preview) -> Scene:
    """The scene with a plane and a separation that keep its depth within `stereo.budget`; unchanged without `fit`.

    The viewpoint between the two eyes stays, so its view does not change: the screen is placed so that the nearest and the
    farthest visible point have the same parallax in degrees. If that is still too much, the eyes move closer
    together. A plane that the scene gives stays where it is.

    Raises:
        SceneError: the picture is empty.
        DeviceError, KernelBuildError: as of a render.
    """
    stereo = scene.stereo
    if stereo is None or stereo.fit is None:
        return scene
    current = _with(scene, fit=None)
    view = scene_view(current)
    # First from the depth that the middle eye sees, then from that of both eyes placed by it.
    points = preview.points(current)
    if not len(points):
        raise SceneError("auto finds nothing to fit to: the picture is empty", Where(path="stereo.fit"))
    current = _fitted_to(current, stereo, view, points)
    more = [preview.points(*seen_by(current, name)) for name in SIDES]
    return _fitted_to(current, stereo, view, np.concatenate([points, *more]))


def _fitted_to(scene: Scene, wanted: Stereo, view: View, points: Floats) -> Scene:
    """A scene with the plane and the separation for points, shape (n, 3), before the eye of a view."""
    depths = (points - view.origin) @ view.axis
    ends = (float(depths.min()), float(depths.max()))
    if wanted.plane is not None:
        return _with(scene, separation=_separation(wanted, ends, eye_distance(view)))
    distance = _balanced(wanted, ends)
    return _with(scene, plane=_plane_at(view, distance), separation=_separation(wanted, ends, distance))


def _with(scene: Scene, **changes: object) -> Scene:
    assert scene.stereo is not None
    return scene.model_copy(update={"stereo": scene.stereo.model_copy(update=changes)})


def _at_depths(stereo: Stereo, depths: Ends, distance: float) -> Ends:
    """Parallax (screen units) at the nearest and the farthest depth, of eyes as far apart as the viewer's.

    By similar triangles of a point at depth z and of a screen at distance d from the eyes: e (1 - d / z), e between them.
    """
    nearest, farthest = (stereo.interpupillary_distance * (1 - distance / depth) for depth in depths)
    return nearest, farthest


def _balanced(stereo: Stereo, depths: Ends) -> float:
    """How far from the eyes the screen is where the nearest and the farthest depth have the same parallax, degrees."""

    def excess(distance: float) -> float:
        """How much more the nearest asks than the farthest: it grows with the screen's distance."""
        apart = _separation(stereo, depths, distance)
        ends = degrees(stereo, [apart * each for each in _at_depths(stereo, depths, distance)])
        return float(-ends[0] - ends[1])

    low, high = depths
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if excess(middle) > 0 else (middle, high)
    return (low + high) / 2


def _separation(stereo: Stereo, depths: Ends, distance: float) -> float:
    """The largest separation up to the scene's own that keeps depths within the budget, of a screen at a distance."""
    eyes, screen = stereo.interpupillary_distance, stereo.screen_distance
    on_screen = 2 * np.arctan(eyes / 2 / screen)
    budget = np.radians(_MARGIN * stereo.budget)
    # The parallax on the screen that the budget allows, before it and behind it; it grows with the separation.
    least = eyes - 2 * screen * np.tan(min((on_screen + budget) / 2, _NEARLY_RIGHT))
    most = eyes - 2 * screen * np.tan((on_screen - budget) / 2)
    nearest, farthest = _at_depths(stereo, depths, distance)
    found = stereo.separation
    if nearest < 0:
        found = min(found, float(least) / nearest)
    if farthest > 0:
        found = min(found, float(most) / farthest)
    return found


def _plane_at(view: View, distance: float) -> StereoPlane:
    """The plane across a view at another distance from its eye, as large as the eye sees there."""
    return StereoPlane(
        center=_triple(view.origin + distance * view.axis),
        normal=_triple(-view.axis),
        up=_triple(view.up),
        width=view.width * distance / eye_distance(view),
        height=None,
    )


def _triple(vector: Floats) -> tuple[float, float, float]:
    x, y, z = (float(each) for each in vector)
    return x, y, z
