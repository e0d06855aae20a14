"""Files of two eyes' pictures: composed, as a pair, and as views; a few rows of them are in memory at a time."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clfractal.errors import FileError
from clfractal.files.exr import read_exr
from clfractal.files.exr_header import read_scene_text
from clfractal.images.compose import Composed, eye_regions
from clfractal.images.formats import check_views
from clfractal.images.framebuffer import Framebuffer, in_memory
from clfractal.images.modes import eye_size
from clfractal.images.outputs import pair_paths, save_outputs, save_views
from clfractal.images.store import JournalFramebuffer
from clfractal.images.tiles import Region
from tests.render.eyes import CHANNELS, COMPOSED, eyes, filled, stereo


@pytest.mark.parametrize("mode", COMPOSED)
def test_files_from_disk_and_from_memory_are_the_same(tmp_path: Path, mode: str) -> None:
    scene = stereo(mode)
    image = (70, 90)
    planes = eyes(eye_size(scene, image))
    region = Region(5, 33, 60, 50)
    parts = eye_regions(scene, image, region)
    header = {"scene": "version: 1\n", "version": "0.1.0"}
    memory: list[Any] = []
    disk: list[Any] = []
    for side, of in zip(("left", "right"), planes, strict=True):
        part = parts["left" if side == "left" else "right"]
        if part is None:
            memory.append(None)
            disk.append(None)
            continue
        size = eye_size(scene, image)
        memory.append(filled(Framebuffer(CHANNELS, size, part, header), of))
        journal = JournalFramebuffer(tmp_path / f"{side}.partial", {}, CHANNELS, size, part, header)
        disk.append(filled(journal, of))
    for name, stores in (("memory", memory), ("disk", disk)):
        composed = Composed(scene, image, stores[0], stores[1], region)
        save_outputs(composed, [tmp_path / f"{name}.exr", tmp_path / f"{name}.png"])
    for suffix in ("exr", "png"):
        assert (tmp_path / f"memory.{suffix}").read_bytes() == (tmp_path / f"disk.{suffix}").read_bytes()
    whole = in_memory(Composed(scene, image, memory[0], memory[1], region))
    found, attributes = read_exr(tmp_path / "disk.exr")
    assert sorted(found) == sorted(whole.channels)
    assert np.array_equal(found["R"], whole["R"].astype(np.float16))
    assert attributes["dataWindow"] == (5, 33, 64, 82)
    assert read_scene_text(tmp_path / "disk.exr") == "version: 1\n"
    with Image.open(tmp_path / "disk.png") as shown:
        assert np.array_equal(np.asarray(shown), whole.to_rgb8())


@pytest.mark.parametrize("mode", ["split", "over_under", "checkerboard", "anaglyph"])
def test_a_few_rows_at_a_time_are_in_memory(tmp_path: Path, mode: str) -> None:
    size = (256, 1024)
    stores: list[Any] = []
    for side in ("left", "right"):
        framebuffer = JournalFramebuffer(tmp_path / side, {}, CHANNELS, size)
        tile = np.random.default_rng(0).random((len(CHANNELS), 32, 32), dtype=np.float32)
        for index in range(framebuffer.grid.count):
            framebuffer.put(index, tile)
        stores.append(framebuffer)
    composed = Composed(stereo(mode), size, stores[0], stores[1])
    band = 32 * size[0] * len(CHANNELS) * 4  # bytes of an eye's row of tiles, a 32nd of its picture
    tracemalloc.start()
    try:
        rows = sum(len(planes["R"]) for _, planes in composed.bands())
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert rows == composed.display[1]
    assert peak < 9 * band


def test_both_views_in_one_file(tmp_path: Path) -> None:
    planes = eyes((50, 40))
    stores: list[Any] = []
    for number, of in enumerate(planes):
        header = {
            "scene": "version: 1\n",
            "worldToCamera": np.eye(4) + number,
            "worldToNDC": np.eye(4) - number,
            "devices": f"1: 0:{number} device: 4 tiles",
            "tileDevices": f"4*{number + 1}",
            "seconds": 0.5 + number,
        }
        stores.append(filled(Framebuffer(CHANNELS, (70, 60), Region(20, 10, 50, 40), header), shifted(of)))
    save_views(stores[0], stores[1], tmp_path / "a.exr")
    found, told = read_exr(tmp_path / "a.exr")
    expected = "R G B A Z N.left.X right.R right.G right.B right.A right.Z N.right.X"
    assert sorted(found) == sorted(expected.split())
    for name in ("R", "Z"):
        for stored, of in ((name, planes[0]), (f"right.{name}", planes[1])):
            assert np.array_equal(found[stored], of[name].astype(found[stored].dtype))
    assert np.array_equal(found["N.left.X"], planes[0]["N.X"].astype(np.float16))
    assert np.array_equal(found["N.right.X"], planes[1]["N.X"].astype(np.float16))
    assert found["right.Z"].dtype == np.float32
    assert told["multiView"] == ("left", "right")
    assert "view" not in told  # it would speak of a file of one view
    assert told["dataWindow"] == (20, 10, 69, 49)
    assert told["clfractalSeconds"] == 2
    for number, views in enumerate([["", "left."], ["right."]]):
        for view in views:
            assert np.array_equal(told[view + "worldToCamera"], np.eye(4) + number)
            assert np.array_equal(told[view + "worldToNDC"], np.eye(4) - number)
    for number, view in enumerate(("left.", "right.")):
        assert told[view + "clfractalDevices"] == f"1: 0:{number} device: 4 tiles"
        assert told[view + "clfractalTileDevices"] == f"4*{number + 1}"
    assert not {"clfractalDevices", "clfractalTileDevices"} & set(told)  # they would speak of one view
    assert read_scene_text(tmp_path / "a.exr") == "version: 1\n"


def shifted(planes: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Planes of 50 x 40 pixels at (20, 10) of a larger picture."""
    return {name: np.pad(plane, ((10, 10), (20, 0))) for name, plane in planes.items()}


