"""Files of every kind: cut short or damaged they are told in a line each, and a full disk leaves what was there."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from clfractal.errors import FileError
from clfractal.files import exr_header, photo, png
from clfractal.files.environment_map import read_environment
from clfractal.files.exr import write_exr
from clfractal.files.mesh import Mesh, write_mesh
from clfractal.files.photo import Format, write_photo
from clfractal.files.png import write_png
from clfractal.files.volume_file import Volume, read_volume, write_volume
from clfractal.files.whole import is_whole
from tests.files.limits import file_size_limit, rewrite

SCENE = "version: 1\nformula: {name: hast}\n# Grüße\n"
TEXTS = {"clfractal": SCENE}
SIZE: dict[str, Any] = {"width": 80, "height": 40}
PIXELS = np.random.default_rng(1).random((40, 80, 3), np.float32)
PLANES = {name: np.ascontiguousarray(PIXELS[..., place]) for place, name in enumerate("RGB")}
VOLUME = Volume(np.random.default_rng(2).normal(size=(8, 9, 10)), texts={"clfractal": "a\nb"})
MESH = Mesh(np.random.default_rng(3).random((300, 3)), np.arange(300, dtype=np.int32).reshape(100, 3))


def as_rows(path: Path) -> None:
    write_exr(path, [PLANES], display=(80, 40), region=(0, 0, 80, 40), channels="RGB", half="", header=TEXTS)


def as_tiles(path: Path) -> None:
    # (The library puts its own objects into the dictionary.)
    with OpenEXR.File({"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}, dict(PLANES)) as file:
        file.write(str(path))


def as_photo(path: Path) -> None:
    kinds: dict[str, Format] = {".jpg": "JPEG", ".webp": "WEBP"}
    write_photo(path, [PIXELS], format=kinds[path.suffix], quality=90, alpha=False, texts=TEXTS, **SIZE)


def as_volume(path: Path) -> None:
    write_volume(path, VOLUME, compress=path.stem == "packed")


Write = Callable[[Path], None]
Read = Callable[[Path], Any]
READ: dict[str, tuple[Write, Read]] = {
    "a.exr": (as_rows, exr_header.read_scene_text),
    "map.exr": (as_rows, read_environment),
    "tiles.exr": (as_tiles, read_environment),
    "a.png": (lambda path: write_png(path, [PIXELS], texts=TEXTS, **SIZE), png.read_scene_text),
    "a.jpg": (as_photo, photo.read_scene_text),
    "a.webp": (as_photo, photo.read_scene_text),
    "a.nrrd": (as_volume, read_volume),
    "packed.nrrd": (as_volume, read_volume),
    "a.npy": (as_volume, read_volume),
}
# Pictures with a text: how many bytes of heads and texts are damaged, and how many of 1000 damages are seen.
PICTURES = {"a.exr": (440, 500), "a.png": (200, 500), "a.jpg": (300, 40), "a.webp": (300, 100)}
WRITTEN: dict[str, Write] = {name: write for name, (write, _) in READ.items() if write is not as_tiles} | {
    f"m{suffix}": lambda path: write_mesh(path, MESH) for suffix in (".ply", ".stl", ".obj", ".glb")
}


def told(path: Path, read: Read) -> str:
    """The line by which a file is refused, without its name and place; none if it is read."""
    try:
        read(path)
    except FileError as error:
        line, status = str(error), error.status
    else:
        return ""
    assert "\n" not in line
    assert line.startswith(f"{path}:")
    assert status == 2
    return line.removeprefix(f"{path}:").partition(" ")[2]


@pytest.mark.parametrize("name", READ)
def test_cut_short_anywhere(name: str, tmp_path: Path) -> None:
    """At every byte of the first ones, and at hundreds of places behind them; nor is a picture taken for a whole one."""
    path, (write, read) = tmp_path / name, READ[name]
    write(path)
    whole = path.read_bytes()
    assert told(path, read) == ""
    assert name not in PICTURES or is_whole(path)
    lengths = {*range(min(500, len(whole))), *range(0, len(whole), len(whole) // 200)}
    for length in lengths | {len(whole) - last for last in (1, 2, 3)}:
        rewrite(path, whole[:length])
        message = told(path, read)
        # (A photo may end with bytes that nothing needs.)
        assert message or (write is as_photo and length > len(whole) - 3), length
        if name in ("a.exr", "map.exr", "a.png"):
            # The first bytes tell what it is.
            said = "is cut short: " if length >= 8 else ("is cut short: ", "is not a")
            assert message.startswith(said), length
        assert name not in PICTURES or not is_whole(path), length
    path.unlink()
    assert told(path, read) == "cannot be read: No such file or directory"
    assert not is_whole(path)


@pytest.mark.parametrize("name", PICTURES)
def test_random_damage_never_breaks_a_reader(name: str, tmp_path: Path) -> None:
    """Of heads and texts; the check sums of a PNG tell of each change of its text."""
    path, (write, read) = tmp_path / name, READ[name]
    write(path)
    whole, (head, least) = path.read_bytes(), PICTURES[name]
    chance, refused = random.Random(2), 0
    for _ in range(1000):
        damaged = bytearray(whole)
        for _ in range(chance.randint(1, 3)):
            damaged[chance.randrange(head)] = chance.randrange(256)
        rewrite(path, bytes(damaged))
        if told(path, read):
            refused += 1
        elif name == "a.png":
            assert read(path) in (SCENE, None)
    assert refused > least


@pytest.mark.parametrize("name", WRITTEN)
def test_a_full_disk_leaves_the_earlier_file(name: str, tmp_path: Path) -> None:
    """Whether its head, its data or its last bytes find no room."""
    path = tmp_path / name
    WRITTEN[name](path)
    before = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    size = path.stat().st_size
    # (Beside an NPY there is a second file.)
    for limit in (100, 600, size // 2, size - 1):
        message = rf"{name}(\.json)?: cannot be written: "
        with pytest.raises(FileError, match=message) as caught, file_size_limit(limit):
            WRITTEN[name](path)
        assert ".tmp" not in str(caught.value)
        assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == before
