"""`clfractal precompile`: what is compiled, kept and told."""

from __future__ import annotations

import os
import re
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from clfractal.cli import run
from clfractal.cli.shell import Shell
from clfractal.device import program
from clfractal.engine.precompile import library_count, library_scenes
from clfractal.files import resources
from clfractal.formulas import catalog
from tests.long_renders import LIMIT_SECONDS
from tests.shell import SCENE, Ended, InProcess, Running, process, works

pytestmark = pytest.mark.usefixtures("interrupts_are_not_ignored")

TOLD = re.compile(r".*: (\d+) programs, (\d+) of them compiled now; [\d.]+ s, the cache has ([\d.]+) MB\n")
# Scenes that take two small programs each.
SCENES = {
    f"{name}.yaml": f"version: 1\nformula: {{name: {name}}}\ncamera: {{}}\nrenderer: {{type: cut_plane}}\n"
    for name in ("mandelbulb", "mandelbox", "hast")
}
OF_A_WINDOW = 3
"""Programs that are compiled with them."""


def given(folder: Path, **more: str) -> dict[str, str]:
    """A cache of its own, and lanes that need not be measured."""
    return {"CLFRACTAL_CACHE": str(folder / "cache"), "CLFRACTAL_LANES": "1", **more}


def entries(folder: Path) -> set[str]:
    return {path.name for path in (folder / "cache" / "programs").iterdir()}


def lay_out(folder: Path) -> None:
    for name, text in SCENES.items():
        (folder / name).write_text(text)


@dataclass(frozen=True, slots=True)
class Done:
    """A folder with scenes whose programs are compiled, in two goes.

    Attributes:
        interrupted: how the first ended, of which a signal was the end.
        seconds: how long it took to end.
        kept: what the cache had after it.
        ended: how the second ended.
    """

    folder: Path
    interrupted: tuple[int, str]
    seconds: float
    kept: set[str]
    ended: Ended


def _on_two_cores() -> None:
    """So that a machine of many does not compile all programs at once."""
    if sys.platform == "linux":
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Done]:
    # (A test run in the background ignores Ctrl-C, and so would the process.)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    folder = tmp_path_factory.mktemp("compiled")
    lay_out(folder)
    running = Running(folder, "precompile", *SCENES, extra=given(folder), before=_on_two_cores)
    programs = folder / "cache" / "programs"
    # (The window's three come first.)
    running.wait_until(lambda: programs.exists() and len(list(programs.glob("*.bin"))) > OF_A_WINDOW)
    begun = time.monotonic()
    interrupted = running.ended_by(signal.SIGINT)
    seconds, kept = time.monotonic() - begun, entries(folder)
    ended = process(["precompile", *SCENES], folder, given(folder))
    yield Done(folder, interrupted, seconds, kept, ended)
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_keeps_what_is_done(compiled: Done) -> None:
    status, told = compiled.interrupted
    assert compiled.seconds < LIMIT_SECONDS
    assert status == 130
    last = told.splitlines()[-1]
    assert re.fullmatch(r"clfractal: interrupted with \d+ of \d+ done; what is compiled is kept", last)
    assert len(compiled.kept) > OF_A_WINDOW
    assert all(name.endswith(".bin") for name in compiled.kept)


def test_the_last_line_tells_what_was_done(compiled: Done) -> None:
    folder, ended = compiled.folder, compiled.ended
    assert (ended.status, ended.out) == (0, "")
    told = TOLD.fullmatch(ended.err.splitlines(keepends=True)[-1])
    assert told is not None, ended.err
    # Each has one for the formula by itself, and one for what is joined to it.
    assert int(told[1]) == 2 * len(SCENES)
    # What the interrupt has left is not compiled again.
    assert 0 < int(told[2]) == int(told[1]) + OF_A_WINDOW - len(compiled.kept) < int(told[1])
    assert len(entries(folder)) == int(told[1]) + OF_A_WINDOW
    size = sum(path.stat().st_size for path in (folder / "cache" / "programs").iterdir())
    assert float(told[3]) == pytest.approx(size / 1e6, abs=0.06)


