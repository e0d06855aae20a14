"""Films that go on after an interruption take only frames that are stored as the film needs them."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from clfractal.errors import FileError
from clfractal.files.png import read_form, write_png
from tests.shell import InProcess

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 64, height: 48}
camera: {position: [0, -3, 0]}
animation: {fps: 12, frames: 3, tracks: {camera.fov: {keys: [{frame: 0, value: 60}, {frame: 2, value: 30}]}}}
"""


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def interrupted(clf: InProcess, monkeypatch: pytest.MonkeyPatch, *options: str) -> None:
    """All frames are made, and the film is not."""
    with monkeypatch.context() as patch:
        patch.setattr("clfractal.files.moving._frame", _interrupt)
        with pytest.raises(KeyboardInterrupt):
            clf("animate", "scene.yaml", "-o", "film.mkv", *options)


def levels(path: Path) -> set[int]:
    """The codes of a film of 16 bits, in its first picture."""
    with av.open(str(path)) as file:
        frame = next(file.decode(video=0))
    assert frame.format.name == "gbrp16le"
    return set(np.frombuffer(bytes(frame.planes[0]), "<u2").tolist())


def test_frames_of_fewer_bits_are_made_again(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    interrupted(clf, monkeypatch)
    kept = sorted(Path("film.mkv.partial").iterdir())
    assert [read_form(path) for path in kept] == [(8, 3)] * 3
    ended = clf("animate", "scene.yaml", "-o", "film.mkv", "--bits", "16", "--resume")
    assert ended.status == 0, ended
    assert "film.mkv: 3 frames, " in ended.err
    assert "there already" not in ended.err
    resumed = levels(Path("film.mkv"))
    assert any(code % 257 for code in resumed)  # more than 8 bits can tell
    Path("film.mkv").unlink()
    assert clf("animate", "scene.yaml", "-o", "film.mkv", "--bits", "16").status == 0
    assert levels(Path("film.mkv")) == resumed


def test_frames_of_more_bits_too_and_those_that_fit_stay(
    clf: InProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So a film has the same bits as one that was never interrupted: those of 8 bits are dithered."""
    interrupted(clf, monkeypatch, "--bits", "16")
    assert (
        "all 3 frames were there"
        in clf("animate", "scene.yaml", "-o", "film.mkv", "--bits", "16", "--resume").err
    )
    interrupted(clf, monkeypatch, "--bits", "16")
    ended = clf("animate", "scene.yaml", "-o", "film.mkv", "--resume")
    assert "there already" not in ended.err
    resumed = Path("film.mkv").read_bytes()
    Path("film.mkv").unlink()
    assert clf("animate", "scene.yaml", "-o", "film.mkv").status == 0
    with av.open("film.mkv") as file:
        assert next(file.decode(video=0)).format.name == "bgr0"
    assert len(Path("film.mkv").read_bytes()) == len(resumed)


def test_a_numbered_picture_that_was_converted_is_made_again(clf: InProcess) -> None:
    assert clf("animate", "scene.yaml", "-o", "f#.png").status == 0
    first = Path("f1.png")
    whole = first.read_bytes()
    with Image.open(first) as picture:
        scene = picture.text["clfractal"]  # type: ignore[attr-defined]
        light = (np.asarray(picture.convert("RGBA")) / np.float32(255)).astype(np.float32)
    write_png(first, [light], width=64, height=48, alpha=True, texts={"clfractal": scene})
    assert read_form(first) == (8, 4)
    ended = clf("animate", "scene.yaml", "-o", "f#.png", "--resume")
    assert "1 frames, 2 were there already" in ended.err
    assert read_form(first) == (8, 3)
    assert abs(len(first.read_bytes()) - len(whole)) < 50


def test_the_form_of_a_picture(tmp_path: Path) -> None:
    for mode, form in {"L": (8, 1), "LA": (8, 2), "RGB": (8, 3), "RGBA": (8, 4), "I;16": (16, 1)}.items():
        Image.new(mode, (3, 2)).save(tmp_path / "a.png")
        assert read_form(tmp_path / "a.png") == form
    (tmp_path / "b.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(FileError, match="is not a PNG file"):
        read_form(tmp_path / "b.png")
