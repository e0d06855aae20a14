"""`--size` renders the same picture with another number of pixels; `--set image.height` makes another one, and says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clfractal.api import load_scene
from clfractal.files.exr import read_exr
from clfractal.scene.parts import Image
from tests.shell import InProcess, works

SCENE = """
version: 1
formula: {name: mandelbulb, iterations: 6}
camera: {position: [1.2, -2.4, 1], target: [0, 0, 0]}
renderer: {samples: 1, precision: float32}
output: {channels: [R, G, B]}
"""
SAID = "image.height is also what the fineness of colours, normals and light is measured by"


@pytest.fixture(autouse=True)
def _scenes(clf: InProcess) -> None:
    Path("bulb.yaml").write_text(SCENE + "image: {width: 64, height: 36}\n", encoding="utf-8")
    Path("plain.yaml").write_text(SCENE, encoding="utf-8")


@pytest.mark.parametrize(
    ("scene", "options", "image"),
    [
        ("bulb.yaml", ["--size", "16X9"], Image(width=16, height=9, reference_height=36)),
        ("bulb.yaml", ["--size", "64x36"], Image(width=64, height=36)),
        ("bulb.yaml", ["--size", "80x36"], Image(width=80, height=36)),
        ("bulb.yaml", ["--size", "16x9", "--set", "image.height=18"], Image(width=16, height=9, reference_height=18)),
        ("bulb.yaml", ["--size", "16x9", "--set", "image.reference_height=99.5"],
         Image(width=16, height=9, reference_height=99.5)),
        ("bulb.yaml", ["--set", "image.height=9", "--set", "image.width=16"], Image(width=16, height=9)),
        ("plain.yaml", ["--size", "16x9"], Image(width=16, height=9, reference_height=1024)),
    ],
)  # fmt: skip
def test_the_size_keeps_the_reference(clf: InProcess, scene: str, options: list[str], image: Image) -> None:
    ended = works(clf("render", scene, "-o", "out.png", *options))
    assert load_scene(Path("out.png")).image == image
    moved = any(option.startswith("image.height") for option in options)
    assert (SAID in ended.err + ended.out) == (moved and image.reference_height is None)


@pytest.mark.parametrize(
    ("key", "value", "status"), [("height", "-5", 0), ("height", "true", 0), ("reference_height", "-5", 2)]
)
def test_what_is_wrong_in_the_file_is_not_told_of_the_size(
    clf: InProcess, key: str, value: str, status: int
) -> None:
    """A height that the size replaces does not matter; a wrong reference is told where it stands."""
    Path("wrong.yaml").write_text(f"{SCENE}image: {{width: 64, {key}: {value}}}\n", encoding="utf-8")
    ended = clf("render", "wrong.yaml", "-o", "out.png", "--size", "16x9")
    assert ended.status == status, ended
    assert status == 0 or ended.err.startswith("wrong.yaml:7:"), ended.err


def test_a_thumbnails_file_renders_the_print(clf: InProcess) -> None:
    for order in (
        ("bulb.yaml", "-o", "print.exr"),
        ("bulb.yaml", "-o", "small.exr", "--size", "16x9"),
        ("small.exr", "-o", "again.exr", "--size", "64x36"),
    ):
        works(clf("render", *order))
    pictures = [read_exr(name)[0] for name in ("print.exr", "again.exr")]
    assert all(np.array_equal(pictures[0][name], pictures[1][name]) for name in "RGB")
    assert load_scene(Path("again.exr")) == load_scene(Path("print.exr"))


def test_frames_and_looks_for_them_say_it_too(clf: InProcess) -> None:
    film = Path("bulb.yaml").read_text(encoding="utf-8")
    Path("film.yaml").write_text(
        film + "animation: {duration: 0.2 s, fps: 10, tracks: {camera.fov: {expression: '40 + u'}}}\n"
    )
    ended = works(clf("animate", "film.yaml", "-o", "f_#.png", "--set", "image.height=18"))
    assert SAID in ended.err + ended.out
    ended = works(clf("animate", "film.yaml", "-o", "g_#.png", "--size", "16x9"))
    assert load_scene(Path("g_1.png")).image == Image(width=16, height=9, reference_height=36)


@pytest.mark.parametrize("size", ["0x9", "99999x9", "65536x65536", "16", "axb"])
def test_sizes_that_are_none_name_the_option(clf: InProcess, size: str) -> None:
    ended = clf("render", "bulb.yaml", "-o", "out.png", "--size", size)
    assert ended.status == 2
    assert ended.err.startswith("--size: "), ended.err
    assert ended.err.count("\n") == 1
    assert not Path("out.png").exists()
