"""The pointer in the picture: drags, wheel and clicks move cameras, planes, lights and zoom boxes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from clfractal.images.modes import eye_at
from clfractal.scene.deeper import Exact, exact_point
from clfractal.scene.parts import OrthographicCamera
from clfractal.scene.rectangle import Plane
from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer import handles, navigation, plane_moves, zoom_box
from clfractal.viewer.aim import Aim
from clfractal.viewer.editing import plain
from clfractal.viewer.motion import Motion
from clfractal.viewer.settings import Settings
from clfractal.viewer.studio import Studio

LEFT, RIGHT, MIDDLE = 0, 1, 2
SHIFT, CONTROL, ALT = 1, 2, 4
DOUBLE_CLICK_SECONDS, DOUBLE_CLICK_PIXELS = 0.35, 6.0
# Factor of a step of the wheel.
_WHEEL = 0.88
_WHEEL_PAUSE = 0.25
# A light's handle is taken within so many pixels.
_REACH = 18.0

Place = tuple[float, float]


@dataclass(slots=True, eq=False)
class Drag:
    """A drag under way: what it does with the pointer's place, from its start on."""

    kind: str
    aim: Aim
    start: Place
    move: Callable[[Drag, float, float], None]
    before: Any = None
    moved: bool = False


class Controls:
    """Turns events of the pointer into edits.

    Attributes:
        marking: whether the zoom box is shown and moved; see `box`.
        box: the next zoom of a volume.
        region_start: first corner of a region that is being drawn; None if none is.
        region_now: the corner opposite.
        focusing: whether the next click sets what is sharp.
        choosing_region: whether the next drag draws the region to refine.
        toward: the point of the formula's space that the wheel brought nearer last.
    """

    def __init__(self, studio: Studio, settings: Settings, motion: Motion) -> None:
        self.studio, self.settings, self.motion = studio, settings, motion
        self.marking = False
        self.box: zoom_box.ZoomBox | None = None
        self.focusing = False
        self.choosing_region = False
        self.region_start: Place | None = None
        self.region_now: Place | None = None
        self.toward: Exact | None = None
        self._drag: Drag | None = None
        self._clicked: tuple[float, Place] = (-10.0, (0.0, 0.0))
        self._wheeled = 0.0

    @property
    def dragging(self) -> bool:
        """Whether a button is held that was pressed in the picture."""
        return self._drag is not None

    def press(self, button: int, mods: int, place: Place, aim: Aim | None, now: float) -> None:
        """A button goes down over the picture.

        Args:
            place: of the pointer, pixels of the picture as it is shown.
            aim: what lies there; None outside the picture.
        """
        if aim is None or self._drag is not None:
            return
        self.motion.stop()
        self.toward = None
        if button == LEFT and (self.focusing or mods & CONTROL):
            self.focus(aim)
            self.focusing = False
            return
        if button == LEFT and (self.choosing_region or mods & ALT):
            self.choosing_region = False
            self.region_start = self.region_now = place
            self._drag = Drag("region", aim, place, self._draw_region)
            return
        if button == LEFT and not mods and self._is_double(place, now):
            self._clicked = (-10.0, place)
            if aim.point is not None and not aim.plane_path:
                self.center(aim, now)
            return
        if button == LEFT:
            self._clicked = (now, place)
        self._drag = self._begin(button, mods, place, aim)

    def move(self, place: Place) -> None:
        """The pointer moves."""
        drag = self._drag
        if drag is not None and (drag.moved or math.dist(place, drag.start) >= 2):
            drag.moved = True
            drag.move(drag, place[0] - drag.start[0], place[1] - drag.start[1])

    def release(self, place: Place) -> None:
        """The button goes up."""
        drag, self._drag = self._drag, None
        if drag is not None and drag.kind == "region":
            self._end_region(place)
        elif drag is not None and drag.moved:
            self.studio.end_gesture()

    def cancel(self) -> bool:
        """Ends what is under way without its result; whether there was anything."""
        had = self._drag is not None or self.focusing or self.choosing_region or self.marking
        self._drag = None
        self.focusing = self.choosing_region = self.marking = False
        self.region_start = self.region_now = None
        return had

    def wheel(self, steps: float, mods: int, aim: Aim | None, now: float) -> None:
        """The wheel turns; positive steps zoom in."""
        if aim is None or not math.isfinite(steps):
            return
        factor = _WHEEL ** (steps * (0.25 if mods & SHIFT else 1.0))
        self._wheeled = now
        if self.marking and self.box is not None:
            self.box = zoom_box.scaled(self.box, zoom_box.stage_of(self.studio.scene), factor)
        elif aim.plane is not None:
            self._set_plane(aim, plane_moves.zoom_to(aim.plane, aim.x, aim.y, aim.size, factor), "wheel")
        else:
            if aim.point is not None:
                self.toward = exact_point(aim.point, aim.scene.deep)
            camera = navigation.zoom_to(aim.camera, aim.x, aim.y, aim.size, factor, aim.depth, view=aim.view)
            self._set_camera(aim, camera, "wheel")

    def rest(self, now: float) -> None:
        """Ends the wheel's gesture a moment after its last step."""
        if self._wheeled and now - self._wheeled > _WHEEL_PAUSE:
            self._wheeled = 0.0
            self.studio.end_gesture()

    def center(self, aim: Aim, now: float) -> None:
        """Moves the point under the pointer into the middle; it is what orbits turn about."""
        camera = navigation.center_on(aim.camera, aim.point or aim.camera.target)
        if aim.camera_path == "camera":
            self.motion.go_to(camera, now)
        else:
            self._set_camera(aim, camera, None)

    def focus(self, aim: Aim) -> None:
        """Makes sharp what is under the pointer."""
        if not math.isfinite(aim.depth):
            self.studio.tell("nothing is there that could be made sharp", wrong=True)
            return
        camera = handles.focus_at(aim.camera, aim.depth)
        if camera is aim.camera:
            self.studio.tell(
                "an orthographic camera has no focus",
                wrong=True,
                holds=lambda: isinstance(self.studio.scene.camera, OrthographicCamera),
            )
            return
        self._set_camera(aim, camera, None)
        if getattr(camera, "f_number", 1) is None:
            self.studio.tell(
                "focus is set; give the lens an f-number to see it",
                holds=lambda: getattr(self.studio.scene.camera, "f_number", 1) is None,
            )

    def mark(self, aim: Aim | None = None) -> None:
        """Shows the box of the next zoom, or hides it. It begins at the surface under the pointer, if there is one."""
        if self.marking:
            self.marking = False
            return
        stage = zoom_box.stage_of(self.studio.scene)
        self.box = zoom_box.within(self.box, stage) if self.box else zoom_box.first_box(stage)
        if aim is not None and aim.point is not None:
            self.box = zoom_box.placed_at(self.box, stage, aim.point)
        self.marking = True

    def apply_box(self) -> None:
        """Fills the grid anew with what is in the box; the old picture stays until it is ready."""
        renderer = self.studio.scene.renderer
        if self.box is None or not isinstance(renderer, VolumeRenderer):
            return
        if self.studio.edit({"renderer.zoom": plain(zoom_box.applied(renderer, self.box))}):
            self.box = zoom_box.first_box(zoom_box.stage_of(self.studio.scene))

    def step_back(self) -> None:
        """Takes the last zoom of a volume back."""
        renderer = self.studio.scene.renderer
        if not isinstance(renderer, VolumeRenderer) or not renderer.zoom:
            return
        zooms, box = zoom_box.stepped_back(renderer)
        if self.studio.edit({"renderer.zoom": plain(zooms)}):
            self.box = box

    def _begin(self, button: int, mods: int, place: Place, aim: Aim) -> Drag | None:
        if self.marking and self.box is not None and button == LEFT:
            return Drag("box", aim, place, self._move_box, self.box)
        if button == LEFT and mods & SHIFT:
            number = self._nearest_light(aim)
            if number is None:
                return None
            return Drag("light", aim, place, self._move_light, (number, aim.scene.lights[number]))
        if aim.plane is not None:
            moves: dict[int, Callable[..., Plane]] = {
                LEFT: plane_moves.pan,
                MIDDLE: plane_moves.tilt,
                RIGHT: plane_moves.spin,
            }
            move = moves.get(button)
            return Drag("plane", aim, place, partial(self._move_plane, move), aim.plane) if move else None
        if button == LEFT:
            return Drag("orbit", aim, place, self._orbit, aim.camera)
        return Drag("pan", aim, place, self._pan, aim.camera)

    def _orbit(self, drag: Drag, dx: float, dy: float) -> None:
        aim, way = drag.aim, (dx * self.settings.mouse, dy * self.settings.mouse)
        style = self.settings.orbit
        vertical = self.studio.saved.camera.up if style == "turntable" else None
        camera = navigation.orbit(drag.before, aim.pivot, *way, aim.size, style, vertical=vertical)
        self._set_camera(aim, camera, "orbit")

    def _pan(self, drag: Drag, dx: float, dy: float) -> None:
        aim = drag.aim
        camera = navigation.pan(drag.before, dx, dy, aim.size, aim.depth, view=aim.view)
        self._set_camera(aim, camera, "pan")

    def _move_box(self, drag: Drag, dx: float, dy: float) -> None:
        stage = zoom_box.stage_of(self.studio.scene)
        self.box = zoom_box.dragged(drag.before, stage, drag.aim.view, drag.aim.size, dx, dy)

    def _move_plane(self, move: Callable[..., Plane], drag: Drag, dx: float, dy: float) -> None:
        if move is plane_moves.spin:
            start, end = (drag.aim.x, drag.aim.y), (drag.aim.x + dx, drag.aim.y + dy)
            self._set_plane(drag.aim, plane_moves.spin(drag.before, start, end, drag.aim.size), "plane")
        else:
            self._set_plane(drag.aim, move(drag.before, dx, dy, drag.aim.size), "plane")

    def _move_light(self, drag: Drag, dx: float, dy: float) -> None:
        aim, (number, light) = drag.aim, drag.before
        behind = handles.is_behind(light, aim.view)
        changed = handles.dragged(
            light, aim.view, aim.size, aim.x + dx, aim.y + dy, aim.scene.bounds, behind=behind
        )
        self.studio.edit({f"lights.{number}": changed.model_dump(mode="json")}, "light")

    def _nearest_light(self, aim: Aim) -> int | None:
        """The light whose handle is under the pointer; else the first one that can be dragged."""
        found: list[tuple[float, int]] = []
        for number, light in enumerate(aim.scene.lights):
            place = handles.handle_position(light, aim.view, aim.size, aim.scene.bounds)
            if place is not None:
                found.append((math.dist(place, (aim.x, aim.y)), number))
        near = min(found, default=(math.inf, None))
        return near[1] if near[0] <= _REACH or not found else found[0][1]

    def _draw_region(self, drag: Drag, dx: float, dy: float) -> None:
        self.region_now = (drag.start[0] + dx, drag.start[1] + dy)

    def _end_region(self, place: Place) -> None:
        start, self.region_start, self.region_now = self.region_start, None, None
        if start is None:
            return
        image = self.studio.shown_scene.image
        size, stereo = (image.width, image.height), self.studio.screens(self.studio.scene.stereo)
        corners = [eye_at(stereo, size, *corner)[1:] for corner in (start, place)]
        (left, right), (top, bottom) = (
            sorted(int(min(max(each, 0), most)) for each in ends)
            for ends, most in zip(zip(*corners, strict=True), size, strict=True)
        )
        region = (left, top, right - left, bottom - top)
        self.studio.set_region(region if min(region[2:]) >= 4 else None)

    def _is_double(self, place: Place, now: float) -> bool:
        before, where = self._clicked
        return now - before <= DOUBLE_CLICK_SECONDS and math.dist(place, where) <= DOUBLE_CLICK_PIXELS

    def _set_camera(self, aim: Aim, camera: Any, gesture: str | None) -> None:
        if aim.camera_path == "camera":
            self.studio.set_camera(camera, gesture)
        else:
            self.studio.edit({aim.camera_path: camera.model_dump(mode="json")}, gesture)

    def _set_plane(self, aim: Aim, plane: Any, gesture: str) -> None:
        self.studio.edit({aim.plane_path: plane.model_dump(mode="json")}, gesture)
