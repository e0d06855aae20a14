"""What only some films have: two eyes, which players are told of, and AV1, whose encoder is well-behaved and may lack."""

from __future__ import annotations

import os
import struct
import sys
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from clfractal.errors import ClfractalError
from clfractal.files.film_kinds import MATROSKA, Recipe
from clfractal.files.moving import plan_film, write_film
from clfractal.files.png import write_png_pixels
from tests.shell import Ended, InProcess, python, works

# --- two eyes ---


SIZE = (96, 64)
# Matroska's StereoMode, with the left eye first and with the right one.
NUMBERS = {
    "split": (1, 11),
    "split_half": (1, 11),
    "over_under": (3, 2),
    "over_under_half": (3, 2),
    "rows": (7, 6),
    "columns": (9, 8),
    "checkerboard": (5, 4),
}
# FFmpeg's AV_STEREO3D_...
KINDS = {
    "split": 1,
    "split_half": 1,
    "over_under": 2,
    "over_under_half": 2,
    "rows": 6,
    "columns": 7,
    "checkerboard": 4,
}


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Pictures of noise that changes: no two are alike."""
    folder = tmp_path_factory.mktemp("pictures")
    rng = np.random.default_rng(3)
    paths = [folder / f"{number}.png" for number in range(3)]
    for path in paths:
        write_png_pixels(path, rng.integers(0, 256, (SIZE[1], SIZE[0], 3), dtype=np.uint8))
    return paths


def stereo_mode(path: Path) -> int:
    """Matroska's element StereoMode (0x53B8), of one byte."""
    data = path.read_bytes()
    at = data.index(b"\x53\xb8\x81")
    return data[at + 3]


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("mode", NUMBERS)
def test_matroska_tells(mode: str, swap: bool, pictures: list[Path], tmp_path: Path) -> None:
    path = tmp_path / "film.mkv"
    plan = plan_film(path, Recipe(), SIZE, 25, stereo=mode, swap=swap)
    assert plan.tells_stereo
    write_film(plan, pictures)
    assert stereo_mode(path) == NUMBERS[mode][swap]
    with av.open(str(path)) as file:
        assert file.streams.video[0].metadata["stereo_mode"] == MATROSKA[mode][swap]


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("suffix", [".mp4", ".mkv", ".mov"])
@pytest.mark.parametrize(
    ("codec", "mode"),
    [*(("h264", mode) for mode in KINDS), *(("h265", mode) for mode in KINDS if KINDS[mode] < 3)],
)
def test_streams_tell(
    codec: str, mode: str, suffix: str, swap: bool, pictures: list[Path], tmp_path: Path
) -> None:
    told, plain = tmp_path / f"told{suffix}", tmp_path / f"plain{suffix}"
    plan = plan_film(told, Recipe(codec), SIZE, 25, stereo=mode, swap=swap)
    assert plan.tells_stereo
    write_film(plan, pictures)
    write_film(plan_film(plain, Recipe(codec), SIZE, 25), pictures)
    with av.open(str(told)) as film, av.open(str(plain)) as other:
        frames, others = list(film.decode(video=0)), list(other.decode(video=0))
    assert len(frames) == len(others) == 3
    assert frames[0].key_frame
    for frame, bare in zip(frames, others, strict=True):
        if frame.key_frame:
            kind, flags = struct.unpack_from("ii", bytes(frame.side_data["STEREO3D"]))
            assert (kind, flags & 1) == (KINDS[mode], swap)
        assert bare.side_data.get("STEREO3D") is None
        # The pictures are coded as before.
        np.testing.assert_array_equal(frame.to_ndarray(), bare.to_ndarray())


def test_what_cannot_tell_is_known(tmp_path: Path) -> None:
    for codec, suffix, mode in (
        ("prores", ".mov", "split"),
        ("av1", ".mp4", "split"),
        ("h265", ".mp4", "rows"),
        ("h265", ".mov", "checkerboard"),
    ):
        for swap in (False, True):
            plan = plan_film(tmp_path / f"f{suffix}", Recipe(codec), SIZE, 25, stereo=mode, swap=swap)
            assert not plan.tells_stereo
    for one in (None, "anaglyph", "left"):  # one picture
        assert plan_film(tmp_path / "f.mov", Recipe(), SIZE, 25, stereo=one, swap=True).tells_stereo


SCENE = """\
version: 1
formula: {name: mandelbulb, iterations: 4}
image: {width: 48, height: 32}
camera: {position: [0, -6, 0], fov: 40}
objects: {near: {type: sphere, position: [0, -3, 0.8], radius: 0.15}}
stereo: {mode: split, swap: true, screen_width: 0.6, screen_distance: 0.6}
animation: {frames: 2, tracks: {camera.position.0: {expression: u}}}
"""


def test_the_shell_tells_that_eyes_are_swapped(clf: InProcess) -> None:
    ended = works(clf("animate", "scene.yaml", "-o", "film.mkv", "-o", "film.mp4", "-o", "film.mov"))
    assert stereo_mode(Path("film.mkv")) == 11
    told = [line for line in ended.err.splitlines() if "players are not told" in line]
    assert told == ["film.mov: players are not told how it holds two pictures; choose it there"]


# --- AV1 ---


WRITING = """
import os, sys, threading
from pathlib import Path
from clfractal.files import moving
from clfractal.files.film_kinds import Recipe

def schedules():
    return {os.sched_getscheduler(int(each.name)) for each in Path("/proc/self/task").iterdir()}

seen = []
def noted(*arguments):
    seen.append(schedules())
    return frame(*arguments)

frame, moving._frame = moving._frame, noted
before = schedules()
plan = moving.plan_film(Path("film.mp4"), Recipe("av1"), (128, 96), 25)
moving.write_film(plan, [Path("a.png")] * 3)
late = threading.Thread(target=lambda: seen.append(schedules()))
late.start(), late.join()
assert len(seen) == 4 and all(each == before for each in seen), (before, seen)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell how threads are scheduled")
def test_no_thread_is_scheduled_otherwise(tmp_path: Path) -> None:
    """Also as root, who may; the same process afterwards starts usual threads, and nothing was said."""
    Image.new("RGB", (128, 96), (40, 90, 200)).save(tmp_path / "a.png")
    ended = python(WRITING, folder=tmp_path, extra={"PYTHONPATH": os.pathsep.join(sys.path)})
    assert ended == Ended(0, "", "")


def test_it_is_av1_with_ten_bits(tmp_path: Path) -> None:
    ramp = np.repeat(np.repeat(np.linspace(0, 255, 128).astype(np.uint8)[None, :, None], 96, 0), 3, 2)
    Image.fromarray(ramp).save(tmp_path / "a.png")
    path = tmp_path / "film.mkv"
    write_film(plan_film(path, Recipe("av1"), (128, 96), 25), [tmp_path / "a.png"] * 2)
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        assert stream.codec_context.codec.canonical_name == "av1"
        assert [frame.format.name for frame in file.decode(stream)] == ["yuv420p10le"] * 2


def test_who_has_no_such_encoder_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(av, "codecs_available", av.codecs_available - {"libsvtav1"})
    with pytest.raises(ClfractalError, match="the installed package av has no libsvtav1") as caught:
        plan_film(tmp_path / "a.mp4", Recipe("av1"), (128, 96), 25)
    assert str(caught.value).startswith("--codec: ")
