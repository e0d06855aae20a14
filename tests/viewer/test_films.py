"""Films that are rendered from the window: ordered in a panel, told, cancelled, continued, and whole in the end."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("imgui_bundle")

from PIL import Image

from clfractal.device.select import Device
from clfractal.errors import FileError
from clfractal.scene.load import load_scene
from clfractal.viewer.films import FilmOrder, FilmQueue, RenderedFilm
from clfractal.viewer.panels import films
from clfractal.viewer.panels.ui import Ui
from clfractal.work.frames import frames
from tests.viewer.panel_clicks import Seen
from tests.viewer.panel_harness import Stage, headless, make_ui

SCENE = """
version: 1
formula: {name: mandelbulb, iterations: 4}
image: {width: 48, height: 32}
camera: {position: [0, -3, 0.5]}
renderer: {samples: 1}
animation:
  fps: 10
  frames: 6
  tracks: {camera.position: {keys: [{frame: 0, value: [0, -3, 0.5]}, {frame: 5, value: [2, -3, 0.5]}]}}
"""


def _until(true: Callable[[], object], queue: FilmQueue, seconds: float = 90.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, [vars(film) for film in queue.films]
        time.sleep(0.02)
        queue.look(time.perf_counter())


def _order(folder: Path, name: str, device: Device, **more: object) -> FilmOrder:
    values = {"text": SCENE, "folder": folder, "first": 0, "last": 5, "device": device.info.index, **more}
    return FilmOrder(output=folder / name, **values)  # type: ignore[arg-type]


@pytest.fixture
def queue() -> Iterator[FilmQueue]:
    found = FilmQueue()
    yield found
    found.close()


def test_a_film_is_the_shells_film(tmp_path: Path, device: Device, queue: FilmQueue) -> None:
    film = queue.order(_order(tmp_path, "f_####.png", device, first=1, last=3))
    assert film.running
    _until(lambda: film.finished, queue)
    assert (film.problem, film.written, film.done) == ("", True, 3)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["f_0001.png", "f_0002.png", "f_0003.png"]
    for number, wanted in frames(SCENE, device.info.index, numbers=(1, 3)):
        shown = np.asarray(Image.open(tmp_path / f"f_{number:04}.png").convert("RGB"))
        assert np.array_equal(shown, wanted.to_rgb8())


def test_a_cancelled_film_keeps_its_frames_and_is_continued(
    tmp_path: Path, device: Device, queue: FilmQueue
) -> None:
    order = _order(tmp_path, "f_####.png", device, size=(320, 200), samples=16)
    film = queue.order(order)
    _until(lambda: film.done >= 2, queue)
    film.cancel()
    _until(lambda: not film.running, queue)
    kept = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.png")}
    assert 2 <= len(kept) < 6
    assert (film.cancelled, film.written, film.problem) == (True, False, "")
    assert film.done == len(kept)
    again = queue.order(order, resume=True)
    assert queue.films == [again]
    _until(lambda: again.finished, queue)
    assert again.written, again.problem
    assert len(list(tmp_path.glob("*.png"))) == 6
    assert {name: (tmp_path / name).stat().st_mtime_ns for name in kept} == kept


@pytest.mark.skipif(pytest.importorskip("importlib.util").find_spec("av") is None, reason="films need av")
def test_a_film_file_is_whole_or_not_there(tmp_path: Path, device: Device, queue: FilmQueue) -> None:
    film = queue.order(_order(tmp_path, "f.mp4", device))
    _until(lambda: film.finished, queue)
    assert film.written, film.problem
    assert [path.name for path in tmp_path.iterdir()] == ["f.mp4"]


def test_what_goes_wrong_is_told_in_one_line(tmp_path: Path, device: Device, queue: FilmQueue) -> None:
    wrong = queue.order(_order(tmp_path, "f_####.png", device, text=SCENE.replace("[2, -3, 0.5]", "[2, -3]")))
    nowhere = queue.order(_order(tmp_path, "none/f_####.png", device))
    _until(lambda: wrong.finished and nowhere.finished, queue)
    assert not wrong.written
    assert "camera.position" in wrong.problem
    assert "\n" not in wrong.problem
    assert "none" in nowhere.problem
    assert list(tmp_path.iterdir()) == []


def test_films_are_rendered_in_turn_and_the_window_ends_them(tmp_path: Path, device: Device) -> None:
    queue = FilmQueue()
    first = queue.order(_order(tmp_path, "one_####.png", device, size=(640, 400), samples=64))
    second = queue.order(_order(tmp_path, "two_####.png", device))
    assert (first.running, second.running) == (True, False)
    assert films.state_text(second) == "waiting for the film before"
    _until(lambda: first.done >= 1, queue)
    begun = time.monotonic()
    (line,) = queue.close()
    assert time.monotonic() - begun < 4
    assert "one_####.png: interrupted with" in line
    assert not first.running
    assert second.cancelled
    assert not queue.busy


@pytest.mark.skipif(not hasattr(os, "getpriority"), reason="priorities are POSIX's")
def test_a_film_gives_way_to_the_window(tmp_path: Path, device: Device, queue: FilmQueue) -> None:
    film = queue.order(_order(tmp_path, "f_####.png", device))
    assert film._process is not None
    assert os.getpriority(os.PRIO_PROCESS, film._process.pid) > os.getpriority(os.PRIO_PROCESS, 0)


def test_the_files_of_frames_are_known() -> None:
    order = FilmOrder(SCENE, Path("/a"), Path("/b/x_##_####.exr"), 3, 5, "0:0")
    assert order.frame(4) == Path("/b/x_##_0004.exr")
    assert FilmOrder(SCENE, Path("/a"), Path("/b/x.mp4"), 3, 5, "0:0").frame(4) == Path(
        "/b/x.mp4.partial/000004.png"
    )
    command = order.command(resume=True)
    assert command[0] == sys.executable
    assert command[command.index("--frames") + 1] == "3-5"
    assert command[-1] == "--resume"


# The panel


@pytest.fixture
def panel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Ui, Stage, Seen, list[FilmOrder]]]:
    monkeypatch.chdir(tmp_path)
    ordered: list[FilmOrder] = []
    monkeypatch.setattr(RenderedFilm, "start", lambda film: ordered.append(film.order))
    with headless():
        seen = Seen(monkeypatch)
        ui, _ = make_ui(load_scene(SCENE, posed=False))
        ui.studio.go_to_frame(0.0)
        ui.show.add("films")
        ui.memory["files"] = SimpleNamespace(
            source=SimpleNamespace(path=tmp_path / "dive.yaml"), text=lambda: SCENE
        )
        yield ui, Stage(ui, films.draw, window=False), seen, ordered


def test_the_panel_orders_all_of_the_film_by_the_scenes_name(
    panel: tuple[Ui, Stage, Seen, list[FilmOrder]], tmp_path: Path
) -> None:
    ui, stage, seen, ordered = panel
    seen.click(stage, "Render")
    (order,) = {id(each): each for each in ordered}.values()
    assert (order.output, order.first, order.last) == (tmp_path / "dive.mp4", 0, 5)
    assert order.text == SCENE
    assert order.device == ui.studio.session.device.info.index


def test_what_is_there_is_continued_and_a_film_is_not_replaced(
    panel: tuple[Ui, Stage, Seen, list[FilmOrder]], tmp_path: Path
) -> None:
    ui, stage, seen, ordered = panel
    partial = tmp_path / "dive.mp4.partial"
    partial.mkdir()
    (partial / "000000.png").touch()
    stage.frame(2.0)
    assert {"Continue", "Begin anew"} <= set(seen.fresh(stage))
    seen.click(stage, "Continue")
    assert ordered
    assert ui.studio.films.films[0]._resume
    ui.studio.films.films.clear()
    (tmp_path / "dive.mp4").touch()
    animation = ui.studio.scene.animation
    assert animation is not None
    with pytest.raises(FileError, match="is there already"):
        films.order_of(ui, films.Wanted(), animation)


@pytest.mark.parametrize(("kind", "name"), [("EXR pictures", "a_####.exr"), ("MOV, ProRes", "a.mov")])
def test_a_name_gets_the_ending_of_its_kind(
    panel: tuple[Ui, Stage, Seen, list[FilmOrder]], tmp_path: Path, kind: str, name: str
) -> None:
    assert films.output_of(panel[0], films.Wanted(kind=kind, name="a.mp4")) == tmp_path / name


def test_states_are_told_in_few_words() -> None:
    order = FilmOrder(SCENE, Path("/a"), Path("/b/x.mp4"), 0, 9, "0:0")
    film = RenderedFilm(order)
    film._process = SimpleNamespace()  # type: ignore[assignment]
    film.done, film.remaining = 4, 12.4
    assert films.state_text(film) == "4 of 10 frames, 12 s left"
    film.done = 10
    assert films.state_text(film) == "10 frames, writing"
    film.written = True
    assert films.state_text(film) == "10 frames, written"
