"""The film in a real window: it plays, is scrubbed, gets keys by a flight, and is saved with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clfractal.engine.frames import at_frame
from clfractal.scene.load import load_scene
from clfractal.viewer.panels import theme
from clfractal.viewer.panels.timeline_area import HEIGHT, LEFT
from tests.window.display import Display, Pixels
from tests.window.driver import Window, wait_for
from tests.window.film import film

SIZE = (900, 640)
FILM = """# A flight round a bulb
version: 1
formula: {name: mandelbulb, iterations: 5}
image: {width: 90, height: 64}
camera: {position: [0, -3, 0.5], fov: 45}  # as it stands
renderer: {samples: 1}
animation:
  fps: 25
  frames: 76
  tracks:
    camera.position:  # half way round
      keys:
        - {frame: 0, value: [0, -3, 0.5]}
        - {frame: 75, value: [2.9, 0, 0.5]}
"""
# The ruler, which begins beside the dock and the names of tracks, and its middle.
RULER_LEFT = 3 * theme.MARGIN + theme.DOCK_LEFT + LEFT
RULER = SIZE[1] - theme.MARGIN - HEIGHT + 48


def test_a_film_is_scrubbed_and_played(display: Display, folder: Path) -> None:
    (folder / "film.yaml").write_text(FILM)
    with Window(display, folder, "film.yaml", "--size", "900x640") as window:
        first = window.still()
        picture = (slice(60, 330), slice(330, 880))
        window.drag((RULER_LEFT + 20, RULER), (RULER_LEFT + 250, RULER))
        scrubbed = window.still()
        assert (first[picture] != scrubbed[picture]).mean() > 0.05
        window.keys("shift+Home")
        assert np.array_equal(window.still()[picture], first[picture])
        window.keys("p")
        for _ in range(4):
            _changes(window, picture)
        window.keys("p")
        window.still()
        assert not window.title.endswith("*"), "looking at frames is no change"


def test_the_timeline_makes_the_picture_smaller(display: Display, folder: Path) -> None:
    """Nothing of the picture lies below it; without panels it is as large as the window again."""
    (folder / "film.yaml").write_text(FILM.replace("frames: 76", "frames: 2"))
    (folder / "still.yaml").write_text(FILM.partition("animation:")[0])
    high = SIZE[1] - int(HEIGHT + theme.MARGIN)
    whole = film(folder, folder / "still.yaml", (SIZE[0], high))
    with Window(display, folder, "film.yaml", "--size", "900x640") as window:
        free = (slice(60, high - 80), slice(int(theme.DOCK_LEFT) + 2 * int(theme.MARGIN), 880))
        wait_for(lambda: not _differs(window.pixels()[:high][free], whole[free]), "a picture above it")
        window.keys("F2", "F3")
        window.shows(film(folder, folder / "still.yaml", SIZE))


def _differs(one: Pixels, other: Pixels) -> bool:
    return bool((np.abs(one.astype(int) - other) > 1).mean() > 1e-3)


def _changes(window: Window, part: tuple[slice, slice]) -> None:
    """Waits until a part of the window shows something else."""
    before = window.pixels()[part].copy()
    wait_for(lambda: (window.pixels()[part] != before).any(), "the next frame")


def test_the_picture_of_a_frame_is_the_shells(display: Display, folder: Path) -> None:
    (folder / "film.yaml").write_text(FILM)
    with Window(display, folder, "film.yaml", "--size", "360x240", "--no-panels") as window:
        window.still()
        window.keys("shift+End")
        scene = at_frame(load_scene(folder / "film.yaml"), 75)
        (folder / "last.yaml").write_text(
            FILM.partition("animation:")[0].replace("[0, -3, 0.5]", "[2.9, 0, 0.5]")
        )
        assert scene.camera.position == (2.9, 0, 0.5)
        window.shows(film(folder, folder / "last.yaml", (360, 240)))


def test_a_frame_that_rests_has_motion_blur(display: Display, folder: Path) -> None:
    # (Noise that is new in each frame is the film's, and not that of a still of the shell.)
    text = FILM.replace("frames: 76", "frames: 76\n  shutter: 1\n  noise: fixed")
    text = text.replace("samples: 1", "samples: 8").replace("[2.9, 0, 0.5]", "[2.9, 0, 40]")
    (folder / "film.yaml").write_text(text)
    with Window(display, folder, "film.yaml", "--size", "180x120", "--no-panels") as window:
        window.still()
        window.keys("alt+period")
        window.shows(film(folder, "film.yaml", (180, 120), "--set", "animation.frame=1"))
        blurred = window.pixels().copy()
        moment = ("--set", "animation.frame=1", "--set", "animation.shutter=0")
        sharp = film(folder, "film.yaml", (180, 120), *moment)
        assert (blurred[:, :, :3] != sharp).mean() > 0.02


def test_keys_that_are_set_are_saved_with_the_text(display: Display, folder: Path) -> None:
    (folder / "film.yaml").write_text(FILM)
    with Window(display, folder, "film.yaml", "--size", "360x240", "--no-panels") as window:
        window.still()
        window.keys("shift+End", "alt+comma")
        window.wheel(180, 120, 3)
        window.still()
        window.keys("shift+k")
        window.still()
        saved = load_scene(window.save())
        text = window.saves.read_text()
    assert saved.animation is not None
    keys = saved.animation.tracks["camera.position"].keys or ()
    assert [key.frame for key in keys] == [0, 74, 75]
    assert "# half way round" in text
    assert "camera: {position: [0, -3, 0.5], fov: 45}  # as it stands" in text


def test_a_flight_is_recorded(display: Display, folder: Path) -> None:
    (folder / "still.yaml").write_text(FILM.partition("animation:")[0])
    with Window(display, folder, "still.yaml", "--size", "360x240", "--no-panels") as window:
        window.still()
        window.keys("shift+j")
        window.hold("w", 1.5)
        window.keys("shift+j")
        window.still()
        animation = load_scene(window.save()).animation
        assert animation is not None
        window.keys("ctrl+z", "ctrl+z")
        window.still()
        assert load_scene(window.save()).animation is None
    keys = animation.tracks["camera.position"].keys or ()
    assert 2 <= len(keys) <= 20
    y = [key.values[1] for key in keys]
    assert y[0] < -2.5
    assert y[-1] > y[0] + 0.3
    assert 20 <= animation.frame_of(keys[-1]) <= 90
