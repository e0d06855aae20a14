"""Stills: nothing is ever overwritten, files have the size that was asked for, and what goes wrong is told."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("imgui_bundle")


from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.engine.local_executor import LocalExecutor
from clfractal.errors import FileError
from clfractal.files.png import read_png_pixels
from clfractal.scene.load import load_scene
from clfractal.viewer.background import Still
from clfractal.viewer.editing import edited
from clfractal.viewer.panels import order_form, stills
from clfractal.viewer.panels.stills import (
    Wanted,
    check,
    free_name,
    names_of,
    on_their_way,
    paths_of,
    state_text,
)
from clfractal.viewer.panels.ui import Ui
from tests.viewer.panel_clicks import Seen
from tests.viewer.panel_harness import Stage, headless, make_ui

SCENE = Path("scenes/mandelbulb.yaml").resolve()
STEREO = Path("scenes/stereo_bulb.yaml").resolve()


@pytest.fixture(autouse=True)
def _context(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    with headless():
        yield


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Seen:
    return Seen(monkeypatch)


def opened(scene: Path = SCENE) -> tuple[Ui, Stage]:
    ui, _ = make_ui(scene)
    ui.show.add("stills")
    return ui, Stage(ui, stills.draw, window=False)


def pair() -> Any:
    """A scene whose eyes go to a file each."""
    scene = load_scene(STEREO)
    return edited(scene, {"stereo.mode": "pair"})


# Names


def test_a_free_name_is_free_for_all_files_of_a_still(tmp_path: Path) -> None:
    assert free_name("bulb", "png", ()) == "bulb-still-1"
    (tmp_path / "bulb-still-1.exr").touch()
    assert free_name("bulb", "png", ()) == "bulb-still-1"
    assert free_name("bulb", "both", ()) == "bulb-still-2"
    taken = {tmp_path / "bulb-still-2.png"}
    assert free_name("bulb", "both", taken) == "bulb-still-3"
    (tmp_path / "bulb-still-1_R.png").touch()
    assert free_name("bulb", "png", (), pair().stereo) == "bulb-still-2"


def test_a_link_to_nothing_is_not_free(tmp_path: Path) -> None:
    (tmp_path / "a-still-1.png").symlink_to(tmp_path / "elsewhere.png")
    assert free_name("a", "png", ()) == "a-still-2"
    with pytest.raises(FileError, match="there already"):
        check(paths_of("a-still-1", "png"), (), None)


@given(st.from_regex(r"[a-zA-Z0-9 ._-]{1,20}", fullmatch=True), st.sampled_from(list(stills.FORMATS)))
def test_files_have_the_name_that_was_typed_and_the_endings_of_their_format(name: str, kind: str) -> None:
    paths = paths_of(name, kind, Path("/pictures"))
    stem = name.strip()
    if stem not in ("", ".", ".."):  # those are refused before anything is written
        assert [path.suffix for path in paths] == ([".png", ".exr"] if kind == "both" else [f".{kind}"])
        for path in paths:
            assert path.name.startswith(stem.removesuffix(".png").removesuffix(".exr"))


def test_typed_endings_and_folders_are_understood(tmp_path: Path) -> None:
    assert paths_of("a.PNG", "exr") == (tmp_path / "a.exr",)
    assert paths_of("a.b", "png") == (tmp_path / "a.b.png",)
    assert paths_of("/pictures/a", "both") == (Path("/pictures/a.png"), Path("/pictures/a.exr"))
    assert paths_of("~/a", "png") == (Path.home() / "a.png",)


def test_what_is_there_or_on_its_way_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    check([path], (), None)
    with pytest.raises(FileError, match="there already"):
        check([path], {path}, None)
    path.touch()
    with pytest.raises(FileError, match="there already"):
        check([path], (), None)
    (tmp_path / "b_L.png").touch()
    check([tmp_path / "b.png"], (), None)
    with pytest.raises(FileError, match="there already"):
        check([tmp_path / "b.png"], (), pair().stereo)
    with pytest.raises(FileError, match="no folder"):
        check([tmp_path / "nothing" / "a.png"], (), None)
    for nameless in ("", ".", "..", "../.."):
        with pytest.raises(FileError, match="needs a name"):
            check(paths_of(nameless, "png"), (), pair().stereo)


def test_both_files_of_a_pair_are_on_their_way(tmp_path: Path) -> None:
    still = Still(pair(), (tmp_path / "a.png",))
    assert on_their_way([still]) == {tmp_path / "a_L.png", tmp_path / "a_R.png"}
    still.cancel()
    assert on_their_way([still]) == set()


def test_names_in_a_line() -> None:
    assert names_of([Path("/x/a.png")]) == "a.png"
    assert names_of([Path("/x/a.png"), Path("/x/a.exr")]) == "a.png, .exr"
    assert names_of([Path("/x/a_L.png"), Path("/x/a_R.png")]) == "a_L.png, a_R.png"


# The panel


def test_render_begins_a_still_of_the_size_and_samples_that_are_set(seen: Seen, tmp_path: Path) -> None:
    ui, stage = opened()
    seen.click(stage, "Render")
    first = ui.studio.stills[0]
    assert first.paths == (tmp_path / "scene-still-1.png",)
    assert (first.scene.image.width, first.scene.image.height) == ui.studio.viewport
    assert first.scene.renderer.samples == ui.studio.scene.renderer.samples
    state: Wanted = ui.memory["stills"]
    state.size, state.samples, state.kind = (333, 222), 7, "both"
    seen.click(stage, "Render")
    second = ui.studio.stills[1]
    assert second.paths == (tmp_path / "scene-still-2.png", tmp_path / "scene-still-2.exr")
    assert (second.scene.image.width, second.scene.image.height) == (333, 222)
    assert second.scene.renderer.samples == 7
    assert ui.studio.history.depth("scene") == (0, 0)


def test_a_file_that_is_there_is_never_overwritten(seen: Seen, tmp_path: Path) -> None:
    ui, stage = opened()
    (tmp_path / "mine.png").write_text("precious")
    state: Wanted = ui.memory["stills"]
    state.name = "mine"
    seen.click(stage, "Render")
    assert ui.studio.stills == []
    assert "there already" in state.problem
    state.name, state.problem = "other", ""
    seen.click(stage, "Render")
    seen.click(stage, "Render")  # the field was emptied: a free name
    assert [still.paths[0].name for still in ui.studio.stills] == ["other.png", "scene-still-1.png"]
    assert (tmp_path / "mine.png").read_text() == "precious"


def test_what_a_format_cannot_hold_does_not_begin(seen: Seen) -> None:
    ui, stage = opened()
    state: Wanted = ui.memory["stills"]
    state.size, state.kind = (16_384, 16), "webp"
    seen.click(stage, "Render")
    assert ui.studio.stills == []
    assert "a WebP has at most 16,383 pixels a side" in state.problem
    state.kind = "jpg"
    seen.click(stage, "Render")
    assert ui.studio.stills[0].paths[0].suffix == ".jpg"


def test_a_picture_beyond_the_schema_cannot_begin(seen: Seen) -> None:
    ui, stage = opened()
    state: Wanted = ui.memory["stills"]
    state.size = (65_536, 65_536)
    seen.fresh(stage)
    assert not seen.enabled["Render"]
    state.size, state.samples = (64, 64), 10**9
    seen.fresh(stage)
    assert seen.enabled["Render"]
    seen.click(stage, "Render")
    assert ui.studio.stills == []
    assert "samples" in state.problem


def test_a_still_is_cancelled_and_the_list_cleared(seen: Seen) -> None:
    ui, stage = opened()
    seen.click(stage, "Render")
    seen.click(stage, "Render")
    still = ui.studio.stills[1]
    assert "Clear the list" not in seen.fresh(stage)
    seen.click(stage, "cancel")  # the list's last: the oldest
    assert ui.studio.stills[0].cancelled
    assert not still.cancelled
    seen.fresh(stage)
    seen.click(stage, "Clear the list")
    assert ui.studio.stills == [still]


def test_every_state_is_told_and_drawn() -> None:
    ui, stage = opened()
    told = []
    for number in range(6):
        still = Still(ui.studio.shown_scene, (Path(f"{number}.png"),))
        ui.studio.stills.append(still)
    waiting, running, writing, written, failed, cancelled = ui.studio.stills
    running.share, running.remaining = 0.25, 130.0
    writing.share = 1.0
    written.written = written.paths
    failed.problem = "no space left on the device"
    cancelled.cancel()
    told = [state_text(still) for still in (waiting, running, writing, written, failed, cancelled)]
    assert told == [
        "1280 x 720, waiting for the picture",
        "1280 x 720, 25 %, 2 min left",
        "1280 x 720, writing",
        "1280 x 720, written",
        "no space left on the device",
        "1280 x 720, cancelled",
    ]
    stage.frame()


@pytest.mark.parametrize(("seconds", "told"), [(0.1, "1 s"), (89, "89 s"), (91, "2 min"), (9000, "2.5 h")])
def test_times_that_are_left(seconds: float, told: str) -> None:
    assert order_form.time_text(seconds) == told


# A real one


def test_files_are_complete_when_the_window_ends(device: Device, tmp_path: Path) -> None:
    """Files are written by a thread of their own, which the end of a session waits for."""
    scene = edited(load_scene(SCENE), {"image": {"width": 160, "height": 90}, "renderer.samples": 1})
    still = Still(scene, paths_of("real", "both"))
    executor = LocalExecutor(device)
    # As in a session, whose thread is a daemon.
    thread = threading.Thread(target=still.work, args=(executor, CancelToken(), print), daemon=True)
    thread.start()
    thread.join()
    still.finish_writing()
    assert still.problem == ""
    assert still.written == (tmp_path / "real.png", tmp_path / "real.exr")
    assert read_png_pixels(tmp_path / "real.png").shape == (90, 160, 3)
    assert (tmp_path / "real.exr").stat().st_size > 1000
    loaded = load_scene(tmp_path / "real.png")
    assert (loaded.image, loaded.camera, loaded.formula) == (scene.image, scene.camera, scene.formula)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []
