"""The film's clock, keys and records; by a clock of the tests."""

from __future__ import annotations

from math import cos, dist, exp, sin
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.scene.load import load_scene
from clfractal.scene.movement import movement_of
from clfractal.viewer.navigation import dolly
from clfractal.viewer.playing import Player
from clfractal.viewer.thinning import TOLERANCE, Sample, at_frames, flight
from tests.viewer.films import STILL, keys, studio_of


def player_of(*scene: Any) -> Player:
    player = Player(studio_of(*scene))
    player.step(100.0)
    return player


def frame(player: Player) -> Any:
    return player.studio.frame_number


# Playing


def test_playing_keeps_time_by_dropping_frames() -> None:
    player = player_of()
    player.play(100.0)
    assert player.wait(100.0) == pytest.approx(1 / 20)
    for now, wanted in ((100.01, 0), (100.051, 1), (100.5, 10), (101.26, 25)):
        player.step(now)
        assert frame(player) == wanted
    assert player.wait(101.26) == pytest.approx(0.04)
    assert not player.step(101.27)
    assert player.studio.session.requests[-1][1]  # type: ignore[attr-defined]
    player.play(101.3)
    assert not player.playing
    assert player.wait(101.3) is None
    assert frame(player) == 25


def test_a_part_of_the_film_is_played() -> None:
    """20 frames a second: from 10 to 19 is half a second, again and again, or once."""
    player = player_of()
    player.show(10)
    player.span_end(-1)
    player.show(19)
    player.span_end(1)
    assert player.span == (10, 19)
    player.play(100.0)
    assert frame(player) == 10
    for now, wanted in ((100.21, 14), (100.46, 19), (100.51, 10), (101.31, 16)):
        player.step(now)
        assert frame(player) == wanted
    player.repeat = False
    player.step(103.0)
    assert (frame(player), player.playing) == (19, False)
    player.show(30)  # beyond its end: it begins at its beginning
    player.play(200.0)
    assert frame(player) == 10
    player.stop()
    player.span_clear()
    assert player.played(player.film) == (0, 40)  # type: ignore[arg-type]
    assert "all of the film" in player.studio.messages[-1].text


def test_parts_that_are_none() -> None:
    player = player_of()
    film = player.film
    assert film is not None
    player.set_span(12.4, 12.0)
    assert player.span is None
    player.set_span(30, 12.4)
    assert player.played(film) == (12, 30)
    player.set_span(38, 90)
    assert player.played(film) == (38, 40)
    player.span = (60, 90)  # the film was longer
    assert player.played(film) == (0, 40)
    player.show(0)
    player.span = None
    player.span_end(1)
    assert player.span is None


def test_a_film_that_plays_goes_on_from_where_it_is_put() -> None:
    player = player_of()
    player.play(100.0)
    player.step(100.5)
    player.show(30)
    player.step(100.6)
    assert frame(player) == 32


def test_frames_and_keys_are_stepped_through() -> None:
    player = player_of()
    player.by(-1)
    assert frame(player) == 40
    player.by(2)
    assert frame(player) == 1
    found = []
    for way in (1, 1, 1, -1, -1):
        player.to_key(way)
        found.append(frame(player))
    assert found == [10, 40, 40, 10, 0]
    player.to_end(1)
    assert frame(player) == 40
    player.to_end(-1)
    assert frame(player) == 0


def test_setting_keys_begins_a_film() -> None:
    player = player_of(STILL, None)
    player.play(0.0)
    assert not player.playing
    player.set_keys()
    assert frame(player) == 0
    assert "nothing was changed" in player.studio.messages[-1].text
    player.studio.edit({"camera.fov": 20})
    player.set_keys()
    assert keys(player.studio, "camera.fov") == {0: 20}


def test_what_stays_behind_is_told() -> None:
    player = player_of()
    player.studio.edit({"camera.fov": 33, "material.ambient": 0.4})
    assert player.studio.unkeyed() == ["camera.fov"]
    player.by(1)
    assert "without a key, camera.fov went back" in player.studio.messages[-1].text
    assert player.studio.scene.material.ambient == 0.4
    count = len(player.studio.messages)
    player.by(1)
    assert len(player.studio.messages) == count


