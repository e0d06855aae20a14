"""What a timeline shows of a film, without its panel: a span of frames, chosen keys, a chosen track."""

from __future__ import annotations

from collections.abc import Callable, Collection, MutableMapping
from dataclasses import dataclass, field
from math import ceil, floor, log10
from typing import Any, TypeAlias, cast

from clfractal.errors import ClfractalError
from clfractal.scene.animation import Animation
from clfractal.scene.curves import Values
from clfractal.scene.movement import movement_of
from clfractal.viewer import timeline_edits as timeline
from clfractal.viewer.filming import InFilm
from clfractal.viewer.timeline_edits import NONE, Selection

_MARGINS = 0.05, 0.02
"""Parts of a film that are shown before its first frame, where curves have the words of their lines, and after its last."""
_NARROWEST = 4.0
_SAMPLES = 400
Edit: TypeAlias = Callable[[Animation], tuple[Animation, Selection]]


@dataclass(slots=True)
class TimelineView:
    """The state of a timeline.

    Attributes:
        selection: the chosen keys.
        track: the chosen track; empty: none.
        curves: whether curves are shown in the place of rows.
        first, last: the frames at the left and the right end.
        count: of the film that they were fitted to.
        before: while keys are dragged, the animation and the selection at the drag's beginning.
    """

    selection: Selection = NONE
    track: str = ""
    curves: bool = False
    first: float = 0.0
    last: float = 1.0
    count: int = 0
    before: tuple[Animation, Selection] | None = None
    held: dict[str, Any] = field(default_factory=dict)

    def follow(self, animation: Animation) -> None:
        """Forgets what the animation does not have any more; a film of another length is shown as a whole."""
        self.selection = timeline.still_there(animation, self.selection)
        if self.track not in animation.tracks:
            self.track = next((name for name, _ in sorted(self.selection)), "")
        if not self.track and self.curves and animation.tracks:
            self.track = next(iter(animation.tracks))
        if animation.count != self.count:
            self.count = animation.count
            self.show_all()

    def show_all(self) -> None:
        """Shows the whole film."""
        end = max(self.count - 1, 1)
        self.first, self.last = -_MARGINS[0] * end, (1 + _MARGINS[1]) * end

    def x_of(self, frame: float, left: float, width: float) -> float:
        """Where a frame is between two ends, points."""
        return left + (frame - self.first) / (self.last - self.first) * width

    def frame_of(self, x: float, left: float, width: float) -> float:
        """The frame at a place between two ends, points."""
        return self.first + (x - left) / width * (self.last - self.first)

    def zoom(self, about: float, factor: float) -> None:
        """Shows so many times as many frames; one frame stays where it is. Never more than twice the film."""
        span = self.last - self.first
        widest = 2.0 * max(self.count, _NARROWEST)
        factor = min(max(factor, _NARROWEST / span), widest / span)
        self.first, self.last = about + (self.first - about) * factor, about + (self.last - about) * factor

    def pan(self, frames: float) -> None:
        """Shows what is some frames later, but always something of the film."""
        span = self.last - self.first
        self.first = min(max(self.first + frames, -0.8 * span), self.count - 0.2 * span)
        self.last = self.first + span

    # Edits

    def begin(self, studio: InFilm) -> None:
        """A drag of the selected keys begins."""
        if studio.scene.animation is not None:
            self.before = (studio.scene.animation, self.selection)

    def drag(self, studio: InFilm, edit: Edit) -> None:
        """The drag has come so far: `edit` makes of the animation at its beginning what it is now."""
        if self.before is None:
            return
        with studio.telling():
            animation, selection = edit(self.before[0])
            if animation == studio.scene.animation or studio.set_animation(animation, gesture="timeline"):
                self.selection = selection

    def end(self, studio: InFilm) -> None:
        """The drag has ended."""
        if self.before is not None:
            self.before = None
            studio.end_drag()
            self.selection = timeline.still_there(studio.scene.animation, self.selection)

    def change(self, studio: InFilm, edit: Callable[[Animation], Animation]) -> bool:
        """One edit of the animation, as a step; whether it was possible."""
        return self.edit(studio, lambda animation: (edit(animation), self.selection))

    def edit(self, studio: InFilm, edit: Edit) -> bool:
        """The same of an edit that says which keys are chosen afterwards."""
        animation = studio.scene.animation
        if animation is None:
            return False
        with studio.telling():
            new, selection = edit(animation)
            if studio.set_animation(new):
                self.selection = selection
                return True
        return False

    def delete(self, studio: InFilm) -> None:
        """Deletes the chosen keys."""
        chosen = timeline.still_there(studio.scene.animation, self.selection)
        if chosen and self.change(studio, lambda animation: timeline.without_keys(animation, chosen)):
            self.selection = NONE


def of(memory: MutableMapping[str, Any]) -> TimelineView:
    """The timeline of a window's panels."""
    return cast(TimelineView, memory.setdefault("timeline", TimelineView()))


# What is drawn


def step_of_marks(span: float, room: int) -> float:
    """The distance of a ruler's marks, frames: 1, 2 or 5 times a power of ten, so that at most `room` fit into a span."""
    return _round_step(max(span / max(room, 1), 1.0))


def _round_step(least: float) -> float:
    power = 10.0 ** floor(log10(least))
    return next(power * each for each in (1, 2, 5, 10) if power * each >= least * (1 - 1e-9))


def round_values(low: float, high: float, room: int) -> list[float]:
    """Round values between two, at most so many and one more, for lines across."""
    step = _round_step((high - low) / room)
    return [step * number for number in range(ceil(low / step), floor(high / step) + 1)]


def marks(first: float, last: float, step: float) -> list[float]:
    """The frames of a ruler's marks within a span, from 0 on."""
    start = max(ceil(first / step), 0)
    return [step * number for number in range(start, floor(last / step) + 1)]


def curve_of(studio: InFilm, name: str, first: float, last: float) -> list[tuple[float, Values]]:
    """A track's values at places of a span, in the film; empty if the track is wrong."""
    document = studio.document
    animation = document.animation
    if animation is None:
        return []
    try:
        mover = next(each for each in movement_of(document).movers if each.name == name)
        begin, end = max(first, 0.0), min(last, float(animation.count - 1))
        count = max(min(_SAMPLES, round(4 * (end - begin))), 1)
        places = [begin + (end - begin) * number / count for number in range(count + 1)]
        return [(place, mover.at(place)) for place in places]
    except (ClfractalError, StopIteration, ArithmeticError):
        return []


def bounds_of(curve: Collection[tuple[float, Values]], keys: Collection[Values]) -> tuple[float, float]:
    """The least and the largest value of a curve and of keys, with a margin."""
    numbers = [number for _, values in curve for number in values] + [each for key in keys for each in key]
    low, high = (min(numbers), max(numbers)) if numbers else (0.0, 1.0)
    margin = 0.12 * (high - low) or 0.5 * max(abs(low), 1e-3)
    return low - margin, high + margin


def why_fixed(animation: Animation, name: str) -> str:
    """Why a track has no keys to drag; empty if it has."""
    track = animation.tracks[name]
    if track.expression is not None:
        texts = track.expression if isinstance(track.expression, tuple) else (track.expression,)
        return f"Follows an expression, so it has no keys to drag: {'; '.join(texts)}"
    if track.file is not None:
        columns = track.column if isinstance(track.column, tuple) else (track.column or "",)
        return f"Follows a table, so it has no keys to drag: {', '.join(columns)} of {track.file}"
    return ""
