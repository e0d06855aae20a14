"""What keys do with the scene: cameras, planes, zooms, stereo and lights. Names as in `actions.py`."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from clfractal.errors import ClfractalError
from clfractal.scene.bookmarks import bookmark, view_of
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.deep import Deep
from clfractal.scene.object_checks import can_show
from clfractal.scene.parts import AnyCamera, OrthographicCamera, PerspectiveCamera
from clfractal.scene.rectangle import Axis, Plane
from clfractal.scene.renderer import RENDERERS
from clfractal.scene.stereo import Mode
from clfractal.schema.base import Vector
from clfractal.viewer import navigation, plane_moves, standard_views, zoom_box
from clfractal.viewer.aim import Aim
from clfractal.viewer.controls import Controls
from clfractal.viewer.editing import plain
from clfractal.viewer.motion import Motion
from clfractal.viewer.studio import Studio

STEREO_MODES: tuple[Mode | None, ...] = (
    None,
    "anaglyph",
    "split",
    "split_half",
    "over_under",
    "over_under_half",
    "rows",
    "columns",
    "checkerboard",
    "anaglyph_chessboard",
    "left",
    "right",
)
_STEP = 24.0  # pixels of a key's orbit or pan
_ZOOM = 0.85
_TURN = 5.0  # degrees
_MOVE = 0.04  # of a plane's height


class SceneOperators:
    """The actions that change the scene, by their names.

    Args:
        aim: what is under the pointer, or under the picture's middle if the pointer is elsewhere.
        now: seconds.

    Attributes:
        first_stereo: what a stereo section begins with that is made in the window: the width of its screen.
    """

    def __init__(
        self,
        studio: Studio,
        controls: Controls,
        motion: Motion,
        aim: Callable[[], Aim | None],
        now: Callable[[], float],
    ) -> None:
        self.studio, self.controls, self.motion = studio, controls, motion
        self.aim, self.now = aim, now
        self.first_stereo: Callable[[Mode], dict[str, Any]] = lambda mode: {}
        self._perspective: PerspectiveCamera | None = None
        self._kept: dict[str, Any] | None = None
        self._pivot: Vector | None = None
        self.operators: dict[str, Callable[[], object]] = {
            **self._cameras(),
            **self._planes(),
            **self._stereo(),
            "undo": lambda: self._undo("scene", self.studio.undo),
            "redo": lambda: self._undo("scene", self.studio.redo),
            "undo_camera": lambda: self._undo("camera", self.studio.undo),
            "redo_camera": lambda: self._undo("camera", self.studio.redo),
            "exposure_down": lambda: self._expose(-0.25),
            "exposure_up": lambda: self._expose(0.25),
            "exposure_reset": lambda: self._edit({"output.exposure": self.studio.saved.output.exposure}),
            "next_renderer": self.next_renderer,
            "region": self._choose_region,
            "region_clear": lambda: self.studio.set_region(None),
        }

    def _cameras(self) -> dict[str, Callable[[], None]]:
        ways = {"left": (-_STEP, 0), "right": (_STEP, 0), "up": (0, -_STEP), "down": (0, _STEP)}
        return {
            **{f"orbit_{way}": partial(self._orbit, *by) for way, by in ways.items()},
            **{f"pan_{way}": partial(self._pan, *by) for way, by in ways.items()},
            **{f"view_{side}": partial(self._view, side) for side in standard_views.SIDES},
            **{f"bookmark_{number}": partial(self.go_to_bookmark, number) for number in range(1, 10)},
            "zoom_in": lambda: self._zoom(_ZOOM),
            "zoom_out": lambda: self._zoom(1 / _ZOOM),
            "level": lambda: self._camera(navigation.levelled(self.studio.scene.camera)),
            "center_pointer": self._center,
            "focus_pointer": self._focus,
            "focus_pick": self._ask_focus,
            "frame_all": self.frame_all,
            "projection": self.switch_projection,
            "bookmark_add": self.add_bookmark,
        }

    def _planes(self) -> dict[str, Callable[[], None]]:
        moves: dict[str, tuple[float, float, float]] = {
            "move_out": (1, 0, 0),
            "move_in": (-1, 0, 0),
            "move_left": (0, -1, 0),
            "move_right": (0, 1, 0),
            "move_up": (0, 0, 1),
            "move_down": (0, 0, -1),
        }
        turns: dict[str, tuple[Axis, float]] = {
            "turn_left": ("up", -_TURN),
            "turn_right": ("up", _TURN),
            "turn_up": ("side", -_TURN),
            "turn_down": ("side", _TURN),
            "spin_left": ("normal", _TURN),
            "spin_right": ("normal", -_TURN),
        }
        return {
            **{name: partial(self._move, *way) for name, way in moves.items()},
            **{name: partial(self._turn, *turn) for name, turn in turns.items()},
            "larger": lambda: self._scale(1 / _ZOOM),
            "smaller": lambda: self._scale(_ZOOM),
            "cut": self._cut,
            "zoom_mark": self._mark,
            "zoom_apply": self._apply,
            "zoom_back": self.controls.step_back,
        }

    def _stereo(self) -> dict[str, Callable[[], None]]:
        return {
            "next_stereo": lambda: self.stereo_mode(1),
            "previous_stereo": lambda: self.stereo_mode(-1),
            "swap_eyes": lambda: self._of_stereo("swap", lambda value: not value),
            "fit_stereo": lambda: self._of_stereo("fit", lambda value: None if value else "auto"),
            "eyes_nearer": lambda: self._of_stereo("interpupillary_distance", lambda value: value / 1.05),
            "eyes_farther": lambda: self._of_stereo("interpupillary_distance", lambda value: value * 1.05),
            "screen_nearer": lambda: self._of_stereo("screen_distance", lambda value: value / 1.05),
            "screen_farther": lambda: self._of_stereo("screen_distance", lambda value: value * 1.05),
            "screen_narrower": lambda: self._of_stereo("screen_width", lambda value: value / 1.05),
            "screen_wider": lambda: self._of_stereo("screen_width", lambda value: value * 1.05),
        }

    # Cameras

    def _camera(self, camera: Any) -> None:
        self.motion.go_to(camera, self.now())

    def _orbit(self, dx: float, dy: float) -> None:
        camera, style = self.motion.target, self.controls.settings.orbit
        vertical = self.studio.saved.camera.up if style == "turntable" else None
        aim = None if self.motion.active else self.aim()
        if aim is not None and aim.camera_path == "camera":
            self._pivot = aim.pivot  # while the camera moves, steps that follow are about the same point
        pivot, size = self._pivot or camera.target, self.studio.viewport
        self._camera(navigation.orbit(camera, pivot, -dx, -dy, size, style, vertical=vertical))

    def _pan(self, dx: float, dy: float) -> None:
        self._camera(navigation.pan(self.motion.target, -dx, -dy, self.studio.viewport, math.inf))

    def _zoom(self, factor: float) -> None:
        aim = self.aim()
        if aim is not None and aim.plane is not None:
            self._plane(lambda plane: plane_moves.scale(plane, factor))
        else:
            self._camera(navigation.dolly(self.motion.target, factor))

    def _view(self, side: standard_views.Side) -> None:
        studio = self.studio
        self._camera(standard_views.axis_view(self.motion.target, side, studio.viewport, studio.scene.extent))

    def frame_all(self) -> None:
        """Shows the whole object."""
        aim = self.aim()
        if aim is not None and aim.plane_path:
            section = dict(self.studio.value(aim.plane_path))
            self._edit({aim.plane_path: {"normal": section.get("normal", [0.0, 0.0, 1.0])}})
            return
        studio, scene = self.studio, self.studio.scene
        whole = None if scene.animation is None else scene.deep  # which its tracks may move
        if whole != scene.deep:
            scene = scene.model_copy(update={"deep": None})
        self._go_to(standard_views.frame_all(self.motion.target, scene.extent, studio.viewport), whole)

    def switch_projection(self) -> None:
        """Perspective to orthographic and back, with what is at the target's depth in the same size."""
        camera = self.studio.scene.camera
        if isinstance(camera, OrthographicCamera):
            self.studio.set_camera(standard_views.to_perspective(camera, like=self._perspective))
        elif self.studio.scene.stereo is not None:
            self.studio.tell(
                "stereo needs a perspective camera",
                wrong=True,
                holds=lambda: self.studio.scene.stereo is not None,
            )
        else:
            self._perspective = camera
            self.studio.set_camera(standard_views.to_orthographic(camera, self.studio.scene.bounds))

    def _center(self) -> None:
        aim = self.aim()
        if aim is not None and aim.point is not None and not aim.plane_path:
            self.controls.center(aim, self.now())

    def _focus(self) -> None:
        aim = self.aim()
        if aim is not None:
            self.controls.focus(aim)

    def _ask_focus(self) -> None:
        self.controls.focusing = True
        self.studio.tell("click what shall be sharp", holds=lambda: self.controls.focusing)

    def _choose_region(self) -> None:
        self.controls.choosing_region = True
        self.studio.tell("drag a rectangle: it alone is refined", holds=lambda: self.controls.choosing_region)

    def add_bookmark(self) -> None:
        """Keeps the camera under a free name."""
        marks = dict(self.studio.value("bookmarks") or {})
        number = next(n for n in range(1, len(marks) + 2) if f"view {n}" not in marks)
        scene = self.studio.scene
        marks[f"view {number}"] = bookmark(scene.camera, scene.deep).model_dump(mode="json")
        if self._edit({"bookmarks": marks}):
            self.studio.tell(f"bookmark: view {number}")

    def go_to_bookmark(self, number: int) -> None:
        """Moves the camera to a bookmark, counted from 1 in their order."""
        marks = list(self.studio.scene.bookmarks.values())
        if number > len(marks):
            self.studio.tell(f"there is no bookmark {number}", wrong=True)
        else:
            self._go_to(*view_of(marks[number - 1]))

    def _go_to(self, camera: AnyCamera, deep: Deep | None) -> None:
        """Moves the camera, on a way to be seen within a place."""
        if deep == self.studio.scene.deep:
            self._camera(camera)
        else:
            self.motion.stop()
            self.studio.set_view(camera, deep)

    # Planes, zooms

    def _plane(self, change: Callable[[Plane], Plane]) -> None:
        """Changes the plane under the pointer, else the renderer's, else the first of the cut planes."""
        scene, aim = self.studio.scene, self.aim()
        if aim is not None and aim.plane is not None:
            path, plane = aim.plane_path, aim.plane
        elif isinstance(scene.renderer, CutPlaneRenderer):
            path, plane = "renderer.plane", scene.renderer.plane
        elif scene.cut_planes:
            path, plane = "cut_planes.0.plane", scene.cut_planes[0].plane
        else:
            return
        self._edit({path: change(plane).model_dump(mode="json")})

    def _move(self, normal: float, side: float, up: float) -> None:
        box = self.controls.box
        if self.controls.marking and box is not None:
            stage, aim = zoom_box.stage_of(self.studio.scene), self.aim()
            if aim is not None:
                self.controls.box = zoom_box.stepped(
                    box, stage, aim.view, right=0.25 * side, up=0.25 * up, forward=-0.25 * normal
                )
            return

        def moved(plane: Plane) -> Plane:
            step = _MOVE * plane.placed.height
            return plane_moves.shift(plane, normal=normal * step, side=side * step, up=up * step)

        self._plane(moved)

    def _turn(self, axis: Axis, angle: float) -> None:
        self._plane(lambda plane: plane_moves.rotate_in_place(plane, axis, angle))

    def _scale(self, factor: float) -> None:
        box = self.controls.box
        if self.controls.marking and box is not None:
            self.controls.box = zoom_box.scaled(box, zoom_box.stage_of(self.studio.scene), factor)
        else:
            self._plane(lambda plane: plane_moves.scale(plane, factor))

    def _cut(self) -> None:
        planes = self.studio.scene.cut_planes
        if planes:
            self._edit({"cut_planes.0.cut": not planes[0].cut})
        elif not isinstance(self.studio.scene.renderer, CutPlaneRenderer):
            self._edit({"cut_planes.0": {"cut": True}})

    def _mark(self) -> None:
        try:
            self.controls.mark(self.aim())
        except ClfractalError as error:
            self.studio.tell(error.message, wrong=True)

    def _apply(self) -> None:
        if not self.controls.marking:
            self._mark()
        else:
            self.controls.apply_box()

    def next_renderer(self) -> None:
        """Surface, volume, cut plane, and again."""
        scene = self.studio.scene
        if scene.layout is not None:
            self.studio.tell(
                "each view of a layout has a renderer of its own",
                wrong=True,
                holds=lambda: self.studio.scene.layout is not None,
            )
            return
        words = list(RENDERERS)
        kind = words[(words.index(scene.renderer.type) + 1) % len(words)]
        other, samples = RENDERERS[kind], scene.renderer.samples
        changes: dict[str, Any] = {"renderer": {"type": kind, "samples": samples, **other.first}}
        if other.has_own_colors and scene.coloring.uses_palette:
            changes["coloring.by"] = "solid"
        if other.is_flat:
            changes["cut_planes"] = []
        shown = {name: each for name, each in scene.objects.items() if can_show(kind, each.tag)}
        if len(shown) < len(scene.objects):
            changes["objects"] = plain(shown)
        if not self._edit(changes):
            self.studio.tell(self.studio.problems.get("renderer", "not possible"), wrong=True)

    # Stereo

    def stereo_mode(self, step: int) -> None:
        """The next or previous way of showing two eyes; the first is one eye alone, without stereo.

        A way that the scene does not fit (an odd width that cannot be halved) is told and left out.
        """
        stereo = self.studio.scene.stereo
        now = stereo.mode if stereo is not None else None
        place = STEREO_MODES.index(now) if now in STEREO_MODES else 2
        for count in range(1, len(STEREO_MODES)):
            mode = STEREO_MODES[(place + count * step) % len(STEREO_MODES)]
            if self._set_stereo(mode):
                self.studio.tell(f"stereo: {mode or 'off'}")
                return
            problem = self.studio.problems.pop("stereo", "not possible")
            self.studio.tell(problem if mode is None else f"stereo: {mode}: {problem}", wrong=True)
            if stereo is None and not isinstance(self.studio.scene.camera, PerspectiveCamera):
                return  # no other way would fit either

    def _set_stereo(self, mode: Mode | None) -> bool:
        if mode is None:
            self._kept = self.studio.value("stereo") or self._kept
            return self._edit({"stereo": None})
        section = self.studio.value("stereo") or self._kept or self.first_stereo(mode)
        return self._edit({"stereo": {**section, "mode": mode}})

    def _of_stereo(self, key: str, change: Callable[[Any], Any]) -> None:
        if self.studio.scene.stereo is None:
            self.studio.tell(
                "stereo is off; choose a mode first",
                wrong=True,
                holds=lambda: self.studio.scene.stereo is None,
            )
            return
        path = f"stereo.{key}"
        if not self._edit({path: change(self.studio.value(path))}):
            self.studio.tell(self.studio.problems.get(path, "not possible"), wrong=True)

    # Common

    def _expose(self, stops: float) -> None:
        self._edit({"output.exposure": round(self.studio.exposure + stops, 3)})

    def _undo(self, kind: Any, how: Callable[[Any], bool]) -> None:
        self.motion.stop()
        if not how(kind):
            self.studio.tell("nothing more to undo or redo")

    def _edit(self, values: dict[str, Any]) -> bool:
        return self.studio.edit(values)
