"""Two projectors: the pair is the one that the scene's screen asks for, whichever window came before."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from clfractal.cli import run
from clfractal.cli.shell import Shell
from clfractal.scene.load import load_scene
from tests.pictures import read_picture
from tests.window.display import Pixels
from tests.window.driver import Window, wait_for
from tests.window.film import film
from tests.window.projectors import PROJECTOR, Projectors

SPHERES = """version: 1
formula: {name: quaternion_julia, julia: [0, 0, 0, 0], iterations: 12}
image: {width: 720, height: 405}
camera: {position: [0, -8, 0], target: [0, 0, 0], fov: 40}
renderer: {samples: 1}
lights: [{direction: [0, 1, 0]}]
material: {color: [0.3, 0.3, 0.3], ambient: 1, diffuse: 0, specular: 0}
coloring: {by: solid}
materials:
  r: {base: {color: [1, 0, 0]}}
  g: {base: {color: [0, 1, 0]}}
  b: {base: {color: [0, 0, 1]}}
objects:
  near: {type: sphere, position: [-1.2, -2, 1.3], radius: 0.15, material: r}
  mid: {type: sphere, position: [0, 0, 1.5], radius: 0.15, material: g}
  far: {type: sphere, position: [2, 4, 1.5], radius: 0.2, material: b}
background: {top: [0, 0, 0], bottom: [0, 0, 0]}
stereo: {mode: split, screen_width: 2, screen_distance: 2, interpupillary_distance: 0.063}
"""
"""Objects before the screen, on it and behind it: another width of the screen moves the outer two."""

FILM = """animation:
  duration: 1 s
  fps: 25
  tracks:
    camera.position: {keys: [{frame: 0, value: [0, -8, 0]}, {frame: 24, value: [3, -7, 1]}]}
    stereo.separation: {keys: [{frame: 0, value: 1}, {frame: 24, value: 1.5}]}
"""


@pytest.fixture(scope="module")
def projectors(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Projectors]:
    with Projectors(tmp_path_factory.mktemp("projectors")) as found:
        yield found


@pytest.fixture(scope="module")
def wall(tmp_path_factory: pytest.TempPathFactory) -> Pixels:
    """What both projectors have to show of the scene: the shell's picture."""
    folder = tmp_path_factory.mktemp("wall")
    (folder / "s.yaml").write_text(SPHERES)
    return film(folder, "s.yaml", PROJECTOR)


def shows(projectors: Projectors, wanted: Pixels) -> None:
    """Waits until the whole desktop shows a picture."""

    def same() -> bool:
        now = projectors.pixels()
        return now.shape == wanted.shape and np.abs(now.astype(int) - wanted).max() <= 1

    wait_for(same, "the picture on the wall", 40)


def width_in(folder: Path) -> float:
    stereo = load_scene(folder / "saved.yaml").stereo
    assert stereo is not None
    return stereo.screen_width


@pytest.mark.parametrize("way", ["--stereo=split", "--windows"])
def test_a_film_begins_with_its_own_screen(projectors: Projectors, tmp_path: Path, way: str) -> None:
    """It shows what the film's file shows, and what is saved names the screen that the scene has."""
    (tmp_path / "s.yaml").write_text(SPHERES + FILM)
    given = ["animate", str(tmp_path / "s.yaml"), "-o", str(tmp_path / "#.png"), "--frames", "0", "--quiet"]
    assert run([*given, "--device", "pthread"], Shell(owns_process=False)) == 0
    wanted = read_picture(tmp_path / "0.png")
    with Window(projectors, tmp_path, "s.yaml", "--monitors", "1,2", way, "--no-panels") as window:
        shows(projectors, wanted)
        window.move(300, 200)
        window.save()
    assert width_in(tmp_path) == 2


