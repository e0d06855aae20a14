"""From tracks to values: what moves a value of a scene, by keys, an expression or a table."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import exp, isfinite, log
from typing import Any, TypeAlias

from clfractal.errors import FileError, FormulaError, SceneError, Where
from clfractal.formulas.evaluate import as_function
from clfractal.formulas.own import safe_path
from clfractal.formulas.parser import parse
from clfractal.scene.animation import EASES, Animation, Track
from clfractal.scene.curves import (
    Curve,
    Mix,
    Monotone,
    Path,
    Spans,
    Values,
    apart,
    same,
    straight,
    turned,
    unit,
)
from clfractal.scene.flight import Around, Distance, EvenTarget
from clfractal.scene.model import Scene
from clfractal.scene.reads import TABLE
from clfractal.scene.tracks import Target, is_camera_place

At: TypeAlias = Callable[[float], Values]
"""The value at a place in the film, in frames from its beginning, which may lie between two."""

_NAMES = ("frame", "t", "u")
# Keys nearer to each other, frames, are at the same time.
_SAME_TIME = 1e-6
# As of a camera and its target: parts of their coordinates.
_TOO_NEAR = 1e-14
_LARGEST = 700.0  # of a logarithm: what is larger is beyond all ranges


@dataclass(frozen=True, slots=True)
class Mover:
    """A track, ready to be asked.

    Attributes:
        name: its key.
        target: what it moves.
        at: the values by frame.
        exact: the same as text, of a value that has more digits than numbers; None: of others.
    """

    name: str
    target: Target
    at: At
    exact: Callable[[float], tuple[str, ...]] | None = None

    def value(self, frame: float) -> Any:
        """The value as the scene has it: a number, or a tuple of them."""
        if self.exact is not None:
            return self.exact(frame)
        found = self.at(frame)
        if self.target.kind == "whole":
            if not isfinite(found[0]):
                raise FormulaError(f"is not a finite number at frame {frame:g}", self.where)
            return round(found[0])
        return found if len(found) > 1 else found[0]

    @property
    def where(self) -> Where:
        """Its place in the scene."""
        return Where(path=f"animation.tracks.{self.name}")


class Movers:
    """Makes the movers of an animation."""

    def __init__(self, scene: Scene, animation: Animation, targets: Mapping[str, Target]) -> None:
        self.scene, self.animation, self.targets = scene, animation, targets
        self.names = {target.path: name for name, target in targets.items()}

    def made(self) -> tuple[Mover, ...]:
        """One for each track."""
        self._refuse_two_for_one()
        return tuple(self._mover(name) for name in self.targets)

    def _refuse_two_for_one(self) -> None:
        for name, target in self.targets.items():
            other = self.names[target.path]
            for length in range(1, len(target.path)):
                other = self.names.get(target.path[:length], other)
            if other != name:
                raise SceneError(
                    f"moves what {other!r} moves already", Where(path=f"animation.tracks.{name}")
                )

    def _mover(self, name: str) -> Mover:
        track, target = self.animation.tracks[name], self.targets[name]
        if track.around_target is not None and not is_camera_place(self.scene, target.path):
            raise self._wrong(name, "around_target", "applies to a camera's position")
        if track.keys is not None and target.kind == "exact":
            place = self._moved_place(name)
            return Mover(name, target, lambda frame: tuple(map(float, place(frame))), place)
        if track.keys is not None:
            at = self._by_keys(name)
        elif track.expression is not None:
            at = self._by_expression(name, track)
        else:
            at = self._by_table(name, track)
        return Mover(name, target, at)

    def _wrong(self, name: str, key: str, message: str) -> SceneError:
        return SceneError(message, Where(path=f"animation.tracks.{name}.{key}"))

    def _check_size(self, name: str, key: str, given: int) -> None:
        target = self.targets[name]
        if target.size not in (None, given):
            wanted = "a number" if target.size == 1 else f"a list of {target.size} numbers"
            got = given if given > 1 else "one"
            raise self._wrong(name, key, f"must be {wanted} for {'.'.join(target.path)}, got {got}")

    # -- keys

    def _by_keys(self, name: str) -> At:
        place = self._flight_of(name)
        if place == name:
            return self._flight(name)
        curve = (self._even_target(place, name) if place is not None else None) or self._curve(name)
        clock = self._clock(name)
        return lambda frame: curve.at(clock(frame))

    def _clock(self, name: str) -> Callable[[float], float]:
        """From a frame to the time between a track's keys that it shows."""
        track = self.animation.tracks[name]
        times, _, closed = self._keys(name)
        loops = closed and self.animation.loop
        repeat = "loop" if loops else track.repeat
        first, period = times[0], times[-1] - times[0]
        if repeat == "none" or period == 0:
            return lambda frame: frame

        def time_of(frame: float) -> float:
            if frame < first and not loops:
                return first
            turns, rest = divmod(frame - first, period)
            backwards = repeat == "ping_pong" and turns % 2 == 1
            return first + (period - rest if backwards else rest)

        return time_of

    def _keys(self, name: str) -> tuple[list[float], list[Values], bool]:
        """Times and values of a track's keys, and whether they are a ring.

        In a film that begins again a track's first key follows its last one, a film's length after it.
        """
        track = self.animation.tracks[name]
        assert track.keys is not None
        self._check_size(name, "keys.0.value", len(track.keys[0].values))
        for index, each in enumerate(track.keys):
            if each.is_exact and self.targets[name].kind != "exact":
                raise self._wrong(name, f"keys.{index}.value", "must be numbers, without quotes")
        times = [self.animation.frame_of(key) for key in track.keys]
        values = [key.values for key in track.keys]
        if self.targets[name].kind == "direction":
            values = [self._direction(name, index, each) for index, each in enumerate(values)]
        ends_meet = len(values) > 2 and same(values[0], values[-1])
        if self.animation.loop and track.repeat == "none" and len(values) > 1:
            end = times[0] + self.animation.count
            if abs(times[-1] - end) < _SAME_TIME:  # seconds are rounded
                times[-1] = end
            if times[-1] > end or (times[-1] == end and not ends_meet):
                key = f"keys.{len(times) - 1}"
                raise self._wrong(
                    name,
                    key,
                    f"must come before frame {end:g}, where a film that loops is at its first key again",
                )
            if times[-1] < end:
                times.append(end)
                values.append(values[0])
            return times, values, True
        return times, values, ends_meet and track.repeat == "loop"

    def _direction(self, name: str, index: int, value: Values) -> Values:
        if max(abs(x) for x in value) < 1e-12:
            raise self._wrong(name, f"keys.{index}.value", "must not be zero")
        return unit(value)

    def _ways(self, name: str, spans: int) -> list[Values | None]:
        """How each span between two keys is crossed, as `Spans` takes it."""
        track = self.animation.tracks[name]
        assert track.keys is not None
        ways: list[Values | None] = []
        for index in range(spans):
            key = track.keys[min(index, len(track.keys) - 1)]
            word = key.interpolation or track.interpolation
            ways.append(() if word == "hold" else None if word == "smooth" else EASES.get(word, key.handles))
        return ways

    def _curve(self, name: str) -> Curve:
        """The curve through the keys of a track by itself."""
        times, values, closed = self._keys(name)
        kind = self.targets[name].kind
        ways = self._ways(name, len(times) - 1)
        if kind == "direction":
            return _along(times, values, ways, turned, closed=closed)
        if kind == "place":
            return _along(times, values, ways, straight, closed=closed)
        if kind == "scale" and all(number > 0 for each in values for number in each):
            logarithms = [tuple(log(number) for number in each) for each in values]
            smooth = _together(times, logarithms, closed=closed)
            return Spans(times, values, ways, lambda time: _exponentials(smooth(time)), _geometric)
        return Spans(times, values, ways, _together(times, values, closed=closed), straight)

    def _flight_of(self, name: str) -> str | None:
        """The track of the position of a camera that flies round its target, if this is it, or its target's; else None."""
        path = self.targets[name].path
        place = self.names.get((*path[:-1], "position"))
        if path[-1] not in ("position", "target") or place is None:
            return None
        flies = is_camera_place(self.scene, self.targets[place].path) and self._flies_around(place)
        return place if flies else None

    def _flies_around(self, name: str) -> bool:
        track = self.animation.tracks[name]
        if track.keys is None or len(track.keys) < 2:
            return False
        smooth = self._is_smooth(name)
        if track.around_target and not smooth:
            raise self._wrong(name, "around_target", "applies to a smooth track")
        return smooth if track.around_target is None else track.around_target

    def _is_smooth(self, name: str) -> bool:
        track = self.animation.tracks[name]
        return track.keys is not None and all(way is None for way in self._ways(name, len(track.keys) - 1))

    def _flight(self, place: str) -> At:
        """The place of a camera: its way from the target, by the clock of its own track, from where the target is then."""
        target_at = self._seen(place)
        times, places, closed = self._keys(place)
        # A key that closes a loop lies beyond the film: its target is that of the first.
        count = self.animation.count
        targets = [target_at(time % count if self.animation.loop else time) for time in times]
        for index, (time, at, target) in enumerate(zip(times, places, targets, strict=True)):
            if not all(map(isfinite, target)):
                raise self._wrong(
                    place, f"keys.{index}", f"needs a target, which is not finite at frame {time:g}"
                )
            if apart(at, target) <= _TOO_NEAR * max(map(abs, (*at, *target))):
                message = f"must differ from the camera's target at frame {time:g}"
                raise self._wrong(place, f"keys.{index}.value", message)
        around = Around(times, places, targets, closed=closed)
        clock = self._clock(place)
        return lambda frame: tuple(
            x + y for x, y in zip(target_at(frame), around.at(clock(frame)), strict=True)
        )

    def _seen(self, place: str) -> At:
        """Where the camera looks, by frame."""
        path = self.targets[place].path[:-1]
        seen = self.names.get((*path, "target"))
        if seen is not None:
            return self._mover(seen).at
        camera: Any = self.scene
        for part in path:
            camera = camera[int(part)] if isinstance(camera, tuple) else getattr(camera, part)
        target: Values = camera.target
        parts = {
            index: self._mover(self.names[each]).at
            for index in range(3)
            if (each := (*path, "target", str(index))) in self.names
        }
        return lambda frame: tuple(
            parts[index](frame)[0] if index in parts else number for index, number in enumerate(target)
        )

    def _even_target(self, place: str, seen: str) -> Curve | None:
        """The target of a flight, if its keys are at the same times as those of the camera; None otherwise."""
        times, places, closed = self._keys(place)
        own_times, targets, own_closed = self._keys(seen)
        same_clock = self.animation.tracks[place].repeat == self.animation.tracks[seen].repeat
        if own_times != times or own_closed != closed or not same_clock or not self._is_smooth(seen):
            return None
        ways = [apart(a, b) for a, b in zip(places, targets, strict=True)]
        if min(ways) <= 0:
            return None
        return EvenTarget(times, targets, Distance(times, ways, closed=closed), closed=closed)

    def _moved_place(self, name: str) -> Callable[[float], tuple[str, ...]]:
        """The centre of a place of any depth."""
        times, _, _ = self._keys(name)
        keys = self.animation.tracks[name].keys or ()
        from clfractal.scene.moved_place import MovedPlace  # which few films need

        texts = [key.texts for key in keys]
        texts += texts[:1] if len(times) > len(texts) else []  # the ring's first key once more
        magnified = self.names.get((*self.targets[name].path[:-1], "magnification"))
        deep = self.scene.deep
        fixed = deep.magnification if deep is not None else 1.0
        at = self._mover(magnified).at if magnified is not None else lambda frame: (fixed,)
        place = MovedPlace(times, texts, self._ways(name, len(times) - 1), lambda frame: at(frame)[0])
        clock = self._clock(name)
        return lambda frame: place.at(clock(frame), at(frame)[0])

    # -- expressions and tables

    def _by_expression(self, name: str, track: Track) -> At:
        assert track.expression is not None
        texts = track.expression if isinstance(track.expression, tuple) else (track.expression,)
        self._check_size(name, "expression", len(texts))
        functions = []
        for index, text in enumerate(texts):
            path = f"animation.tracks.{name}.expression"
            where = Where(path=f"{path}.{index}" if isinstance(track.expression, tuple) else path)
            functions.append(as_function(parse(text, names=_NAMES, where=where, parameters_only=True)))
        fps, count, loop = self.animation.fps, self.animation.count, self.animation.loop
        last = count if loop else max(count - 1, 1)

        def at(frame: float) -> Values:
            values = {"frame": float(frame), "t": frame / fps, "u": frame / last}
            return tuple(float(function(values)) for function in functions)

        return at

    def _by_table(self, name: str, track: Track) -> At:
        from clfractal.files.columns import read_columns

        assert track.file is not None
        assert track.column is not None
        titles = track.column if isinstance(track.column, tuple) else (track.column,)
        self._check_size(name, "column", len(titles))
        where = Where(path=f"animation.tracks.{name}.file")
        path = safe_path(track.file, self.scene.folder, where)
        try:
            table = self.scene.once(
                f"{TABLE}{name}",
                lambda: read_columns(path, dict.fromkeys(titles), str(track.file), self.animation.fps),
            )
        except FileError as error:
            raise FileError(error.inside(track.file), where) from error
        columns = [[track.offset + track.factor * number for number in table[title]] for title in titles]
        rows = len(columns[0])
        if rows < self.animation.count:
            raise FileError(
                f"{track.file} has {rows:,} rows, but the film {self.animation.count:,} frames", where
            )

        def at(frame: float) -> Values:
            row = min(int(frame), rows - 1)
            share, after = frame - row, min(row + 1, rows - 1)
            return tuple(column[row] + share * (column[after] - column[row]) for column in columns)

        return at


def _along(
    times: Sequence[float], values: Sequence[Values], ways: Sequence[Values | None], mix: Mix, *, closed: bool
) -> Curve:
    return Spans(times, values, ways, Path(times, values, mix, closed=closed).at, mix)


def _together(times: Sequence[float], values: Sequence[Values], *, closed: bool) -> At:
    """Numbers, each of which follows its own curve."""
    curves = [Monotone(times, each, closed=closed) for each in zip(*values, strict=True)]
    return lambda time: tuple(curve.number(time) for curve in curves)


def _exponentials(logarithms: Values) -> Values:
    return tuple(exp(min(number, _LARGEST)) for number in logarithms)


def _geometric(a: Values, b: Values, share: float) -> Values:
    """The numbers that are reached from `a` by a part of the factor to `b`."""
    return _exponentials(tuple(log(x) + share * (log(y) - log(x)) for x, y in zip(a, b, strict=True)))
