"""`clfractal slices`: numbered pictures of parallel planes, whole or not there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.cli.slices import Stack, slice_scene
from clfractal.files.exr import read_exr
from clfractal.integrators.cut_plane import renderer_of
from tests.interrupts import interrupted_at
from tests.shell import InProcess, works

SCENE = """version: 1
formula: {name: hast, iterations: 20}
image: {width: 40, height: 36}
camera: {}
renderer: {type: cut_plane, plane: {normal: [0, -1, 0], width: 3}, colors: {mode: stepped}}
output: {channels: [R, G, B, iterations, P.X, P.Y, P.Z]}
"""


def names() -> list[str]:
    return sorted(path.name for path in Path().iterdir() if path.name != "scene.yaml")


def test_slices_follow_each_other_along_the_normal(clf: InProcess) -> None:
    ended = works(
        clf("slices", "scene.yaml", "-o", "s.exr", "-o", "t.png", "--count", "3", "--spacing", "0.25")
    )
    assert ended.err.splitlines()[-1].startswith("s_0001.exr to s_0003.exr: ")
    assert names() == [
        f"{word}_000{i}.{kind}" for word, kind in (("s", "exr"), ("t", "png")) for i in (1, 2, 3)
    ]
    for number in (1, 2, 3):
        pixels, _ = read_exr(f"s_000{number}.exr")
        np.testing.assert_allclose(pixels["P.Y"], -0.25 * (number - 2), atol=1e-6)
        # The file tells its own plane: rendered anew it is the same.
        again = clfractal.render(f"s_000{number}.exr")
        np.testing.assert_array_equal(pixels["iterations"], again["iterations"])
    # The middle one is the scene's own plane.
    plane = clfractal.render("scene.yaml")
    np.testing.assert_array_equal(read_exr("s_0002.exr")[0]["iterations"], plane["iterations"])


def test_by_default_they_reach_through_the_set(clf: InProcess) -> None:
    assert clf("slices", "scene.yaml", "--count", "2", "--start", "2", "--quiet").err == ""
    assert names() == ["slice_0002.png"]
    scene = clfractal.load_scene(Path("scene.yaml"))
    ends = [slice_scene(scene, Stack(count=8), number) for number in (1, 8)]
    centers = [renderer_of(end).plane.placed.center[1] for end in ends]
    assert centers == pytest.approx([1.75, -1.75])


def test_interrupted_the_finished_ones_stay(clf: InProcess) -> None:
    with interrupted_at(3):
        clf("slices", "scene.yaml", "--count", "4")
    assert names() == ["slice_0001.png", "slice_0002.png"]


REFUSED = {
    ("--count", "0"): "--count: must be from 1 to 100,000, got 0",
    ("--start", "11"): "--start: must be from 1 to the count, 10, got 11",
    ("--spacing", "0"): "--spacing: must be a number above 0, got 0",
    ("--spacing", "nan"): "--spacing: must be a number above 0, got nan",
    ("--spacing", "1e6"): "--spacing: puts slice 1 outside the range of coordinates",
    ("-o", "s.gif"): "s_0001.gif: unknown extension '.gif'",
    ("-o", "none/s.png"): "none/s_0001.png: cannot be written: there is no folder",
    ("--set", "renderer={}"): "scene.yaml: renderer.type: must be cut_plane for slices, got surface",
    ("--size", "big"): "--size: must be WIDTHxHEIGHT",
    ("--set", "renderer.plane.normal=[0, 0, 0]"): "renderer.plane.normal: must not be zero",
}


@pytest.mark.parametrize("options", REFUSED, ids=" ".join)
def test_what_is_refused(clf: InProcess, options: tuple[str, str]) -> None:
    assert clf("slices", "scene.yaml", *options).is_one_line(2, REFUSED[options])
    assert names() == []
