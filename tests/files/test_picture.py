"""Pictures of codes that scenes name: the light that their codes stand for, and one line for what is none."""

from __future__ import annotations

import io
import random
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import png
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image, ImageCms

from clfractal.errors import FileError
from clfractal.files.atomic import ContentError
from clfractal.files.environment_map import read_environment
from clfractal.files.photo import write_photo
from clfractal.files.picture import Picture, read_picture
from clfractal.files.png import write_png
from clfractal.files.texture import read_texture

SHAPES = st.tuples(st.integers(1, 9), st.integers(1, 9))


def light(codes: Any) -> Any:
    """IEC 61966-2-1, of codes from 0 to 1."""
    codes = np.asarray(codes, np.float64)
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def read(data: bytes, folder: Path, name: str = "a.png") -> Picture:
    (folder / name).write_bytes(data)
    return read_picture(folder / name, lambda _width, _height: None, 1e9)


def encoded(codes: Any, kind: str, **more: Any) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(codes).save(stream, kind, **more)
    return stream.getvalue()


def deep(codes: Any, **more: Any) -> bytes:
    """A PNG of 16 bits, shape (height, width, components)."""
    height, width, components = codes.shape
    stream = io.BytesIO()
    kind = {"greyscale": components < 3, "alpha": components in (2, 4), "bitdepth": 16, **more}
    png.Writer(width=width, height=height, **kind).write(stream, codes.reshape(height, -1).tolist())
    return stream.getvalue()


