"""`seconds` in a picture's header is the time of its rays: compiling, which happens once, is no part of it."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest

import clfractal
from clfractal.device import program
from clfractal.device.select import choose
from clfractal.files.exr import read_exr
from clfractal.files.png import read_texts
from clfractal.integrators.surface import PROGRAMS
from tests.shell import SCENE, Ended, InProcess

COMPILING = 1000.0  # seconds that a program takes to be built, by a clock that a test puts forward
RAYS = 100.0  # and that the rays of a small picture do not take on any machine
# Built beside the march's, which is enough to wait for.
BESIDE = {each.name for each in PROGRAMS} - {"rays"}
KINDS = {
    "surface": "",
    "cut plane": "renderer: {type: cut_plane}\n",
    "volume": "renderer: {type: volume, resolution: 32}\n",
    "stereo": "stereo: {mode: split}\n",
    "layout": "layout: {views: [{}, {renderer: {type: cut_plane}}]}\n",
}


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The texts of the programs that are built from now on, which take their time: of a surface's the march's."""
    texts: list[str] = []
    built, real, late = program._built, time.perf_counter, [0.0]

    def slow(device: Any, key: str, text: str, *others: Any) -> tuple[Any, bool]:
        texts.append(text)
        if others[-1] not in BESIDE:
            late[0] += COMPILING
        return built(device, key, text, *others)

    for kind in KINDS:  # whatever they really take is over
        clfractal.render(SCENE + KINDS[kind])
    monkeypatch.setattr(program, "_built", slow)
    monkeypatch.setattr(time, "perf_counter", lambda: real() + late[0])
    choose().loaded.clear()
    return texts


@pytest.mark.parametrize("kind", KINDS)
def test_of_python(kind: str, builds: list[str]) -> None:
    seen: list[clfractal.Progress] = []
    start = time.perf_counter()
    film = clfractal.render(SCENE + KINDS[kind], progress=seen.append)
    assert time.perf_counter() - start > COMPILING
    assert builds
    state, seconds = seen[-1], film.header["seconds"]
    assert 1e-3 * state.kernel_ms < seconds < RAYS
    assert seconds <= state.seconds < RAYS
    assert state.build_ms >= 1e3 * COMPILING


@pytest.mark.parametrize("kind", KINDS)
def test_of_the_shell(
    kind: str,
    builds: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.yaml").write_text(SCENE + KINDS[kind])
    outputs = ("-o", "a.exr", "-o", "a.png", "--stats", "stats.json", "--quiet")
    assert InProcess(capfd)("render", "scene.yaml", *outputs) == Ended(0, "", "")
    told = json.loads(Path("stats.json").read_text())
    assert builds
    assert told["wall_ms"] > 1e3 * COMPILING <= told["build_ms"]
    seconds = read_exr("a.exr")[1]["clfractalSeconds"]
    assert 1e-3 * told["kernel_ms"] < seconds < RAYS
    assert float(read_texts("a.png")["clfractalSeconds"]) == pytest.approx(seconds)


def test_of_both_eyes_films(builds: list[str]) -> None:
    """Each tells its own time."""
    films = clfractal.render_pair(SCENE + KINDS["stereo"])
    assert builds
    assert len(builds) == len(set(builds))  # both eyes have the same programs
    assert all(0 < film.header["seconds"] < RAYS for film in films)