def test_views_that_cannot_be_written(tmp_path: Path) -> None:
    framebuffer = Framebuffer(CHANNELS, (8, 8))
    message = r"a\.png: a PNG has room for one view; write both to an EXR"
    with pytest.raises(FileError, match=message):
        save_views(framebuffer, framebuffer, tmp_path / "a.png")
    with pytest.raises(FileError, match=message):
        check_views(tmp_path / "a.png")
    with pytest.raises(FileError, match="a JPEG has room for one view"):
        check_views(tmp_path / "a.jpg")
    with pytest.raises(FileError, match="unknown extension"):
        check_views(tmp_path / "a.gif")
    with pytest.raises(ValueError, match="same size, region and channels"):
        save_views(framebuffer, Framebuffer(CHANNELS, (8, 9)), tmp_path / "a.exr")
    assert not list(tmp_path.iterdir())


def test_a_pairs_files(tmp_path: Path) -> None:
    assert pair_paths("out.exr") == (Path("out_L.exr"), Path("out_R.exr"))
    assert pair_paths(tmp_path / "a.b.PNG") == (tmp_path / "a.b_L.PNG", tmp_path / "a.b_R.PNG")
    for path, view in zip(pair_paths(tmp_path / "a.exr"), ("left", "right"), strict=True):
        framebuffer = Framebuffer(CHANNELS, (8, 8), header={"view": view})
        save_outputs(framebuffer, [path])
        assert read_exr(path)[1]["view"] == view


def test_views_are_written_a_few_rows_at_a_time(tmp_path: Path) -> None:
    taken: list[str] = []

    class Watched(Framebuffer):
        def bands(self) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
            for row, band in super().bands():
                taken.append(f"{self.header['side']}{row}")
                yield row, band

    left, right = (Watched(["R"], (8, 70), header={"side": side}) for side in "lr")
    save_views(left, right, tmp_path / "a.exr")
    assert taken == ["l0", "r0", "l32", "r32", "l64", "r64"]
