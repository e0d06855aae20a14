"""What the window shows is the picture that the shell renders: renderers, layouts, and every stereo mode."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.pictures import read_picture
from tests.window import scenes
from tests.window.display import Display, Pixels
from tests.window.driver import Window, differs
from tests.window.film import film

WIDTH, HEIGHT = 360, 240
# Modes of the compositor, and the size of each eye's picture that fills the window.
MODES = {
    "anaglyph": (WIDTH, HEIGHT),
    "split": (WIDTH // 2, HEIGHT),
    "split_half": (WIDTH, HEIGHT),
    "over_under": (WIDTH, HEIGHT // 2),
    "over_under_half": (WIDTH, HEIGHT),
    "rows": (WIDTH, HEIGHT),
    "columns": (WIDTH, HEIGHT),
    "checkerboard": (WIDTH, HEIGHT),
    "anaglyph_chessboard": (WIDTH, HEIGHT),
    "left": (WIDTH, HEIGHT),
    "right": (WIDTH, HEIGHT),
}


def shot(
    display: Display, folder: Path, scene: str | Path, *options: str, extra: dict[str, str] | None = None
) -> Pixels:
    """What the window shows when the picture is finished."""
    target = folder / "shot.png"
    given = ["--size", f"{WIDTH}x{HEIGHT}", "--no-panels", "--shot", str(target), *options]
    with Window(display, folder, scene, *given, extra=extra, save=False, open=False) as window:
        ended = window.ended(120)
    assert (ended.status, ended.out, ended.err) == (0, "", "")
    return read_picture(target)


@pytest.mark.parametrize("kind", ["SURFACE", "VOLUME", "CUT_PLANE", "LAYOUT"])
def test_a_shot_is_the_film(display: Display, folder: Path, kind: str) -> None:
    (folder / "s.yaml").write_text(getattr(scenes, kind))
    shown = shot(display, folder, "s.yaml")
    assert differs(shown, film(folder, "s.yaml", (WIDTH, HEIGHT))) == ""
    assert shown.std() > 10


@pytest.mark.parametrize("mode", MODES)
def test_each_stereo_mode_is_the_films(display: Display, folder: Path, mode: str) -> None:
    (folder / "s.yaml").write_text(scenes.SURFACE)
    shown = shot(display, folder, "s.yaml", "--stereo", mode)
    expected = film(folder, "s.yaml", MODES[mode], "--set", f"stereo={{mode: {mode}}}")
    assert differs(shown, expected) == ""


def test_exchanged_eyes_are_the_films(display: Display, folder: Path) -> None:
    text = scenes.SURFACE + "stereo: {mode: split, swap: true}\n"
    (folder / "s.yaml").write_text(text)
    shown = shot(display, folder, "s.yaml")
    assert differs(shown, film(folder, "s.yaml", MODES["split"])) == ""
    plain = film(folder, "s.yaml", MODES["split"], "--set", "stereo.swap=false")
    half = WIDTH // 2
    exchanged = np.concatenate([plain[:, half:], plain[:, :half]], axis=1)
    assert (
        np.abs(shown.astype(int) - exchanged).max() <= 1
    )  # noise that hides the steps of 8 bits stays in its place
    assert np.abs(shown.astype(int) - plain).max() > 10


def test_a_shot_opens_again_as_a_scene(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(scenes.SURFACE)
    shown = shot(display, folder, "s.yaml", "--set", "camera.fov=30")
    assert differs(shown, film(folder, folder / "shot.png", (WIDTH, HEIGHT))) == ""
    assert differs(shown, film(folder, "s.yaml", (WIDTH, HEIGHT))) != ""


def test_panels_lie_over_the_picture(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(scenes.SURFACE)
    target = folder / "shot.png"
    given = ["--size", "1280x720", "--shot", str(target)]
    with Window(display, folder, "s.yaml", *given, save=False, open=False) as window:
        assert window.ended(120).status == 0
    shown = read_picture(target)
    picture = film(folder, "s.yaml", (1280, 720))
    middle = np.s_[200:500, 420:900]
    assert differs(shown[middle], picture[middle]) == ""
    assert differs(shown, picture) != ""


def test_the_screen_itself_shows_the_film(display: Display, folder: Path) -> None:
    """Not only what the program reads back of what it drew."""
    (folder / "s.yaml").write_text(scenes.SURFACE)
    given = ["--size", f"{WIDTH}x{HEIGHT}", "--no-panels"]
    with Window(display, folder, "s.yaml", *given) as window:
        window.shows(film(folder, "s.yaml", (WIDTH, HEIGHT)))
        assert window.title.startswith("clfractal")
        assert "s.yaml" in window.title
