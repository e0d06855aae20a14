"""Films that are rendered from the window: ordered in a panel, told, cancelled, continued, and whole in the end."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("imgui_bundle")

from PIL import Image

from clfractal.device.select import Device
from clfractal.engine.frames import frames
from clfractal.errors import FileError
from clfractal.files.frame_names import frame_file, frames_there
from clfractal.images.outputs import output_files
from clfractal.scene.load import load_scene
from clfractal.scene.stereo import Mode, Stereo
from clfractal.viewer import film_queue
from clfractal.viewer.film_queue import FilmOrder, FilmQueue, RenderedFilm
from clfractal.viewer.panels import films
from clfractal.viewer.panels.ui import Ui
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


def _until(true: Callable[[], object], queue: FilmQueue) -> None:
    end = time.monotonic() + 120
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
    # So many frames that the film cannot end before it is cancelled, however fast the machine.
    many = {"text": SCENE.replace("frames: 6", "frames: 60"), "last": 59}
    order = _order(tmp_path, "f_####.png", device, size=(320, 200), samples=4, **many)
    film = queue.order(order)
    _until(lambda: film.done >= 2, queue)
    film.cancel()
    _until(lambda: not film.running, queue)
    kept = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.png")}
    assert 2 <= len(kept) < 60
    assert (film.cancelled, film.written, film.problem) == (True, False, "")
    assert film.done == len(kept)
    again = queue.order(order, resume=True)
    assert queue.films == [again]
    _until(lambda: again.finished, queue)
    assert again.written, again.problem
    assert len(list(tmp_path.glob("*.png"))) == 60
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
    many = {"text": SCENE.replace("frames: 6", "frames: 600"), "last": 599}
    first = queue.order(_order(tmp_path, "one_####.png", device, size=(640, 400), samples=64, **many))
    second = queue.order(_order(tmp_path, "two_####.png", device))
    assert (first.running, second.running) == (True, False)
    assert films.state_text(second) == "waiting for the film before"
    _until(lambda: first.done >= 1, queue)
    begun = time.monotonic()
    (line,) = queue.close()
    assert time.monotonic() - begun < 60  # to finish it would take minutes
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
    assert order.patterns == [Path("/b/x_##_####.exr")]
    of_film = FilmOrder(SCENE, Path("/a"), Path("/b/x.mp4"), 3, 5, "0:0")
    assert of_film.patterns == [Path("/b/x.mp4.partial/######.png")]
    command = order.command(resume=True)
    assert command[0] == sys.executable
    assert command[command.index("--frames") + 1] == "3-5"
    assert command[-1] == "--resume"


# Processes that stand in for the shell's


@dataclass(frozen=True)
class StandIn(FilmOrder):
    """A film that a small program makes instead of the shell.

    Attributes:
        program: Python, with `go(name)`, which writes a file, and `await_(name)`, which waits for one for some minutes.
    """

    program: str = ""

    def command(self, *, resume: bool) -> list[str]:
        """The program; `resume` is a name in it."""
        return [sys.executable, "-c", f"resume = {resume}\n{_TOOLS}\n{self.program}"]


_TOOLS = """
import pathlib, signal, sys, time
def go(name): pathlib.Path(name).write_text(str(time.time_ns()))
def await_(name):
    end = time.monotonic() + 200
    while not pathlib.Path(name).exists() and time.monotonic() < end: time.sleep(0.01)
