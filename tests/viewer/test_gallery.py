"""The gallery: every shipped scene, pictures only where they are seen, kept on the disk, and nothing lost by a click."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from clfractal.device import cache
from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.thumbnails import SIZE, shown_scene, words_of
from clfractal.files.resources import folder
from clfractal.scene.load import check_scene, load_scene
from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer.background import Thumbnail
from clfractal.viewer.panels import gallery
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.shelf import Entry, Shelf, kind_of
from tests.viewer.panel_clicks import Seen
from tests.viewer.panel_harness import Stage, headless, make_ui

FILES = gallery.scene_files()
SCENE = "scenes/mandelbulb.yaml"


@pytest.fixture(autouse=True)
def _context(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(tmp_path / "cache"))
    with headless():
        yield


def pixels(seed: int = 1) -> Any:
    picture = np.random.default_rng(seed).integers(0, 256, (SIZE[1], SIZE[0], 4), dtype=np.uint8)
    picture[..., 3] = 255
    return picture


def shelf(paths: list[Path], device: str = "a device") -> Shelf:
    found = Shelf(paths, device, lambda: None)
    for entry in found.entries:
        found.look(entry)
    found.close()
    return found


def opened(size: tuple[float, float] = (1280, 720)) -> tuple[Ui, list[str], list[Any]]:
    """A window with the gallery, all scenes read; its actions, and the pictures that were asked for."""
    ui, done = make_ui(SCENE)
    ui.size = size
    ui.show.add("gallery")
    tasks: list[Any] = []
    ui.studio.session.add = tasks.append  # type: ignore[method-assign, assignment]
    found = gallery.Gallery(Shelf(FILES, "a device", lambda: None))
    ui.memory["gallery"] = found
    return ui, done, tasks


def settle(ui: Ui, stage: Stage) -> gallery.Gallery:
    """Draws until the thread has nothing left to do."""
    state: gallery.Gallery = ui.memory["gallery"]
    for _ in range(3):
        stage.frame()
        state.shelf._pool.submit(lambda: None).result(60)
    stage.frame()
    return state


def plankton() -> tuple[Stage, gallery.Gallery, Any, list[Any]]:
    """A gallery in which one scene was searched for: where it is drawn, its entry, and the pictures that were asked for."""
    ui, _, tasks = opened()
    ui.memory["gallery.filter"] = "plankton"
    stage = Stage(ui, gallery.draw, window=False)
    state = settle(ui, stage)
    entry = next(entry for entry in state.shelf.entries if entry.path.stem == "volume_plankton")
    return stage, state, entry, tasks


# Scenes


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_shipped_scene_has_a_title_and_a_small_picture(path: Path) -> None:
    title, about = words_of(path.read_text(encoding="utf-8"))
    assert title
    assert "Takes" not in about
    assert "`" not in about
    scene = load_scene(path)
    small = shown_scene(scene)
    check_scene(small)
    assert small.stereo is None
    renderers = [small.renderer, *(view.renderer for view in small.layout.views)] if small.layout else []
    for renderer in [small.renderer, *renderers]:
        if isinstance(renderer, VolumeRenderer) and renderer.file is None:
            assert np.max(renderer.resolution) <= 96
    assert kind_of(scene) in gallery.KINDS


def test_every_kind_has_scenes() -> None:
    assert {kind_of(load_scene(path)) for path in FILES} == set(gallery.KINDS) - {"all"}


def test_words_are_found_in_name_title_and_description() -> None:
    entry = Entry(Path("stereo_bulb.yaml"), "Crater", "A crater of the Mandelbulb.", kind="stereo")
    assert gallery.matches(entry, "all", "")
    assert gallery.matches(entry, "stereo", "mandelBULB crater")
    assert not gallery.matches(entry, "volume", "crater")
    assert not gallery.matches(entry, "all", "crater jade")


def test_a_scene_that_is_wrong_tells_why_and_does_not_stop_the_others(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("# Wrong\nversion: 1\ncamera: {fov: lots}\n")
    found = shelf([wrong, *FILES[:2]])
    assert found.entries[0].title == "Wrong"
    assert found.entries[0].problem
    assert found.entries[0].scene is None
    assert all(entry.scene is not None and entry.problem == "" for entry in found.entries[1:])


# Kept pictures


def test_a_changed_scene_gets_a_new_picture(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    shutil.copy(SCENE, path)
    before = shelf([path]).entries[0].key
    path.write_text(re.sub(r"fov: [\d.]+", "fov: 45", path.read_text()))
    assert shelf([path]).entries[0].key != before


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    from clfractal.files.png import write_png_pixels

    path = tmp_path_factory.mktemp("kept") / "kept.png"
    write_png_pixels(path, np.ascontiguousarray(pixels()[..., :3]))
    return path.read_bytes()


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_picture_is_ignored(kept: bytes, data: st.DataObject) -> None:
    """Whatever byte is another, or wherever the file ends: no picture, or (in a comment) the right one."""
    from clfractal.engine import thumbnails as module

    place = data.draw(st.integers(0, len(kept) - 1))
    if data.draw(st.booleans()):
        damaged = kept[:place]
    else:
        damaged = kept[:place] + bytes([kept[place] ^ data.draw(st.integers(1, 255))]) + kept[place + 1 :]
    path = module._place("key")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(damaged)
    found = module.load("key")
    assert found is None or np.array_equal(found, pixels()[..., :3])


def test_a_picture_of_another_size_is_ignored() -> None:
    from clfractal.engine import thumbnails as module
    from clfractal.files.png import write_png_pixels

    path = module._place("key")
    path.parent.mkdir(parents=True)
    write_png_pixels(path, np.zeros((3, 5, 3), np.uint8))
    assert module.load("key") is None


def test_the_oldest_pictures_go_first(monkeypatch: pytest.MonkeyPatch) -> None:
    from clfractal.engine import thumbnails as module

    monkeypatch.setattr(module, "MOST_KEPT", 2)
    for number in range(4):
        module.store(f"{number}", pixels(number))
        stamp = 1_000_000 + number
        os.utime(module._place(f"{number}"), (stamp, stamp))
    assert sorted(path.stem for path in module._place("0").parent.glob("*.png")) == ["2", "3"]


def test_without_a_cache_folder_pictures_are_only_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from clfractal.engine import thumbnails as module

    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(tmp_path / "gone"))
    assert not list(cache.folder().iterdir())
    cache.folder().rmdir()
    cache.folder().touch()
    module.store("key", pixels())
    assert module.load("key") is None


# The panel


def test_pictures_are_rendered_only_where_they_are_seen() -> None:
    ui, _, tasks = opened()
    stage = Stage(ui, gallery.draw, window=False)
    state = settle(ui, stage)
    assert state.shelf.read
    assert 8 <= len(tasks) <= 24 < len(FILES)
    assert state.asked == set(state.shelf.entries[: len(state.asked)])


def test_what_is_seen_no_more_is_given_up() -> None:
    ui, _, tasks = opened()
    stage = Stage(ui, gallery.draw, window=False)
    settle(ui, stage)
    ui.memory["gallery.filter"] = "plankton"
    state = settle(ui, stage)
    assert {entry.path.stem for entry in state.asked} == {"volume_plankton"}
    assert sum(not task.finished for task in tasks) == 1
    ui.show.discard("gallery")
    stage.frame()
    assert all(task.finished for task in tasks)


def test_a_rendered_picture_is_shown_and_kept_and_not_rendered_again() -> None:
    stage, state, entry, tasks = plankton()
    tasks[-1].pixels = pixels()
    settle(stage.ui, stage)
    assert entry.pixels is not None
    assert state.asked == set()
    state.shelf.close()
    _, _, again, more = plankton()
    assert np.array_equal(again.pixels, pixels())
    assert more == []


def test_a_picture_that_fails_is_told_and_not_tried_again() -> None:
    stage, _, entry, tasks = plankton()
    tasks[-1].problem = "out of memory"
    settle(stage.ui, stage)
    assert (entry.problem, len(tasks)) == ("out of memory", 1)


def test_a_click_opens_a_scene_and_closes_the_gallery(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = Seen(monkeypatch)
    ui, done, _ = opened()
    stage = Stage(ui, gallery.draw, window=False)
    settle(ui, stage)
    seen.click(stage, "bulbox")
    assert len(done) == 1
    kind, _, path = done[0].partition(":")
    assert kind == "open"
    assert Path(path).samefile(folder("scenes") / "bulbox.yaml")
    assert "gallery" not in ui.show


def test_unsaved_changes_are_asked_about(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = Seen(monkeypatch)
    ui, done, _ = opened()
    assert ui.studio.edit({"camera.fov": 30.0})
    assert not gallery.changed(ui)
    assert ui.studio.edit({"formula.iterations": 7})
    assert gallery.changed(ui)
    stage = Stage(ui, gallery.draw, window=False)
    settle(ui, stage)
    seen.click(stage, "bulbox")
    assert done == []
    assert "gallery" in ui.show
    seen.fresh(stage)
    seen.click(stage, "Cancel")
    assert "Cancel" not in seen.fresh(stage)
    seen.click(stage, "bulbox")
    seen.fresh(stage)
    seen.click(stage, "Open Bulbox and discard them")
    assert [each.partition(":")[0] for each in done] == ["open"]
    assert "gallery" not in ui.show


def test_the_close_button_and_a_click_beside_it_close_the_gallery(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = Seen(monkeypatch)
    ui, done, _ = opened()
    stage = Stage(ui, gallery.draw, window=False)
    seen.click(stage, "gallery.close")
    assert "gallery" not in ui.show
    ui.show.add("gallery")
    stage.frame()
    stage.click(40, 300)
    assert "gallery" not in ui.show
    assert done == []


def test_nothing_below_the_gallery_gets_the_pointer() -> None:
    ui, _, _ = opened()
    stage = Stage(ui, gallery.draw, window=False)
    for place in ((5, 5), (640, 360), (1275, 715)):
        stage.move(*place)
        stage.frame()
        assert imgui.get_io().want_capture_mouse
    ui.show.discard("gallery")
    stage.frame()
    stage.move(640, 360)
    assert not imgui.get_io().want_capture_mouse


def test_a_question_comes_before_the_gallery() -> None:
    ui, _, _ = opened()
    ui.show.add("save")
    stage = Stage(ui, gallery.draw, window=False)
    stage.move(640, 360)
    assert not imgui.get_io().want_capture_mouse
    assert "gallery" in ui.show


@pytest.mark.parametrize("size", [(320, 240), (640, 720), (1280, 720), (2560, 1440)])
def test_the_gallery_fits_into_every_window(
    size: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = Seen(monkeypatch)
    ui, _, _ = opened(size)
    stage = Stage(ui, gallery.draw, window=False)
    settle(ui, stage)
    x, y = seen.fresh(stage)["gallery.close"]
    assert 0 <= x <= size[0] - 20
    assert 0 <= y <= size[1] - 20


# A real picture


def test_the_picture_of_a_scene_is_the_scene_at_its_size(device: Device) -> None:
    from clfractal.engine.thumbnails import SAMPLES

    small = shown_scene(load_scene(SCENE))
    task = Thumbnail(lambda: small, SIZE, SAMPLES)
    task.work(LocalExecutor(device), CancelToken(), lambda line: None)
    assert task.pixels is not None
    assert task.pixels.shape == (SIZE[1], SIZE[0], 4)
    light = task.pixels[..., :3].max(axis=-1)
    assert light[100:170, 200:280].mean() > 2 * light[:10, :10].mean()
