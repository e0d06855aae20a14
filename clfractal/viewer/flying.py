"""Flying with keys held, at a speed that follows the distance to the surface."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, field
from math import exp, isfinite, log
from typing import Literal, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from clfractal.scene.parts import OrthographicCamera
from clfractal.viewer.pointer import Floats
from clfractal.viewer.pose import C, Style, pose_of, rotation, stood, turned_about, turning

Key: TypeAlias = Literal["forward", "back", "left", "right", "up", "down", "roll_left", "roll_right"]

# Rates of a camera at full speed: distances to the surface in a second, degrees in a second.
SPEED = 0.8
ROLL_SPEED = 60.0
# Bounds of the factor that a mouse wheel changes.
SLOWEST, FASTEST = 1 / 64, 64.0
# Time constant of the acceleration, seconds: after 0.2 s a camera has 95 % of its speed.
_EASE = 0.2 / 3
# Time constant by which the target's distance follows the surface's, seconds.
_FOLLOW = 0.5
# Part of the distance to the surface that one step may go.
_LONGEST_STEP = 0.5
# A frame that took longer, seconds, flies no farther.
_LONGEST_FRAME = 0.25
# A slower camera than this part of the full speed stands.
_STILL = 1e-3

# What each key moves: to the right, up, forward, and the roll (clockwise).
_DIRECTIONS: dict[Key, tuple[float, float, float, float]] = {
    "right": (1, 0, 0, 0),
    "left": (-1, 0, 0, 0),
    "up": (0, 1, 0, 0),
    "down": (0, -1, 0, 0),
    "forward": (0, 0, 1, 0),
    "back": (0, 0, -1, 0),
    "roll_right": (0, 0, 0, 1),
    "roll_left": (0, 0, 0, -1),
}


@dataclass(slots=True)
class Fly:
    """The state of a flight.

    Attributes:
        factor: on the speed, for a mouse wheel (see `faster`).
        vertical: looking to the sides turns about it and keeps the horizon; None: about the picture's own up, as in a
            spaceship.
    """

    factor: float = 1.0
    vertical: npt.ArrayLike | None = None
    # The present speed to the right, up, forward and of the roll, parts of the full speed.
    _pace: Floats = field(default_factory=lambda: np.zeros(4))
    _distance: float | None = None

    @property
    def moving(self) -> bool:
        """Whether the camera still moves without a key: it takes a moment to stop."""
        return bool(np.any(self._pace != 0))

    def faster(self, steps: float) -> None:
        """Changes the speed by steps of a mouse wheel, four of which double it."""
        if isfinite(steps):
            self.factor = min(max(self.factor * 2.0 ** min(max(steps / 4, -12), 12), SLOWEST), FASTEST)

    def scale(self, factor: float) -> None:
        """Lengths are told in other units."""
        if self._distance is not None:
            self._distance *= factor

    def stop(self) -> None:
        """Stops at once, for example when the window loses the keyboard."""
        self._pace = np.zeros(4)
        self._distance = None

    @np.errstate(all="ignore")
    def step(
        self,
        camera: C,
        keys: Set[Key],
        look: tuple[float, float] = (0.0, 0.0),
        seconds: float = 1 / 60,
        distance_to_surface: float = float("inf"),
    ) -> C:
        """The camera after a moment; it never goes farther than half the distance to the surface.

        An orthographic camera changes its height instead of going forward, and its speed follows the height.

        Args:
            keys: those that are held; opposite ones cancel.
            look: by how much the head turns to the right and down, degrees.
            seconds: since the last step.
            distance_to_surface: from the camera to the nearest surface in any direction, scene units; infinite if it is
                unknown: then the last known one counts, at first the target's.
        """
        camera = self._looked(camera, look)
        if not (isfinite(seconds) and seconds > 0):
            return camera
        seconds = min(seconds, _LONGEST_FRAME)
        distance = self._reach(camera, distance_to_surface)
        right, up, forward, turn = self._advance(keys, seconds)
        pose = pose_of(camera)
        tip = rotation(pose.axis, np.radians(turn * ROLL_SPEED)) @ pose.up if turn else None
        shift = np.array([right, up, forward]) * SPEED * self.factor
        size = float(np.linalg.norm(shift))
        shift *= min(1.0, _LONGEST_STEP / size) if size > 0 else 1.0
        if isinstance(camera, OrthographicCamera):
            across = camera.height * (shift[0] * pose.side + shift[1] * pose.up)
            height = camera.height * exp(-shift[2])
            return cast(C, stood(camera, pose.position + across, pose.target + across, tip, height=height))
        way = distance * (shift @ np.stack([pose.side, pose.up, pose.axis]))
        if not way.any() and tip is None:
            return camera
        position = pose.position + way
        if way.any():
            focus = self._followed(pose.distance, distance, seconds)
            flown = stood(camera, position, position + focus * pose.axis, tip)
            if flown is not camera:
                return flown
        # No target can be at that distance, so it keeps its own.
        return stood(camera, position, position + pose.distance * pose.axis, tip)

    def _looked(self, camera: C, look: tuple[float, float]) -> C:
        right, down = look
        if not (isfinite(right) and isfinite(down)) or right == down == 0:
            return camera
        # A camera whose object follows a drag to the right turns its head to the right, too.
        pose = pose_of(camera)
        style: Style = "free" if self.vertical is None else "turntable"
        vertical = camera.up if self.vertical is None else self.vertical
        matrix, up = turning(pose, style, float(np.radians(right)), float(np.radians(down)), vertical)
        return turned_about(camera, pose.position, matrix, up)

    def _reach(self, camera: C, distance_to_surface: float) -> float:
        """The distance that sets the speed, scene units."""
        if isfinite(distance_to_surface) and distance_to_surface >= 0:
            self._distance = distance_to_surface
        elif self._distance is None:
            self._distance = pose_of(camera).distance
        return self._distance

    def _advance(self, keys: Set[Key], seconds: float) -> Floats:
        """The way of this step in full speeds x seconds; it also updates the pace.

        Both follow exactly from the pace's exponential approach, so that the way does not depend on the frame rate.
        """
        wanted = np.sum([np.zeros(4), *(np.array(_DIRECTIONS[key], float) for key in keys)], axis=0)
        length = float(np.linalg.norm(wanted[:3]))
        if length > 1:
            wanted[:3] /= length
        left = exp(-seconds / _EASE)
        way: Floats = wanted * seconds + (self._pace - wanted) * (_EASE * (1 - left))
        self._pace = wanted + (self._pace - wanted) * left
        if not wanted.any() and np.abs(self._pace).max() < _STILL:
            self._pace = np.zeros(4)
        return way

    def _followed(self, focus: float, distance: float, seconds: float) -> float:
        """The target's distance, on its way to the surface's.

        A target that stayed far behind the surface would leave stereo's screen and the focus there, too.
        """
        if not (focus > 0 and distance > 0):
            return focus
        return focus * exp((1 - exp(-seconds / _FOLLOW)) * log(distance / focus))
