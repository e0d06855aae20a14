"""What is wrong with a stereo scene: one line that begins with its place, exit status 2, and no file."""

from __future__ import annotations

from pathlib import Path

import pytest

from clfractal.errors import STATUS_BAD_INPUT
from tests.scene.errors import cases
from tests.shell import SCENE, InProcess


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a stereo scene."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.yaml").write_text(SCENE + "stereo: {}\n")
    return tmp_path


@pytest.fixture
def shell(capsys: pytest.CaptureFixture[str]) -> InProcess:
    return InProcess(capsys)


def added(here: Path) -> set[str]:
    return {path.name for path in here.iterdir()} - {"scene.yaml"}


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        *cases(
            """
stereo:
  screen_width: 0 => 6:17: stereo.screen_width: must be above 0, got 0
stereo:
  screen_distance: -0.6 => 6:20: stereo.screen_distance: must be above 0, got -0.6
stereo:
  interpupillary_distance: 0.0 => 6:28: stereo.interpupillary_distance: must be above 0, got 0
stereo: {screen_width: .nan} => 5:24: stereo.screen_width: must be a finite number, got .nan
stereo: {screen_width: wide} => 5:24: stereo.screen_width: must be a number, got 'wide'
stereo: {screen_width: 1.0e-9}
=> 5:9: stereo.screen_distance: must be within a factor of 10,000 of screen_width (1e-09), in the same unit, got 0.6
stereo: {interpupillary_distance: 6300}
=> 5:35: stereo.interpupillary_distance: must be within a factor of 10,000 of screen_width (0.52), in the same unit, got
    6300
stereo: {mod: split} => 5:10: stereo: unknown key 'mod'; did you mean 'mode'?
stereo: {separation: -1} => 5:22: stereo.separation: must be at least 0, got -1
stereo: {budget: 0} => 5:18: stereo.budget: must be above 0, got 0
stereo: {fit: yes} => 5:15: stereo.fit: must be auto, got 'yes'
stereo: {mode: split_half}
image: {width: 41, height: 36}
=> 6:16: image.width: must be even for stereo.mode split_half, where each eye gets half of it, got 41
stereo: {mode: over_under_half}
image: {width: 40, height: 35}
=> 6:28: image.height: must be even for stereo.mode over_under_half, where each eye gets half of it, got 35
stereo: {colors: [[1, 0, 1.5], [0, 1, 0]]} => 5:26: stereo.colors.0.2: must be at most 1, got 1.5
stereo: {colors: [[1, 0, 0], [0, -1, 0]]} => 5:34: stereo.colors.1.1: must be at least 0, got -1
stereo: {colors: [[1, 0, 0]]} => 5:18: stereo.colors: must be a list of 2 lists, got a list of 1
stereo: {mode: anaglyph}
output: {channels: [R, Z]} => 6:20: output.channels: anaglyph needs the channels R, G, B; G, B not among them
stereo: {plane: {normal: [0, 0, 0]}} => 5:26: stereo.plane.normal: must not be zero
stereo: {plane: {up: [0, 0, 0]}} => 5:22: stereo.plane.up: must not be zero
stereo: {plane: {normal: [0, -1, 1], up: [0, 2, -2]}} => 5:42: stereo.plane.up: must not be parallel to the normal
stereo: {plane: {width: 0}} => 5:25: stereo.plane.width: must be at least 1e-18, got 0
stereo: {fit: auto}
layout: {views: [{}, {}]} => 5:15: stereo.fit: auto cannot fit several views at once; give plane and separation instead
stereo: {fit: auto}
renderer: {type: cut_plane} => 5:15: stereo.fit: auto needs depth, but the picture of a cut_plane renderer is flat
stereo: {fit: auto, convergence: toe_in}
=> 5:15: stereo.fit: auto needs convergence off_axis, where parallax follows from depth alone, got toe_in
stereo: 3 => 5:9: stereo: must be a mapping, got 3
"""
        ),
        ("stereo: {mode: anaglif}", "5:16: stereo.mode: must be left, right, "),
        (
            "stereo: {}\nlayout: {views: [{}, {camera: {projection: orthographic}}]}",
            "6:44: layout.views.1.camera.projection: must be perspective with stereo: ",
        ),
    ],
)
def test_bad_input(here: Path, shell: InProcess, lines: str, message: str) -> None:
    scene = SCENE
    if "image:" in lines:
        scene = scene.replace("image: {width: 40, height: 36}\n", "") + "# as many lines\n"
    (here / "scene.yaml").write_text(scene + lines + "\n")
    for command in (("check",), ("render", "-o", "a.png", "-o", "a.exr", "--stats", "s.json")):
        ended = shell(command[0], "scene.yaml", *command[1:])
        assert ended.is_one_line(STATUS_BAD_INPUT, f"scene.yaml:{message}")
        assert added(here) == set()


def test_an_unknown_mode_is_answered_with_the_nearest(here: Path, shell: InProcess) -> None:
    for wrong, meant in (("anaglif", "anaglyph"), ("spilt", "split"), ("Over-Under", "over_under")):
        ended = shell("render", "scene.yaml", "-o", "a.png", "--set", f"stereo.mode={wrong}")
        assert ended.is_one_line(STATUS_BAD_INPUT, "--set stereo.mode: must be ", f"did you mean '{meant}'?")


def test_an_orthographic_camera(here: Path, shell: InProcess) -> None:
    camera = "camera: {projection: orthographic, position: [0, -3, 0]}"
    (here / "scene.yaml").write_text(SCENE.replace("camera: {position: [0, -3, 0]}", camera) + "stereo: {}\n")
    ended = shell("render", "scene.yaml", "-o", "a.png")
    assert ended.is_one_line(
        STATUS_BAD_INPUT,
        "scene.yaml:4:22: camera.projection: must be perspective with stereo: parallel rays look the same to both"
        " eyes; use {projection: perspective, position, target, fov}, or remove stereo",
    )


def test_odd_sizes_from_the_command_line(here: Path, shell: InProcess) -> None:
    ended = shell("render", "scene.yaml", "-o", "a.png", "--set", "stereo.mode=split_half", "--size", "41x36")
    assert ended.is_one_line(STATUS_BAD_INPUT, "--size: must be even for stereo.mode split_half")


def test_outputs_are_checked_before_anything_is_rendered(here: Path, shell: InProcess) -> None:
    (here / "a_R.png").mkdir()
    ended = shell("render", "scene.yaml", "-o", "a.png", "--set", "stereo.mode=pair")
    assert ended.is_one_line(STATUS_BAD_INPUT, "a_R.png: cannot be written: it is a folder")
    (here / "a_R.png").rmdir()
    channels = ("--set", "output.channels=[R, Z]")
    ended = shell("render", "scene.yaml", "-o", "a.png", *channels, "--set", "stereo.mode=multi_view")
    assert ended.is_one_line(STATUS_BAD_INPUT, "a_L.png: a PNG needs the channels R, G, B")
    assert added(here) == set()


def test_a_region_outside(here: Path, shell: InProcess) -> None:
    """It is one of the finished picture, twice as wide as an eye's."""
    ended = shell("render", "scene.yaml", "-o", "a.png", "--region", "41,0,40,1")
    assert ended.is_one_line(STATUS_BAD_INPUT, "--region: must lie inside the picture of 80 x 36 pixels")
    assert added(here) == set()