"""
_STUBBORN = """
signal.signal(signal.SIGTERM, lambda *_: None)
go(f"began-{resume}"); await_("end"); go("ended"); sys.exit(0 if resume else 1)
"""


def _stand_in(folder: Path, program: str, name: str = "f_####.png", **more: Any) -> StandIn:
    return StandIn(more.pop("text", ""), folder, folder / name, 0, 5, "0:0", program=program, **more)


@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot refuse to end there")
@pytest.mark.parametrize("cleared", [False, True])
def test_a_film_begins_again_only_when_its_process_has_ended(
    tmp_path: Path, queue: FilmQueue, cleared: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film_queue, "_PATIENCE", 1000.0)  # nor is it killed before the test lets it end
    order = _stand_in(tmp_path, _STUBBORN)
    film = queue.order(order)
    _until((tmp_path / "began-False").exists, queue)
    assert queue.cancel()
    assert not queue.cancel()
    assert (film.running, film.finished, film.under_way, queue.busy) == (True, False, False, True)
    assert films.state_text(film) == "being cancelled, 0 of 6 frames"
    if cleared:
        queue.clear()
        assert queue.films == []
        assert queue.busy
    again = queue.order(order, resume=True)
    assert queue.films == [again]
    for _ in range(20):
        queue.look(time.perf_counter())
        assert not again.running
        time.sleep(0.01)
    (tmp_path / "end").touch()
    _until(lambda: again.finished, queue)
    assert film.finished
    assert int((tmp_path / "ended").read_text()) > int((tmp_path / "began-True").read_text())
    assert again.written
    assert not queue.busy


@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot refuse to end there")
def test_a_cancelled_process_that_does_not_end_is_killed(tmp_path: Path, queue: FilmQueue) -> None:
    film = queue.order(_stand_in(tmp_path, _STUBBORN))
    _until((tmp_path / "began-False").exists, queue)
    film.cancel()
    now = time.perf_counter()
    queue.look(now + 1)
    queue.look(now + 3)
    assert film.running
    queue.look(now + 6)
    _until(lambda: film.finished, queue)
    assert not (tmp_path / "ended").exists()


@pytest.mark.parametrize(
    ("program", "lines", "state"),
    [
        ("go('film')", [], (True, False, 6)),
        ("sys.exit('out of memory')", ["out of memory"], (False, False, 0)),
    ],
)
def test_a_film_that_ended_just_before_the_window_does(
    tmp_path: Path, program: str, lines: list[str], state: tuple[bool, bool, int]
) -> None:
    queue = FilmQueue()
    film = queue.order(_stand_in(tmp_path, program))
    assert film._process is not None
    film._process.wait()
    assert queue.close() == lines
    assert (film.written, film.cancelled, film.done) == state


@pytest.mark.parametrize(
    ("mode", "name", "files"),
    [
        ("pair", "f_####.png", ["f_0002_L.png", "f_0002_R.png"]),
        ("multi_view", "f_####.jpg", ["f_0002_L.jpg", "f_0002_R.jpg"]),
        ("multi_view", "f_####.exr", ["f_0002.exr"]),
        ("split", "f_####.png", ["f_0002.png"]),
    ],
)
def test_frames_with_a_file_of_each_eye_are_counted(
    tmp_path: Path, mode: Mode, name: str, files: list[str]
) -> None:
    order = _stand_in(tmp_path, "", name, stereo=Stereo(mode=mode))
    assert [path.name for path in output_files(order.stereo, frame_file(order.output, 2))] == files
    for file in files:
        assert order.there() == set()
        assert [*order.stamps([2])] == [None]
        (tmp_path / file).touch()
    assert order.there() == {2}
    assert [*order.stamps([1, 2])] == [None, tuple((tmp_path / file).stat().st_mtime_ns for file in files)]


def test_only_names_that_are_frames_count(tmp_path: Path) -> None:
    for name in ("f_0001.png", "f_00002.png", "f_03.png", "f_12345.png", "f_0004.png.tmp", "xf_0005.png"):
        (tmp_path / name).touch()
    assert frames_there([tmp_path / "f_####.png"], range(20_000)) == {1, 12345}
    assert frames_there([tmp_path / "none" / "f_####.png"], range(9)) == set()


def test_many_frames_are_counted_in_a_moment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"{number:06d}.png" for number in range(36_000)]
    monkeypatch.setattr(os, "listdir", lambda _: names)
    order = FilmOrder("", tmp_path, tmp_path / "f.mp4", 0, 35_999, "0:0")
    begun = time.process_time()
    assert len(order.there()) == 36_000
    assert time.process_time() - begun < 3  # each beside all others would take minutes


def test_frames_of_an_earlier_run_do_not_count_unless_it_is_continued(
    tmp_path: Path, queue: FilmQueue
) -> None:
    for number in range(6):
        (tmp_path / f"f_{number:04}.png").write_text("old")
    program = "go('f_0000.png'); go('f_0001.png'); go('two'); await_('end')"
    film = queue.order(_stand_in(tmp_path, program))
    _until((tmp_path / "two").exists, queue)
    _until(lambda: film.done, queue)
    assert film.done == 2
    (tmp_path / "end").touch()
    _until(lambda: film.finished, queue)
    (tmp_path / "f_0003.png").unlink()
    (tmp_path / "end").unlink()
    continued = queue.order(_stand_in(tmp_path, "await_('end')"), resume=True)
    _until(lambda: continued.done, queue)
    assert continued.done == 5
    (tmp_path / "end").touch()


def test_a_long_scene_does_not_hold_up_the_window(tmp_path: Path, queue: FilmQueue) -> None:
    text = "# long\n" * 100_000
    begun = time.monotonic()
    film = queue.order(_stand_in(tmp_path, "await_('read'); go(f'{len(sys.stdin.read())}')", text=text))
    assert time.monotonic() - begun < 60  # it waits for none to read
    (tmp_path / "read").touch()
    _until(lambda: film.finished, queue)
    assert film.written, film.problem
    assert (tmp_path / f"{len(text)}").exists()


def test_on_windows_a_film_opens_no_console(
    tmp_path: Path, queue: FilmQueue, monkeypatch: pytest.MonkeyPatch
) -> None:
    flags: list[int] = []

    def started(*_: object, creationflags: int, **__: object) -> None:
        flags.append(creationflags)
        raise OSError(2, "not there")

    monkeypatch.setattr(subprocess, "CREATE_NO_WINDOW", 0x8000000, raising=False)
    monkeypatch.setattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0x4000, raising=False)
    monkeypatch.setattr(subprocess, "Popen", started)
    assert "not there" in queue.order(_stand_in(tmp_path, "")).problem
    assert flags == [0x8004000]


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


def test_the_list_is_cleared_by_the_queue(panel: tuple[Ui, Stage, Seen, list[FilmOrder]]) -> None:
    ui, stage, seen, _ = panel
    queue = ui.studio.films
    ending = queue.order(FilmOrder("", Path(), Path("/b/x.mp4"), 0, 9, "0:0"))
    ending._process = process = SimpleNamespace(poll=lambda: None, terminate=lambda: None)  # type: ignore[assignment]
    ending.cancel()
    stage.frame(1.0)
    seen.click(stage, "Clear the list")
    assert queue.films == []
    assert queue.busy
    process.poll = lambda: -15
    queue.look(time.perf_counter())
    assert not queue.busy


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
