"""PNG files, read back with Pillow and pypng."""

from __future__ import annotations

import io
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import png
import pytest
from PIL import Image

from clfractal.errors import FileError
from clfractal.files.png import read_scene_text, read_texts, write_png
from clfractal.files.srgb import encode8, encode16

SCENE = "version: 1\nformula: {name: hast}\n# Grüße, 分形\n"


def linear(height: int, width: int, components: int = 3, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).random((height, width, components), dtype=np.float32)


def bands(pixels: np.ndarray, rows: int = 32) -> Iterator[np.ndarray]:
    for first in range(0, len(pixels), rows):
        yield pixels[first : first + rows]


def write(path: Path, pixels: np.ndarray, **settings: object) -> None:
    height, width, components = pixels.shape
    write_png(path, bands(pixels), width=width, height=height, alpha=components == 4, **settings)  # type: ignore[arg-type]


def read16(path: Path) -> np.ndarray:
    width, height, rows, info = png.Reader(filename=str(path)).asDirect()
    assert info["bitdepth"] == 16
    return np.array([np.array(row) for row in rows]).reshape(height, width, info["planes"])


def test_8_bits_hold_the_srgb_codes(tmp_path: Path) -> None:
    pixels = linear(70, 45)
    write(tmp_path / "a.png", pixels)
    with Image.open(tmp_path / "a.png") as image:
        assert image.mode == "RGB"
        assert image.info["srgb"] == 0
        assert np.array_equal(np.asarray(image), encode8(pixels))


def test_16_bits_hold_the_srgb_codes(tmp_path: Path) -> None:
    pixels = linear(70, 45)
    write(tmp_path / "a.png", pixels, bits=16)
    assert np.array_equal(read16(tmp_path / "a.png"), encode16(pixels))


@pytest.mark.parametrize("bits", [8, 16])
def test_alpha_is_coverage_and_colours_are_straight(tmp_path: Path, bits: int) -> None:
    # Straight colours that 8 bits hold exactly, premultiplied by coverages from 0 to 1.
    pixels = np.zeros((40, 33, 4), dtype=np.float32)
    pixels[..., 3] = np.linspace(0, 1, 33)
    pixels[..., :3] = pixels[..., 3:] * np.array(
        [0, 1, 0.21404114], dtype=np.float32
    )  # the last is code 127.5 of 255
    write(tmp_path / "a.png", pixels, bits=bits)
    largest = (1 << bits) - 1
    if bits == 8:
        with Image.open(tmp_path / "a.png") as image:
            codes = np.asarray(image).astype(int)
    else:
        codes = read16(tmp_path / "a.png").astype(int)
    assert codes.shape == (40, 33, 4)
    assert np.array_equal(codes[..., 3], np.broadcast_to(np.rint(np.linspace(0, 1, 33) * largest), (40, 33)))
    assert not codes[:, 0, :3].any()
    assert (codes[:, 1:, 0] == 0).all()
    assert (codes[:, 1:, 1] == largest).all()
    assert np.abs(codes[:, 1:, 2] - 0.5 * largest).max() <= 1


def test_text_survives(tmp_path: Path) -> None:
    write(tmp_path / "a.png", linear(4, 4), texts={"clfractal": SCENE, "Software": "clfractal 1"})
    assert read_scene_text(tmp_path / "a.png") == SCENE
    assert read_texts(tmp_path / "a.png") == {"clfractal": SCENE, "Software": "clfractal 1"}
    with Image.open(tmp_path / "a.png") as image:
        image.load()
        assert image.info["clfractal"] == SCENE


def test_foreign_pictures_have_no_scene(tmp_path: Path) -> None:
    Image.new("L", (3, 3)).save(tmp_path / "a.png")
    assert read_scene_text(tmp_path / "a.png") is None


def test_the_same_picture_gives_the_same_bytes(tmp_path: Path) -> None:
    pixels = linear(70, 45)
    write_png(tmp_path / "a.png", bands(pixels, 32), width=45, height=70)
    write_png(tmp_path / "b.png", bands(pixels, 7), width=45, height=70)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize("size", [(1, 1), (1, 50), (50, 1), (33, 31)])
def test_odd_sizes(tmp_path: Path, size: tuple[int, int]) -> None:
    pixels = linear(*size)
    write(tmp_path / "a.png", pixels)
    with Image.open(tmp_path / "a.png") as image:
        assert np.array_equal(np.asarray(image), encode8(pixels))


def test_a_text_of_gigabytes_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    write(path, linear(4, 4))
    whole = path.read_bytes()
    with open(path, "wb") as stream:
        stream.write(whole[:33] + (2 << 30).to_bytes(4, "big") + b"iTXt")
        stream.truncate(3 << 30)  # a sparse file
    with pytest.raises(FileError, match="is damaged: a text of 2,147,483,648 bytes"):
        read_scene_text(path)


def test_a_compressed_or_malformed_text_is_passed_over(tmp_path: Path) -> None:
    write(tmp_path / "a.png", linear(4, 4))
    whole = (tmp_path / "a.png").read_bytes()
    for content in (
        b"clfractal\0\1\0\0\0" + zlib.compress(b"a: 1"),
        b"clfractal\0\0\0",
        b"clfractal\0\0\0\0\0\xff",
    ):
        stream = io.BytesIO()
        png.write_chunk(stream, b"iTXt", content)
        (tmp_path / "b.png").write_bytes(whole[:33] + stream.getvalue() + whole[33:])
        assert read_scene_text(tmp_path / "b.png") is None


def test_missing_rows_are_noticed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="rows"):
        write_png(tmp_path / "a.png", bands(linear(8, 8)), width=8, height=9)
    assert not list(tmp_path.iterdir())
