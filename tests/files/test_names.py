"""Files whose names are not UTF-8: Linux takes any bytes, and old disks have names in other encodings."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.errors import FileError
from clfractal.files.environment_map import read_environment
from clfractal.files.exr import library_name, read_exr, write_exr
from clfractal.files.exr_header import read_header
from clfractal.files.texture import read_texture
from tests.shell import InProcess, process

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
    assert read_texture(folder / file)[0].any()


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
