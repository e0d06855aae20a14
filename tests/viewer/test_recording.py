"""Recorded events are played back as they were, at their times; damaged files are told by their lines."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import FileError
from clfractal.viewer.recording import KINDS, Event, Player, Recorder, Recording, Timed, read_recording

WHOLE = st.integers(-(2**31), 2**31)
REAL = st.floats(allow_nan=False, allow_infinity=False)
BY_TYPE: dict[type, st.SearchStrategy[Any]] = {int: WHOLE, float: REAL, str: st.text()}


def of_kind(kind: str) -> st.SearchStrategy[Event]:
    types = KINDS[kind]
    values = (
        st.tuples(*(BY_TYPE[each] for each in types))
        if isinstance(types, tuple)
        else st.lists(BY_TYPE[types]).map(tuple)
    )
    return values.map(lambda found: Event(kind, found))


EVENTS = st.sampled_from(sorted(KINDS)).flatmap(of_kind)
# Steps between events: whole microseconds, as files keep them.
TIMED = st.lists(st.tuples(st.integers(0, 10**7), EVENTS), max_size=30)


def timed(steps: list[tuple[int, Event]]) -> tuple[Timed, ...]:
    found, now = [], 0
    for step, event in steps:
        now += step
        found.append(Timed(now / 1e6, event))
    return tuple(found)


def written(events: tuple[Timed, ...], path: Path, size: tuple[int, int] = (1280, 720)) -> None:
    with Recorder(path, size) as recorder:
        for each in events:
            recorder.add(each.event, each.seconds)


@given(TIMED, st.tuples(st.integers(1, 10_000), st.integers(1, 10_000)))
def test_what_is_recorded_is_read(steps: list[tuple[int, Event]], size: tuple[int, int]) -> None:
    events = timed(steps)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.jsonl")
        written(events, path, size)
        assert read_recording(path) == Recording(size, events)


@given(TIMED, st.data())
def test_a_cut_off_recording_has_its_whole_lines(steps: list[tuple[int, Event]], data: st.DataObject) -> None:
    events = timed(steps)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.jsonl")
        written(events, path)
        content = path.read_bytes()
        header = content.index(b"\n") + 1
        length = data.draw(st.integers(header, len(content)))
        path.write_bytes(content[:length])
        # A line that only lacks its line break is whole.
        whole = (content[:length] + b"\n").count(b"}\n") - 1
        assert read_recording(path).events == events[:whole]


@given(TIMED, st.lists(st.floats(0, 400), max_size=20))
def test_each_event_is_played_once_in_order_when_its_time_has_come(
    steps: list[tuple[int, Event]], looks: list[float]
) -> None:
    events = timed(steps)
    player = Player(Recording((1, 1), events))
    given_so_far: list[Event] = []
    for now in sorted(looks):
        given_so_far += player.due(now)
        assert given_so_far == [each.event for each in events if each.seconds <= now]
        later = [each.seconds for each in events if each.seconds > now]
        assert player.next_seconds == (later[0] if later else None)
        assert player.done is (not later)
    given_so_far += player.due(float("inf"))
    assert given_so_far == [each.event for each in events]
    assert player.done
    assert player.due(float("inf")) == []


def test_times_never_go_back(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a", (10, 10)) as recorder:
        for seconds in (0.5, 0.25, 0.75):
            recorder.add(Event("focus", (1,)), seconds)
    found = read_recording(tmp_path / "a")
    assert [each.seconds for each in found.events] == [0.5, 0.5, 0.75]
    assert found.seconds == 0.75


def test_after_a_second_it_is_on_the_disk(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a", (10, 10))
    recorder.add(Event("char", (65,)), 0.1)
    recorder.add(Event("char", (66,)), 1.2)
    # Not closed, as after a crash.
    assert [each.event.values for each in read_recording(tmp_path / "a").events] == [(65,), (66,)]
    recorder.close()


HEADER = {"format": "clfractal events", "version": 1, "size": [640, 360]}
MOVE = {"at": 1.5, "move": [3, 4.5]}
WRONG: dict[str, tuple[list[Any], str]] = {
    "no recording": ([{"camera": 1}], "a: is no recording of clfractal's window"),
    "version": ([{**HEADER, "version": 2}], "a:1: version must be 1, got 2"),
    "size": ([{**HEADER, "size": [0, 1]}], "a:1: size must be the window's width and height"),
    "list": ([HEADER, MOVE, []], "a:3: must be a mapping"),
    "no time": ([HEADER, {"move": [1, 2]}], "a:2: `at` must be a time in seconds, at least 0"),
    "negative": ([HEADER, {**MOVE, "at": -1}], "a:2: `at` must be a time in seconds, at least 0"),
    "back": ([HEADER, MOVE, {**MOVE, "at": 1}], "a:3: `at` must not be before the line above, 1.5, got 1"),
    "two": ([HEADER, {**MOVE, "char": [1]}], "a:2: must have `at` and one kind of event, got 2"),
    "none": ([HEADER, {"at": 1}], "a:2: must have `at` and one kind of event, got 0"),
    "kind": ([HEADER, {"at": 1, "mov": [1, 2]}], "a:2: unknown event 'mov'; did you mean 'move'?"),
    "count": ([HEADER, {"at": 1, "move": [1]}], "a:2: move must have 2 values, got 1"),
    "word": ([HEADER, {"at": 1, "move": [1, "2"]}], "a:2: move must have numbers, got '2'"),
    "part": ([HEADER, {"at": 1, "char": [1.5]}], "a:2: char must have whole numbers, got '1.5'"),
    "truth": ([HEADER, {"at": 1, "focus": [True]}], "a:2: focus must have whole numbers, got 'True'"),
    "text": ([HEADER, {"at": 1, "drop": [1]}], "a:2: drop must have texts, got '1'"),
    "single": ([HEADER, {"at": 1, "char": 65}], "a:2: char must have a list of values"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_lines(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lines, message = WRONG[name]
    Path("a").write_text("".join(json.dumps(line) + "\n" for line in lines))
    with pytest.raises(FileError) as caught:
        read_recording("a")
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "a: is no recording of clfractal's window"),
        ("version: 1\n", "a: is no recording of clfractal's window"),
        (json.dumps(HEADER) + "\nnot json\n" + json.dumps(MOVE) + "\n", "a:2: is not a line of JSON"),
        (json.dumps(HEADER) + '\n{"at": NaN, "focus": [1]}\n', "a:2: is not a line of JSON"),
        (json.dumps(HEADER) + '\n{"at": 1e999, "focus": [1]}\n', "a:2: `at` must be a time in seconds"),
        (json.dumps(HEADER) + "\n" + "[" * 100_000 + "\n", "a:2: is not a line of JSON"),
    ],
)
def test_wrong_texts(content: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a").write_text(content)
    with pytest.raises(FileError) as caught:
        read_recording("a")
    assert str(caught.value).startswith(message)


def test_files_that_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="cannot be read"):
        read_recording(tmp_path / "none")
    with pytest.raises(FileError, match="cannot be written"):
        Recorder(tmp_path / "none" / "a", (1, 1))


@pytest.mark.parametrize(
    "event",
    [Event("mov", (1, 2)), Event("move", (1,)), Event("char", (1.5,)), Event("move", (float("nan"), 1))],
)
def test_events_that_are_none_are_not_recorded(event: Event, tmp_path: Path) -> None:
    with Recorder(tmp_path / "a", (1, 1)) as recorder, pytest.raises(ValueError, match=event.kind):
        recorder.add(event, 0)
    assert read_recording(tmp_path / "a").events == ()
