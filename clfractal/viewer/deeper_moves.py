"""The window's scene goes over to deeper places by itself, while its camera comes nearer, and back."""

from __future__ import annotations

from clfractal.scene.deeper import is_far_off, seen_point, settled, why_it_stays
from clfractal.scene.model import Scene
from clfractal.viewer.controls import Controls
from clfractal.viewer.deeper_orbits import DeeperOrbits
from clfractal.viewer.motion import Motion
from clfractal.viewer.studio import Studio


class DeeperMoves:
    """Looks after each move whether the scene is told better by another place; see `scene.deeper`.

    Attributes:
        orbits: how many iterations the scene has there.
    """

    def __init__(self, studio: Studio, controls: Controls, motion: Motion) -> None:
        self.studio, self.controls, self.motion = studio, controls, motion
        self.orbits = DeeperOrbits(studio)
        self._known: Scene | None = None
        self._told = ""

    def look(self) -> None:
        """Called every turn. A drag keeps its numbers until it ends, a recorded flight until it is keys."""
        studio, scene = self.studio, self.studio.scene
        if scene is not self._known and not self.controls.dragging and not studio.recording:
            self._known = scene
            self._settle(scene)
        self.orbits.look()

    def _settle(self, scene: Scene) -> None:
        studio = self.studio
        exact = None if self.motion.active else self.controls.toward
        toward = None if exact is None else seen_point(exact, scene.deep)
        # (What was opened and never moved stays as its file has it.)
        if scene.camera == studio.opened.camera or not is_far_off(scene, toward):
            self._told = ""
            return
        why = why_it_stays(scene)
        if why and why != self._told:
            studio.tell(why, holds=lambda: self._told == why)
        self._told = why
        found = settled(scene, toward)
        if found is scene:
            return
        self.motion.told_anew(scene.deep, found)
        studio.retell(found)
        self._known = studio.scene
