"""Files on a disk: whole or not at all, whatever their names; and changes, told once each."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.errors import FileError
from clfractal.files.atomic import atomic_writer, check_output, open_regular
from clfractal.files.environment_map import read_environment
from clfractal.files.exr import library_name, read_exr, write_exr
from clfractal.files.exr_header import read_header
from clfractal.files.texture import read_texture
from clfractal.files.watching import INTERVAL, Watched
from tests.calls import counted, failure, raising
from tests.files.limits import file_size_limit
from tests.shell import InProcess, process


def contents(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


@pytest.fixture
def target(tmp_path: Path) -> Iterator[Path]:
    """An earlier file, which stays as it was and alone."""
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    yield path
    assert contents(tmp_path) == ["a.png"]
    assert path.read_bytes() == b"old"


def test_file_appears_with_its_content(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    with atomic_writer(target) as beside:
        beside.write_bytes(b"new")
        assert contents(tmp_path) == [beside.name]
        assert beside.name.startswith(".")
    assert contents(tmp_path) == ["a.png"]
    assert target.read_bytes() == b"new"


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, SystemExit])
def test_any_exception_leaves_the_earlier_file_alone(target: Path, error: type[BaseException]) -> None:
    def broken() -> None:
        with atomic_writer(target) as beside:
            beside.write_bytes(b"half of it")
            raise error

    with pytest.raises(error):
        broken()


def test_system_errors_become_one_line_that_names_the_file(target: Path) -> None:
    with (
        pytest.raises(FileError) as caught,
        file_size_limit(1000),
        atomic_writer(target) as beside,
        open(beside, "wb") as stream,
    ):
        stream.write(b"x" * 5000)
    told = f"{target}: cannot be written: File too large: at most 1000 bytes are allowed here (ulimit -f)"
    assert str(caught.value) == told


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


def test_check_leaves_nothing_behind_and_touches_nothing(target: Path) -> None:
    check_output(target)
    check_output(target.with_name("new.EXR"))


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
        error = failure(FileError, check_output, f"{tmp_path}/{name}")
        assert error.message.startswith(message.strip()), name
        assert error.where.file == f"{tmp_path}/{name}"


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
        assert failure(FileError, open_regular, path).message.startswith(message.strip())


def test_a_disk_that_fails_late_is_noticed(target: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Some file systems find out that there is no room only when the data is brought to the disk.
    monkeypatch.setattr(os, "fsync", raising(OSError(28, "No space left on device")))
    with (
        pytest.raises(FileError, match=r"a\.png: cannot be written: No space left on device$"),
        atomic_writer(target) as beside,
    ):
        beside.write_bytes(b"new")


# --- names that are not UTF-8 ---


SCENE = """version: 1
formula: {name: mandelbulb, iterations: 4}
image: {width: 16, height: 8}
camera: {position: [1.2, -2.2, 1.0]}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder whose name is Latin-1 with a byte that UTF-8 never has."""
    name = os.fsdecode(b"d\xe9\xff")
    try:
        (tmp_path / name).mkdir()
    except OSError:
        pytest.skip("this file system takes no such names")
    return tmp_path / name


def write(path: Path, rows: int = 4) -> npt.NDArray[np.float32]:
    """A picture, twice as wide as high, of random colours; gives its red."""
    colours: npt.NDArray[np.float32] = np.random.default_rng(1).random((3, rows, 2 * rows)).astype(np.float32)
    bands = [dict(zip("RGB", colours, strict=True))]
    size = (2 * rows, rows)
    write_exr(path, bands, display=size, region=(0, 0, *size), channels=tuple("RGB"), half=())
    red: npt.NDArray[np.float32] = colours[0]
    return red


@pytest.mark.skipif(sys.platform == "win32", reason="its names are Unicode")
@pytest.mark.parametrize("file", ["a.exr", os.fsdecode(b"\xe9\xff.exr")])
def test_pictures(folder: Path, file: str) -> None:
    red = write(folder / file)
    assert [path.name for path in folder.iterdir()] == [file], "written there, and nothing else"
    np.testing.assert_array_equal(read_exr(folder / file)[0]["R"], red)
    assert read_header(folder / file).values()["dataWindow"] == (0, 0, 7, 3)
    assert read_environment(folder / file).any()
    assert read_texture(folder / file).pixels.any()


def test_the_shell_s_outputs_and_inputs(folder: Path, clf: InProcess) -> None:
    for name in ("a.exr", "a.png", "a.jpg", "a.webp"):
        ended = clf("render", "scene.yaml", "-o", folder / name, "--quiet")
        assert (ended.status, ended.err) == (0, ""), name
        assert (folder / name).exists()
    assert clf("render", folder / "a.exr", "-o", "again.exr", "--quiet").status == 0
    ours, theirs = (read_exr(path)[0] for path in (folder / "a.exr", Path("again.exr")))
    assert all(np.array_equal(ours[name], theirs[name]) for name in ours)
    (folder / "env.yaml").write_text(SCENE + "environment: {file: a.exr}\n")
    assert clf("render", folder / "env.yaml", "-o", folder / "b.exr", "--resume", "--quiet").status == 0
    assert not list(folder.glob("*.partial"))


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have UTF-8 in every locale")
def test_names_in_a_locale_without_utf8(tmp_path: Path) -> None:
    """Python decodes names by the locale, and the library must get the bytes that the file system has."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    name = os.fsdecode("é.exr".encode())
    ended = process(["render", "scene.yaml", "-o", name, "--quiet"], tmp_path, plain)
    assert (ended.status, ended.err) == (0, "")
    assert (tmp_path / name).exists()


def test_half_a_pair_of_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows has names of any 16-bit numbers; the library has none for these there."""
    monkeypatch.setattr(sys, "platform", "win32")
    assert library_name("é.exr") == b"\xc3\xa9.exr"
    with pytest.raises(FileError, match=r"^b\.exr: the name .* is not valid Unicode$"):
        library_name("\ud800.exr", shown="b.exr")


# --- changes on the disk, told once each ---


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
    looks = counted(monkeypatch, os, "stat")
    for frame in range(1, 121):  # two seconds
        now[0] = frame / 60
        watched.changed()
    assert [path for path, *_ in looks].count(files[0]) == 4


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
