"""Scenes on the disk: saved with Ctrl+S, never over what is shipped, loaded again when they change, kept over a crash."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from clfractal.files import resources
from clfractal.scene.load import load_scene
from clfractal.viewer.autosave import Autosave
from tests.window.display import Display, Pixels
from tests.window.driver import Window, wait_for
from tests.window.film import film
from tests.window.scenes import SURFACE

SIZE = (360, 240)
PLAIN = ("--size", "360x240", "--no-panels")


def below(pixels: Pixels) -> Pixels:
    """What lies below messages."""
    return pixels[130:]


def test_a_saved_scene_is_the_picture_that_was_seen(display: Display, folder: Path) -> None:
    """And the text that it came from, with its comments; only what was changed is another."""
    (folder / "s.yaml").write_text(SURFACE)
    with Window(display, folder, "s.yaml", *PLAIN) as window:
        window.drag((180, 120), (230, 100))
        window.wheel(150, 100, 2)
        window.keys("minus", "bracketleft")
        window.still()
        assert window.title.endswith("*")
        saved = window.save()
        wait_for(lambda: not window.title.endswith("*"), "the title of a saved scene")
        assert "saved.yaml" in window.title
        expected = film(folder, saved, SIZE)
        wait_for(lambda: np.array_equal(window.pixels(), expected), "the shell's picture")
    text = saved.read_text()
    assert "# A bulb" in text
    assert "# not the window's" in text
    kept = [line for line in SURFACE.splitlines() if not line.startswith(("camera", "output"))]
    assert [line for line in kept if line not in text.splitlines()] == []
    assert (folder / "s.yaml").read_text() == SURFACE


def test_without_a_name_it_is_saved_where_it_came_from(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(SURFACE)
    with Window(display, folder, "s.yaml", *PLAIN, save=False) as window:
        window.saves = folder / "s.yaml"
        window.keys("minus")
        window.still()
        window.save()
        assert load_scene(folder / "s.yaml").output.exposure == 0.25
        # And again: the file that the window wrote is no change of somebody else's.
        window.keys("minus")
        window.still()
        window.save()
        assert load_scene(folder / "s.yaml").output.exposure == 0.0


@pytest.mark.parametrize("linked", [False, True])
def test_a_shipped_scene_is_not_overwritten(display: Display, folder: Path, linked: bool) -> None:
    shipped = resources.folder("scenes") / "sierpinski_tetrahedron.yaml"
    before, scene = shipped.read_bytes(), folder / "mine.yaml" if linked else shipped
    if linked:
        scene.symlink_to(shipped)
    with Window(display, folder, scene, *PLAIN, save=False) as window:
        window.keys("minus")
        plain = window.still()
        window.keys("ctrl+s")
        assert (window.still() != plain).any(), "nothing asks for a name"
        assert window.title.endswith("*")
    assert shipped.read_bytes() == before
    assert [path for path in folder.glob("*.yaml") if path != scene] == []


def test_a_scene_that_changes_on_the_disk_is_loaded_again(display: Display, folder: Path) -> None:
    scene = folder / "s.yaml"
    scene.write_text(SURFACE)
    with Window(display, folder, "s.yaml", *PLAIN) as window:
        scene.write_text(SURFACE.replace("fov: 50", "fov: 30"))
        window.shows(film(folder, scene, SIZE))
        # A mistake: the last picture stays.
        good = window.still()
        scene.write_text(SURFACE.replace("mandelbulb", "mandelblub"))
        assert np.array_equal(below(window.still(1.5)), below(good))
        assert window.process.poll() is None
        # An editor that writes beside and renames.
        (folder / "other").write_text(SURFACE.replace("fov: 50", "fov: 70"))
        (folder / "other").replace(scene)
        window.shows(film(folder, scene, SIZE))


def test_a_formula_file_that_changes_is_loaded_again(display: Display, folder: Path) -> None:
    library = resources.folder("formulas/library")
    shutil.copy(library / "mandelbulb.yaml", folder / "own.yaml")
    scene = folder / "s.yaml"
    scene.write_text(SURFACE.replace("name: mandelbulb", "file: own.yaml"))
    with Window(display, folder, "s.yaml", *PLAIN) as window:
        text = (folder / "own.yaml").read_text()
        before = window.still()
        changed = text.replace("default: 8", "default: 5")
        assert changed != text
        (folder / "own.yaml").write_text(changed)
        window.shows(film(folder, scene, SIZE))
        assert (window.still() != before).any()


def test_unsaved_changes_survive_a_crash(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(SURFACE)
    (folder / "settings.yaml").write_text("autosave: 0.2\n")
    cache = folder / "cache"
    extra = {"CLFRACTAL_SETTINGS": str(folder / "settings.yaml"), "CLFRACTAL_CACHE": str(cache)}
    with Window(display, folder, "s.yaml", *PLAIN, extra=extra) as window:
        window.drag((180, 120), (230, 100))
        window.keys("minus")
        wait_for(lambda: list((cache / "autosave").glob("*.json")), "the safety copy")
        wait_for(lambda: window.title.endswith("*"))
        window.still(1.0)
        edited = window.still()
        window.kill()
    with Window(display, folder, "s.yaml", "--size", "1280x720", extra=extra) as window:
        # It belongs to this window, which offers it.
        assert Autosave(cache / "autosave").found() == []
        window.kill()
    kept = Autosave(cache / "autosave").found()
    assert len(kept) == 1
    assert kept[0].path is not None
    assert kept[0].path.name == "s.yaml"
    (folder / "kept.yaml").write_text(kept[0].text)
    assert np.array_equal(film(folder, "kept.yaml", SIZE), edited)
    kept[0].release()


def test_what_was_saved_is_not_kept(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(SURFACE)
    (folder / "settings.yaml").write_text("autosave: 0.2\n")
    cache = folder / "cache"
    extra = {"CLFRACTAL_SETTINGS": str(folder / "settings.yaml"), "CLFRACTAL_CACHE": str(cache)}
    with Window(display, folder, "s.yaml", *PLAIN, extra=extra) as window:
        window.keys("minus")
        wait_for(lambda: list((cache / "autosave").glob("*.json")), "the safety copy")
        window.save()
        wait_for(lambda: not list((cache / "autosave").glob("*.json")), "the end of the safety copy")
        window.kill()
    assert Autosave(cache / "autosave").found() == []


SPLIT = """version: 1
formula: {name: hast, iterations: 10}
camera: {position: [-0.6, -3, 1.2], target: [-0.5, 0, 0]}
cut_planes:
  - plane: &plane {center: [-0.6, 0, 0], width: 2.6, height: 2.6}  # one plane
    opacity: 0.4
renderer: {samples: 1}
layout:
  columns: 2
  views:
    - {}
    - renderer: {type: cut_plane, plane: *plane, samples: 1}  # its cut
"""


@pytest.mark.parametrize("x", [90, 270])
def test_in_a_split_picture_the_plane_and_its_cut_are_one(display: Display, folder: Path, x: int) -> None:
    """Page Up, Ctrl+Right and Alt+Up over either half: the file has one plane, and the shell shows the same picture."""
    (folder / "s.yaml").write_text(SPLIT)
    with Window(display, folder, "s.yaml", "--size", "360x180", "--no-panels") as window:
        window.move(x, 90)
        window.still()
        window.keys("Page_Up", "ctrl+Right", "alt+Up")
        window.still()
        window.save()
        saved = (folder / "saved.yaml").read_text()
        changed = [
            (one, other)
            for one, other in zip(SPLIT.splitlines(), saved.splitlines(), strict=True)
            if one != other
        ]
        assert len(changed) == 1
        assert "plane: &plane {" in changed[0][1]
        assert changed[0][1].endswith("}  # one plane")
        window.still(7)
        window.shows(film(folder, "saved.yaml", (360, 180)))
