"""What can be done to an animation: by examples, and for any keys and any order of deeds."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import SceneError
from clfractal.scene.animation import MAX_FRAMES, Animation, Interpolation, Key, Track
from clfractal.viewer import timeline_edits as t

WAYS: tuple[Any, ...] = get_args(Interpolation)


def film(*frames: float, name: str = "camera.fov", **settings: Any) -> Animation:
    """A film of 100 frames with one track, whose values are 10 times the keys' numbers."""
    keys = tuple(Key(frame=frame, value=10.0 * n + 10) for n, frame in enumerate(frames))
    return Animation(frames=100, fps=25.0, tracks={name: Track(keys=keys)}, **settings)


def times(animation: Animation, name: str = "camera.fov") -> list[float]:
    return [animation.frame_of(key) for key in animation.tracks[name].keys or ()]


def values(animation: Animation, name: str = "camera.fov") -> list[Any]:
    return [key.value for key in animation.tracks[name].keys or ()]


@st.composite
def films(draw: st.DrawFn) -> Animation:
    """Any film with keys alone, in frames and seconds, with all ways between them."""
    fps = draw(st.sampled_from([1.0, 24.0, 29.97, 30.0, 60.0]))
    tracks = {}
    for name in draw(st.lists(st.sampled_from("abcd"), min_size=1, max_size=3, unique=True)):
        size = draw(st.sampled_from([0, 3]))
        frames = sorted(draw(st.sets(st.integers(0, 200), min_size=1, max_size=8)))
        keys = []
        for frame in frames:
            way = draw(st.sampled_from([None, *WAYS]))
            number = draw(st.floats(-100, 100))
            time = {"time": frame / fps} if draw(st.booleans()) else {"frame": float(frame)}
            handles = (0.2, 0.5, 0.7, 1.5) if way == "bezier" else None
            value = (number, 1.0, 2.0) if size else number
            keys.append(Key(**time, value=value, interpolation=way, handles=handles))
        tracks[name] = Track(keys=tuple(keys), interpolation=draw(st.sampled_from(["smooth", "linear"])))
    return Animation(fps=fps, frames=draw(st.integers(2, 300)), tracks=tracks)


@st.composite
def chosen(draw: st.DrawFn) -> tuple[Animation, t.Selection]:
    """A film, and some of its keys."""
    animation = draw(films())
    everything = sorted(t.keys_between(animation, 0, MAX_FRAMES, animation.tracks))
    return animation, frozenset(draw(st.sets(st.sampled_from(everything), min_size=1)))


def rises(animation: Animation) -> bool:
    """Whether the keys of all tracks are in order, and valid as a whole."""
    Animation.model_validate(animation.model_dump())
    return all(
        all(b - a > t.NEAR for a, b in pairwise(found))
        for found in (times(animation, name) for name in animation.tracks)
    )


# Times


@pytest.mark.parametrize(
    ("frame", "fps", "text"),
    [(0, 30, "0:00.00"), (75, 30, "0:02.50"), (1799.9, 30, "1:00.00"), (1, 3, "0:00.33")],
)
def test_times_are_told_in_minutes_and_seconds(frame: float, fps: float, text: str) -> None:
    assert t.clock(frame, fps) == text


# Keys


def test_a_key_is_put_in_its_place() -> None:
    new = t.with_key(film(0, 50), "camera.fov", 20, 33)
    assert (times(new), values(new)) == ([0, 20, 50], [10, 33, 20])
    assert t.with_key(new, "camera.fov", 20, 34) == t.with_key(film(0, 50), "camera.fov", 20, 34)
    assert times(t.with_key(film(10), "camera.fov", 0, 1)) == [0, 10]


def test_a_track_begins_with_its_first_key() -> None:
    new = t.with_key(t.new_film(), "camera.position", 12, [1, 2, 3])
    assert new.tracks["camera.position"].keys == (Key(frame=12.0, value=(1.0, 2.0, 3.0)),)
    assert (new.count, new.fps) == (120, 30)


def test_keys_in_seconds_stay_in_seconds() -> None:
    one = Animation(frames=100, fps=25.0, tracks={"a": Track(keys=(Key(time=1.0, value=0.0),))})
    new = t.with_key(one, "a", 50, 1.0)
    assert [key.time for key in new.tracks["a"].keys or ()] == [1.0, 2.0]
    shifted, _ = t.shifted(new, frozenset({("a", 1)}), 5)
    assert [key.time for key in shifted.tracks["a"].keys or ()] == [1.0, 2.2]


