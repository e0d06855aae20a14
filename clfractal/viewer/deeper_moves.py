"""The window's scene goes over to deeper places by itself, while its camera comes nearer, and back."""

from __future__ import annotations

from contextlib import suppress

from clfractal.errors import ClfractalError
from clfractal.scene.deeper import is_far_off, seen_point, settled, why_it_stays
from clfractal.scene.model import Scene
from clfractal.viewer.controls import Controls
from clfractal.viewer.motion import Motion
from clfractal.viewer.studio import Studio


class DeeperMoves:
    """Looks after each move whether the scene is told better by another place; see `scene.deeper`."""

    def __init__(self, studio: Studio, controls: Controls, motion: Motion) -> None:
        self.studio, self.controls, self.motion = studio, controls, motion
        self._known: Scene | None = None
        self._told = ""

    def look(self) -> None:
        """Called every turn. A drag keeps its numbers until it ends, a recorded flight until it is keys."""
        studio, scene = self.studio, self.studio.scene
        # (What was opened and never moved stays as its file has it.)
        if scene is self._known or self.controls.dragging or studio.recording:
            return
        self._known = scene
        if scene.camera == studio.opened.camera or not is_far_off(scene):
            self._told = ""
            return
        why = why_it_stays(scene)
        if why and why != self._told:
            studio.tell(why, holds=lambda: self._told == why)
        self._told = why
        toward = self.controls.toward
        found = settled(scene, None if toward is None else seen_point(toward, scene.deep))
        if found is scene:
            return
        try:
            self.motion.told_anew(scene.deep, found.deep)
        except ClfractalError:
            self.motion.stop()
        with suppress(ClfractalError):
            studio.retell(found)
        self._known = studio.scene