# Recording


def recorded(player: Player, seconds: float, start: float = 100.0, rate: float = 50.0) -> None:
    """Flies towards the target, faster and faster, with a frame 50 times a second."""
    player.record(start)
    for step in range(1, int(seconds * rate) + 1):
        now = start + 1 + step / rate
        player.studio.set_camera(dolly(player.studio.scene.camera, exp(-0.02)), "fly")
        player.step(now)
    player.record(start + 1 + seconds)


def test_a_flight_becomes_few_keys_and_one_step_of_undo() -> None:
    player = player_of()
    before = player.studio.document
    player.show(10)
    first = player.studio.scene.camera
    recorded(player, 1.0)
    studio = player.studio
    assert not player.recording
    found = keys(studio, "camera.position")
    assert 2 <= len([each for each in found if 10 <= each <= 30]) <= 7
    assert set(found) - {10.0} >= {0.0, 40.0}
    # The film flies as it was flown.
    movement = movement_of(studio.document)
    for number in range(0, 20, 3):
        wanted = dist(first.position, first.target) * exp(-0.02 * (1 + number * 2.5))
        here = movement.scene(10 + number).camera
        assert dist(here.position, here.target) == pytest.approx(wanted, rel=0.03)
    assert studio.undo("scene")
    assert studio.document == before
    assert studio.history.depth("camera") == (0, 0)


def test_recording_begins_with_the_first_move() -> None:
    player = player_of()
    player.record(100.0)
    for now in (101.0, 102.0):
        assert not player.step(now)
    player.record(103.0)
    assert "nothing was recorded" in player.studio.messages[-1].text
    assert not player.studio.unsaved


def test_a_long_flight_makes_the_film_longer() -> None:
    player = player_of(STILL, None)
    recorded(player, 5.0)
    film = player.film
    assert film is not None
    assert film.count == pytest.approx(150, abs=2)
    assert set(film.tracks) == {"camera.position", "camera.target"}


def flights(draw: st.DrawFn) -> list[Sample]:
    """A camera that turns, comes nearer and looks around, at frames of a screen."""
    speed, near, look = (draw(st.floats(-1, 1)) for _ in range(3))
    samples = []
    for step in range(draw(st.integers(2, 90))):
        t = step / 30
        target = (0.3 * look * sin(t), 0.2 * look * t, 0.0)
        far = 3 * exp(-2 * near * t)
        offset = (far * sin(speed * t), -far * cos(speed * t), 0.3 * far)
        place = tuple(a + b for a, b in zip(target, offset, strict=True))
        samples.append(Sample(step * 0.9, place, target, (0.0, 0.0, 1.0)))  # type: ignore[arg-type]
    return samples


@settings(max_examples=25, deadline=None)
@given(st.composite(flights)())
def test_no_place_of_a_flight_is_missed(samples: list[Sample]) -> None:
    scene = load_scene(STILL)
    steady = at_frames(samples)
    film = flight(scene.model_copy(update={"animation": {"frames": 10}}), samples, 0.0)
    movement = movement_of(scene.model_copy(update={"animation": film}))
    for sample in steady:
        camera = movement.posed(sample.frame).camera
        far = dist(sample.position, sample.target)
        assert dist(camera.position, sample.position) <= 1.001 * TOLERANCE * far
        assert dist(camera.target, sample.target) <= 1.001 * TOLERANCE * far


def test_a_straight_flight_needs_two_keys() -> None:
    samples = [
        Sample(float(step), (0.0, -3 * exp(-step / 20), 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        for step in range(60)
    ]
    film = flight(load_scene(STILL).model_copy(update={"animation": {"frames": 10}}), samples, 0.0)
    assert [key.frame for key in film.tracks["camera.position"].keys or ()] == [0, 59]
    assert film.count == 60
