"""Files of two eyes' pictures: composed, as a pair, and as views; a few rows of them are in memory at a time."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clfractal.errors import FileError
from clfractal.files.exr import read_exr
from clfractal.files.exr_header import read_scene_text
from clfractal.images.compose import Composed
from clfractal.images.formats import check_views
from clfractal.images.framebuffer import Framebuffer, in_memory
from clfractal.images.modes import eye_size
from clfractal.images.outputs import pair_paths, save_outputs, save_views
from clfractal.images.store import JournalFramebuffer
from clfractal.images.tiles import Region
from tests.render.eyes import CHANNELS, COMPOSED, eyes, filled, framebuffers, stereo


@pytest.mark.parametrize("mode", COMPOSED)
def test_files_from_disk_and_from_memory_are_the_same(tmp_path: Path, mode: str) -> None:
    scene, image, region = stereo(mode), (70, 90), Region(5, 33, 60, 50)
    planes = eyes(eye_size(scene, image))
    header = {"scene": "version: 1\n", "version": "0.1.0"}
    kinds: dict[str, Callable[..., Any]] = {
        "memory": lambda side, size, part: Framebuffer(CHANNELS, size, part, header),
        "disk": lambda side, size, part: JournalFramebuffer(
            tmp_path / f"{side}.partial", {}, CHANNELS, size, part, header
        ),
    }
    for name, make in kinds.items():
        composed = Composed(scene, image, *framebuffers(scene, image, region, planes, make), region)
        save_outputs(composed, [tmp_path / f"{name}.exr", tmp_path / f"{name}.png"])
    for suffix in ("exr", "png"):
        assert (tmp_path / f"memory.{suffix}").read_bytes() == (tmp_path / f"disk.{suffix}").read_bytes()
    whole = in_memory(composed)
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
    for stored, number, name in (
        *(("R", 0, "R"), ("Z", 0, "Z"), ("N.left.X", 0, "N.X")),
        *(("right.R", 1, "R"), ("right.Z", 1, "Z"), ("N.right.X", 1, "N.X")),
    ):
        assert np.array_equal(found[stored], planes[number][name].astype(found[stored].dtype))
    assert {found[name].dtype for name in ("Z", "right.Z")} == {np.dtype(np.float32)}
    wanted: dict[str, Any] = {
        "multiView": ("left", "right"),
        "dataWindow": (20, 10, 69, 49),
        "clfractalSeconds": 2,
        **{
            f"{view}clfractalDevices": f"1: 0:{n} device: 4 tiles"
            for n, view in enumerate(("left.", "right."))
        },
        **{f"{view}clfractalTileDevices": f"4*{n + 1}" for n, view in enumerate(("left.", "right."))},
    }
    assert {key: told[key] for key in wanted} == wanted
    # They would speak of a file of one view.
    assert not {"view", "clfractalDevices", "clfractalTileDevices"} & set(told)
    for number, view in ((0, ""), (0, "left."), (1, "right.")):
        assert np.array_equal(told[view + "worldToCamera"], np.eye(4) + number)
        assert np.array_equal(told[view + "worldToNDC"], np.eye(4) - number)
    assert read_scene_text(tmp_path / "a.exr") == "version: 1\n"


def shifted(planes: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Planes of 50 x 40 pixels at (20, 10) of a larger picture."""
    return {name: np.pad(plane, ((10, 10), (20, 0))) for name, plane in planes.items()}


def test_views_that_cannot_be_written(tmp_path: Path) -> None:
    framebuffer = Framebuffer(CHANNELS, (8, 8))
    with pytest.raises(FileError, match=r"a\.png: a PNG has room for one view; write both to an EXR"):
        save_views(framebuffer, framebuffer, tmp_path / "a.png")
    for name, message in (
        ("a.png", r"a\.png: a PNG has room for one view; write both to an EXR"),
        ("a.jpg", "a JPEG has room for one view"),
        ("a.gif", "unknown extension"),
    ):
        with pytest.raises(FileError, match=message):
            check_views(tmp_path / name)
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
