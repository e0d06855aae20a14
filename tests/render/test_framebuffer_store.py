"""The framebuffer on disk, and the files that framebuffers are written to."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clfractal.errors import FileError
from clfractal.files.channels import CHANNELS
from clfractal.files.exr import read_exr
from clfractal.files.exr_header import read_scene_text
from clfractal.files.png import read_texts
from clfractal.files.srgb import encode8
from clfractal.images.formats import Content, check_output
from clfractal.images.framebuffer import Framebuffer, in_memory
from clfractal.images.outputs import save_outputs
from clfractal.images.store import JournalFramebuffer
from clfractal.images.tiled import TiledStore
from clfractal.images.tiles import Region
from tests.files.limits import file_size_limit

ALL = tuple(CHANNELS)
IDENTITY = {"scene": "abc", "version": "0.1.0"}
HEADER: dict[str, Any] = {
    "scene": "version: 1\n",
    "version": "0.1.0",
    "device": "PoCL",
    "precision": "float32",
    "seconds": 2.5,
    "worldToCamera": np.arange(16.0).reshape(4, 4),
    "worldToNDC": np.eye(4),
}
PART = Region(10, 20, 90, 70)


def tile_content(store: TiledStore, index: int) -> np.ndarray:
    tile = store.grid.tile(index)
    shape = (len(store.channels), tile.height, tile.width)
    return np.random.default_rng(index).random(shape, dtype=np.float32)


def fill(store: Framebuffer | JournalFramebuffer, indices: range | None = None) -> None:
    for index in indices or range(store.grid.count):
        store.put(index, tile_content(store, index))


def whole(store: TiledStore) -> dict[str, np.ndarray]:
    bands = [band for _, band in store.bands()]
    return {name: np.concatenate([band[name] for band in bands]) for name in store.channels}


@pytest.mark.parametrize("region", [None, PART])
def test_both_stores_hold_the_same_picture(tmp_path: Path, region: Region | None) -> None:
    memory = Framebuffer(ALL, (150, 100), region)
    disk = JournalFramebuffer(tmp_path / "a.partial", IDENTITY, ALL, (150, 100), region)
    for store in (memory, disk):
        # Tile 5 is never rendered.
        fill(store, range(5))
        fill(store, range(6, store.grid.count))
        assert np.flatnonzero(~store.done).tolist() == [5]
    rows = [20, 32, 64] if region else [0, 32, 64, 96]
    assert [first for first, _ in memory.bands()] == [first for first, _ in disk.bands()] == rows
    for name, plane in whole(memory).items():
        assert np.array_equal(plane, memory[name])
        assert np.array_equal(plane, whole(disk)[name])
        assert np.array_equal(plane, in_memory(disk)[name])
    assert np.isinf(memory["Z"]).sum() == 32 * 32


def test_a_resumed_picture_is_the_same(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    first = JournalFramebuffer(path, IDENTITY, ALL, (150, 100))
    fill(first, range(7))
    first.close()
    second = JournalFramebuffer(path, IDENTITY, ALL, (150, 100), resume=True)
    assert np.flatnonzero(second.done).tolist() == list(range(7))
    fill(second, range(7, second.grid.count))
    straight = Framebuffer(ALL, (150, 100))
    fill(straight)
    for name in ALL:
        assert whole(second)[name].tobytes() == straight[name].tobytes()
    second.discard()
    assert not path.exists()


def test_another_size_region_or_scene_is_not_resumed(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    JournalFramebuffer(path, IDENTITY, ALL, (150, 100)).close()
    for identity, display, region, message in (
        (IDENTITY, (150, 101), None, r"the region was .*, the size was \[150, 100\] and is \[150, 101\]"),
        (IDENTITY, (150, 100), PART, r"the region was \[0, 0, 150, 100\] and is \[10, 20, 90, 70\]"),
        ({**IDENTITY, "scene": "def"}, (150, 100), None, 'the scene was "abc" and is "def"'),
    ):
        with pytest.raises(FileError, match=message):
            JournalFramebuffer(path, identity, ALL, display, region, resume=True)


@pytest.mark.parametrize("region", [None, PART])
def test_files_of_both_formats(tmp_path: Path, region: Region | None) -> None:
    framebuffer = Framebuffer(ALL, (150, 100), region, HEADER)
    fill(framebuffer)
    save_outputs(framebuffer, [tmp_path / "a.exr", tmp_path / "a.png"])
    planes, header = read_exr(tmp_path / "a.exr")
    assert set(planes) == set(ALL)
    for name in ALL:
        assert planes[name].dtype == (np.float16 if CHANNELS[name].precision == "half" else np.float32)
        assert np.array_equal(planes[name], framebuffer[name].astype(planes[name].dtype))
    wanted = {
        "displayWindow": (0, 0, 149, 99),
        "dataWindow": (10, 20, 99, 89) if region else (0, 0, 149, 99),
        "software": "clfractal 0.1.0",
        "clfractalDevice": "PoCL",
        "clfractalPrecision": "float32",
        "clfractalVersion": "0.1.0",
        "clfractalSeconds": 2.5,
        **{name: HEADER[name] for name in ("worldToCamera", "worldToNDC")},
    }
    np.testing.assert_equal({name: header[name] for name in wanted}, wanted)
    assert read_scene_text(tmp_path / "a.exr") == "version: 1\n"
    with Image.open(tmp_path / "a.png") as image:
        assert np.array_equal(np.asarray(image), framebuffer.to_rgb8())
    told = {"clfractal": "version: 1\n", "Software": "clfractal 0.1.0", "clfractalSeconds": "2.5"}
    assert read_texts(tmp_path / "a.png").items() >= told.items()
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a.exr", "a.png"]


def test_settings(tmp_path: Path) -> None:
    framebuffer = Framebuffer(("R", "G", "B", "A", "Z"), (40, 40))
    fill(framebuffer)
    framebuffer.save(tmp_path / "a.exr", half={"Z"}, header={"seconds": 1.0}, exposure=3)
    planes, header = read_exr(tmp_path / "a.exr")
    assert planes["Z"].dtype == np.float16
    assert np.array_equal(planes["R"], framebuffer["R"])
    assert header["clfractalSeconds"] == 1
    framebuffer.save(tmp_path / "a.png", exposure=-2)
    with Image.open(tmp_path / "a.png") as image:
        colors = np.stack([framebuffer[name] for name in "RGB"], axis=-1)
        assert np.array_equal(np.asarray(image), encode8(colors * np.float32(0.25)))
    framebuffer.save(tmp_path / "b.png", transparent=True, bits=16)
    with open(tmp_path / "b.png", "rb") as stream:
        # IHDR: width, height, then bits and colour type (6: RGB with alpha)
        assert stream.read(26)[16:] == bytes([0, 0, 0, 40, 0, 0, 0, 40, 16, 6])


def test_extreme_pixels_make_no_trouble(tmp_path: Path) -> None:
    framebuffer = Framebuffer(("R", "G", "B", "A", "Z"), (4, 4))
    framebuffer["R"][:] = 3e38
    framebuffer["G"][:] = np.inf
    framebuffer["A"][:2] = 1e-40
    for transparent in (False, True):
        framebuffer.save(tmp_path / "a.png", exposure=4, transparent=transparent)
    framebuffer.save(tmp_path / "a.exr")
    assert (read_exr(tmp_path / "a.exr")[0]["R"] == 65504).all()


def test_outputs_are_checked_before_anything_is_written(tmp_path: Path) -> None:
    framebuffer = Framebuffer(("R", "G", "B"), (4, 4))
    for bad, message in (("a.gif", "unknown extension '.gif'"), ("gone/a.exr", "there is no folder")):
        with pytest.raises(FileError, match=message):
            save_outputs(framebuffer, [tmp_path / "good.png", tmp_path / bad])
    assert not list(tmp_path.iterdir())
    check_output(tmp_path / "a.exr", Content(("Z",), (4, 4), False, None, 90))
    with pytest.raises(
        FileError, match=r"a\.png: a PNG needs the channels R, G, B; without G, B write an EXR"
    ):
        check_output(tmp_path / "a.png", Content(("R", "Z"), (4, 4), False, None, 90))


def test_full_disk_leaves_earlier_outputs(tmp_path: Path) -> None:
    framebuffer = Framebuffer(("R", "G", "B", "A", "Z"), (200, 200))
    fill(framebuffer)
    for name in ("a.exr", "a.png"):
        (tmp_path / name).write_bytes(b"old")
        with pytest.raises(FileError, match=f"{name}: cannot be written: "), file_size_limit(50_000):
            framebuffer.save(tmp_path / name)
        assert (tmp_path / name).read_bytes() == b"old"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a.exr", "a.png"]


MEMORY = """
import resource, sys
import numpy as np
from clfractal.images.framebuffer import Framebuffer, in_memory
from clfractal.images.outputs import save_outputs
from clfractal.images.store import JournalFramebuffer

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

outputs = [sys.argv[1] + "/a.png", sys.argv[1] + "/a.exr"]
save_outputs(Framebuffer(display=(64, 64)), outputs)
before = peak()
framebuffer = JournalFramebuffer(sys.argv[1] + "/a.partial", {}, display=(4096, 2048))
tile = np.random.default_rng(0).random((5, 32, 32), dtype=np.float32)
for index in range(framebuffer.grid.count):
    framebuffer.put(index, tile)
save_outputs(framebuffer, outputs)
print(peak() - before)
"""


def test_memory_does_not_grow_with_the_height(tmp_path: Path) -> None:
    # 4096 x 2048 x 5 channels are 160 MB; a small picture first takes what the libraries need once.
    run = subprocess.run(
        [sys.executable, "-c", MEMORY, str(tmp_path)], capture_output=True, text=True, check=True
    )
    assert float(run.stdout) < 80
