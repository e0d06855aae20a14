"""What can be done to a scene's `animation`, as functions from one to the next.

Times are frames, counted from 0, which may lie between two. A key keeps the word that it was written with: one with `time`
stays in seconds. No two keys of a track are at the same frame: a key that is put where another one is replaces it.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, Literal, TypeAlias

from clfractal.errors import SceneError, Where
from clfractal.scene.animation import EASES, MAX_FRAMES, Animation, Interpolation, Key, Track

KeyAt: TypeAlias = tuple[str, int]
"""A key: the name of its track, and its number there, from 0."""
Selection: TypeAlias = frozenset[KeyAt]
NONE: Selection = frozenset()

NEAR = 1e-3
"""Keys nearer to each other than this, frames, are at the same time."""
FRAMES, FPS = 120, 30.0
"""Length and rate of a film that begins in the window."""
_DIGITS = 9  # of seconds
# Where the handles of a Bezier curve are that goes as the way before it: those of a straight one lie on it.
_HANDLES = {**EASES, "linear": (0.3333, 0.3333, 0.6667, 0.6667)}


def new_film(frames: int = FRAMES, fps: float = FPS) -> Animation:
    """An animation in which nothing moves yet."""
    return Animation(fps=fps, frames=frames)


# Times


def clock(frame: float, fps: float) -> str:
    """The time of a frame, as minutes, seconds and hundredths: `0:02.50`."""
    hundredths = round(100 * frame / fps)
    return f"{hundredths // 6000}:{hundredths // 100 % 60:02}.{hundredths % 100:02}"


def frames_of_keys(animation: Animation, names: Collection[str] | None = None) -> list[float]:
    """The frames at which there are keys, rising, each once; of some tracks, or of all."""
    found: list[float] = []
    for time in sorted(
        animation.frame_of(key)
        for name, track in animation.tracks.items()
        if names is None or name in names
        for key in track.keys or ()
    ):
        if not found or time - found[-1] > NEAR:
            found.append(time)
    return found


def key_after(animation: Animation, frame: float) -> float | None:
    """The next frame with a key behind a frame; None if there is none."""
    return next((time for time in frames_of_keys(animation) if time > frame + NEAR), None)


def key_before(animation: Animation, frame: float) -> float | None:
    """The last frame with a key before a frame; None if there is none."""
    return max((time for time in frames_of_keys(animation) if time < frame - NEAR), default=None)


def key_at(animation: Animation, name: str, frame: float) -> KeyAt | None:
    """The key of a track at a frame; None if there is none."""
    found = keys_between(animation, frame, frame, [name] if name in animation.tracks else [])
    return min(found, default=None)


def keys_between(animation: Animation, first: float, last: float, names: Iterable[str]) -> Selection:
    """The keys of some tracks from one frame to another, both included."""
    return frozenset(
        (name, index)
        for name in names
        for index, key in enumerate(animation.tracks[name].keys or ())
        if first - NEAR <= animation.frame_of(key) <= last + NEAR
    )


def still_there(animation: Animation | None, selection: Selection) -> Selection:
    """The keys of a selection that an animation has."""
    if animation is None:
        return NONE
    return frozenset(
        (name, index)
        for name, index in selection
        if name in animation.tracks and index < len(animation.tracks[name].keys or ())
    )


# Keys


def with_key(animation: Animation, name: str, frame: float, value: Any) -> Animation:
    """With a key of a track at a frame; a key that is there gets the value, and keeps its way to the next one.

    A track that does not exist is made. A Bezier curve that is divided by the key goes on to it and from it by `ease`.

    Args:
        value: a number, or a list of numbers.

    Raises:
        SceneError: the track has no keys, or others of another size.
    """
    track = animation.tracks.get(name)
    new = _valued(value)
    if track is None:
        return _with_track(animation, name, Track(keys=(Key(frame=_tidy(frame), value=new),)))
    if track.keys is None:
        raise SceneError("has no keys", Where(path=f"animation.tracks.{name}"))
    found = key_at(animation, name, frame)
    keys = list(track.keys)
    if found is not None:
        keys[found[1]] = keys[found[1]].model_copy(update={"value": new})
        return _with_keys(animation, name, keys)
    times = [animation.frame_of(key) for key in keys]
    place = bisect_left(times, frame)
    # As its neighbours are written, in frames or in seconds.
    like = keys[place - 1] if place > 0 else keys[0]
    way = like.interpolation if place > 0 else None
    if (way or track.interpolation) == "bezier":
        way = "ease"
        if place > 0:
            keys[place - 1] = like.model_copy(update={"interpolation": way, "handles": None})
    made = Key(**_time(animation, frame, in_seconds=like.frame is None), value=new, interpolation=way)
    return _with_keys(animation, name, [*keys[:place], made, *keys[place:]])


def without_keys(animation: Animation, selection: Selection) -> Animation:
    """Without some keys; a track that has none left goes, too."""
    tracks = dict(animation.tracks)
    for name in {name for name, _ in selection}:
        keys = tuple(
            key for index, key in enumerate(tracks[name].keys or ()) if (name, index) not in selection
        )
        if keys:
            tracks[name] = tracks[name].model_copy(update={"keys": keys})
        else:
            del tracks[name]
    return animation.model_copy(update={"tracks": tracks})


def moved(
    animation: Animation, selection: Selection, to: Callable[[float], float]
) -> tuple[Animation, Selection]:
    """Keys at other frames; keys that are not selected give way where one lands on them.

    Args:
        to: the new frame of each of them by the old one; it must not fall, or keys of one track change their order.

    Returns:
        the animation, and where the selected keys are in it. Of selected keys that land on each other the last one stays.
    """
    tracks = dict(animation.tracks)
    chosen: set[KeyAt] = set()
    for name in {name for name, _ in selection}:
        track = tracks[name]
        placed: list[tuple[float, bool, Key]] = []
        for index, key in enumerate(track.keys or ()):
            time, own = animation.frame_of(key), (name, index) in selection
            if own:
                new = _tidy(min(max(to(time), 0.0), float(MAX_FRAMES)))
                changed = _time(animation, new, in_seconds=key.frame is None)
                key, time = key.model_copy(update={"frame": None, "time": None} | changed), new
            placed.append((time, own, key))
        keys = [(own, _with_way(key, track)) for own, key in _in_order(placed)]
        tracks[name] = track.model_copy(update={"keys": tuple(key for _, key in keys)})
        chosen |= {(name, index) for index, (own, _) in enumerate(keys) if own}
    return animation.model_copy(update={"tracks": tracks}), frozenset(chosen)


def shifted(
    animation: Animation, selection: Selection, frames: float, *, whole: bool = True
) -> tuple[Animation, Selection]:
    """Keys so many frames later (or earlier); none comes before the first frame: then all go as far as the first may.

    Args:
        whole: each goes to the nearest whole frame.
    """
    if not selection:
        return animation, selection
    step = max(frames, -min(animation.frame_of(key_of(animation, at)) for at in selection))
    return moved(animation, selection, lambda time: _snapped(time + step, whole))


def stretched(
    animation: Animation, selection: Selection, pivot: float, factor: float, *, whole: bool = True
) -> tuple[Animation, Selection]:
    """Keys whose distances from a frame are `factor` (above 0) times as long: what they do goes slower, or faster."""
    return moved(
        animation, selection, lambda time: _snapped(max(pivot + factor * (time - pivot), 0.0), whole)
    )


def with_value(animation: Animation, at: KeyAt, value: Any) -> Animation:
    """A key with another value, a number or a list of numbers."""
    return _with_key_changed(animation, at, {"value": _valued(value)})


def with_number(animation: Animation, at: KeyAt, component: int, number: float) -> Animation:
    """A key with another number in one place of its value."""
    key = key_of(animation, at)
    if not isinstance(key.value, tuple):
        return with_value(animation, at, number)
    # (The others keep their digits.)
    new = repr(number) if key.is_exact else number
    return with_value(animation, at, [*key.value[:component], new, *key.value[component + 1 :]])


def with_way(animation: Animation, selection: Selection, word: Interpolation | None) -> Animation:
    """Keys with another interpolation to the next one; None: the track's. `bezier` begins with the way it was."""
    for name, index in sorted(selection):
        track = animation.tracks[name]
        key = key_of(animation, (name, index))
        before = key.interpolation or track.interpolation
        change: dict[str, Any] = {"interpolation": word, "handles": None}
        if (word or track.interpolation) == "bezier":
            change["handles"] = key.handles or _HANDLES.get(before, EASES["ease"])
        animation = _with_key_changed(animation, (name, index), change)
    return animation


