"""Plays a scene's film in the window, by the clock, and records flights into it."""

from __future__ import annotations

from collections.abc import Sequence

from clfractal.scene.animation import MAX_FRAMES, Animation
from clfractal.scene.parts import AnyCamera
from clfractal.viewer import film_place
from clfractal.viewer import timeline_edits as timeline
from clfractal.viewer.number_words import counted
from clfractal.viewer.studio import Studio
from clfractal.viewer.thinning import Sample, flight

_CAMERA = ("position", "target", "up")


class Player:
    """The film's clock.

    Attributes:
        playing: whether the film runs; frames for which there is no time are left out.
        repeat: whether it begins again after its end.
        span: the first and the last frame of the part that is played; None: all of the film.
    """

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        self.playing = False
        self.repeat = True
        self.span: tuple[int, int] | None = None
        self._since = 0.0
        self._from = 0.0
        self._samples: list[Sample] = []
        self._first: AnyCamera | None = None
        self._start = 0.0

    @property
    def film(self) -> Animation | None:
        """The scene's animation."""
        return self.studio.scene.animation

    @property
    def recording(self) -> bool:
        """Whether a flight is recorded."""
        return self.studio.recording

    def open_film(self) -> None:
        """Shows the film's first frame, of a new film if there is none; or again the scene as it stands."""
        self.stop()
        if self.recording:
            self._end_recording()
        elif self.studio.frame_number is not None:
            self.studio.go_to_frame(None)
        elif self.film is None:
            self.studio.set_animation(timeline.new_film())
        else:
            self.studio.go_to_frame(0.0)

    def switch_repeat(self) -> None:
        """Repeats the film while it plays, or plays it once."""
        self.repeat = not self.repeat
        self.studio.tell("the film is repeated" if self.repeat else "the film is played once")

    def switch_auto_keys(self) -> None:
        """Sets keys at once where the value of a track changes, or not."""
        self.studio.auto_keys = not self.studio.auto_keys
        self.studio.tell(
            "changes of what moves set keys at once" if self.studio.auto_keys else "keys are set by hand"
        )

    # Playing

    def played(self, film: Animation) -> tuple[int, int]:
        """The first and the last frame that are played; a part that the film no longer has is none."""
        last = film.count - 1
        if self.span is None or self.span[0] >= last:
            return 0, last
        return self.span[0], min(self.span[1], last)

    def set_span(self, first: float, last: float) -> None:
        """Plays only a part, from one frame to another, in any order; all of the film if they are the same."""
        low, high = sorted((round(first), round(last)))
        self.span = (max(low, 0), high) if high > max(low, 0) else None

    def span_end(self, way: int) -> None:
        """The part that is played ends at the frame that is shown, or with -1 begins there."""
        film = self.film
        if film is None or self.studio.frame_number is None:
            return
        frame, (first, last) = round(self.studio.frame_number), self.played(film)
        if way < 0:
            self.set_span(frame, last if frame < last else film.count - 1)
        else:
            self.set_span(first if frame > first else 0, frame)
        self._tell_span(film)

    def span_clear(self) -> None:
        """Plays all of the film again."""
        self.span = None
        if self.film is not None:
            self._tell_span(self.film)

    def _tell_span(self, film: Animation) -> None:
        first, last = self.played(film)
        whole = (first, last) == (0, film.count - 1)
        self.studio.tell("all of the film is played" if whole else f"frames {first} to {last} are played")

    def play(self, now: float) -> None:
        """Plays from the frame that is shown, or from the beginning if that is not before the end; or stops."""
        if self.recording:
            self.record(now)
            return
        if self.playing:
            self.stop()
            return
        film = self.film
        if film is None or film.count < 2:
            self.studio.tell(
                "there is no film to play; a film begins in the timeline",
                holds=lambda: self.studio.scene.animation is None,
            )
            return
        frame = self.studio.frame_number or 0.0
        self._tell_unkeyed()
        first, last = self.played(film)
        self._since, self._from = now, frame if first <= frame < last else float(first)
        self.playing = self.studio.go_to_frame(self._from, moving=True)

    def stop(self) -> None:
        """Stops at the frame that is shown; its picture becomes whole."""
        if self.playing:
            self.playing = False
            self.studio.end_gesture()

    def show(self, frame: float, *, moving: bool = False) -> None:
        """Goes to a frame; a film that plays goes on from there."""
        if frame != self.studio.frame_number and not self.playing:
            self._tell_unkeyed()
        if self.studio.go_to_frame(frame, moving=moving or self.playing):
            self._from, self._since = self.studio.frame_number or 0.0, self._now

    def _tell_unkeyed(self) -> None:
        names, frame = self.studio.unkeyed(), self.studio.frame_number
        if names:
            self.studio.tell(f"without a key, {_listed(names, 3)} went back to the film at frame {frame:g}")

    _now = 0.0

    def step(self, now: float) -> bool:
        """Shows the frame whose time has come; whether anything changed. Called in every turn of the window's loop."""
        self._now = now
        film = self.film
        if film is None or self.studio.frame_number is None:
            if self.playing or self.recording:
                self.playing = self.studio.recording = False
                return True
            return False
        if self.recording:
            return self._recorded(now, film)
        if not self.playing:
            return False
        frame = int(self._from + (now - self._since) * film.fps + 1e-6)
        first, last = self.played(film)
        if frame > last:
            if not (self.repeat or film.loop):
                self.studio.go_to_frame(last)
                self.stop()
                return True
            frame = first + (frame - first) % (last - first + 1)
        if frame == self.studio.frame_number:
            return False
        if not self.studio.go_to_frame(frame, moving=True):
            self.stop()
        return True

    def wait(self, now: float) -> float | None:
        """Seconds until the next frame is due; None if nothing plays."""
        if self.film is None or not (self.playing or (self.recording and self._samples)):
            return None
        passed = (now - self._since) * self.film.fps
        return max((int(passed) + 1 - passed) / self.film.fps, 0.0)

    # From frame to frame

    def by(self, frames: int) -> None:
        """Some frames on, or back; from the end to the beginning where the film repeats."""
        film, now = self.film, self.studio.frame_number
        if film is not None:
            frame = round(now) + frames if now is not None else 0
            self._stop_at(frame % film.count if self.repeat else frame)

    def to_key(self, way: int) -> None:
        """To the next frame with a key, or with -1 to the one before."""
        film = self.film
        if film is None:
            return
        self.stop()
        find = timeline.key_after if way > 0 else timeline.key_before
        found = find(film, self.studio.frame_number or 0.0)
        if found is None:
            self.studio.tell(f"there is no key {'after' if way > 0 else 'before'} this frame")
        else:
            self.show(found)

    def to_end(self, way: int) -> None:
        """To the last frame, or with -1 to the first."""
        if self.film is not None:
            self._stop_at(self.film.count - 1 if way > 0 else 0)

    def _stop_at(self, frame: float) -> None:
        self.stop()
        self.show(frame)

    # Keys

    def set_keys(self) -> None:
        """Sets keys for what was changed at this frame; tells what became of it."""
        studio = self.studio
        found = studio.set_keys() if self._in_film() else None
        if found is None:
            return
        for name in found.refused:
            studio.tell(f"{name}: {film_place.why_no_keys(studio.scene, name)}", wrong=True)
        if found.keyed:
            studio.tell(f"keys at frame {studio.frame_number:g}: {_listed(found.keyed, 4)}")
        elif not found.refused:
            studio.tell("nothing was changed at this frame; + in the timeline adds a track")

    # Recording

    def record(self, now: float) -> None:
        """Waits for the camera's first move, and records from then on; or ends the recording and makes it keys."""
        studio = self.studio
        if self.recording:
            self._end_recording()
            return
        self.stop()
        if not self._in_film():
            return
        self._samples, self._first = [], studio.scene.camera
        self._start = studio.frame_number or 0.0
        studio.recording = True
        studio.history.seal()
        studio.tell(
            "recording: begins with the first move",
            holds=lambda: studio.recording and len(self._samples) < 2,
        )

    def _in_film(self) -> bool:
        """Shows a frame of the film, of a new one if there is none; whether that is possible."""
        studio = self.studio
        if studio.scene.animation is None and not studio.set_animation(timeline.new_film()):
            return False
        return studio.frame_number is not None or studio.go_to_frame(0.0)

    def _recorded(self, now: float, film: Animation) -> bool:
        studio = self.studio
        camera = studio.scene.camera
        if not self._samples:
            if camera is self._first:
                return False
            self._since = now
            self._samples.append(Sample.of(0.0, camera))
            return True
        passed = (now - self._since) * film.fps
        if self._start + passed >= MAX_FRAMES - 1:
            self._end_recording()
            return True
        if passed <= self._samples[-1].frame:
            return False
        self._samples.append(Sample.of(passed, camera))
        frame = int(self._start + passed)
        if frame == studio.frame_number or frame >= film.count:
            return False  # beyond the film's end all else stands still
        if studio.go_to_frame(frame, moving=True):
            own = {name: getattr(camera, name) for name in _CAMERA}
            studio.show_camera(studio.scene.camera.model_copy(update=own))
        return True

    def _end_recording(self) -> None:
        studio, samples = self.studio, self._samples
        studio.recording, self._samples = False, []
        if len(samples) < 2 or samples[-1].frame < 1:
            studio.end_gesture()
            studio.tell("nothing was recorded")
            return
        # The camera's own steps of undo were the recording; as the film's they are one.
        studio.go_to_frame(self._start)
        with studio.telling():
            animation, frames = flight(studio.scene, samples, self._start), samples[-1].frame
            if studio.set_animation(animation):
                end = self._start + frames + 1
                keys = timeline.keys_between(animation, self._start, end, ["camera.position"])
                count = counted(len(keys), "key")
                studio.tell(f"recorded {frames / animation.fps:.1f} s of flight as {count}")


def _listed(names: Sequence[str], most: int) -> str:
    return ", ".join(names[:most]) + (" and others" if len(names) > most else "")