def test_a_still_scene_too(projectors: Projectors, wall: Pixels, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(SPHERES)
    with Window(projectors, tmp_path, "s.yaml", "--monitors", "1,2", "--windows", "--no-panels"):
        shows(projectors, wall)


@pytest.mark.parametrize("key", ["shift+F11", "ctrl+F11"])
def test_the_wall_does_not_depend_on_the_window_before(
    projectors: Projectors, wall: Pixels, tmp_path: Path, key: str
) -> None:
    """From a small window to the wall and back, again and again: the screen stays the scene's."""
    (tmp_path / "s.yaml").write_text(SPHERES)
    size = (426, 240)
    with Window(projectors, tmp_path, "s.yaml", "--size", "426x240", "--no-panels") as window:
        window.move(200, 120)
        for _ in range(2):
            window.keys(key)
            shows(projectors, wall)
            window.keys(key)
            wait_for(lambda: window.place[2:] == size, "the window")
        window.still()
        window.save()
    assert width_in(tmp_path) == 2


def test_a_window_that_is_resized_is_another_screen_and_says_so(
    projectors: Projectors, wall: Pixels, tmp_path: Path
) -> None:
    """Half as wide again; on the wall it stays so; and the old size brings the old number back."""
    (tmp_path / "s.yaml").write_text(SPHERES)
    with Window(projectors, tmp_path, "s.yaml", "--size", "400x240", "--no-panels") as window:
        window.move(200, 120)
        plain = window.still()
        for width in (437, 513, 600):
            window.resize(width, 240)
        wait_for(lambda: window.place[2] == 600, "the size")
        window.still()
        window.save()
        assert width_in(tmp_path) == 3
        window.resize(400, 240)
        wait_for(lambda: window.pixels().shape == plain.shape, "the size")

        def told() -> bool:
            """The line covers a part of the picture of before, and nothing else of it."""
            now = window.pixels()
            return np.array_equal(now[210:], plain[210:]) and not np.array_equal(now[:210], plain[:210])

        def saved() -> bool:
            """(The window may have its new size before the program has heard of it.)"""
            window.save()
            return width_in(tmp_path) == 2

        wait_for(told, "the line about it", 10)
        wait_for(saved, "the old number", 10)


def test_a_projector_that_goes_and_comes_back(projectors: Projectors, wall: Pixels, tmp_path: Path) -> None:
    """Its window is taken away, both are told, and in the end the wall is as it was, wherever the window was put."""
    (tmp_path / "s.yaml").write_text(SPHERES)
    with Window(projectors, tmp_path, "s.yaml", "--monitors", "1,2", "--windows", "--no-panels") as window:
        shows(projectors, wall)

        def windows() -> list[str]:
            return projectors.xdotool("search", "--onlyvisible", "--name", "^clfractal").split()

        (right,) = [each for each in windows() if "right" in projectors.xdotool("getwindowname", each)]
        try:
            projectors.plug(right=False)
            wait_for(lambda: right not in windows(), "the right eye's window to go")
            left = wall[:, : PROJECTOR[0]]

            def told() -> bool:
                now = projectors.pixels()[:, : PROJECTOR[0]]
                return not np.array_equal(now[:200], left[:200]) and np.array_equal(now[300:], left[300:])

            wait_for(told, "a line about it", 10)
            projectors.xdotool("windowmove", right, PROJECTOR[0] - 96, 0)  # as some systems do
        finally:
            projectors.plug(right=True)
        wait_for(lambda: right in windows(), "the right eye's window")
        shows(projectors, wall)
        assert window.process.poll() is None


def test_an_uncomfortable_pair_is_told(projectors: Projectors, tmp_path: Path) -> None:
    """The window warns of what files warn of: a line over the picture."""
    (tmp_path / "s.yaml").write_text(
        SPHERES.replace("screen_width: 2, screen_distance: 2", "screen_width: 0.5")
    )
    with Window(
        projectors, tmp_path, "s.yaml", "--size", "800x300", "--no-panels", "--stereo", "left"
    ) as window:
        window.move(200, 120)
        fewer = film(tmp_path, "s.yaml", (800, 300), "--set", "stereo.mode=left")

        def told() -> bool:
            now = window.pixels()
            return np.abs(now[150:].astype(int) - fewer[150:]).max() <= 1 and not np.array_equal(
                now[:150], fewer[:150]
            )

        wait_for(told, "the warning", 20)