def test_an_expression_takes_no_keys() -> None:
    given = Animation(frames=10, tracks={"a": Track(expression="frame")})
    with pytest.raises(SceneError, match="has no keys"):
        t.with_key(given, "a", 0, 1.0)


def test_a_divided_bezier_curve_needs_no_handles() -> None:
    track = Track(
        keys=(Key(frame=0.0, value=0.0, handles=(0.1, 0, 0.9, 1)), Key(frame=9.0, value=1.0)),
        interpolation="bezier",
    )
    new = t.with_key(Animation(frames=10, tracks={"a": track}), "a", 5, 0.7)
    assert [key.interpolation for key in new.tracks["a"].keys or ()] == ["ease", "ease", None]
    assert rises(new)


@given(films(), st.integers(0, 250), st.floats(-5, 5))
def test_a_key_that_was_set_is_found_and_all_others_stay(
    animation: Animation, frame: int, number: float
) -> None:
    for name, track in animation.tracks.items():
        value: Any = (number, 0.0, 0.0) if isinstance((track.keys or ())[0].value, tuple) else number
        new = t.with_key(animation, name, frame, value)
        place = t.key_at(new, name, frame)
        assert place is not None
        assert t.key_of(new, place).value == value
        assert rises(new)
        others = {
            time: v
            for time, v in zip(times(new, name), values(new, name), strict=True)
            if abs(time - frame) > t.NEAR
        }
        before = {
            time: v
            for time, v in zip(times(animation, name), values(animation, name), strict=True)
            if abs(time - frame) > t.NEAR
        }
        assert others == before


def test_deleting_the_last_key_deletes_the_track() -> None:
    one = t.without_keys(film(0, 50), frozenset({("camera.fov", 0)}))
    assert times(one) == [50]
    assert t.without_keys(one, frozenset({("camera.fov", 0)})).tracks == {}


def test_keys_are_moved_and_others_give_way() -> None:
    new, kept = t.shifted(film(0, 10, 20, 30), frozenset({("camera.fov", 1), ("camera.fov", 2)}), 10)
    assert (times(new), values(new)) == ([0, 20, 30], [10, 20, 30])
    assert kept == {("camera.fov", 1), ("camera.fov", 2)}
    # Past another one, and not before the film's beginning.
    new, kept = t.shifted(film(0, 10, 20), frozenset({("camera.fov", 0)}), 15)
    assert (times(new), values(new)) == ([10, 15, 20], [20, 10, 30])
    assert kept == {("camera.fov", 1)}
    new, _ = t.shifted(film(0, 10, 20), frozenset({("camera.fov", 1), ("camera.fov", 2)}), -40)
    assert (times(new), values(new)) == ([0, 10], [20, 30])


@given(chosen(), st.integers(-100, 100))
def test_shifting_keeps_order_distances_and_values(given_: tuple[Animation, t.Selection], step: int) -> None:
    animation, selection = given_
    new, kept = t.shifted(animation, selection, step, whole=False)
    assert rises(new)
    assert t.still_there(new, kept) == kept
    for name in {name for name, _ in selection}:
        old = [
            (animation.frame_of(t.key_of(animation, k)), t.key_of(animation, k).value)
            for k in sorted(selection)
            if k[0] == name
        ]
        now = [(new.frame_of(t.key_of(new, k)), t.key_of(new, k).value) for k in sorted(kept) if k[0] == name]
        assert [value for _, value in now] == [value for _, value in old]
        moved = {round(b - a, 4) for (a, _), (b, _) in zip(old, now, strict=True)}
        assert len(moved) == 1
        unmoved = [value for k, value in enumerate(values(animation, name)) if (name, k) not in selection]
        assert all(value in unmoved or (name, k) in kept for k, value in enumerate(values(new, name)))


@given(chosen(), st.integers(0, 200), st.floats(0.1, 5))
def test_stretching_keeps_the_order(given_: tuple[Animation, t.Selection], pivot: int, factor: float) -> None:
    animation, selection = given_
    new, kept = t.stretched(animation, selection, pivot, factor)
    assert rises(new)
    assert t.still_there(new, kept) == kept
    assert all(
        new.frame_of(t.key_of(new, each)) == int(new.frame_of(t.key_of(new, each)) + 0.5)
        or t.key_of(new, each).time
        for each in kept
    )