def test_nothing_is_compiled_twice(compiled: Done) -> None:
    folder = compiled.folder
    before = entries(folder)
    again = TOLD.fullmatch(process(["precompile", *SCENES], folder, given(folder)).err)
    assert again is not None
    assert again[2] == "0"
    assert entries(folder) == before
    assert process(["precompile", *SCENES, "--quiet"], folder, given(folder)) == Ended(0, "", "")


@contextmanager
def asked_for() -> Iterator[set[str]]:
    """Names of the programs that are asked for meanwhile, in this process."""
    names: set[str] = set()
    key = program._key

    def recorded(*arguments: Any) -> str:
        name = key(*arguments)
        names.add(name)
        return name

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(program, "_key", recorded)
        yield names


@pytest.fixture(scope="module")
def of_a_surface(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """What is compiled for a plain surface."""
    path = tmp_path_factory.mktemp("surface") / "a.yaml"
    path.write_text(SCENE)
    kept = program.is_kept
    with asked_for() as names, pytest.MonkeyPatch.context() as patch:
        # It asks for each whether it is kept, and is told that it is: here only names are needed.
        patch.setattr(program, "is_kept", lambda *about, **more: kept(*about, **more) or True)
        assert run(["precompile", str(path)], Shell(owns_process=False)) == 0
    assert len(names) >= 10
    return names


@pytest.mark.parametrize(
    "change",
    [
        "fog={density: 0.1, scattering: {}}",
        "lighting={mode: path}",
        "coloring={by: trap, trap: {shape: sphere}}",
        "glow={by: trap}",
        "mist={by: iterations}",
        "objects={ball: {type: sphere, position: [1.5, 0, 0], radius: 0.3}}",
        "objects={ball: {type: sphere, position: [1, 0, 0], radius: 0.3, join: smooth_union}}",
        "cut_planes=[{plane: {center: [0, 0, 0], normal: [1, -1, 0.2], width: 2, height: 2}, cut: true}]",
    ],
)
def test_what_is_switched_on_is_compiled(of_a_surface: set[str], clf: InProcess, change: str) -> None:
    with asked_for() as names:
        assert clf("render", "scene.yaml", "-o", "a.png", "-q", "--set", change) == Ended(0, "", "")
    assert len(names) >= 3
    assert names <= of_a_surface


def test_a_limit_that_is_too_small_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(SCENE.replace("camera:", "renderer: {type: cut_plane}\ncamera:"))
    ended = works(process(["precompile", "a.yaml"], tmp_path, given(tmp_path, CLFRACTAL_CACHE_MB="0")))
    assert ended.err.endswith(
        "programs are not kept: the cache takes no more than 0 MB; CLFRACTAL_CACHE_MB sets the limit\n"
    )


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["none.yaml"], "none.yaml"),
        (["a.yaml", "--device", "nothing"], "nothing"),
        (["a.yaml", "--precision", "half"], "--precision"),
        (["bad.yaml"], "bad.yaml:2"),
    ],
)
def test_mistakes_are_one_line(arguments: list[str], part: str, here: Path, clf: InProcess) -> None:
    (here / "a.yaml").write_text(SCENE)
    (here / "bad.yaml").write_text(SCENE.replace("mandelbulb", "mandelbub"))
    assert clf("precompile", *arguments).is_one_line(2, part)


def test_the_library_has_every_formula_and_scene() -> None:
    files = sorted(resources.folder("scenes").glob("*.yaml"))[:2]
    found = list(library_scenes(files))
    assert len(found) == library_count(files)
    plain = {(scene.formula.name, scene.renderer.type) for scene in found[:-2]}
    assert plain == {
        (name, renderer) for name in catalog.names() for renderer in ("surface", "cut_plane", "volume")
    }