def with_handles(animation: Animation, at: KeyAt, handles: Sequence[float]) -> Animation:
    """A key with other handles of its Bezier curve; times are kept within the way, values within -10 and 10."""
    bounds = ((0, 1), (-10, 10), (0, 1), (-10, 10))
    inside = tuple(round(min(max(x, low), high), 4) for x, (low, high) in zip(handles, bounds, strict=True))
    of_track = animation.tracks[at[0]].interpolation == "bezier"
    word = None if of_track and key_of(animation, at).interpolation is None else "bezier"
    return _with_key_changed(animation, at, {"interpolation": word, "handles": inside})


# Tracks


def with_track(animation: Animation, name: str, changes: Mapping[str, Any]) -> Animation:
    """A track with other settings, such as `repeat`; with `interpolation` keys get the handles that they need.

    Raises:
        SceneError: they do not fit each other.
    """
    track, update = animation.tracks[name], dict(changes)
    word, before = changes.get("interpolation", track.interpolation), track.interpolation
    own = [key for key in track.keys or () if key.interpolation is None]
    if (word == "bezier") != (before == "bezier") and own:
        ease = _HANDLES.get(before, EASES["ease"])
        update["keys"] = tuple(
            key.model_copy(update={"handles": (key.handles or ease) if word == "bezier" else None})
            if key.interpolation is None
            else key
            for key in track.keys or ()
        )
    return _with_track(animation, name, track.model_copy(update=update))


