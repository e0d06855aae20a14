"""`-`: scenes from standard input, files to standard output."""

from __future__ import annotations

import io
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clfractal.cli import run
from clfractal.cli.pipes import is_stream
from clfractal.cli.shell import Shell
from clfractal.files.exr import read_exr
from clfractal.files.regular import MAX_BYTES
from clfractal.files.volume_file import read_volume
from tests.shell import SCENE, command, environment


class Piped:
    """Calls the program as a function, with bytes at both ends; gives its status, standard output, and standard error."""

    def __init__(self, capture: pytest.CaptureFixture[bytes], patch: pytest.MonkeyPatch) -> None:
        self.capture, self.patch = capture, patch

    def __call__(self, *arguments: str, given: bytes | str = b"") -> tuple[int, bytes, str]:
        data = given.encode() if isinstance(given, str) else given
        self.patch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(data)))
        self.capture.readouterr()
        status = run(arguments, Shell(owns_process=False))
        told = self.capture.readouterr()
        return status, told.out, told.err.decode()


@pytest.fixture
def piped(here: Path, capsysbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch) -> Piped:
    temporary = here / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    return Piped(capsysbinary, monkeypatch)


def files(folder: Path) -> list[str]:
    """What is there beside the scene; nothing temporary stays."""
    assert not list((folder / "temporary").iterdir())
    return sorted(each.name for each in folder.iterdir() if each.name not in ("scene.yaml", "temporary"))


def refused(ended: tuple[int, bytes, str], line: str) -> None:
    assert ended == (2, b"", line + "\n")


def test_names_of_standard_output() -> None:
    assert all(is_stream(Path(name)) for name in ("-", "-.exr", "-.JPG"))
    assert not any(is_stream(Path(name)) for name in ("a-", "-a", "-.", "-.a/b", "folder/-", "--", "-a.png"))
    assert is_stream(Path("./-"))  # which Path does not tell from `-`
    assert not is_stream(None)


def test_a_picture_from_end_to_end(here: Path, piped: Piped) -> None:
    assert piped("render", "scene.yaml", "-o", "file.png", "-o", "file.exr", "--quiet")[0] == 0
    with Image.open("file.png") as image:
        wanted = np.asarray(image)
    status, png, told = piped("render", "-", "-o", "-", given=SCENE)
    assert (status, told.count("\n"), told.startswith("standard output: ")) == (0, 1, True)
    with Image.open(io.BytesIO(png)) as image:
        assert image.format == "PNG"
        np.testing.assert_array_equal(np.asarray(image), wanted)
    # A picture holds the scene, so it is one, also in a pipe; and another format is named behind the dash.
    status, exr, told = piped("render", "-", "-o", "-.exr", "-o", "too.jpg", "-q", given=png)
    assert (status, told) == (0, "")
    (here / "sent.exr").write_bytes(exr)
    np.testing.assert_array_equal(read_exr("sent.exr")[0]["R"], read_exr("file.exr")[0]["R"])
    assert files(here) == ["file.exr", "file.png", "sent.exr", "too.jpg"]


@pytest.mark.parametrize(("name", "kind"), [("-.jpg", "JPEG"), ("-.WEBP", "WEBP")])
def test_other_formats(here: Path, piped: Piped, name: str, kind: str) -> None:
    status, data, _ = piped("render", "scene.yaml", "-o", name)
    assert status == 0
    with Image.open(io.BytesIO(data)) as image:
        assert image.format == kind
    assert files(here) == []


def test_statistics(here: Path, piped: Piped) -> None:
    status, told, _ = piped("render", "scene.yaml", "-o", "a.png", "--stats", "-", "-q")
    assert status == 0
    assert json.loads(told)["width"] == 40
    assert files(here) == ["a.png"]


def test_scenes_for_other_commands(here: Path, piped: Piped) -> None:
    assert piped("check", "-", given=SCENE)[:2] == piped("check", "scene.yaml")[:2]
    assert piped("probe", "-", "20,18", given=SCENE)[:2] == piped("probe", "scene.yaml", "20,18")[:2]
    cut = ("--set", "renderer={type: cut_plane}", "--count", "2", "-q")
    assert piped("slices", "-", "-o", "s.png", *cut, given=SCENE) == (0, b"", "")
    small = ("--count", "1", "--size", "16x9", "-q")
    assert piped("vary", "-", *small, given=SCENE) == (0, b"", "")
    assert files(here) == ["s_0001.png", "s_0002.png", "scene-01.png", "scene-01.yaml"]


