"""The journal keeps every whole tile, whatever happens to its writer."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from clfractal.errors import FileError
from clfractal.files.journal import MAGIC, SIDE, Journal
from tests.calls import failure
from tests.files.journals import CHANNELS, COUNT, IDENTITY, content
from tests.files.limits import file_size_limit


def filled(path: Path, indices: range) -> Path:
    journal = Journal.create(path, IDENTITY, CHANNELS, COUNT)
    for index in indices:
        journal.append(index, content(index))
    journal.close()
    return path


def resumed(path: Path) -> Journal:
    return Journal.resume(path, IDENTITY, CHANNELS, COUNT)


def done(journal: Journal) -> list[int]:
    return np.flatnonzero(journal.done).tolist()


def test_tiles_come_back_in_the_same_run_and_in_the_next(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    journal = Journal.create(path, IDENTITY, CHANNELS, COUNT)
    for index in (7, 299, 0):
        journal.append(index, content(index))
    for _ in range(2):
        assert done(journal) == [0, 7, 299]
        for index in (7, 299, 0):
            assert np.array_equal(journal.tile(index), content(index))
        with pytest.raises(KeyError):
            journal.tile(1)
        journal.close()
        journal = resumed(path)
    journal.discard()
    assert not list(tmp_path.iterdir())


def test_bits_survive_also_of_infinities_and_nan(tmp_path: Path) -> None:
    array = content(0)
    array[0, 0, :4] = [np.inf, -np.inf, np.nan, -0.0]
    journal = Journal.create(tmp_path / "a.partial", IDENTITY, CHANNELS, COUNT)
    journal.append(3, array)
    assert journal.tile(3).tobytes() == array.tobytes()


def test_small_tiles_lie_in_the_top_left_corner(tmp_path: Path) -> None:
    journal = Journal.create(tmp_path / "a.partial", IDENTITY, CHANNELS, COUNT)
    journal.append(3, content(3, 5, 9))
    journal.append(4, content(4)[:, ::-1, ::-1])
    assert np.array_equal(journal.tile(3)[:, :5, :9], content(3, 5, 9))
    assert np.array_equal(journal.tile(4), content(4)[:, ::-1, ::-1])
    for wrong in ((1, 32, 32), (2, 33, 32), (2, 32, 33)):
        with pytest.raises(ValueError, match="shape"):
            journal.append(5, np.zeros(wrong, np.float32))


def test_every_truncation_keeps_the_whole_records(tmp_path: Path) -> None:
    path = filled(tmp_path / "a.partial", range(4))
    whole = path.read_bytes()
    size = 8 + content(0).nbytes
    start = len(whole) - 4 * size
    source = random.Random(4)
    cuts = {start + k * size + off for k in range(4) for off in (0, 1, 4, 7, 8, 9, size - 1)}
    for length in sorted(cuts | {source.randint(start, len(whole)) for _ in range(40)}):
        path.write_bytes(whole[:length])
        journal = resumed(path)
        kept = (length - start) // size
        assert done(journal) == list(range(kept))
        # What comes next takes the place of the torn record.
        journal.append(200, content(200))
        journal.close()
        journal = resumed(path)
        assert done(journal) == [*range(kept), 200]
        assert np.array_equal(journal.tile(200), content(200))
        journal.close()


def test_a_damaged_record_costs_its_own_tile_only(tmp_path: Path) -> None:
    path = filled(tmp_path / "a.partial", range(5))
    whole = path.read_bytes()
    size = 8 + content(0).nbytes
    start = len(whole) - 5 * size
    for place in (0, 5, 8, 100, size - 1):
        damaged = bytearray(whole)
        damaged[start + 2 * size + place] ^= 1
        path.write_bytes(damaged)
        journal = resumed(path)
        assert done(journal) == [0, 1, 3, 4]
        journal.close()


def test_a_record_of_zeros_is_no_tile(tmp_path: Path) -> None:
    # What some file systems leave of a file's end after a power failure.
    path = filled(tmp_path / "a.partial", range(1, 3))
    with open(path, "ab") as stream:
        stream.write(bytes(8 + content(0).nbytes))
    assert done(resumed(path)) == [1, 2]


def test_damage_after_opening_is_noticed(tmp_path: Path) -> None:
    path = filled(tmp_path / "a.partial", range(2))
    journal = resumed(path)
    with open(path, "r+b") as stream:
        stream.seek(-5, os.SEEK_END)
        stream.write(b"\xff")
    with pytest.raises(FileError, match=r"a\.partial: is damaged: tile 1 has changed"):
        journal.tile(1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": "0.2.0"}, 'the version was "0.1.0" and is "0.2.0"'),
        ({"scene": "version: 1\n" * 21}, "the scene has changed"),
        (
            {"samples": 9, "device": "GPU"},
            'the device was "PoCL cpu" and is "GPU", the samples was 4 and is 9',
        ),
        ({"more": 1}, "the more was unknown and is 1"),
    ],
)
def test_other_work_is_refused_with_what_differs(
    tmp_path: Path, change: dict[str, object], message: str
) -> None:
    path = filled(tmp_path / "a.partial", range(3))
    before = path.read_bytes()
    assert (
        str(failure(FileError, Journal.resume, path, {**IDENTITY, **change}, CHANNELS, COUNT))
        == f"{path}: cannot be resumed: {message}"
    )
    assert path.read_bytes() == before


def test_other_channels_or_sizes_are_refused(tmp_path: Path) -> None:
    path = filled(tmp_path / "a.partial", range(3))
    with pytest.raises(FileError, match=r'the channels was \["R", "Z"\] and is \["Z", "R"\]'):
        Journal.resume(path, IDENTITY, ("Z", "R"), COUNT)
    with pytest.raises(FileError, match="the tiles was 300 and is 301"):
        Journal.resume(path, IDENTITY, CHANNELS, 301)


def test_what_is_no_journal_is_neither_resumed_nor_replaced(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    whole = filled(tmp_path / "b.partial", range(1)).read_bytes()
    head_damaged = bytearray(whole)
    head_damaged[30] ^= 1
    for text in (b"", b"my precious notes", MAGIC, MAGIC + b"\xff" * 8, whole[:50], bytes(head_damaged)):
        path.write_bytes(text)
        with pytest.raises(FileError, match="holds no work in progress that could be resumed"):
            resumed(path)
        if not text.startswith(MAGIC):
            with pytest.raises(FileError, match="is in the way"):
                Journal.create(path, IDENTITY, CHANNELS, COUNT)
        assert path.read_bytes() == text


def test_two_processes_do_not_share_a_journal(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    journal = Journal.create(path, IDENTITY, CHANNELS, COUNT)
    for begin in (Journal.create, Journal.resume):
        with pytest.raises(FileError, match=r"a\.partial: is in use"):
            begin(path, IDENTITY, CHANNELS, COUNT)
    journal.close()
    resumed(path).close()


def test_folders_pipes_and_missing_folders(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path, tmp_path / "pipe", tmp_path / "gone" / "a.partial"):
        for begin in (Journal.create, Journal.resume):
            assert str(failure(FileError, begin, path, IDENTITY, CHANNELS, COUNT)).startswith(f"{path}: ")


def test_full_disk_keeps_what_was_written(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    journal = Journal.create(path, IDENTITY, CHANNELS, COUNT)
    with file_size_limit(20000):
        journal.append(0, content(0))
        journal.append(1, content(1))
        with pytest.raises(FileError, match=r"a\.partial: cannot be written: File too large"):
            journal.append(2, content(2))
    assert done(journal) == [0, 1]
    assert path.stat().st_size == 20000
    # There is room again: the torn record is overwritten.
    journal.append(9, content(9))
    journal.close()
    journal = resumed(path)
    assert done(journal) == [0, 1, 9]
    assert np.array_equal(journal.tile(9), content(9))


def test_many_tiles_at_a_time_are_stored_as_one_after_the_other(tmp_path: Path) -> None:
    """More than the system is given at a time."""
    indices = [7, *range(20, COUNT), 3]
    tiles = np.stack([content(index) for index in indices])
    one, many = (Journal.create(tmp_path / name, IDENTITY, CHANNELS, COUNT) for name in ("one", "many"))
    for index, tile in zip(indices, tiles, strict=True):
        one.append(index, tile, 2)
    many.append_whole(indices, tiles, 2)
    many.append(0, content(0))
    assert np.array_equal(many.tile(3), content(3))
    assert many.provenance[[7, 0]].tolist() == [2, 0]
    one.append(0, content(0))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "many").read_bytes()
    assert done(one) == done(many)
    with pytest.raises(ValueError, match="a journal of"):
        many.append_whole([1], tiles[:1, :1])


def test_of_many_tiles_those_stay_that_a_full_disk_has_room_for(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    journal = Journal.create(path, IDENTITY, CHANNELS, COUNT)
    with file_size_limit(20000), pytest.raises(FileError, match="File too large"):
        journal.append_whole([5, 6, 7], np.stack([content(index) for index in (5, 6, 7)]))
    assert done(journal) == [5, 6]
    journal.close()
    assert done(resumed(path)) == [5, 6]


def test_full_disk_at_the_start_leaves_the_earlier_journal(tmp_path: Path) -> None:
    path = filled(tmp_path / "a.partial", range(3))
    with pytest.raises(FileError, match="cannot be written"), file_size_limit(50):
        Journal.create(path, IDENTITY, CHANNELS, COUNT)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.partial"]
    assert done(resumed(path)) == [0, 1, 2]


WRITER = """
import sys, time
from tests.files.journals import CHANNELS, COUNT, IDENTITY, content
from clfractal.files.journal import Journal
journal = Journal.resume(sys.argv[1], IDENTITY, CHANNELS, COUNT)
missing = [i for i in range(COUNT) if not journal.done[i]]
print("ready", flush=True)
for index in missing:
    journal.append(index, content(index))
    time.sleep(1e-3)  # or it could be done before it is killed, on a busy machine
    if index % 2 == 0:
        print(index, flush=True)
