"""Standard streams that are closed, or that lack letters; what is told of speed and of an interrupt."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import clfractal
from clfractal.cli.progress import shown_rate
from tests.calls import failure
from tests.shell import SCENE, Ended, environment, process

posix = pytest.mark.skipif(os.name != "posix", reason="the shell of this system cannot close streams")
NAMED = SCENE.replace(
    "name: mandelbulb",
    "inline: {title: Zażółć ń, reference: Škoda, variables: [x, y, z], map: [x*x, y, z], degree: 2,"
    " bounds: {center: [0, 0, 0], radius: 2}, bailout: 4}",
)


@pytest.fixture(autouse=True)
def _named(here: Path) -> None:
    (here / "named.yaml").write_text(NAMED, encoding="utf-8")


def closed(line: str, streams: str, folder: Path) -> Ended:
    """Runs a command whose streams the shell has closed."""
    ended = subprocess.run(
        ["/bin/sh", "-c", f'exec "$0" -P -m clfractal {line} {streams}', sys.executable],
        cwd=folder,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=240,
    )
    return Ended(ended.returncode, ended.stdout, ended.stderr)


@posix
@pytest.mark.parametrize("line", ["check scene.yaml", "formulas", "schema"])
def test_results_without_standard_output(here: Path, line: str) -> None:
    assert closed(line, ">&-", here).is_one_line(2, "standard output: cannot be written: it is closed")


@posix
@pytest.mark.parametrize("streams", ["<&- >&- 2>&-", "2>&-", "<&-"])
def test_rendering_needs_no_streams(here: Path, streams: str) -> None:
    assert closed("render scene.yaml -o out.png", streams, here).status == 0
    assert sorted(path.name for path in here.iterdir()) == ["named.yaml", "out.png", "scene.yaml"]
    assert closed("render missing.yaml -o new.png", streams, here).status == 2


def test_streams_that_lack_letters(here: Path) -> None:
    whole = clfractal.load_scene(here / "named.yaml")
    ended = process(["check", "named.yaml"], here, {"PYTHONIOENCODING": "ascii"})
    assert (ended.status, ended.err) == (0, "")
    assert ended.out.isascii()
    assert clfractal.load_scene(ended.out) == whole
    library = process(["formulas"], here, {"PYTHONIOENCODING": "ascii"})
    assert library.status == 0
    assert library.out.isascii()
    wrong = process(["check", "Zażółć.yaml"], here, {"PYTHONIOENCODING": "ascii"})
    assert wrong.is_one_line(2, "cannot be read: No such file")


def test_speeds_are_never_zero() -> None:
    rates = {3.456e6: "3.46 Mrays/s", 1.2e5: "0.12 Mrays/s", 4_460: "4.5 krays/s", 12.2: "12 rays/s"}
    assert {rate: shown_rate(rate) for rate in rates} == rates


def test_compiling_for_looks_counts() -> None:
    """`stereo.fit` renders a small picture first; its programs are a part of build_ms."""
    with clfractal.Engine() as engine:
        engine.device.loaded.clear()
        before = engine.device.loaded.building.milliseconds
        film = engine.render(SCENE + "stereo: {fit: auto, mode: anaglyph}\n")
        built = engine.device.loaded.building.milliseconds - before
        assert 0 < engine.previews_built_ms <= built
        assert film.stats["build_ms"] == pytest.approx(built, abs=0.01)


def test_a_comma_that_yaml_takes() -> None:
    wrong = NAMED.replace("map:", "let: {d: max(x, 1)}, map:")
    with pytest.raises(
        clfractal.FormulaError, match=r"inside {} or .* an expression with a comma needs quotes"
    ):
        clfractal.load_scene(wrong)


def test_errors_of_files_that_a_scene_names_keep_their_line(here: Path) -> None:
    head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 four 4\nencoding: raw\n\n"
    (here / "scan.nrrd").write_text(head)
    (here / "volume.yaml").write_text(SCENE + "renderer: {type: volume, file: scan.nrrd}\n")
    assert str(failure(clfractal.FileError, clfractal.load_scene, here / "volume.yaml")).endswith(
        ": renderer.file: " + f"{here}/scan.nrrd:4: sizes: must be 3 whole numbers, got '4 four 4'"
    )
    (here / "scan.nrrd").write_text("NRRD0004\n")
    with pytest.raises(clfractal.FileError, match=r"renderer.file: .*scan.nrrd is damaged: its header"):
        clfractal.load_scene(here / "volume.yaml")
