"""A pointer in the picture without a window: a studio, its controls, and the picture that lies under the pointer."""

from __future__ import annotations

from typing import Any

import numpy as np

from clfractal.camera.views import scene_view
from clfractal.device.select import Device
from clfractal.scene.model import Scene
from clfractal.viewer.aim import aimed
from clfractal.viewer.controls import LEFT, Controls
from clfractal.viewer.deeper_moves import DeeperMoves
from clfractal.viewer.display import CopyTarget, Display, Shown
from clfractal.viewer.motion import Motion
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.pointer import project
from clfractal.viewer.settings import Settings
from clfractal.viewer.studio import Studio
from tests.viewer.sessions import wait_for

VIEW = (128, 96)


class Hand:
    """A studio with controls, and the picture that the pointer is over."""

    def __init__(self, scene: Scene, device: Device) -> None:
        self.studio = Studio(scene, device, Pacing(), lambda: None)
        self.studio.resize(*VIEW)
        self.studio.refresh()
        self.motion = Motion(self.studio)
        self.controls = Controls(self.studio, Settings(), self.motion)
        self.deeper = DeeperMoves(self.studio, self.controls, self.motion)
        self.display = Display(device, self.studio.session.pool, lambda: None, to_image=False)
        self.now = 0.0

    def look(self) -> Shown:
        """The finished picture."""
        wait_for(lambda: self.studio.session.idle)
        assert self.studio.session.problem is None
        frame, look = self.studio.frame, self.studio.look
        assert frame is not None
        target = CopyTarget(self.studio.session.device, frame.arrangement.size(look))
        assert self.display.show(frame, look, target)
        found: list[Shown] = []

        def arrived() -> bool:
            found.extend(shown for shown in (self.display.take(),) if shown is not None)
            return bool(found)

        wait_for(arrived)
        return found[-1]

    def aim(self, x: float, y: float) -> Any:
        """What lies at a place of the picture; not typed as optional, because most of the tests know that something is."""
        pick = self.studio.pick(x, y, self.look())
        return aimed(self.studio.shown_scene, pick) if pick is not None else None

    def drag(self, button: int, start: tuple[float, float], end: tuple[float, float], mods: int = 0) -> None:
        """Presses, moves in steps, lets go."""
        self.now += 10
        self.controls.press(button, mods, start, self.aim(*start), self.now)
        for share in (0.3, 0.6, 1.0):
            self.controls.move(tuple(a + share * (b - a) for a, b in zip(start, end, strict=True)))  # type: ignore[arg-type]
        self.controls.release(end)

    def click(self, place: tuple[float, float], mods: int = 0, after: float = 10) -> None:
        self.now += after
        self.controls.press(LEFT, mods, place, self.aim(*place), self.now)
        self.controls.release(place)

    def at(self, point: tuple[float, float, float]) -> tuple[float, float]:
        """Where the present camera shows a point."""
        x, y, _ = project(scene_view(self.studio.shown_scene), np.array(point), VIEW)
        return x, y

    def close(self) -> None:
        self.display.close()
        self.studio.close()
