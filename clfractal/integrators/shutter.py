"""Motion blur: what moves while a frame's shutter is open, and where the view is meanwhile.

A pixel is the mean of samples at times spread over the opening. Where only the view moves, each sample of each pixel
has a time of its own, and kernels mix the view's poses. What else moves is the same for all pixels of a sample: the opening
has as many equal parts as there are samples, and each sample has the scene in the middle of its part, and the view's way in
it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View, scene_view, seen_by, shown_views
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from clfractal.scene.stereo import MIDDLE, Eye, EyeName
from clfractal.scene.tracks import Target

Floats = npt.NDArray[np.float64]

MOST_SPANS = 64
"""Most straight pieces of a view's way."""
# Pieces to begin with: an odd number, so that a vibration is not met at its nodes alone.
_FIRST_SPANS = 3
# How far from its place, in pixels, what a view shows may be where the view is mixed of two poses.
_STRAYING = 0.1
# A view that moves less, in pixels, stands still.
_STILL = 1e-3
# Times of an opening at which values are compared: one for each sample, but not more.
_LOOKS = 64
# Times whose values tell one movement from another.
_TOLD = 17


@dataclass(frozen=True, slots=True)
class Shutter:
    """The time in which one view of a frame is taken, as plain data.

    Attributes:
        film: the scene with its animation, of which the picture is a frame.
        opens, closes: frames, which need not be whole.
        side: the eye that sees it, of a stereo scene.
        number: which of the layout's views it is.
    """

    film: Scene
    opens: float
    closes: float
    side: EyeName | None
    number: int

    def seen(self, time: float) -> tuple[Scene, Eye]:
        """What the view shows at a time, frames, and whose it is.

        Raises:
            SceneError, FormulaError: a value is out of its range then; at its track.
        """
        scene, eye = movement_of(self.film).instant(time), MIDDLE
        if self.side is not None:
            scene, eye = seen_by(scene, self.side)
        view, own_eye, _ = shown_views(scene, eye)[self.number]
        return view, own_eye

    def part(self, sample: int, count: int) -> tuple[float, float]:
        """The part of the opening that one of a pixel's `count` samples has, frames; all parts together are the opening."""
        each = (self.closes - self.opens) / count
        place = _places_of(count)[sample]
        return self.opens + place * each, self.opens + (place + 1) * each

    def poses(self, start: float, end: float) -> tuple[View, ...]:
        """The view at equal steps of time, frames, so near to each other that it may be mixed between two of them."""
        # Just before its end: a cut there belongs to the next frame.
        end = math.nextafter(end, start)
        first = [start + place / _FIRST_SPANS * (end - start) for place in range(_FIRST_SPANS)]
        found = [self._pose(time) for time in (*first, end)]
        while True:
            spans = len(found) - 1
            step = (end - start) / spans
            middles = [self._pose(start + (index + 0.5) * step) for index in range(spans)]
            off = max(
                _apart(middle, (before.points + after.points) / 2)
                for before, middle, after in zip(found, middles, found[1:], strict=False)
            )
            found = [*(pose for pair in zip(found, middles, strict=False) for pose in pair), found[-1]]
            # The middles are poses from now on, so that a quarter of this is left.
            if off <= 4 * _STRAYING or 2 * spans >= MOST_SPANS:
                return tuple(pose.view for pose in found)

    def moves_view(self) -> bool:
        """Whether the view moves."""
        first, *others = (self._pose(time) for time in _times(self.opens, self.closes, _LOOKS))
        return any(_apart(pose, first.points) > _STILL or pose.lens != first.lens for pose in others)

    def moves_others(self, samples: int) -> bool:
        """Whether anything but the view moves, as far as so many samples of a pixel can show it."""
        movement = movement_of(self.film)
        names = [name for name, target in movement.targets.items() if not _is_view(self.film, target)]
        times = _times(self.opens, self.closes, min(max(samples, 3), _LOOKS))
        each = [movement.values(time) for time in times] if names else []
        return any(values[name] != each[0][name] for values in each for name in names)

    def told(self) -> list[object]:
        """What tells the movement from another: the tracks' values at some times of the opening, and these."""
        movement = movement_of(self.film)
        return [[time, movement.values(time)] for time in _times(self.opens, self.closes, _TOLD)]

    def _pose(self, time: float) -> _Pose:
        scene, eye = self.seen(time)
        view = scene_view(scene, eye)
        across, up = view.side * view.width / 2, view.up * view.height / 2
        corners = [view.center + x * across + y * up for x in (-1, 1) for y in (-1, 1)]
        lens = (view.lens_radius, view.focus_distance if view.lens_radius > 0 else 0.0)
        return _Pose(view, np.stack([view.origin, *corners]), lens, view.pixel_size(scene.image.height))


@dataclass(frozen=True, slots=True)
class _Pose:
    """A view and what kernels mix of it.

    Attributes:
        view: it.
        points: its origin and the corners of its plane, shape (5, 3), scene units.
        lens: the lens's radius and the distance that is sharp.
        pixel: width of a pixel on the plane, scene units.
    """

    view: View
    points: Floats
    lens: tuple[float, float]
    pixel: float


def shutter_of(scene: Scene, side: EyeName | None, number: int) -> Shutter | None:
    """The shutter of one view of a frame's scene; None if the picture shows one moment.

    It opens at the frame. Of a film that does not begin again nothing is known after its last frame: there it closes.

    Args:
        side: the eye that sees it, of a stereo scene.
        number: which of the layout's views it is.
    """
    animation = scene.animation
    if animation is None or animation.frame is None or animation.shutter == 0:
        return None
    opens = closes = animation.frame
    closes += animation.shutter
    if not animation.loop:
        last = float(animation.count - 1)
        opens, closes = min(opens, max(last - animation.shutter, 0.0)), min(closes, last)
    return Shutter(scene, opens, closes, side, number) if closes > opens else None


def _is_view(scene: Scene, target: Target) -> bool:
    """Whether a value decides nothing but from where is looked."""
    path = target.path
    if path[0] == "layout":
        return path[3:4] == ("camera",)
    flat = isinstance(scene.renderer, CutPlaneRenderer) and path[:2] == ("renderer", "plane")
    # (No kernel knows the exposure: it is for the picture that was made.)
    return path[0] in ("camera", "stereo", "output") or flat


def _apart(pose: _Pose, points: Floats) -> float:
    """How far a pose's points are from others, pixels."""
    return float(np.linalg.norm(pose.points - points, axis=1).max()) / pose.pixel


def _times(opens: float, closes: float, count: int) -> list[float]:
    return [float(time) for time in np.linspace(opens, closes, count)]


@lru_cache(maxsize=16)
def _places_of(count: int) -> tuple[int, ...]:
    """Which part of the opening each sample has: early ones are spread over all of it, in van der Corput's order."""
    bits = max((count - 1).bit_length(), 1)
    turned = sorted(range(count), key=lambda sample: int(f"{sample:0{bits}b}"[::-1], 2))
    return tuple(sorted(range(count), key=turned.__getitem__))
