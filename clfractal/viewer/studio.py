"""What the window shows and edits, without a window: the scene, its history, its picture, and work beside it.

Panels, keys and pointers change the scene only through this class; so all of them can be undone, saved and tested alike.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clfractal.device.select import Device
from clfractal.engine.show import Look
from clfractal.errors import ClfractalError
from clfractal.scene.deep import Deep
from clfractal.scene.model import Scene
from clfractal.scene.parts import OrthographicCamera, PerspectiveCamera
from clfractal.scene.stereo import Stereo
from clfractal.viewer.background import Still, Thumbnail
from clfractal.viewer.editing import edited, replaced, value_at
from clfractal.viewer.film_queue import FilmQueue
from clfractal.viewer.filming import MOVING_SECONDS, InFilm
from clfractal.viewer.formula_texts import FormulaTexts
from clfractal.viewer.frame import Frame
from clfractal.viewer.history import History, Kind
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.picking import Pick, picked
from clfractal.viewer.session import Session
from clfractal.viewer.shared import Group, Shared
from clfractal.viewer.tracked import TrackedError, check_tracked
from clfractal.viewer.viewport import image_of, render_key

Camera = PerspectiveCamera | OrthographicCamera
MESSAGE_SECONDS = 6.0
# How long the window waits for a device to end what it does, seconds.
_PATIENCE = 0.25
# Within so many seconds an equal line is the same event.
_AGAIN = 0.1
_PATIENCE_AT_END = 2.0
MOST_MESSAGES = 200
MOST_THUMBNAILS = 300


@dataclass(frozen=True, slots=True)
class Message:
    """A line for the user: what was done, or what went wrong.

    Attributes:
        holds: whether its cause is still there; it goes when that does.
        topic: what it is about, such as an action: of each topic the newest lines are shown alone. Empty: nothing.
    """

    text: str
    wrong: bool
    time: float
    holds: Callable[[], bool] = lambda: True
    topic: str = ""


class Studio(InFilm):
    """A scene that is looked at and edited.

    Args:
        scene: the first one.
        device: where it is rendered.
        pacing: how coarse moving pictures may be.
        woken: called from any thread when the window has something new to show.

    Attributes:
        scene: as it is now; `image` is what files of it say, not the window's size. While a frame of its film is shown
            (`place`), it has the values of that frame; what is saved is `document`.
        place: the frame that is shown; None: the scene as it stands.
        auto_keys: whether a change of what a track moves sets a key at once.
        problems: dotted path -> what was wrong with the value that was last tried there.
        viewport: width and height of what the window shows, pixels.
        messages: lines for the user, the newest last.
        formula_texts: how formulas were typed.
        shared_in_text: what the scene's text has once and uses at several places.
        screens: how the screens show a scene's pair; eyes with a screen each have another way than the scene's.
    """

    def __init__(self, scene: Scene, device: Device, pacing: Pacing, woken: Callable[[], None]) -> None:
        super().__init__(scene)
        self.pacing, self.woken = pacing, woken
        self.history = History()
        self.problems: dict[str, str] = {}
        self.messages: list[Message] = []
        self._topic = ""
        self.viewport = (1280, 720)
        self.screens: Callable[[Stereo | None], Stereo | None] = lambda stereo: stereo
        self.shared_in_text: Callable[[], tuple[Group, ...]] = tuple
        self._shared = Shared()
        self.formula_texts = FormulaTexts()
        self.region: tuple[int, int, int, int] | None = None
        self.smooth = True
        self.stills: list[Still] = []
        self.films = FilmQueue()
        self._thumbnails: dict[Hashable, Thumbnail] = {}
        self._requested: Any = None
        self.session = Session(device, pacing, woken)
        self.session.start()

    # The scene

    def edit(self, values: Mapping[str, Any], gesture: str | None = None) -> bool:
        """Sets values at dotted paths, as in a scene file (`{"lights.0.intensity": 2.0}`); whether they were valid.

        Args:
            values: see `editing.edited`. A path of one part, such as `coloring`, replaces a whole section.
            gesture: a name for edits that follow each other, as while a slider is dragged: they are one step of undo, and
                the picture may be coarse meanwhile. Call `end_gesture` when it is let go.

        On a mistake the scene stays as it was, and `problems` tells what is wrong with each path.
        """
        try:
            changed = self._tied(edited(self.scene, values))
        except ClfractalError as error:
            tracked = isinstance(error, TrackedError)
            of_film = not tracked and (error.where.path or "").startswith("animation.")
            text = str(error) if of_film else error.message
            self.problems |= dict.fromkeys(values, text)
            if (tracked or of_film) and gesture is None:  # no panel of what is edited has a place for it
                paths = tuple(values)
                self.tell(
                    text, wrong=True, holds=lambda: any(self.problems.get(path) == text for path in paths)
                )
            return False
        for path in values:
            self.problems.pop(path, None)
        self._replace(changed, gesture)
        return True

    def set_camera(self, camera: Camera, gesture: str | None = None) -> None:
        """Moves the camera; it is a step of the camera's own undo.

        A camera of another kind is refused, by a message, if a track moves what it does not have.
        """
        changed = self.scene.model_copy(update={"camera": camera})
        if type(camera) is not type(self.scene.camera):
            try:
                check_tracked(self.scene, changed)
            except ClfractalError as error:
                self.tell(error.message, wrong=True)
                return
        try:
            changed = self._tied(changed)
        except ClfractalError as error:
            self.tell(f"camera: {error}", wrong=True)
            return
        self._replace(changed, gesture)

    def set_view(self, camera: Camera, deep: Deep | None) -> None:
        """Another camera in a place of any depth, as a step of the camera's own undo."""
        if deep == self.scene.deep:
            self.set_camera(camera)
            return
        try:
            changed = self._tied(replaced(self.scene, {"camera": camera, "deep": deep}))
        except ClfractalError as error:
            self.tell(str(error), wrong=True)
            return
        self._replace(changed, None)

    def retell(self, scene: Scene) -> None:
        """The same view by other numbers, see `scene.deeper`: no step of undo by itself, and a movement goes on."""
        before = self.scene
        scene, place = self._auto_keyed(scene)
        self.history.retell(before, scene, place.frame if place is not None else None)
        self.scene, self.place = scene, place
        self.refresh()

    def set_scene(self, scene: Scene, gesture: str | None = None) -> None:
        """Another scene in the place of this one, as a step that can be undone (a variation, for example)."""
        with suppress(ClfractalError):  # what cannot be the same at all places of a shared value becomes two
            scene = self._tied(scene)
        self._replace(scene, gesture)

    def open(self, scene: Scene) -> None:
        """Shows a scene that was loaded, a film's first frame if it moves; its history begins anew."""
        self.scene = self.saved = self.opened = scene
        self.place = None
        self.history = History()
        self.problems.clear()
        self.messages.clear()  # they are about the scene before
        self.region = None
        if scene.animation is None or not self.go_to_frame(0.0):
            self.refresh()

    def value(self, path: str) -> Any:
        """The plain value at a dotted path."""
        return value_at(self.scene, path)

    def end_gesture(self) -> None:
        """A drag has ended: the next edit is a new step, and the picture goes to full resolution."""
        self.history.seal()
        self._moving_until = 0.0
        self.refresh(follows=True)

    def undo(self, kind: Kind = "scene") -> bool:
        """Takes back the last step of one stack, at the film's frame at which it was made; whether there was one."""
        return self._restore(kind, redo=False)

    def redo(self, kind: Kind = "scene") -> bool:
        """Repeats the step that was taken back last."""
        return self._restore(kind, redo=True)

    # The picture

    @property
    def frame(self) -> Frame | None:
        """The newest picture on the device."""
        return self.session.frame

    @property
    def look(self) -> Look:
        """How the picture is shown at the moment."""
        scene = self.scene
        return Look(
            self.exposure,
            self.screens(scene.stereo),
            self.smooth,
            transparent=scene.background == "transparent",
            tone=scene.output.tone,
        )

    @property
    def exposure(self) -> float:
        """The exposure in use, stops: the scene's, or what was measured for the newest picture."""
        output, frame = self.scene.output, self.frame
        if isinstance(output.exposure, str) and frame is not None:
            return frame.job.scene.output.stops
        return output.stops

    @property
    def shown_scene(self) -> Scene:
        """The scene as the window renders it: with an image of the viewport's size."""
        stereo = self.screens(self.scene.stereo)
        width, height = image_of(stereo, self.viewport)
        shown = {"image": self.scene.image.resized(width, height), "stereo": stereo}
        return self.as_rendered(self.scene).model_copy(update=shown)

    def resize(self, width: int, height: int) -> None:
        """The window has another size, pixels; nothing happens if it is the same."""
        if (width, height) == self.viewport or width <= 0 or height <= 0:
            return
        self.viewport = (width, height)
        self.region = None
        if self._requested is not None:
            self.refresh()

    def refresh(self, *, again: bool = False, follows: bool = False) -> None:
        """Asks for a picture of what is wanted now, unless it is there or under way already.

        Args:
            again: render even what is there (the device has changed, or the user insists).
            follows: it ends a movement, and comes after what was begun for that; see `Session.request`.
        """
        moving = time.perf_counter() < self._moving_until
        exposed_in = self.exposed_in
        key = (render_key(self.shown_scene), self.region, exposed_in)
        failed = self.session.frame is None and self.session.problem is not None and not moving
        if not again and key == self._requested and not failed:
            return
        self._requested = key
        self.session.request(
            key[0], moving=moving, region=self.region, exposed_in=exposed_in, follows=follows
        )

    def tick(self) -> None:
        """Asks for the first picture; called every turn."""
        if self._requested is None:
            self.refresh()

    def set_region(self, region: tuple[int, int, int, int] | None) -> None:
        """Refines only a part of the picture: x, y, width, height, pixels of each eye's picture; None: all again."""
        self.region = region
        self.refresh()

    def pick(self, x: float, y: float, depths: Any) -> Pick | None:
        """What lies under a pixel of the window; None if nothing was rendered there yet. See `picking.picked`."""
        return picked(depths, x, y) if depths is not None else None

    def use_device(self, device: Device) -> None:
        """Goes on with another device; the last picture stays until the new one is there."""
        before = self.session
        ended = before.close(_PATIENCE)
        self.session = Session(device, self.pacing, self.woken)
        self.session.start()
        if ended:
            self._take_over(before)
        else:
            threading.Thread(target=self._take_over, args=(before,), daemon=True).start()
        self._requested = None
        self.refresh()

    def _take_over(self, before: Session) -> None:
        """Goes on with the tasks of a session that is closed, when it has ended: measuring a device takes seconds."""
        before.close(None)
        for task in before.take_tasks():
            self.session.add(task)

    # Beside the picture

    def thumbnail(
        self, key: Hashable, load: Callable[[], Scene], size: tuple[int, int], samples: int = 1
    ) -> Thumbnail:
        """A small picture that is rendered in the background, once for a key; ask again until it is `finished`."""
        found = self._thumbnails.get(key)
        if found is None:
            found = self._thumbnails[key] = Thumbnail(load, size, samples)
            self.session.add(found)
            while len(self._thumbnails) > MOST_THUMBNAILS:
                self._thumbnails.pop(next(iter(self._thumbnails))).cancel()
        return found

    def forget_thumbnails(self, belongs: Callable[[Hashable], bool]) -> None:
        """Drops thumbnails that nobody wants any more."""
        for key in [key for key in self._thumbnails if belongs(key)]:
            self._thumbnails.pop(key).cancel()

    def render_still(
        self, paths: tuple[Path, ...], size: tuple[int, int] | None = None, samples: int | None = None
    ) -> Still:
        """Renders the present scene to files in the background; see `Still` for its progress and result.

        Args:
            size: of the scene's image, pixels; None: as the window shows it.
            samples: None: the scene's.
        """
        width, height = size if size is not None else image_of(self.scene.stereo, self.viewport)
        scene = self.as_rendered(self.scene).model_copy(
            update={"image": self.scene.image.resized(width, height)}
        )
        if samples is not None:
            scene = edited(scene, {"renderer.samples": samples})
        still = Still(scene, paths, exposed_in=self.exposed_in)
        self.stills.append(still)
        self.session.add(still)
        return still

    @property
    def busy_beside(self) -> bool:
        """Whether stills or films are rendered beside the picture."""
        return self.films.busy or any(not still.finished for still in self.stills)

    def begin_topic(self, topic: str) -> None:
        """What is told from now on is about something, such as an action; what was told about it before is gone."""
        self._topic = topic
        if topic:
            self.messages[:] = [message for message in self.messages if message.topic != topic]

    def tell(self, text: str, *, wrong: bool = False, holds: Callable[[], bool] = lambda: True) -> None:
        """A line for the user; one that was told just now is not told twice.

        Args:
            holds: whether its cause is still there: the line goes with it.
        """
        new = Message(" ".join(text.split()), wrong, time.perf_counter(), holds, self._topic)
        last = self.messages[-1] if self.messages else None
        if last is None or last.text != new.text or last.time <= new.time - _AGAIN:
            self.messages.append(new)
            del self.messages[:-MOST_MESSAGES]
            self.woken()

    def close(self) -> None:
        """Ends all work; files that are being written become complete."""
        self.session.close(_PATIENCE_AT_END)
        for still in self.stills:
            still.finish_writing()

    def _tied(self, changed: Scene) -> Scene:
        """An edited scene in which what is one thing in its text still is.

        Raises:
            ClfractalError: the new value is not possible at another of its places.
        """
        return self._shared.tied(self.scene, changed, self.shared_in_text())

    def _replace(self, scene: Scene, gesture: str | None) -> None:
        scene, place = self._auto_keyed(scene)
        if not self.recording:
            self.history.add(self.scene, scene, gesture, place.frame if place is not None else None)
        self.scene, self.place = scene, place
        self._moving_until = time.perf_counter() + MOVING_SECONDS if gesture is not None else 0.0
        self.refresh()

    def _restore(self, kind: Kind, *, redo: bool) -> bool:
        step = self.history.next_step(kind, redo=redo)
        if step is None:
            return False
        present = self.scene
        try:
            self._put_back(step.after if redo else step.before, step.frame)
        except ClfractalError as error:
            # The other stack has moved on: a step of stereo does not fit an orthographic camera, for example.
            self.tell(f"this step does not fit the present scene: {error}", wrong=True)
            return True
        (self.history.redo if redo else self.history.undo)(kind)
        self._shared.follow(present, self.scene, self.shared_in_text())
        self._moving_until = 0.0
        self.refresh()
        return True