class TestCodes:
    @given(data=st.data(), kind=st.sampled_from(["PNG", "WEBP", "BMP", "TIFF"]))
    @settings(max_examples=60, deadline=None)
    def test_eight_bits_without_loss(self, data: st.DataObject, kind: str, tmp_path_factory: Any) -> None:
        shape = (*data.draw(SHAPES), 3)
        codes = data.draw(arrays(np.uint8, shape))
        found = read(
            encoded(codes, kind, **({"lossless": True} if kind == "WEBP" else {})),
            tmp_path_factory.getbasetemp(),
        )
        assert found.has_codes
        assert found.coverage is None
        np.testing.assert_allclose(found.pixels, light(codes / 255), rtol=1e-6)

    @given(data=st.data(), components=st.sampled_from([1, 3, 4]), interlaced=st.booleans())
    @settings(max_examples=60, deadline=None)
    def test_sixteen_bits_without_loss(
        self, data: st.DataObject, components: int, interlaced: bool, tmp_path_factory: Any
    ) -> None:
        shape = (*data.draw(SHAPES), components)
        codes = data.draw(arrays(np.uint16, shape))
        found = read(deep(codes, interlace=interlaced), tmp_path_factory.getbasetemp())
        colors = np.broadcast_to(codes[..., :3], (*shape[:2], 3))
        np.testing.assert_allclose(found.pixels, light(colors / 65535), rtol=1e-6)
        if components == 4:
            assert found.coverage is not None
            np.testing.assert_allclose(found.coverage, codes[..., 3] / 65535, rtol=1e-6)

    def test_our_own_files_come_back(self, tmp_path: Path) -> None:
        band = np.random.default_rng(1).random((5, 7, 3)).astype(np.float32)
        write_png(tmp_path / "a.png", [band], width=7, height=5, bits=16)
        np.testing.assert_allclose(read_texture(tmp_path / "a.png").pixels, band, atol=2e-5)
        write_photo(tmp_path / "a.webp", [band], format="WEBP", width=7, height=5, quality=100)
        # (They are dithered: one code up or down.)
        assert np.abs(read_texture(tmp_path / "a.webp").pixels - band).max() < 0.01

    def test_jpeg(self, tmp_path: Path) -> None:
        codes = np.full((8, 16, 3), (200, 60, 90), np.uint8)
        found = read(encoded(codes, "JPEG", quality=95), tmp_path)
        assert np.abs(found.pixels - light(codes / 255)).max() < 0.02

    def test_grey_and_palettes(self, tmp_path: Path) -> None:
        grey = np.array([[0, 80, 255]], np.uint8)
        np.testing.assert_allclose(
            read(encoded(grey, "PNG"), tmp_path).pixels[..., 2], light(grey / 255), rtol=1e-6
        )
        stream = io.BytesIO()
        picture = Image.fromarray(np.array([[0, 1]], np.uint8), "P")
        picture.putpalette([255, 0, 0, 10, 20, 30])
        picture.save(stream, "PNG")
        expected = light(np.array([[255, 0, 0], [10, 20, 30]]) / 255)
        np.testing.assert_allclose(read(stream.getvalue(), tmp_path).pixels[0], expected, rtol=1e-6)

    def test_what_is_transparent_brings_no_light(self, tmp_path: Path) -> None:
        codes = np.full((2, 4, 4), 255, np.uint8)
        codes[0, :, 3] = 0, 51, 102, 255
        (tmp_path / "a.png").write_bytes(encoded(codes, "PNG"))
        found = read_environment(tmp_path / "a.png")
        np.testing.assert_allclose(found[0, :, 1], [0, 0.2, 0.4, 1], rtol=1e-6)
        assert (read_texture(tmp_path / "a.png").pixels == 1).all()

    @pytest.mark.parametrize("kind", ["JPEG", "PNG", "WEBP", "TIFF"])
    @pytest.mark.parametrize("orientation", range(1, 9))
    def test_cameras_that_were_turned(self, kind: str, orientation: int, tmp_path: Path) -> None:
        """Exif 2.32, 4.6.4.A: what side of the scene the first row and the first column of a file are."""
        seen = np.kron(np.array([[0, 90], [160, 250]], np.uint8), np.ones((16, 32), np.uint8))
        stored = {
            1: seen,
            2: seen[:, ::-1],
            3: seen[::-1, ::-1],
            4: seen[::-1],
            5: seen.T,
            6: seen.T[::-1],
            7: seen.T[::-1, ::-1],
            8: seen.T[:, ::-1],
        }[orientation]
        exif = Image.Exif()
        exif[0x0112] = orientation
        more: dict[str, Any] = {"lossless": True} if kind == "WEBP" else {}
        colors = np.repeat(stored[..., None], 3, axis=-1)
        (tmp_path / "a").write_bytes(encoded(np.ascontiguousarray(colors), kind, exif=exif, **more))
        found = read_environment(tmp_path / "a")  # which is twice as wide as high once it is upright
        assert np.abs(found[..., 0] - light(seen / 255)).max() < 0.03

    def test_colours_of_another_profile(self, tmp_path: Path) -> None:
        """A profile whose red is sRGB's green, and the other way around."""
        profile = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
        tags = {}
        for number in range(struct.unpack_from(">I", profile, 128)[0]):
            tag, place, size = struct.unpack_from(">4sII", profile, 132 + 12 * number)
            tags[tag] = slice(place, place + size)
        red, green = bytes(profile[tags[b"rXYZ"]]), bytes(profile[tags[b"gXYZ"]])
        profile[tags[b"rXYZ"]], profile[tags[b"gXYZ"]] = green, red
        codes = np.array([[[255, 0, 0], [0, 180, 20]]], np.uint8)
        same = encoded(codes, "PNG", icc_profile=bytes(profile))
        # (A profile that calls itself sRGB is taken for it.)
        np.testing.assert_allclose(read(same, tmp_path).pixels, light(codes / 255), rtol=1e-6)
        other = bytes(profile).replace("sRGB".encode("utf-16-be"), "mine".encode("utf-16-be"))
        for kind in ("PNG", "TIFF"):
            found = read(encoded(codes, kind, icc_profile=other), tmp_path)
            assert np.abs(found.pixels - light(codes[..., [1, 0, 2]] / 255)).max() < 0.02, kind
        damaged = read(encoded(codes, "PNG", icc_profile=b"no profile at all"), tmp_path)
        np.testing.assert_allclose(damaged.pixels, light(codes / 255), rtol=1e-6)


