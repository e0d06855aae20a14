"""JPEG and WebP from a scene to a file and back, and what a format cannot hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

import clfractal
from clfractal.files.atomic import PICTURES
from clfractal.files.exr import read_exr
from clfractal.files.photo import read_texts
from clfractal.files.png import read_texts as read_png_texts
from clfractal.images.formats import KINDS
from clfractal.images.modes import PICKED
from tests.shell import SCENE, Ended, InProcess


def pixels(path: str | Path) -> npt.NDArray[np.uint8]:
    with Image.open(path) as image:
        return np.asarray(image)


def test_every_extension_has_a_format() -> None:
    assert tuple(KINDS) == PICTURES


def test_all_formats_of_one_render(here: Path, clf: InProcess) -> None:
    """The scene is in each, and renders to the same pixels again."""
    names = ["a.png", "a.jpg", "b.jpeg", "a.webp", "a.exr"]
    outputs = [part for name in names for part in ("-o", name)]
    ended = clf(
        "render", "scene.yaml", *outputs, "--quiet", "--set", "output.tone=agx", "--set", "output.quality=100"
    )
    assert ended == Ended(0, "", "")
    np.testing.assert_array_equal(pixels("a.webp"), pixels("a.png"))
    assert (here / "a.jpg").read_bytes() == (here / "b.jpeg").read_bytes()
    assert np.abs(pixels("a.jpg").astype(int) - pixels("a.png")).mean() < 1
    assert read_texts("a.jpg") == read_texts("a.webp") == read_png_texts("a.png")
    exr = read_exr("a.exr")[0]["R"]
    for name in names:
        assert clfractal.load_scene(here / name).output.tone == "agx"
    assert clf("render", "a.jpg", "-o", "again.exr", "--quiet").status == 0
    np.testing.assert_array_equal(read_exr("again.exr")[0]["R"], exr)
    assert clf("check", "a.webp").out == clf("check", "a.exr").out
    assert sorted(entry.name for entry in here.iterdir()) == sorted([*names, "again.exr", "scene.yaml"])


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("x.jpg", ["image={width: 65501, height: 1}"], "a JPEG has at most 65,500 pixels a side, got 65,501 x 1"),
        ("x.jpeg", ["image={width: 2, height: 65536}"], "a JPEG has at most 65,500 pixels a side, got 2 x 65,536"),
        ("x.webp", ["image={width: 16384, height: 1}"], "a WebP has at most 16,383 pixels a side, got 16,384 x 1"),
        ("x.webp", ["image={width: 9000, height: 2}", "stereo={mode: split}"], "a WebP has at most 16,383 pixels a side"),
        ("x.jpg", ["background=transparent"], "a JPEG has no transparency; write a PNG, WebP or EXR, or"),
        ("x.JPG", ["output.channels=[R, Z]"], "a JPEG needs the channels R, G, B; without G, B write an EXR"),
        ("x.webp", ["output.channels=[Z]"], "a WebP needs the channels R, G, B; without R, G, B write an EXR"),
    ],
)  # fmt: skip
def test_what_a_format_cannot_hold_is_refused(
    clf: InProcess, here: Path, name: str, changes: list[str], message: str
) -> None:
    """Before anything is rendered, and beside an output that could be written."""
    options = [part for change in changes for part in ("--set", change)]
    ended = clf("render", "scene.yaml", "-o", "good.exr", "-o", name, *options)
    assert ended.is_one_line(2, f"{name}: {message}")
    assert [entry.name for entry in here.iterdir()] == ["scene.yaml"]


@pytest.mark.parametrize("mode", PICKED)
def test_formats_that_mix_pixels_do_not_interlace_eyes(clf: InProcess, mode: str) -> None:
    stereo = ("--set", f"stereo.mode={mode}")
    told = f"mixes neighbouring pixels, which {mode} gives to different eyes; write a PNG"
    assert clf("render", "scene.yaml", "-o", "x.jpg", *stereo).is_one_line(2, f"x.jpg: a JPEG {told}\n")
    ended = clf("render", "scene.yaml", "-o", "x.webp", *stereo)
    assert ended.is_one_line(2, f"x.webp: a WebP {told}, or set output.quality to 100\n")
    lossless = (*stereo, "--set", "output.quality=100", "--quiet")
    assert clf("render", "scene.yaml", "-o", "x.webp", "-o", "x.png", *lossless) == Ended(0, "", "")
    np.testing.assert_array_equal(pixels("x.webp"), pixels("x.png"))


def test_modes_and_parts_that_fit(clf: InProcess) -> None:
    """A region is what a file holds; a pair is two files."""
    wide = ("--set", "image={width: 20000, height: 40}", "--region", "10000,0,40,32")
    assert clf("render", "scene.yaml", "-o", "part.webp", *wide, "--quiet") == Ended(0, "", "")
    assert pixels("part.webp").shape == (32, 40, 3)
    pair = ("--set", "stereo.mode=multi_view", "--quiet")
    assert clf("render", "scene.yaml", "-o", "eyes.jpg", *pair) == Ended(0, "", "")
    assert pixels("eyes_L.jpg").shape == pixels("eyes_R.jpg").shape == (36, 40, 3)


def test_a_webp_is_transparent(clf: InProcess) -> None:
    clear = ("--set", "background=transparent", "--set", "output.quality=100", "--quiet")
    assert clf("render", "scene.yaml", "-o", "a.webp", "-o", "a.png", *clear) == Ended(0, "", "")
    assert pixels("a.png").shape[2] == 4
    np.testing.assert_array_equal(pixels("a.webp"), pixels("a.png"))


@pytest.mark.parametrize("value", ["0", "101", "2.5", "high"])
def test_a_wrong_quality(clf: InProcess, value: str) -> None:
    ended = clf("render", "scene.yaml", "-o", "x.jpg", "--set", f"output.quality={value}")
    assert ended.is_one_line(2, "--set output.quality: ")


def test_films_are_saved(here: Path) -> None:
    film = clfractal.render(SCENE + "output: {exposure: 1, tone: reinhard}\n")
    film.save("fine.jpg", quality=98)
    film.save("small.jpg", quality=20)
    film.save("whole.webp", quality=100)
    assert (here / "fine.jpg").stat().st_size > (here / "small.jpg").stat().st_size
    np.testing.assert_array_equal(pixels("whole.webp"), film.to_rgb8())
    assert np.abs(pixels("fine.jpg").astype(int) - film.to_rgb8()).mean() < 1.5
    with pytest.raises(clfractal.SceneError, match="quality: must be from 1 to 100, got 0"):
        film.save("x.jpg", quality=0)
    rows = clfractal.render(SCENE + "stereo: {mode: rows}\n")
    with pytest.raises(clfractal.FileError, match=r"x\.jpg: a JPEG mixes neighbouring pixels"):
        rows.save("x.jpg")
    clear = clfractal.render(SCENE + "background: transparent\n")
    with pytest.raises(clfractal.FileError, match=r"x\.jpg: a JPEG has no transparency"):
        clear.save("x.jpg")
    clear.save("black.jpg", transparent=False)
    assert not (here / "x.jpg").exists()


def test_slices_are_checked_too(clf: InProcess) -> None:
    cut = ("--set", "renderer={type: cut_plane}", "--count", "2")
    ended = clf("slices", "scene.yaml", "-o", "s.jpg", *cut, "--set", "background=transparent")
    assert ended.is_one_line(2, "s_0001.jpg: a JPEG has no transparency")
    assert clf("slices", "scene.yaml", "-o", "s.webp", *cut, "--quiet") == Ended(0, "", "")
    assert pixels("s_0002.webp").shape == (36, 40, 3)