print("end", flush=True)
"""


def test_kill_at_random_moments_loses_nothing_that_was_finished(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    source = random.Random(5)
    kills = 0
    finished: set[int] = set()
    for _ in range(40):
        with subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True
        ) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == "ready\n"
            # Reading slows the writer down to our pace: it is killed some tiles later.
            told = []
            for _ in range(source.randint(0, 25)):
                told.append(writer.stdout.readline().strip())
                if told[-1] in ("end", ""):
                    break
            time.sleep(source.random() * 1e-3)
            writer.send_signal(signal.SIGKILL)
            told += writer.stdout.read().split()
            kills += writer.wait() == -signal.SIGKILL
        finished |= {int(line) for line in told if line.isdecimal()}
        journal = resumed(path)
        assert finished <= set(done(journal))
        for index in done(journal):
            assert np.array_equal(journal.tile(index), content(index))
        complete = bool(journal.done.all())
        journal.close()
        if complete:
            break
    assert complete
    assert kills >= 2


def test_who_made_a_tile_is_kept(tmp_path: Path) -> None:
    path, identity, channels = tmp_path / "a.partial", {"scene": "one"}, ("R", "G")
    tiles = np.random.default_rng(5).random((4, 2, SIDE, SIDE), np.float32)
    with closing(Journal.create(path, identity, channels, 10)) as journal:
        journal.append(7, tiles[0])
        journal.note(2, {"name": "a device of Ångström", "key": "k" * 5000})
        journal.append(9, tiles[1], 2)
        journal.append(0, tiles[2], 250)
    with closing(Journal.resume(path, identity, channels, 10)) as journal:
        assert journal.done.nonzero()[0].tolist() == [0, 7, 9]
        assert journal.provenance.tolist() == [250, 0, 0, 0, 0, 0, 0, 0, 0, 2]
        assert journal.notes[2]["name"] == "a device of Ångström"
        assert set(journal.notes) == {2}
        assert journal.notes[2]["key"] == "k" * len(journal.notes[2]["key"])
        for index, tile in ((7, tiles[0]), (9, tiles[1]), (0, tiles[2])):
            np.testing.assert_array_equal(journal.tile(index), tile)
        journal.append(9, tiles[3], 1)  # done again by another
        assert journal.provenance[9] == 1
    with closing(Journal.resume(path, identity, channels, 10)) as journal:
        assert journal.provenance[9] == 1
        np.testing.assert_array_equal(journal.tile(9), tiles[3])


def test_other_identities_that_may_be_continued(tmp_path: Path) -> None:
    path, channels = tmp_path / "a.partial", ("R",)
    first, second, third = ({"device": name, "scene": "s" * 90} for name in ("one", "two", "three"))
    Journal.create(path, first, channels, 3).close()
    Journal.resume(path, second, channels, 3, [third, first]).close()
    with pytest.raises(FileError, match='the device was "one" and is "two"'):
        Journal.resume(path, second, channels, 3, [{**third, "scene": "another"}])
