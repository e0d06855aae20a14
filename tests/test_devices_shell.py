"""Several devices from the shell: names, files, kills and interrupts; the halves of the processor are two devices."""

from __future__ import annotations

import json
import random
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from clfractal.device.select import choose
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import Result
from clfractal.errors import DeviceError
from clfractal.files.exr import read_exr
from tests.halves import halves_of
from tests.interrupts import planes
from tests.long_renders import HEAVY, TILES, interrupted_in_a_kernel
from tests.shell import Ended, InProcess, command, environment, process, works

pytestmark = pytest.mark.usefixtures("interrupts_are_not_ignored")


@pytest.fixture(scope="module")
def halves() -> str:
    return halves_of(choose())


def render(folder: Path, *options: str) -> Ended:
    return process(["render", "heavy.yaml", "-o", "out.exr", *options], folder)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A picture by one device."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "heavy.yaml").write_text(HEAVY)
    assert render(folder, "--quiet").status == 0
    return folder / "out.exr"


def test_killed_and_resumed_by_one_and_by_several(whole: Path, halves: str, tmp_path: Path) -> None:
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    chance, kept = random.Random(1), 0
    for number in range(6):
        named = ["--device", halves] if number % 2 == 0 else []
        running = subprocess.Popen(
            command("render", "heavy.yaml", "-o", "out.exr", "--quiet", "--resume", *named),
            cwd=tmp_path,
            env=environment(),
        )
        try:
            running.wait(chance.uniform(0.6, 1.4))
            break
        except subprocess.TimeoutExpired:
            running.send_signal(signal.SIGKILL)
            running.wait()
        if (tmp_path / "out.exr.partial").exists():
            size = (tmp_path / "out.exr.partial").stat().st_size
            assert size >= kept  # nothing that was done is lost
            kept = size
    ended = render(tmp_path, "--resume", "--quiet", "--device", halves)
    assert ended == Ended(0, "", "")
    assert planes(tmp_path / "out.exr") == planes(whole)
    assert not (tmp_path / "out.exr.partial").exists()


def test_the_header_and_the_statistics_name_the_devices(whole: Path, halves: str, tmp_path: Path) -> None:
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    ended = works(render(tmp_path, "--device", halves, "--stats", "stats.json", "--verbose"))
    assert planes(tmp_path / "out.exr") == planes(whole)
    shares = json.loads((tmp_path / "stats.json").read_text())["devices"]
    header = read_exr(tmp_path / "out.exr")[1]
    assert sum(each["tiles"] for each in shares) == TILES
    for each in shares:
        line = f"{each['index']} {each['device']}: {each['tiles']} tile{'' if each['tiles'] == 1 else 's'}"
        assert line in header["clfractalDevices"]
        assert line in ended.err
    assert sum(int(run.split("*")[0]) for run in header["clfractalTileDevices"].split()) == TILES


def told_tiles(lines: str) -> dict[str, int]:
    """Of `clfractalDevices`: how many tiles each device made, by its index."""
    return {line.split(" ")[1]: int(line.split(": ")[-1].split()[0]) for line in lines.split("\n")}


@pytest.mark.parametrize("layout", [False, True])
def test_each_view_of_a_file_names_its_own_devices(
    halves: str,
    layout: bool,
    tmp_path: Path,
    clf: InProcess,
) -> None:
    """By view, and together as the statistics tell it."""
    scene = HEAVY.replace("samples: 16", "samples: 1") + "stereo: {mode: multi_view, separation: 0.1}\n"
    if layout:
        scene += "layout: {views: [{}, {renderer: {samples: 2}}]}\n"
    (tmp_path / "heavy.yaml").write_text(scene)
    render = ("render", "heavy.yaml", "-o", "out.exr", "--device", halves, "--stats", "stats.json")
    works(clf(*render))
    header = read_exr(tmp_path / "out.exr")[1]
    shares = json.loads((tmp_path / "stats.json").read_text())
    assert "clfractalDevices" not in header
    assert "clfractalTileDevices" not in header
    found: dict[str, int] = {}
    for view in ("left", "right"):
        own = told_tiles(header[f"{view}.clfractalDevices"])
        assert sum(own.values()) == shares["tiles"] / 2
        assert (f"{view}.clfractalTileDevices" in header) != layout
        for index, tiles in own.items():
            found[index] = found.get(index, 0) + tiles
    assert found == {each["index"]: each["tiles"] for each in shares["devices"]}
    assert header["clfractalSeconds"] > 0


def test_no_device_is_left(
    whole: Path,
    halves: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    clf: InProcess,
) -> None:
    """Status 3 and one line more than those of the devices; what was done is kept, and one device continues it."""
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    execute = LocalExecutor.execute

    def failing(own: LocalExecutor, *arguments: Any) -> Iterator[Result]:
        done = 0
        for result in execute(own, *arguments):
            yield result
            done += len(result.tiles)
            if done >= 5:
                raise DeviceError(f"{own.device.info.name}: the device failed while rendering: OUT_OF_ORDER")

    with monkeypatch.context() as patch:
        patch.setattr(LocalExecutor, "execute", failing)
        ended = clf("render", "heavy.yaml", "-o", "out.exr", "--device", halves)
    assert ended.status == 3
    lines = ended.err.splitlines()
    assert [line for line in lines if "is left out, others do its work: " in line] == lines[-2:-1]
    assert lines[-1].startswith("no device is left: ")
    assert (tmp_path / "out.exr.partial").exists()
    assert not (tmp_path / "out.exr").exists()
    index = halves.split("/")[0]
    ended = clf("render", "heavy.yaml", "-o", "out.exr", "--resume", "--device", index)
    assert ended.status == 0
    assert planes(tmp_path / "out.exr") == planes(whole)
    # Of the tiles of the earlier run it is still known who made them.
    told = read_exr(tmp_path / "out.exr")[1]["clfractalDevices"]
    assert [line.split()[1] for line in told.split("\n")][-1] == index
    assert f"{halves}#" in told


def test_ctrl_c_with_several_devices(halves: str, tmp_path: Path) -> None:
    for told in interrupted_in_a_kernel(tmp_path, "--device", halves):
        assert told.endswith("out.exr: interrupted before a tile was done\n")


def test_a_film_by_several_devices(halves: str, tmp_path: Path) -> None:
    scene = HEAVY.replace("samples: 16", "samples: 1").replace("224, height: 160", "96, height: 64")
    scene += "animation: {frames: 3, tracks: {camera.fov: {keys: [{frame: 0, value: 30}, {frame: 2, value: 40}]}}}\n"
    (tmp_path / "film.yaml").write_text(scene)
    for name, device in (("one", halves.split("/")[0]), ("two", halves)):
        works(process(["animate", "film.yaml", "-o", f"{name}_#.exr", "--device", device], tmp_path))
    for number in range(3):
        assert planes(tmp_path / f"one_{number}.exr") == planes(tmp_path / f"two_{number}.exr")
        assert "clfractalDevices" in read_exr(tmp_path / f"two_{number}.exr")[1]
