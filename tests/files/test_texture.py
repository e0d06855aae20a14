"""Pictures that surfaces show: colours as they were written, and one line for what is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clfractal.errors import FileError
from clfractal.files.exr import write_exr
from clfractal.files.srgb import decode
from clfractal.files.texture import MAX_SIDE, read_texture

CODES = np.random.default_rng(2).integers(0, 256, (3, 5, 3), dtype=np.uint8)


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.tiff", "no_extension"])
def test_codes_become_linear_light(tmp_path: Path, name: str) -> None:
    Image.fromarray(CODES).save(tmp_path / name, format=None if "." in name else "PNG")
    found = read_texture(tmp_path / name)
    assert found.has_codes
    assert np.allclose(found.pixels, decode(CODES / 255), atol=1e-6)


def test_sixteen_bits_keep_theirs(tmp_path: Path) -> None:
    codes = np.array([[0, 1000, 65_535]], np.uint16)
    Image.fromarray(codes).save(tmp_path / "a.png")
    pixels = read_texture(tmp_path / "a.png").pixels
    assert np.allclose(pixels[..., 1], decode(codes / 65_535), atol=1e-6)


def test_transparency_is_of_no_account(tmp_path: Path) -> None:
    Image.fromarray(np.dstack([CODES, np.zeros((3, 5), np.uint8)])).save(tmp_path / "a.png")
    assert np.allclose(read_texture(tmp_path / "a.png").pixels, decode(CODES / 255), atol=1e-6)


def test_openexr_is_linear(tmp_path: Path) -> None:
    light = np.random.default_rng(3).random((3, 2, 4), np.float32) * 3
    light[0, 0, 0] = -1
    band = dict(zip("RGB", light, strict=True))
    write_exr(tmp_path / "a.exr", [band], display=(4, 2), region=(0, 0, 4, 2), channels=tuple("RGB"), half=())
    found = read_texture(tmp_path / "a.exr")
    assert not found.has_codes
    assert np.array_equal(found.pixels, np.maximum(np.moveaxis(light, 0, -1), 0))


def test_what_is_no_picture_is_told(tmp_path: Path) -> None:
    Image.fromarray(CODES).save(tmp_path / "a.png")
    (tmp_path / "cut.png").write_bytes((tmp_path / "a.png").read_bytes()[:60])
    (tmp_path / "text.png").write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 4 4\n")
    for name, message in (("cut.png", "is damaged: its pixels"), ("text.png", "is not an EXR, HDR")):
        with pytest.raises(FileError, match=message):
            read_texture(tmp_path / name)
    Image.new("L", (MAX_SIDE + 1, 1)).save(tmp_path / "wide.png")
    with pytest.raises(FileError, match="at most 4,096 pixels wide and high, got 4,097 x 1"):
        read_texture(tmp_path / "wide.png")
    with pytest.raises(FileError, match="is a folder"):
        read_texture(tmp_path)
