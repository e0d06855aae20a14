"""Changes on the disk are told once each, however an editor writes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from clfractal.files.watching import INTERVAL, Watched


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        self.now += INTERVAL
        return self.now


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    scene, formula = tmp_path / "scene.yaml", tmp_path / "own.yaml"
    scene.write_text("a: 1\n")
    formula.write_text("b: 1\n")
    return scene, formula


def test_a_change_of_any_file_is_told_once(files: tuple[Path, Path]) -> None:
    watched = Watched(files, clock=Clock())
    assert watched.paths == files
    assert not watched.changed()
    for path in files:
        path.write_text("c: 1000\n")
        assert watched.changed()
        assert not watched.changed()


def test_an_editor_that_renames(files: tuple[Path, Path], tmp_path: Path) -> None:
    watched = Watched(files, clock=Clock())
    status = files[0].stat()
    new = tmp_path / ".scene.yaml.swp"
    new.write_text("a: 2\n")
    # Size and time are those of the old file; only the inode tells.
    os.utime(new, ns=(status.st_atime_ns, status.st_mtime_ns))
    new.rename(files[0])
    assert watched.changed()
    assert not watched.changed()


def test_a_file_that_is_missing_for_a_moment(files: tuple[Path, Path], tmp_path: Path) -> None:
    watched = Watched(files, clock=Clock())
    aside = tmp_path / "aside"
    files[0].rename(aside)
    assert not watched.changed()
    aside.rename(files[0])
    assert not watched.changed()  # the same file again
    files[0].unlink()
    assert not watched.changed()
    files[0].write_text("a: 3\n")
    assert watched.changed()


def test_a_file_that_is_written_in_two_parts(files: tuple[Path, Path]) -> None:
    watched = Watched(files, clock=Clock())
    with files[0].open("w") as stream:
        stream.write("a: [1, ")
        stream.flush()
        assert watched.changed()
        stream.write("2]\n")
    assert watched.changed()
    assert not watched.changed()


def test_a_file_that_appears_later(tmp_path: Path) -> None:
    watched = Watched([tmp_path / "later.yaml"], clock=Clock())
    assert not watched.changed()
    (tmp_path / "later.yaml").write_text("a: 1\n")
    assert watched.changed()


def test_a_link_that_leads_elsewhere(files: tuple[Path, Path], tmp_path: Path) -> None:
    link = tmp_path / "link.yaml"
    link.symlink_to(files[0])
    watched = Watched([link], clock=Clock())
    link.unlink()
    link.symlink_to(files[1])
    assert watched.changed()


def test_what_the_window_has_written_itself_is_not_told(files: tuple[Path, Path]) -> None:
    watched = Watched(files[:1], clock=Clock())
    files[0].write_text("a: 12345\n")
    watched.accept()
    assert not watched.changed()
    # Another list of files keeps what is still to be told.
    files[0].write_text("a: 1234567\n")
    watched.follow(files)
    assert watched.changed()
    assert watched.paths == files


def test_the_disk_is_looked_at_every_half_second_at_most(
    files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    watched = Watched(files, clock=lambda: now[0])
    looks: list[Path] = []
    stat = os.stat

    def counted(path: Path, **rest: Any) -> os.stat_result:
        looks.append(path)
        return stat(path, **rest)

    monkeypatch.setattr(os, "stat", counted)
    for frame in range(1, 121):  # two seconds
        now[0] = frame / 60
        watched.changed()
    assert looks.count(files[0]) == 4


def test_a_file_that_stays_away_is_missing(files: tuple[Path, Path], tmp_path: Path) -> None:
    """Not for the moment in which an editor renames."""
    watched = Watched([*files, tmp_path / "never"], clock=Clock())
    files[0].rename(tmp_path / "aside")
    assert not watched.changed()
    assert not watched.missing
    for _ in range(2):
        assert not watched.changed()
        assert [*watched.missing] == [files[0]]
    (tmp_path / "aside").rename(files[0])
    assert not watched.changed()
    assert not watched.missing
