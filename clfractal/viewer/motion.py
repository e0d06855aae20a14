"""What moves by itself: animated transitions, and flights by held keys, gamepads and 3D mice."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from clfractal.errors import ClfractalError
from clfractal.scene.deep import Deep
from clfractal.scene.deeper import camera_told_anew, magnification_of
from clfractal.scene.model import Scene
from clfractal.scene.parts import AnyCamera
from clfractal.viewer.flying import Fly, Key
from clfractal.viewer.navigation import dolly, interpolated, orbit, pan
from clfractal.viewer.pose import pose_of
from clfractal.viewer.studio import Studio
from clfractal.viewer.transition import eased

TRANSITION_SECONDS = 0.3
# Below this a stick rests.
_DEAD = 0.15
_TURN = 90.0  # degrees in a second, of a stick at its rim


@dataclass(slots=True)
class Motion:
    """Moves the studio's camera as time passes.

    Attributes:
        sensitivity: factor on what a 3D mouse does.
        level: whether looking around keeps the horizon.
        keys: of flying that are held.
        look: degrees that the head has turned since the last step, to the right and down.
        fly: the flight's state.
        depth: to the nearest surface in the picture; infinite if nothing is in sight.
    """

    studio: Studio
    sensitivity: float = 1.0
    level: bool = True
    keys: set[Key] = field(default_factory=set)
    look: tuple[float, float] = (0.0, 0.0)
    fly: Fly = field(default_factory=Fly)
    depth: float = float("inf")
    _from: AnyCamera | None = None
    _to: AnyCamera | None = None
    _start: float = 0.0
    _flew: bool = False

    @property
    def active(self) -> bool:
        """Whether the camera moves by itself at the moment."""
        return self._to is not None or bool(self.keys) or self.fly.moving or self.look != (0.0, 0.0)

    @property
    def target(self) -> AnyCamera:
        """Where the camera will be when a move under way has ended; so that keys add up."""
        return self._to if self._to is not None else self.studio.scene.camera

    def go_to(self, camera: AnyCamera, now: float) -> None:
        """Begins a smooth move of the scene's camera."""
        self.keys.clear()
        self.fly.stop()
        self._from, self._to, self._start = self.studio.scene.camera, camera, now

    def told_anew(self, before: Deep | None, present: Scene) -> None:
        """The scene shows another place: a move that is under way goes on there, if it ends within reach."""
        after = present.deep
        self.fly.scale(magnification_of(after) / magnification_of(before))
        self.depth = float("inf")
        if self._from is None or self._to is None:
            return
        try:
            self._to = camera_told_anew(self._to, before, after)
        except ClfractalError:
            self._to = None
            return
        try:
            self._from = camera_told_anew(self._from, before, after)
        except ClfractalError:  # out of reach already
            self._from = present.camera

    def stop(self) -> None:
        """Ends all moves where the camera is."""
        self._to = None
        self.keys.clear()
        self.fly.stop()

    def turn(self, right: float, down: float) -> None:
        """Turns the head, degrees."""
        self.look = (self.look[0] + right, self.look[1] + down)

    def step(self, now: float, seconds: float, pad: Any = None, six: Any = None) -> bool:
        """Moves by what has passed; whether anything moved.

        Args:
            pad: axes and buttons of a gamepad (`window.gamepad`), or None.
            six: axes of a 3D mouse, or None.
        """
        if self._to is not None:
            self._animate(now)
            return True
        if six is not None and self._spun(six, seconds):
            return True
        keys, look = set(self.keys), self.look
        self.look = (0.0, 0.0)
        if pad is not None:
            look = self._padded(pad, keys, look, seconds)
        if not keys and not self.fly.moving and look == (0.0, 0.0):
            if self._flew:
                self._flew = False
                self.studio.end_gesture()
            return False
        self.fly.vertical = self.studio.saved.camera.up if self.level else None
        camera = self.fly.step(self.studio.scene.camera, keys, look, seconds, self.depth)
        return self._flown(camera)

    def _flown(self, camera: AnyCamera) -> bool:
        self._flew = True
        self.studio.set_camera(camera, "fly")
        return True

    def _animate(self, now: float) -> None:
        assert self._from is not None
        assert self._to is not None
        share = (now - self._start) / TRANSITION_SECONDS
        if share >= 1 or type(self._from) is not type(self._to):
            camera, self._to = self._to, None
            self.studio.set_camera(camera, "transition")
            self.studio.end_gesture()
            return
        self.studio.set_camera(interpolated(self._from, self._to, eased(share)), "transition")

    def _padded(
        self, pad: Any, keys: set[Key], look: tuple[float, float], seconds: float
    ) -> tuple[float, float]:
        axes, buttons = pad
        pairs: tuple[tuple[float, Key, Key], ...] = (
            (axes[0], "right", "left"),
            (axes[1], "back", "forward"),
            (axes[5] - axes[4] if len(axes) > 5 else 0.0, "up", "down"),
        )
        for value, positive, negative in pairs:
            if abs(value) > 0.5:
                keys.add(positive if value > 0 else negative)
        rolls: tuple[tuple[int, Key], ...] = ((4, "roll_left"), (5, "roll_right"))
        keys |= {key for number, key in rolls if len(buttons) > 5 and buttons[number]}
        turned = [value if abs(value) > _DEAD else 0.0 for value in axes[2:4]]
        return look[0] + turned[0] * _TURN * seconds, look[1] + turned[1] * _TURN * seconds

    def _spun(self, six: Any, seconds: float) -> bool:
        """A 3D mouse moves the object, as if it were held in the hand."""
        axes = np.where(np.abs(six) > _DEAD, six, 0.0)
        if not axes.any():
            return False
        camera, size = self.studio.scene.camera, self.studio.viewport
        pixels = 600 * seconds * self.sensitivity
        camera = pan(camera, axes[0] * pixels, axes[2] * pixels, size, float("inf"))
        camera = dolly(camera, float(np.exp(-axes[1] * 1.5 * seconds)))
        turned = orbit(camera, pose_of(camera).target, axes[5] * pixels, axes[3] * pixels, size, "free")
        return self._flown(turned)
