"""The header reader meets damaged files of every kind: one line each, and never a crash."""

from __future__ import annotations

import random
import struct
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from clfractal.errors import FileError
from clfractal.files.exr import write_exr
from clfractal.files.exr_header import MAGIC, read_header, read_scene_text
from tests.files.limits import rewrite

SCENE = "version: 1\nformula: {name: hast}\n# Grüße\n"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A file of ours with several chunks."""
    path = tmp_path_factory.mktemp("exr") / "a.exr"
    source = np.random.default_rng(1)
    band = {name: source.random((50, 9), dtype=np.float32) for name in "RZ"}
    header = {"clfractal": SCENE, "worldToCamera": np.eye(4)}
    write_exr(path, [band], display=(9, 50), region=(0, 0, 9, 50), channels="RZ", half="R", header=header)
    return path.read_bytes()


def refusal(path: Path, content: bytes) -> str:
    rewrite(path, content)
    with pytest.raises(FileError) as caught:
        read_scene_text(path)
    assert caught.value.where.file == str(path)
    assert "\n" not in str(caught.value)
    return caught.value.message


def test_scene_comes_back(tmp_path: Path, whole: bytes) -> None:
    (tmp_path / "a.exr").write_bytes(whole)
    assert read_scene_text(tmp_path / "a.exr") == SCENE
    values = read_header(tmp_path / "a.exr").values()
    assert values["dataWindow"] == (0, 0, 8, 49)
    assert values["screenWindowCenter"] == (0, 0)
    assert values["pixelAspectRatio"] == 1


def test_every_truncation_is_refused(tmp_path: Path, whole: bytes) -> None:
    for length in range(len(whole)):
        message = refusal(tmp_path / "a.exr", whole[:length])
        assert "cut short" in message or (length < 4 and message == "is not an OpenEXR file"), length


def test_random_damage_never_breaks_the_reader(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "a.exr"
    (tmp_path / "b.exr").write_bytes(whole)
    end = read_header(tmp_path / "b.exr").end + 8 * 4
    source = random.Random(2)
    refused, lines = 0, set[int]()
    for _ in range(2000):
        damaged = bytearray(whole)
        for _ in range(source.randint(1, 3)):
            damaged[source.randrange(end)] = source.randrange(256)
        rewrite(path, bytes(damaged))
        try:
            read_scene_text(path)
        except FileError as error:
            refused += 1
            lines |= {str(error).count("\n")}
    assert refused > 500
    assert lines == {0}


def test_foreign_pictures_have_no_scene(tmp_path: Path) -> None:
    pixels = {"Z": np.zeros((40, 40), np.float32)}
    tiled = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    for compression in (OpenEXR.NO_COMPRESSION, OpenEXR.PIZ_COMPRESSION, OpenEXR.RLE_COMPRESSION):
        for kind in ({"type": OpenEXR.scanlineimage}, tiled):
            with OpenEXR.File({**kind, "compression": compression}, pixels) as file:
                file.write(str(tmp_path / "a.exr"))
            assert read_scene_text(tmp_path / "a.exr") is None


def test_a_scene_of_another_type_is_none(tmp_path: Path, whole: bytes) -> None:
    old = b"clfractal\0string\0"
    assert old in whole
    (tmp_path / "a.exr").write_bytes(whole.replace(old, b"clfractal\0strinG\0"))
    assert read_scene_text(tmp_path / "a.exr") is None


def attribute(name: bytes, kind: bytes, data: bytes, length: int | None = None) -> bytes:
    size = len(data) if length is None else length
    return name + b"\0" + kind + b"\0" + struct.pack("<i", size) + data


def test_hostile_headers(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    start = MAGIC + struct.pack("<I", 2)
    assert refusal(path, b"v/1\x02" + bytes(100)) == "is not an OpenEXR file"
    assert refusal(path, MAGIC + struct.pack("<I", 3)).startswith("is an OpenEXR file of version 3")
    assert refusal(path, start + b"n" * 1000) == "is damaged: an endless name"
    for length in (-1, 2**31 - 1):
        assert refusal(path, start + attribute(b"a", b"string", b"", length)).startswith("is damaged")
    many = b"".join(attribute(b"%d" % index, b"int", b"1234") for index in range(2000))
    assert refusal(path, start + many + b"\0").startswith("is damaged")
    assert refusal(path, start + b"\0").startswith("is damaged: its header lacks")


def picture(box: tuple[int, int, int, int], compression: int, channels: bytes) -> bytes:
    return (
        MAGIC
        + struct.pack("<I", 2)
        + attribute(b"channels", b"chlist", channels)
        + attribute(b"compression", b"compression", bytes([compression]))
        + attribute(b"dataWindow", b"box2i", struct.pack("<4i", *box))
        + b"\0"
        + bytes(1000)
    )


def test_impossible_pictures(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    one = b"Z\0" + struct.pack("<iIii", 2, 0, 1, 1) + b"\0"
    huge = 2**31 - 1
    for box, compression, channels in (
        ((0, 0, huge, huge), 3, one),
        ((0, 0, huge, huge), 4, one),
        ((-huge, -huge, huge, huge), 0, one),
        ((5, 5, 4, 4), 3, one),
        ((0, 0, 9, 9), 77, one),
        ((0, 0, 9, 9), 3, b""),
        ((0, 0, 9, 9), 3, b"\0"),
        ((0, 0, 9, 9), 3, b"Z\0"),
        ((0, 0, 9, 9), 3, b"Z\0" + struct.pack("<iIii", 9, 0, 1, 1) + b"\0"),
        ((0, 0, 9, 9), 3, b"Z\0" + struct.pack("<iIii", 2, 0, 0, 1) + b"\0"),
        ((0, 0, 9, 9), 3, one),  # a table of zeros: never finished
    ):
        message = refusal(path, picture(box, compression, channels))
        assert message.startswith(("is damaged", "is cut short")), (box, compression)
