"""A scene that is edited at a frame of its film: what is shown and saved, keys, steps of undo."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from clfractal.errors import ClfractalError
from clfractal.scene.animation import Animation
from clfractal.scene.load import check_scene
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from clfractal.scene.parts import AnyCamera
from clfractal.viewer import film_place
from clfractal.viewer.editing import edited, replaced
from clfractal.viewer.film_place import FilmPlace, Keyed
from clfractal.viewer.history import History, Kind
from clfractal.viewer.kept_view import differ_in_more

MOVING_SECONDS = 0.4
"""So long after a move more of it is expected."""


@dataclass(slots=True)
class Told:
    """Whether something was wrong, and told."""

    wrong: bool = False


class InFilm(ABC):
    """The part of a studio that knows films.

    Attributes:
        scene: as it is now. While a frame of its film is shown (`place`), it has the values of that frame in the places
            of its tracks; what is saved is `document`.
        saved: the document as its file has it.
        opened: the document as it was opened, loaded again, or saved last: its file's, with values of the command line.
        place: the frame that is shown; None: the scene as it stands.
        auto_keys: whether a change of what a track moves sets a key at once.
        recording: whether a flight is recorded: then changes are no steps of undo, and set no keys.
    """

    history: History

    def __init__(self, scene: Scene) -> None:
        self.scene = self.saved = self.opened = scene
        self.place: FilmPlace | None = None
        self.auto_keys = self.recording = False
        self._moving_until = 0.0
        self._document: tuple[Scene, FilmPlace, Scene] | None = None
        self._first: tuple[Scene, Scene] | None = None

    @abstractmethod
    def refresh(self, *, again: bool = False, follows: bool = False) -> None:
        """Asks for a picture; see `Studio`."""

    @abstractmethod
    def tell(self, text: str, *, wrong: bool = False) -> None:
        """A line for the user; see `Studio`."""

    @contextmanager
    def telling(self) -> Iterator[Told]:
        """Mistakes of users are told, instead of being raised; `Told.wrong` says afterwards whether there was one."""
        told = Told()
        try:
            yield told
        except ClfractalError as error:
            told.wrong = True
            self.tell(str(error), wrong=True)

    @abstractmethod
    def undo(self, kind: Kind = "scene") -> bool:
        """Takes back a step; see `Studio`."""

    @abstractmethod
    def end_gesture(self) -> None:
        """A drag has ended; see `Studio`."""

    @property
    def document(self) -> Scene:
        """The scene to be saved: what its tracks move is as its file has it, whichever frame is shown."""
        place, scene = self.place, self.scene
        if place is None:
            return scene
        known = self._document
        if known is None or known[0] is not scene or known[1] is not place:
            known = self._document = (scene, place, place.document(scene))
        return known[2]

    @property
    def unsaved(self) -> bool:
        """Whether the document differs from its file."""
        document = self.document
        return document is not self.saved and document != self.saved

    @property
    def edited(self) -> bool:
        """Whether anything but cameras was changed since it was opened: a move of the camera alone is nothing to keep."""
        return differ_in_more(self.document, self.opened)

    @property
    def frame_number(self) -> float | None:
        """The film's frame that is shown; None: the scene as it stands."""
        return self.place.frame if self.place is not None else None

    def keep(self, saved: Scene) -> None:
        """The document was saved, as this scene: names of files may be others now."""
        elsewhere = self.document.folder != saved.folder
        self.saved = self.opened = saved
        if elsewhere or self.place is None or self.scene is self.place.posed:
            self._pose(saved, self.frame_number)

    def load_again(self, document: Scene, opened: Scene, saved: Scene) -> None:
        """The same for what was loaded from the scene's file once more; a camera that was moved at a frame stays there.

        Args:
            document: with the cameras that are to be kept.
            opened, saved: see there.
        """
        place, camera = self.place, self.scene.camera
        moved = place is not None and camera != place.posed.camera
        if self._take(document):
            self.opened, self.saved = opened, saved
        if moved and self.place is not None and type(camera) is type(self.scene.camera):
            self.scene = self.scene.model_copy(update={"camera": camera})
            self.refresh()

    def _take(self, document: Scene) -> bool:
        before = self.document
        frame = self.frame_number
        if frame is None and before.animation is None and document.animation is not None:
            frame = 0.0
        if not self._pose(document, frame):
            return False
        self.history.add(before, document)
        return True

    def adjust(self, values: Mapping[str, Any]) -> None:
        """Sets values that no track moves, as no step of undo and no unsaved change: they follow from the window.

        Raises:
            ClfractalError: they are wrong.
        """
        unsaved = self.unsaved
        scene = edited(self.scene, values)
        if self.place is not None:
            rest, posed = edited(self.place.rest, values), edited(self.place.posed, values)
            # (An unchanged scene stays the very one that was posed.)
            scene = posed if self.scene is self.place.posed else scene
            self.place = FilmPlace(self.place.frame, rest, posed)
        self.scene = scene
        with suppress(ClfractalError):
            self.opened = edited(self.opened, values)
        if not unsaved:
            self.saved = self.document

    # Frames

    def go_to_frame(self, frame: float | None, *, moving: bool = False) -> bool:
        """Shows a frame of the film, or with None the scene as it stands; no step of undo. Whether that was possible.

        What was changed at the frame before, and has no key, stays behind there.

        Args:
            frame: from 0 to the last one; it may lie between two.
            moving: whether others will follow soon: the picture may be coarse.
        """
        document, place = self.document, self.place
        if frame is not None:
            if document.animation is None:
                return False
            frame = min(max(frame, 0.0), float(document.animation.count - 1))
            if place is not None and place.frame == frame and self.scene is place.posed and moving:
                return True
        return self._pose(document, frame, moving=moving)

    def _pose(self, document: Scene, frame: float | None, *, moving: bool = False) -> bool:
        """Shows a document at a frame; on a mistake all stays as it was, and a message tells it."""
        place = None
        with self.telling() as told:
            if frame is not None and document.animation is not None:
                place = _within(document, frame)
        if told.wrong:
            return False
        self.place, self.scene = place, document if place is None else place.posed
        self._moving_until = time.perf_counter() + MOVING_SECONDS if moving else 0.0
        self.refresh()
        return True

    def show_camera(self, camera: AnyCamera) -> None:
        """Another camera at the frame that is shown, as no step of undo: a flight that is recorded goes on."""
        self.scene = self.scene.model_copy(update={"camera": camera})
        self._moving_until = time.perf_counter() + MOVING_SECONDS
        self.refresh()

    def as_rendered(self, scene: Scene) -> Scene:
        """What is rendered of a scene that is edited here.

        At a frame it has the film's motion blur, unless what a track moves was changed there: its way is not known yet.
        """
        if self.place is None:
            return film_place.as_it_stands(scene)
        return film_place.rendered(scene, self.place.frame, blurred=not self.unkeyed())

    @property
    def exposed_in(self) -> Scene | None:
        """The scene in which an exposure of `auto` is measured: a film's first frame; None: the one that is shown."""
        if self.place is None or not isinstance(self.scene.output.exposure, str):
            return None
        document, known = self.document, self._first
        if known is None or known[0] is not document:
            try:
                first = movement_of(document).scene(0)
            except ClfractalError:  # while a key is dragged; the drag's end tells it
                return None
            known = self._first = (document, first)
        return known[1] if isinstance(known[1].output.exposure, str) else None

    # Keys

    def set_animation(self, animation: Animation | None, gesture: str | None = None) -> bool:
        """Another animation, as a step that can be undone; the frame that is shown follows it. Whether it was possible.

        Without one before, its first frame is shown; without one afterwards, the scene as it stands.

        Args:
            gesture: see `Studio.edit`; while a drag goes on only the tracks are checked, at its end all frames.
        """
        before = self.document
        with self.telling():
            after = before.model_copy(update={"animation": animation})
            if gesture is None:
                check_scene(after)
            if self._pose(after, self.frame_number or 0.0, moving=gesture is not None):
                self.history.add(before, after, gesture)
                return True
        return False

    def end_drag(self) -> None:
        """Ends a drag of keys: all frames are checked, and it is taken back if one of them is not possible."""
        try:
            check_scene(self.document)
        except ClfractalError as error:
            self.tell(str(error), wrong=True)
            self.undo("scene")
        self.end_gesture()

    def set_keys(self) -> Keyed | None:
        """Sets keys for all that was changed at the frame that is shown, as one step; None if that was not possible."""
        place = self.place
        if place is None or self.scene.animation is None:
            return None
        with self.telling():
            found = film_place.keyed(self.scene, place)
            after = self.scene.model_copy(update={"animation": found.animation})
            check_scene(after)
            keyed = self._keyed_place(place, after)
            if found.keyed:
                self.history.seal()
                self.history.add(self.scene, after, None, place.frame)
                self.scene, self.place = after, keyed
                self.refresh()
            return found
        return None

    def changed(self) -> dict[film_place.Path, tuple[Any, Any]]:
        """What was changed at the frame that is shown, and has no key: by path, (before, after)."""
        if self.place is None or self.scene is self.place.posed:
            return {}
        return film_place.changes(self.place.posed, self.scene)

    def unkeyed(self) -> list[str]:
        """The tracks whose values were changed at the frame that is shown, and have no key: another frame undoes it."""
        changed = self.changed()
        if not changed:
            return []
        targets = movement_of(self.scene).targets.items() if self.scene.animation is not None else ()
        return [name for name, target in targets if any(target.path[: len(path)] == path for path in changed)]

    def _auto_keyed(self, scene: Scene) -> tuple[Scene, FilmPlace | None]:
        """An edited scene, with keys for what tracks move if they are to be set at once."""
        place = self.place
        if place is None or scene.animation is None:
            return scene, None
        if not self.auto_keys or self.recording:
            return scene, place
        with self.telling():
            found = film_place.keyed(scene, place, tracked_only=True)
            if found.keyed:
                scene = scene.model_copy(update={"animation": found.animation})
                place = self._keyed_place(place, scene)
        return scene, place

    @staticmethod
    def _keyed_place(place: FilmPlace, scene: Scene) -> FilmPlace:
        """The place after keys were set: what has one is changed no more."""
        return film_place.place_at(place.document(scene), place.frame)

    def _put_back(self, sections: dict[str, Any], frame: float | None) -> None:
        """Sections of a step of undo, at the frame at which it was made.

        Raises:
            ClfractalError: they do not fit the present scene, which stays.
        """
        document, place = self.document, self.place
        if frame is None or document.animation is None:
            changed = replaced(document, sections)
            shown = self.frame_number
            if shown is None and document.animation is None and changed.animation is not None:
                shown = 0.0
            at = None if changed.animation is None or shown is None else _within(changed, shown)
            self.place, self.scene = at, changed if at is None else at.posed
            return
        scene = self.scene
        if place is None or place.frame != frame:
            place = _within(document, frame)
            scene = place.posed
        scene = replaced(scene, sections)
        at = None if scene.animation is None else self._keyed_place(place, scene)
        self.place, self.scene = at, scene


def _within(document: Scene, frame: float) -> FilmPlace:
    assert document.animation is not None
    return film_place.place_at(document, min(frame, float(document.animation.count - 1)))