@given(chosen(), st.sampled_from([None, *WAYS]))
def test_every_way_can_be_chosen_for_any_keys(given_: tuple[Animation, t.Selection], word: Any) -> None:
    animation, selection = given_
    new = t.with_way(animation, selection, word)
    assert rises(new)
    assert all(t.key_of(new, each).interpolation == word for each in selection)
    assert [times(new, name) for name in new.tracks] == [times(animation, name) for name in animation.tracks]


@given(films(), st.sampled_from(WAYS), st.sampled_from(WAYS))
def test_every_way_can_be_chosen_for_a_track(animation: Animation, first: Any, then: Any) -> None:
    for word in (first, then):
        for name in animation.tracks:
            animation = t.with_track(animation, name, {"interpolation": word})
        assert rises(animation)
        assert {track.interpolation for track in animation.tracks.values()} == {word}


def test_a_bezier_curve_begins_as_the_way_that_was_there() -> None:
    first = frozenset({("camera.fov", 0)})
    straight = t.with_way(t.with_way(film(0, 10), first, "linear"), first, "bezier")
    x1, y1, x2, y2 = t.key_of(straight, ("camera.fov", 0)).handles or (0, 1, 0, 1)
    assert x1 == y1 < x2 == y2
    eased = t.with_way(t.with_way(film(0, 10), first, "ease_in"), first, "bezier")
    assert t.key_of(eased, ("camera.fov", 0)).handles == (0.42, 0, 1, 1)


def test_numbers_and_handles_are_kept_in_their_ranges() -> None:
    new = t.with_number(film(0, 10), ("camera.fov", 1), 0, 55)
    assert values(new) == [10, 55]
    several = t.with_key(t.new_film(), "a", 0, (1, 2, 3))
    assert values(t.with_number(several, ("a", 0), 2, 9.5), "a") == [(1, 2, 9.5)]
    handled = t.with_handles(film(0, 10), ("camera.fov", 0), (-1, -20, 2, 20))
    assert t.key_of(handled, ("camera.fov", 0)).handles == (0, -10, 1, 10)
    assert t.key_of(handled, ("camera.fov", 0)).interpolation == "bezier"


# The film


def test_a_longer_film_keeps_its_keys_or_scales_them() -> None:
    assert times(t.with_frames(film(0, 50, 99), 199)) == [0, 50, 99]
    longer = t.with_frames(film(0, 50, 99), 199, scale=True)
    assert (times(longer), longer.count) == ([0, 100, 198], 199)
    assert times(t.with_frames(film(0, 50, loop=True), 200, scale=True)) == [0, 100]
    in_seconds = Animation(fps=10.0, duration=4.0)
    assert t.with_frames(in_seconds, 15) == Animation(fps=10.0, frames=15)


@given(films(), st.integers(2, 500))
def test_scaling_there_and_back_keeps_all_keys(animation: Animation, frames: int) -> None:
    if frames < animation.count:
        frames, animation = animation.count, t.with_frames(animation, frames)
    there = t.with_frames(animation, frames, scale=True)
    back = t.with_frames(there, animation.count, scale=True)
    for name in animation.tracks:
        assert times(back, name) == pytest.approx(times(animation, name), abs=0.01)
        assert values(back, name) == values(animation, name)


@given(films(), st.sampled_from([12.0, 24.0, 50.0]))
def test_another_rate_keeps_seconds_or_frames(animation: Animation, fps: float) -> None:
    same = t.with_rate(animation, fps, "frames")
    assert same.count == animation.count
    slow = t.with_rate(animation, fps, "seconds")
    assert slow.count / fps == pytest.approx(animation.count / animation.fps, abs=1 / fps)
    for name in animation.tracks:
        assert times(same, name) == pytest.approx(times(animation, name), abs=1e-4)
        seconds = [time / fps for time in times(slow, name)]
        assert seconds == pytest.approx([time / animation.fps for time in times(animation, name)], abs=1e-4)


def test_a_duration_stays_one() -> None:
    assert t.with_rate(Animation(fps=10.0, duration=4.0), 20.0, "seconds") == Animation(
        fps=20.0, duration=4.0
    )
    assert t.with_rate(Animation(fps=10.0, duration=4.0), 20.0, "frames") == Animation(fps=20.0, frames=40)


def test_a_selection_follows_what_is_left() -> None:
    some = frozenset({("camera.fov", 0), ("camera.fov", 5), ("gone", 0)})
    assert t.still_there(film(0, 1), some) == {("camera.fov", 0)}
    assert t.still_there(None, some) == t.NONE
