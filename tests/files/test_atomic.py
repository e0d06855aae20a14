"""Files appear whole or not at all, and what cannot be written is told in one line beforehand."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from clfractal.errors import FileError
from clfractal.files.atomic import atomic_writer, check_output, open_regular
from tests.files.limits import file_size_limit


def contents(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def test_file_appears_with_its_content(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    with atomic_writer(target) as beside:
        beside.write_bytes(b"new")
        assert contents(tmp_path) == [beside.name]
        assert beside.name.startswith(".")
    assert contents(tmp_path) == ["a.png"]
    assert target.read_bytes() == b"new"


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, SystemExit])
def test_any_exception_leaves_the_earlier_file_alone(tmp_path: Path, error: type[BaseException]) -> None:
    target = tmp_path / "a.png"
    target.write_bytes(b"old")

    def broken() -> None:
        with atomic_writer(target) as beside:
            beside.write_bytes(b"half of it")
            raise error

    with pytest.raises(error):
        broken()
    assert contents(tmp_path) == ["a.png"]
    assert target.read_bytes() == b"old"


def test_system_errors_become_one_line_that_names_the_file(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    target.write_bytes(b"old")
    with (
        pytest.raises(FileError) as caught,
        file_size_limit(1000),
        atomic_writer(target) as beside,
        open(beside, "wb") as stream,
    ):
        stream.write(b"x" * 5000)
    told = f"{target}: cannot be written: File too large: at most 1000 bytes are allowed here (ulimit -f)"
    assert str(caught.value) == told
    assert target.read_bytes() == b"old"
    assert contents(tmp_path) == ["a.png"]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    link = tmp_path / "a.png"
    link.symlink_to(tmp_path / "real" / "b.png")
    with atomic_writer(link) as beside:
        beside.write_bytes(b"new")
    assert link.is_symlink()
    assert (tmp_path / "real" / "b.png").read_bytes() == b"new"


def test_permissions_of_the_earlier_file_are_kept_and_new_ones_follow_the_umask(tmp_path: Path) -> None:
    earlier, fresh, plain = tmp_path / "a.png", tmp_path / "b.png", tmp_path / "c.png"
    earlier.write_bytes(b"old")
    earlier.chmod(0o640)
    plain.write_bytes(b"")
    for target in (earlier, fresh):
        with atomic_writer(target) as beside:
            beside.write_bytes(b"new")
    assert earlier.stat().st_mode & 0o777 == 0o640
    assert fresh.stat().st_mode == plain.stat().st_mode


def test_the_longest_names_work(tmp_path: Path) -> None:
    target = tmp_path / ("n" * 251 + ".png")
    check_output(target)
    with atomic_writer(target) as beside:
        beside.write_bytes(b"new")
    assert target.read_bytes() == b"new"


def test_check_leaves_nothing_behind_and_touches_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.EXR"
    target.write_bytes(b"old")
    check_output(target)
    check_output(tmp_path / "new.png")
    assert contents(tmp_path) == ["a.EXR"]
    assert target.read_bytes() == b"old"


def test_check_tells_what_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").write_bytes(b"")
    os.mkfifo(tmp_path / "pipe.png")
    cases = {
        "a.gif": "unknown extension '.gif'; known: .exr, .png, .jpg, .jpeg, .webp",
        "a": "needs an extension: .exr, .png",
        "gone/a.png": f"cannot be written: there is no folder '{tmp_path}/gone'",
        "file/a.png": f"cannot be written: '{tmp_path}/file' is not a folder",
        "folder.png": "cannot be written: it is a folder",
        "pipe.png": "cannot be written: it is not a regular file",
        "n" * 300 + ".png": "cannot be written: File name too long",
        "a\0b.png": "cannot be written: ",
    }
    for name, message in cases.items():
        with pytest.raises(FileError) as caught:
            check_output(f"{tmp_path}/{name}")
        assert caught.value.message.startswith(message.strip()), name
        assert caught.value.where.file == f"{tmp_path}/{name}"
        assert caught.value.status == 2


def test_check_follows_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A link that leads to itself, one into a folder that is not there, and one to a file that is still to come."""
    monkeypatch.chdir(tmp_path)
    Path("loop.png").symlink_to("back.png")
    Path("back.png").symlink_to("loop.png")
    Path("dangling.png").symlink_to("missing/picture.png")
    Path("into.png").symlink_to("loop.png/picture.png")
    messages = {
        "loop.png": "loop.png: cannot be written: it is a link that leads to itself",
        "dangling.png": f"dangling.png: cannot be written: there is no folder '{tmp_path}/missing'",
        "into.png": "into.png: cannot be written",
    }
    for name, message in messages.items():
        with pytest.raises(FileError, match=f"^{re.escape(message)}"):
            check_output(name)
    Path("new.png").symlink_to("picture.png")
    check_output("new.png")
    assert not Path("picture.png").exists()


def test_check_refuses_what_the_system_does_not_let_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The rights of a folder do not bind the superuser, as whom tests may run: the system's answer is put in.
    def refuse(path: Path, flags: int, mode: int = 0o777) -> int:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(FileError, match=r"a\.png: cannot be written: Permission denied$"):
        check_output(tmp_path / "a.png")
    with (
        pytest.raises(FileError, match=r"a\.png: cannot be written: Permission denied$"),
        atomic_writer(tmp_path / "a.png"),
    ):
        pass


def test_reading_never_waits_for_a_pipe_or_reads_a_device(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, message in {
        str(tmp_path / "pipe"): "is not a regular file",
        "/dev/zero": "is not a regular file",
        str(tmp_path): "is a folder, not a file",
        str(tmp_path / "gone"): "cannot be read: No such file or directory",
        "a\0b": "cannot be read: ",
    }.items():
        with pytest.raises(FileError) as caught:
            open_regular(path)
        assert caught.value.message.startswith(message.strip())


def test_a_disk_that_fails_late_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Some file systems find out that there is no room only when the data is brought to the disk.
    def fail(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    target = tmp_path / "a.png"
    target.write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", fail)
    with (
        pytest.raises(FileError, match=r"a\.png: cannot be written: No space left on device$"),
        atomic_writer(target) as beside,
    ):
        beside.write_bytes(b"new")
    assert target.read_bytes() == b"old"
    assert contents(tmp_path) == ["a.png"]