def test_grids_and_triangles(here: Path, piped: Piped) -> None:
    status, grid, told = piped("voxelize", "-", "-o", "-", "--resolution", "16", given=SCENE)
    assert status == 0
    assert told.splitlines()[0].startswith("standard input: 16 x 16 x 16 voxels")
    (here / "a.nrrd").write_bytes(grid)
    assert read_volume(here / "a.nrrd").values.shape == (16, 16, 16)
    status, triangles, _ = piped("mesh", "a.nrrd", "-o", "-.stl", "-q")
    assert status == 0
    assert len(triangles) == 84 + 50 * int.from_bytes(triangles[80:84], "little")
    refused(
        piped("voxelize", "scene.yaml", "-o", "-.npy"),
        "standard output: cannot be written to: beside an NPY there is a second file; use -.nrrd",
    )


def test_files_that_a_piped_scene_names_lie_in_the_current_folder(here: Path, piped: Piped) -> None:
    formula = 'variables: [x, y, z]\nmap: ["x*x - y*y", "2*x*y", "z/2"]\nadd: point\ndegree: 2\nbounds: {radius: 2}\n'
    (here / "mine.yaml").write_text(formula)
    scene = SCENE.replace("name: mandelbulb", "file: mine.yaml")
    assert piped("check", "-", given=scene)[0] == 0
    gone = piped("check", "-", given=scene.replace("mine", "gone"))
    assert gone[0] == 2
    assert gone[2].startswith("standard input:2:")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["render", "-"], "-o: is needed where the scene comes from standard input"),
        (["render", "S", "-o", "-", "-o", "-.exr"], ">takes one file, but 2 are meant for it; name the others"),
        (["render", "S", "-o", "-", "--stats", "-"], ">takes one file, but 2 are meant for it; name the others"),
        (["render", "S", "-o", "-", "--resume"], "--resume: needs an output file, beside which"),
        (["render", "S", "-o", "-.gif"], ">unknown extension '.gif'; known: .exr, .png,"),
        (["render", "S", "-o", "-", "--set", "stereo.mode=pair"], ">takes one file, but a pair is two; name a file"),
        (["render", "S", "-o", "-.jpg", "--set", "background=transparent"], ">a JPEG has no transparency; write"),
        (["slices", "S", "-o", "-"], ">cannot be written to: slices are several files"),
        (["vary", "S", "-o", "-"], ">cannot be written to: variations are several files; name a folder"),
        (["find", "S", "-o", "-"], ">cannot be written to: views are several files; name a folder"),
        (["vary", "S", "--sheet", "-"], ">cannot be written to: the sheet needs a file"),
        (["mesh", "S", "-o", "-.exr"], ">unknown extension '.exr'; known: .ply, .stl, .obj, .glb"),
        (["check", "-"], "standard input: holds no scene: it is empty"),
    ],
)  # fmt: skip
def test_what_cannot_be_piped(here: Path, piped: Piped, arguments: list[str], line: str) -> None:
    status, data, told = piped(*(word.replace("S", "scene.yaml") for word in arguments))
    assert (status, data, told.count("\n")) == (2, b"", 1)
    assert told.startswith(line.replace(">", "standard output: "))
    assert files(here) == []


def test_wrong_scenes(here: Path, piped: Piped) -> None:
    wrong = SCENE.replace("camera:", "camra:")
    refused(
        piped("check", "-", given=wrong), "standard input:4:1: unknown key 'camra'; did you mean 'camera'?"
    )
    refused(piped("check", "-", given=b"a: \xff\n"), "standard input:1: is not UTF-8 text")
    large = piped("check", "-", given=b"#" * (MAX_BYTES + 1))
    refused(large, "standard input: is too large: at most 1,000,000 bytes")
    cut = piped("check", "-", given=b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR")
    refused(cut, "standard input: is cut short: the file ends inside its data")
    files(here)


def test_an_error_sends_nothing(here: Path, piped: Piped) -> None:
    """Also one that comes late: the second file's disk is full."""
    (here / "full.png").symlink_to("/dev/full")
    ended = piped("render", "scene.yaml", "-o", "-", "-o", "full.png")
    assert ended[:2] == (2, b"")
    assert ended[2].startswith("full.png: cannot be written")


def test_in_a_real_pipe(here: Path) -> None:
    """A full disk, a reader that goes away, a closed output; drivers' own lines never reach it."""
    line = command("render", "scene.yaml", "-o", "-", "-q")
    with open("/dev/full", "wb") as full:
        ended = subprocess.run(line, env=environment(), stdout=full, stderr=subprocess.PIPE, text=True)
    assert (ended.returncode, ended.stderr) == (
        2,
        "standard output: cannot be written: No space left on device\n",
    )
    with subprocess.Popen(line, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE) as gone:
        assert gone.stdout is not None
        gone.stdout.close()
        assert gone.stderr is not None
        assert (gone.stderr.read(), gone.wait()) == (b"", 0)
    closed = subprocess.run(
        ["sh", "-c", '"$@" >&-', "sh", *line], env=environment(), stderr=subprocess.PIPE, text=True
    )
    assert (closed.returncode, closed.stderr) == (2, "standard output: is closed\n")