def header(width: int, height: int) -> bytes:
    """A PNG that promises a size, and holds hardly anything."""

    def chunk(tag: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))

    start = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", start)
        + chunk(b"IDAT", zlib.compress(bytes(99)))
        + chunk(b"IEND", b"")
    )


class TestHostile:
    @pytest.mark.parametrize(
        ("size", "message"),
        [
            (
                (2_000_000, 1_000_000),
                "is too large: its header says so many pixels as only harmful files have",
            ),
            ((17_000, 8_500), "is too large: 17,000 pixels wide, at most 16,384"),
            (
                (9, 4),
                "must be twice as wide as high, as latitude-longitude maps are, got 9 x 4 pixels; stretch: true",
            ),
            ((8, 4), "is damaged: its pixels cannot be read"),
        ],
    )
    def test_headers_that_promise_too_much(self, size: tuple[int, int], message: str, tmp_path: Path) -> None:
        path = tmp_path / "a.png"
        path.write_bytes(header(*size) if size != (8, 4) else header(*size)[:-20])
        with pytest.raises(FileError) as caught:
            read_environment(path)
        assert str(caught.value).startswith(f"{path}: {message}")
        assert "\n" not in str(caught.value)

    @pytest.mark.parametrize("size", [(3, 17_000), (17_000, 3)])
    def test_stretched_ones_have_limits_too(self, size: tuple[int, int], tmp_path: Path) -> None:
        (tmp_path / "a.png").write_bytes(header(*size))
        with pytest.raises(FileError, match="is too large: 17,000 pixels"):
            read_environment(tmp_path / "a.png", stretch=True)

    def test_any_shape_is_stretched(self, tmp_path: Path) -> None:
        codes = np.random.default_rng(1).integers(0, 256, (5, 3, 3), dtype=np.uint8)
        (tmp_path / "a.png").write_bytes(encoded(codes, "PNG"))
        found = read_environment(tmp_path / "a.png", stretch=True)
        np.testing.assert_allclose(found, light(codes / 255), rtol=1e-6)

    def test_numbers_are_no_codes(self, tmp_path: Path) -> None:
        with pytest.raises(FileError, match="has numbers in the place of codes"):
            read(encoded(np.zeros((2, 4), np.float32), "TIFF"), tmp_path)

    @pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP", "TIFF", "BMP"])
    def test_cut_short_and_damaged(self, kind: str, tmp_path: Path) -> None:
        whole = encoded(np.random.default_rng(1).integers(0, 256, (16, 32, 3), dtype=np.uint8), kind)
        chance, refused = random.Random(3), 0
        for turn in range(300):
            data = bytearray(whole)
            if turn % 3:
                for _ in range(chance.randint(1, 4)):
                    data[chance.randrange(len(data))] = chance.randrange(256)
            else:
                data = data[: chance.randrange(len(data))]
            path = tmp_path / "a"
            path.write_bytes(data)
            try:
                found = read_environment(path, stretch=True)
            except FileError as error:
                line = str(error)
            else:
                line = ""
                assert 0 <= found.min() <= found.max() <= 1
            refused += bool(line)
            assert "\n" not in line
            assert not line or line.startswith(f"{path}: ")
        assert refused > 80

    def test_the_size_is_asked_before_pixels_are_read(self, tmp_path: Path) -> None:
        def refuse(width: int, height: int) -> None:
            raise ContentError(f"is {width} x {height}")

        exif = Image.Exif()
        exif[0x0112] = 6
        for data, size in (
            (header(6, 3)[:60], "6 x 3"),
            (encoded(np.zeros((6, 4, 3), np.uint8), "JPEG", exif=exif), "6 x 4"),
        ):
            (tmp_path / "a").write_bytes(data)
            with pytest.raises(FileError, match=f"is {size}"):
                read_picture(tmp_path / "a", refuse, 1.0)