def without_track(animation: Animation, name: str) -> Animation:
    """Without a track."""
    tracks = {other: track for other, track in animation.tracks.items() if other != name}
    return animation.model_copy(update={"tracks": tracks})


# The film


def with_frames(animation: Animation, frames: int, *, scale: bool = False) -> Animation:
    """A film of another length.

    Args:
        scale: keys keep their part of the film's time (the first frame and the last stay where they are in it);
            otherwise they stay where they are.
    """
    frames = min(max(frames, 1), MAX_FRAMES)
    before = animation.count
    if scale and before > 1 and frames > 1:
        factor = frames / before if animation.loop else (frames - 1) / (before - 1)
        everything = keys_between(animation, 0, MAX_FRAMES, animation.tracks)
        animation, _ = moved(animation, everything, lambda time: time * factor)
    return animation.model_copy(update={"frames": frames, "duration": None})


def with_rate(animation: Animation, fps: float, keep: Literal["seconds", "frames"]) -> Animation:
    """A film with another number of frames a second.

    Args:
        keep: `seconds`: it lasts as long as before, and keys stay at their seconds; `frames`: it has as many frames, and
            keys stay at theirs, so that all goes faster or slower.
    """
    before, ratio = animation.fps, fps / animation.fps
    tracks: dict[str, Track] = {}
    for name, track in animation.tracks.items():
        keys = []
        for key in track.keys or ():
            if keep == "seconds" and key.frame is not None:
                key = key.model_copy(update={"frame": _tidy(key.frame * ratio)})
            elif keep == "frames" and key.time is not None:
                key = key.model_copy(update={"time": round(key.time * before / fps, _DIGITS)})
            keys.append(key)
        tracks[name] = track.model_copy(update={"keys": tuple(keys)}) if keys else track
    length: dict[str, Any] = {"frames": animation.count, "duration": None}
    if keep == "seconds" and animation.duration is None:
        length["frames"] = min(max(round(animation.count * ratio), 1), MAX_FRAMES)
    elif keep == "seconds":
        length = {}
    return animation.model_copy(update={"fps": fps, "tracks": tracks, **length})


# Within


def key_of(animation: Animation, at: KeyAt) -> Key:
    """A key by its place."""
    keys = animation.tracks[at[0]].keys
    assert keys is not None
    return keys[at[1]]


def _valued(value: Any) -> Any:
    if not isinstance(value, (list, tuple)):
        return float(value)
    return tuple(each if isinstance(each, str) else float(each) for each in value)


def _time(animation: Animation, frame: float, *, in_seconds: bool) -> dict[str, float]:
    if in_seconds:
        return {"time": round(frame / animation.fps, _DIGITS)}
    return {"frame": _tidy(frame)}


def _tidy(frame: float) -> float:
    """A frame without the dirt of floating point in its last digits."""
    nearest = round(frame)
    return float(nearest) if abs(frame - nearest) < 1e-6 else round(frame, 6)


def _snapped(frame: float, whole: bool) -> float:
    return float(int(frame + 0.5)) if whole else frame


def _in_order(placed: list[tuple[float, bool, Key]]) -> list[tuple[bool, Key]]:
    """Keys by their times; of several at one time the selected ones win, of these the last."""
    kept: list[tuple[float, bool, Key]] = []
    for time, own, key in sorted(placed, key=lambda each: each[0]):
        if kept and time - kept[-1][0] <= NEAR:
            if own or not kept[-1][1]:
                kept[-1] = (time, own, key)
        else:
            kept.append((time, own, key))
    return [(own, key) for _, own, key in kept]


def _with_way(key: Key, track: Track) -> Key:
    """A key that may have been the last of its track: then it needs no handles, elsewhere it does."""
    if (key.interpolation or track.interpolation) == "bezier" and key.handles is None:
        return key.model_copy(update={"handles": EASES["ease"]})
    return key


def _with_keys(animation: Animation, name: str, keys: Iterable[Key]) -> Animation:
    track = animation.tracks[name]
    return _with_track(animation, name, track.model_copy(update={"keys": tuple(keys)}))


def _with_key_changed(animation: Animation, at: KeyAt, changes: Mapping[str, Any]) -> Animation:
    name, index = at
    keys = list(animation.tracks[name].keys or ())
    keys[index] = keys[index].model_copy(update=dict(changes))
    return _with_keys(animation, name, keys)


def _with_track(animation: Animation, name: str, track: Track) -> Animation:
    return animation.model_copy(update={"tracks": {**animation.tracks, name: track}})
