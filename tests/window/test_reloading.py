"""The scene's file while its window is open: what changes in it is loaded, wherever the camera is, and told at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clfractal.scene.load import load_scene
from tests.window.display import Display, Pixels
from tests.window.driver import Window, differs, wait_for
from tests.window.film import film
from tests.window.scenes import SURFACE

SIZE = (360, 240)
PLAIN = ("--size", "360x240", "--no-panels")
DARKER = SURFACE.replace("intensity: 1.7", "intensity: 0.4")


def seen_from(folder: Path, text: str, camera: object) -> Pixels:
    """The shell's picture of a scene, seen by another camera."""
    scene = load_scene(text, folder=folder)
    (folder / "moved.yaml").write_text(text)
    given = [f"camera.{name}={list(getattr(camera, name))}" for name in ("position", "target", "up")]
    options = [each for value in given for each in ("--set", value)]
    assert scene.camera != camera
    return film(folder, "moved.yaml", SIZE, *options)


def test_the_file_is_loaded_after_an_orbit_and_the_camera_stays(display: Display, folder: Path) -> None:
    """Without another move of the pointer. Also by F5; and an angle of view that changes in the file counts."""
    scene = folder / "s.yaml"
    scene.write_text(SURFACE)
    with Window(display, folder, "s.yaml", *PLAIN) as window:
        window.drag((180, 120), (230, 100))
        window.still()
        window.keys("F12")
        wait_for((folder / "s-001.png").exists, "the scene as it is")
        camera = load_scene(folder / "s-001.png").camera
        scene.write_text(DARKER)
        window.shows(seen_from(folder, DARKER, camera))
        wider = DARKER.replace("fov: 50", "fov: 70")
        scene.write_text(wider)
        expected = seen_from(folder, wider, camera)
        window.shows(expected)
        window.keys("F5")
        window.still(1.0)
        window.shows(expected, 20)


def test_values_of_the_command_line_stay(display: Display, folder: Path) -> None:
    scene = folder / "s.yaml"
    scene.write_text(SURFACE)
    with Window(display, folder, "s.yaml", *PLAIN, "--set", "camera.fov=30") as window:
        scene.write_text(DARKER)
        window.shows(film(folder, "s.yaml", SIZE, "--set", "camera.fov=30"))


def banner(window: Window, plain: Pixels) -> int:
    """Pixels of the uppermost rows that a message covers."""
    return int((window.pixels()[:70] != plain[:70]).any(axis=2).sum())


def test_what_cannot_be_loaded_is_told_at_once(display: Display, folder: Path) -> None:
    """The pointer does not move: nothing else wakes the window. What was changed here is kept, also by undo after F5."""
    scene = folder / "s.yaml"
    scene.write_text(SURFACE)
    (folder / "settings.yaml").write_text("autosave: 0\n")
    extra = {"CLFRACTAL_SETTINGS": str(folder / "settings.yaml")}
    with Window(display, folder, "s.yaml", *PLAIN, extra=extra) as window:
        window.keys("minus")
        plain = window.still(1.0)
        scene.write_text(DARKER)
        wait_for(lambda: banner(window, plain) > 2000, "a message about the file", 10)
        window.shows(plain, 30)  # it goes, and the changes of the window are still there
        window.keys("F5")
        window.shows(film(folder, scene, SIZE))
        window.keys("ctrl+z")
        window.shows(plain)


def test_a_file_that_is_gone_is_told(display: Display, folder: Path) -> None:
    scene = folder / "s.yaml"
    scene.write_text(SURFACE)
    with Window(display, folder, "s.yaml", *PLAIN) as window:
        plain = window.still(1.0)
        scene.unlink()
        wait_for(lambda: banner(window, plain) > 2000, "a message about the file", 10)
        assert window.process.poll() is None
        # And when it comes back, with a change, it is loaded.
        scene.write_text(DARKER)
        window.shows(film(folder, "s.yaml", SIZE))


def test_a_screenshot_is_the_picture_alone(display: Display, folder: Path) -> None:
    """Beside the scene, wherever the shell stands; with the panels only if that is asked for."""
    (folder / "scenes").mkdir()
    (folder / "scenes/s.yaml").write_text(SURFACE)
    size = (1280, 720)
    with Window(display, folder, "scenes/s.yaml", "--size", "1280x720") as window:
        seen = window.still(1.0)
        window.keys("F12", "shift+F12", "ctrl+e")
        first, second = (folder / f"scenes/s-00{number}.png" for number in (1, 2))
        wait_for((folder / "scenes/s-001.exr").exists, "the export", 60)
        wait_for(second.exists, "both screenshots")
        from tests.pictures import read_picture

        expected = film(folder, "scenes/s.yaml", size)
        assert differs(read_picture(first), expected) == ""
        whole = read_picture(second)
        assert differs(whole, expected) != ""
        docks = np.s_[200:650, :300]
        assert differs(whole[docks], seen[docks]) == ""
        assert window.process.poll() is None
    assert list(folder.glob("*.png")) == [folder / "film.png"]
    assert np.array_equal(film(folder, "scenes/s-001.exr", size), expected)
    assert differs(film(folder, "scenes/s-001.png", size), expected) == ""


def test_kept_changes_are_offered_for_their_scene_alone(display: Display, folder: Path) -> None:
    """And a camera that was moved is nothing to keep; a window that fills a screen asks nothing."""
    (folder / "settings.yaml").write_text("autosave: 0.2\n")
    cache = folder / "cache"
    extra = {"CLFRACTAL_SETTINGS": str(folder / "settings.yaml"), "CLFRACTAL_CACHE": str(cache)}
    size = ("--size", "700x500", "--no-panels")
    for name in ("s.yaml", "other.yaml"):
        (folder / name).write_text(SURFACE)
    with Window(display, folder, "other.yaml", *size, extra=extra) as window:
        window.drag((350, 250), (430, 220))
        window.still(1.0)
        assert not list((cache / "autosave").glob("*.json"))
        window.kill()
    for _ in range(2):
        with Window(display, folder, "s.yaml", *size, extra=extra) as window:
            window.still()
            window.keys("Escape", "minus")
            wait_for(lambda: list((cache / "autosave").glob("*.json")), "the safety copy")
            window.kill()
    picture = film(folder, "s.yaml", (700, 500))
    with Window(display, folder, "other.yaml", *size, extra=extra) as window:
        window.shows(picture)
    with Window(display, folder, "s.yaml", *size, extra=extra) as window:
        middle = np.s_[150:260, 150:550]

        def asked() -> bool:
            return bool((window.pixels()[middle] != picture[middle]).any(axis=2).mean() > 0.5)

        wait_for(asked, "a question")
    with (
        Display(folder / "screen", (700, 500), managed=True) as screen,
        Window(screen, folder, "s.yaml", "--fullscreen", extra=extra) as window,
    ):
        wait_for(lambda: window.place[2:] == (700, 500), "the full screen")
        window.shows(picture)
