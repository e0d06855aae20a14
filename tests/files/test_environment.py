"""Environment maps: read whatever way they are stored, and refused with one line when they are none."""

from __future__ import annotations

import struct
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.errors import FileError
from clfractal.files.environment_map import BRIGHTEST, read_environment
from clfractal.files.exr import write_exr
from tests.calls import failure

Pixels = npt.NDArray[Any]

SMALL = np.random.default_rng(5).random((6, 12, 3)).astype(np.float16)
# Red, green, blue, white: ITU-R BT.2020-2 and SMPTE ST 2065-1 (AP0).
REC2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
AP0 = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)


def planes(pixels: Pixels, names: str = "RGB") -> dict[str, Pixels]:
    return {name: np.ascontiguousarray(pixels[..., place]) for place, name in enumerate(names)}


def write(path: Path, channels: dict[str, Pixels], **header: Any) -> Path:
    """A file of the library's own making."""
    full = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION, **header}
    with OpenEXR.File(full, channels) as file:
        file.write(str(path))
    return path


def with_primaries(path: Path, pixels: Pixels, chromaticities: tuple[float, ...]) -> Path:
    """A file that names its primaries; the library cannot write them."""
    height, width, _ = pixels.shape
    band = {name: plane.astype(np.float32) for name, plane in planes(pixels).items()}
    write_exr(path, [band], display=(width, height), region=(0, 0, width, height), channels="RGB", half="")
    content = path.read_bytes()
    name = b"chromaticities\0chromaticities\0" + struct.pack("<i", 32)
    start = content.index(name) + len(name)
    path.write_bytes(content[:start] + struct.pack("<8f", *chromaticities) + content[start + 32 :])
    return path


def refusal(path: Path) -> str:
    """The one line that a file is refused with, after its name."""
    text = str(failure(FileError, read_environment, path))
    assert text.startswith(f"{path}: ")
    return text.removeprefix(f"{path}: ")


@pytest.mark.parametrize("compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ"])
@pytest.mark.parametrize("tiled", [False, True])
def test_pixels_come_back_however_they_are_stored(tmp_path: Path, compression: str, tiled: bool) -> None:
    header = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()} if tiled else {}
    kind = getattr(OpenEXR, f"{compression}_COMPRESSION")
    path = write(tmp_path / "a.exr", planes(SMALL), compression=kind, **header)
    found = read_environment(path)
    assert found.dtype == np.float32
    assert found.flags.c_contiguous
    assert np.array_equal(found, SMALL.astype(np.float32))


def test_floats_and_further_channels(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).random((4, 8, 5)).astype(np.float32) * 1e5
    found = read_environment(write(tmp_path / "a.exr", planes(pixels, "ARGBZ")))
    assert np.array_equal(found, pixels[..., 1:4])


def test_grey_light(tmp_path: Path) -> None:
    found = read_environment(write(tmp_path / "a.exr", {"Y": SMALL[..., 0].copy()}))
    assert np.array_equal(found, np.repeat(SMALL[..., :1], 3, axis=-1).astype(np.float32))


def test_all_black_is_an_environment(tmp_path: Path) -> None:
    assert not read_environment(write(tmp_path / "a.exr", planes(SMALL * np.float16(0)))).any()


def test_negative_light_is_none(tmp_path: Path) -> None:
    pixels = SMALL.astype(np.float32)
    pixels[2, 3] = (-0.01, 0.5, -1e20)
    found = read_environment(write(tmp_path / "a.exr", planes(pixels)))
    assert found[2, 3].tolist() == [0.0, 0.5, 0.0]
    assert found.min() == 0


def test_other_primaries_are_turned_into_rec_709(tmp_path: Path) -> None:
    """Report ITU-R BT.2407-0, annex 2: the matrix from BT.2020 to BT.709."""
    colors = np.array([[0.2, 0.5, 0.3], [0.5, 0.5, 0.5]], np.float32).reshape(1, 2, 3)
    found = read_environment(with_primaries(tmp_path / "a.exr", colors, REC2020))
    matrix = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]
    expected = np.maximum(colors @ np.array(matrix).T, 0)
    np.testing.assert_allclose(found, expected, atol=2e-4)


def test_white_stays_white(tmp_path: Path) -> None:
    found = read_environment(with_primaries(tmp_path / "a.exr", np.full((2, 4, 3), 0.7, np.float32), AP0))
    np.testing.assert_allclose(found, 0.7, rtol=1e-5)


@pytest.mark.parametrize(
    "chromaticities", [(0.0,) * 8, (np.nan,) * 8, (0.3, 0.3) * 4, (*REC2020[:6], 0.3, -0.1), (1e30,) * 8]
)
def test_primaries_that_are_none_are_ignored(tmp_path: Path, chromaticities: tuple[float, ...]) -> None:
    found = read_environment(with_primaries(tmp_path / "a.exr", SMALL, chromaticities))
    assert np.array_equal(found, SMALL.astype(np.float32))


@pytest.mark.parametrize("shape", [(6, 11), (6, 13), (12, 6), (1, 1)])
def test_the_shape(tmp_path: Path, shape: tuple[int, int]) -> None:
    path = write(tmp_path / "a.exr", {name: np.zeros(shape, np.float16) for name in "RGB"})
    size = f"{shape[1]} x {shape[0]} pixels"
    assert (
        refusal(path)
        == f"must be twice as wide as high, as latitude-longitude maps are, got {size}; stretch: true takes any shape"
    )


@pytest.mark.parametrize("region", [(0, 0, 8, 4), (4, 2, 16, 8)])
def test_a_part_of_a_map_is_none(tmp_path: Path, region: tuple[int, int, int, int]) -> None:
    """A render with --region is twice as wide as high by chance, or reaches over its picture."""
    width, height = region[2:]
    band = planes(np.ones((height, width, 3), np.float32))
    path = tmp_path / "part.exr"
    write_exr(path, [band], display=(16, 8), region=region, channels="RGB", half="")
    assert (
        refusal(path)
        == f"holds only a part of its picture, or more than it: {width} x {height} of 16 x 8 pixels"
    )


def test_the_size(tmp_path: Path) -> None:
    """Found in the header: nothing is read of a picture that promises too much."""
    path = write(tmp_path / "a.exr", planes(SMALL), compression=OpenEXR.PIZ_COMPRESSION)
    content = path.read_bytes()
    window = b"dataWindow\0box2i\0" + struct.pack("<i", 16)
    start = content.index(window) + len(window)
    # By tiles, so that the length of the file says nothing against it.
    content = content[:4] + struct.pack("<I", 2 | 0x200) + content[8:]
    path.write_bytes(content[:start] + struct.pack("<4i", 0, 0, 19_999, 9_999) + content[start + 16 :])
    assert refusal(path) == "is too large: 20,000 pixels wide, at most 16,384"


def test_the_channels(tmp_path: Path) -> None:
    path = write(tmp_path / "a.exr", planes(SMALL, "RBZ"))
    assert refusal(path) == "must have the channels R, G and B, or Y; it has B, R, Z"


@pytest.mark.parametrize(
    ("value", "what"),
    [
        (np.nan, "of NaN"),
        (np.inf, "of infinite brightness"),
        (-np.inf, "of infinite brightness"),
        (2e9, "brighter than 1e+09"),
    ],
)
def test_numbers_that_are_no_light(tmp_path: Path, value: float, what: str) -> None:
    pixels = SMALL.astype(np.float32)
    pixels[3, 7, 1] = value
    path = write(tmp_path / "a.exr", planes(pixels))
    assert (
        refusal(path) == f"has 1 pixel {what}, the first in column 7, row 3 (counted from 0 at the top left)"
    )
    pixels[3, 7:10] = value
    pixels[5, 0, 2] = value
    path = write(tmp_path / "b.exr", planes(pixels))
    assert refusal(path).startswith(f"has 4 pixels {what}, the first in column 7, row 3")


def test_full_of_nan(tmp_path: Path) -> None:
    path = write(tmp_path / "a.exr", planes(np.full((64, 128, 3), np.nan, np.float16)))
    assert refusal(path).startswith("has 8,192 pixels of NaN, the first in column 0, row 0")


def test_the_brightest_light(tmp_path: Path) -> None:
    pixels = np.full((1, 2, 3), BRIGHTEST, np.float32)
    assert read_environment(write(tmp_path / "a.exr", planes(pixels))).max() == BRIGHTEST


def test_what_is_no_picture(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    assert refusal(path) == "cannot be read: No such file or directory"
    path.write_text("version: 1\n")
    assert refusal(path).startswith("is not an EXR, HDR, PNG, ")
    path.write_bytes(b"")
    assert refusal(path).startswith("is not an EXR, HDR, PNG, ")
    assert refusal(tmp_path) == "is a folder, not a file"


def test_pixels_that_cannot_be_decoded(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    rough = np.random.default_rng(2).integers(0, 9, (64, 128, 3)).astype(np.float32)
    path = write(tmp_path / "a.exr", planes(rough))
    content = bytearray(path.read_bytes())
    content[-2000:-1000] = bytes(1000)
    path.write_bytes(content)
    assert refusal(path) == "is damaged: its pixels cannot be read"
    assert capfd.readouterr().out == ""


def test_cubes_parts_and_deep_pixels(tmp_path: Path) -> None:
    path = write(tmp_path / "a.exr", planes(SMALL), envmap=OpenEXR.ENVMAP_CUBE)
    assert refusal(path) == "is a cube map; an environment is a latitude-longitude map"
    assert read_environment(write(tmp_path / "b.exr", planes(SMALL), envmap=OpenEXR.ENVMAP_LATLONG)).any()
    part = OpenEXR.Part({"type": OpenEXR.scanlineimage}, planes(SMALL), name="a")
    other = OpenEXR.Part({"type": OpenEXR.scanlineimage}, planes(SMALL), name="b")
    with OpenEXR.File([part, other]) as file:
        file.write(str(tmp_path / "c.exr"))
    assert refusal(tmp_path / "c.exr") == "holds several parts or deep pixels, which are not read"


@cache
def whole_files() -> tuple[bytes, ...]:
    """Small maps as stored in different ways."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.exr"
        tiles = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
        found = []
        for header in ({}, {"compression": OpenEXR.PIZ_COMPRESSION}, tiles):
            found.append(write(path, planes(SMALL), **header).read_bytes())
            path.unlink()
        return tuple(found)


@given(
    st.integers(0, 2),
    st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.binary(min_size=1, max_size=8)), max_size=6),
    st.floats(0, 1),
    st.booleans(),
)
@settings(max_examples=150)
def test_damage_is_told_in_one_line(
    which: int, changes: list[tuple[float, bytes]], kept: float, cut: bool
) -> None:
    """Any bytes changed, any part cut off: a map of finite light, or one line."""
    content = bytearray(whole_files()[which])
    for place, replacement in changes:
        start = int(place * len(content))
        content[start : start + len(replacement)] = replacement
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.exr"
        path.write_bytes(content[: int(kept * len(content))] if cut else content)
        try:
            found = read_environment(path)
        except FileError as error:
            told = str(error).splitlines()
        else:
            told = []
    if told:
        assert len(told) == 1
        return
    assert found.shape[1] == 2 * found.shape[0]
    assert found.shape[2:] == (3,)
    assert (found >= 0).all()
    assert (found <= 100 * BRIGHTEST).all()


# --- Radiance's pictures, written here by the format's words ---


def runs(line: bytes, shortest: int = 3) -> bytes:
    """Bytes as runs and as they are, at most 127 and 128 in a piece."""
    found, plain, at = b"", b"", 0
    while at < len(line):
        end = at + 1
        while end < len(line) and end - at < 127 and line[end] == line[at]:
            end += 1
        if end - at >= shortest:
            found += (bytes([len(plain)]) + plain if plain else b"") + bytes([128 + end - at, line[at]])
            plain, at = b"", end
            continue
        plain += line[at : at + 1]
        at += 1
        if len(plain) == 128:
            found, plain = found + bytes([128]) + plain, b""
    return found + (bytes([len(plain)]) + plain if plain else b"")


def flat(rows: Pixels) -> bytes:
    return rows.tobytes()


def by_parts(rows: Pixels) -> bytes:
    width = rows.shape[1]
    head = bytes([2, 2, width >> 8, width & 255])
    return b"".join(head + b"".join(runs(row[:, part].tobytes()) for part in range(4)) for row in rows)


def by_pixels(rows: Pixels) -> bytes:
    found = b""
    for row in rows:
        at = 0
        while at < len(row):
            end = at + 1
            while end < len(row) and (row[end] == row[at]).all():
                end += 1
            found += row[at].tobytes()
            count = end - at - 1
            while count:
                found += bytes([1, 1, 1, count & 255])
                count >>= 8
            at = end
    return found


WAYS = {"flat": flat, "by parts": by_parts, "by pixels": by_pixels}


def write_radiance(
    path: Path, rows: Pixels, way: str = "by parts", head: str = "", size: str = "", kind: str = "rgbe"
) -> Path:
    size = size or f"-Y {rows.shape[0]} +X {rows.shape[1]}"
    text = f"#?RADIANCE\n# of a test\n{head}FORMAT=32-bit_rle_{kind}\n\n{size}\n"
    path.write_bytes(text.encode() + WAYS[way](rows))
    return path


def random_rows(height: int, width: int, seed: int = 1) -> Pixels:
    random = np.random.default_rng(seed)
    rows = random.integers(2, 256, (height, width, 4), np.uint8)
    rows[..., 3] = random.integers(120, 140, (height, width))
    rows[:, width // 3 : width // 2] = rows[:, width // 3 : width // 3 + 1]  # something to run over
    rows[0, 0] = 0
    return rows


def value(rows: Pixels) -> Pixels:
    """By the words of Graphics Gems II, in double precision."""
    found = (rows[..., :3] + 0.5) / 256 * 2.0 ** (rows[..., 3:].astype(float) - 128)
    return np.where(rows[..., 3:] > 0, found, 0.0)


@pytest.mark.parametrize(
    ("way", "width"),  # rows of 4 pixels have no runs of their parts
    [(way, width) for way in WAYS for width in (4, 14, 700) if way != "by parts" or width >= 8],
)
def test_three_ways_to_lie(tmp_path: Path, way: str, width: int) -> None:
    rows = random_rows(width // 2, width)
    found = read_environment(write_radiance(tmp_path / "a.hdr", rows, way))
    assert found.dtype == np.float32
    assert np.allclose(found, value(rows), rtol=1e-6)


def test_where_rows_and_columns_go(tmp_path: Path) -> None:
    rows = random_rows(10, 20)
    expected = value(rows)
    for size, stored in {
        "+Y 10 +X 20": rows[::-1],
        "-Y 10 -X 20": rows[:, ::-1],
        "+X 20 -Y 10": rows.swapaxes(0, 1),
        "-X 20 +Y 10": rows[::-1, ::-1].swapaxes(0, 1),
    }.items():
        path = write_radiance(tmp_path / "a.hdr", np.ascontiguousarray(stored), size=size)
        assert np.allclose(read_environment(path), expected, rtol=1e-6), size


def test_exposures_are_taken_back(tmp_path: Path) -> None:
    rows = random_rows(4, 8)
    path = write_radiance(tmp_path / "a.hdr", rows, head="EXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 0.5 2\n")
    assert np.allclose(read_environment(path), value(rows) / 8 / [1, 0.5, 2], rtol=1e-6)


def test_colours(tmp_path: Path) -> None:
    """XYZ goes back to itself through Rec. 709 (SMPTE RP 177); Rec. 2020 has the same white and a red outside."""
    rows = np.zeros((4, 8, 4), np.uint8)
    rows[...] = (243, 255, 255, 128)
    white = value(rows)[0, 0]
    found = read_environment(write_radiance(tmp_path / "a.hdr", rows, kind="xyze"))[0, 0]
    back = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    assert np.allclose(back @ found, white, rtol=1e-3)
    rows[...] = (128, 128, 128, 128)
    given_primaries = "PRIMARIES=0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290\n"
    grey = read_environment(write_radiance(tmp_path / "a.hdr", rows, head=given_primaries))[0, 0]
    assert np.allclose(grey, value(rows)[0, 0], rtol=1e-4)
    rows[...] = (128, 0, 0, 128)
    red = read_environment(write_radiance(tmp_path / "a.hdr", rows, head=given_primaries))[0, 0]
    assert red[0] > 0.5
    assert red[1] == 0


@pytest.mark.parametrize(
    ("head", "size", "cut", "message"),
    [
        (
            "",
            "-Y 4 +X 9",
            0,
            "must be twice as wide as high, as latitude-longitude maps are, got 9 x 4 pixels"
            "; stretch: true takes any shape",
        ),
        ("", "4 8", 0, "is damaged: the line with its size is missing"),
        ("", "-Y 4 +Y 8", 0, "is damaged: the line with its size is missing"),
        ("EXPOSURE=0\n", "", 0, "is damaged: its EXPOSURE is not above 0"),
        ("EXPOSURE=much\n", "", 0, "is damaged: its EXPOSURE is no number"),
        ("COLORCORR=1 2\n", "", 0, "is damaged: its COLORCORR has not 3 numbers"),
        (
            "FORMAT=32-bit_rle_other\n",
            "",
            0,
            "is a Radiance picture of an unknown format, '32-bit_rle_other'",
        ),
        ("", "", 3, "is damaged: its pixels end too early or go beyond their row"),
        ("", "-Y 8 +X 16", 0, "is damaged: a row has another length than the picture"),
    ],
)
def test_refused(tmp_path: Path, head: str, size: str, cut: int, message: str) -> None:
    path = write_radiance(tmp_path / "a.hdr", random_rows(4, 8), head=head, size=size)
    path.write_bytes(path.read_bytes()[: -cut or None])
    assert str(failure(FileError, read_environment, path)) == f"{path}: {message}"


@settings(max_examples=200, deadline=None)
@given(
    st.sampled_from(sorted(WAYS)),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=4),
)
def test_damaged_files_end_in_one_line(
    tmp_path_factory: Any, way: str, changes: list[tuple[float, int]]
) -> None:
    path = write_radiance(tmp_path_factory.getbasetemp() / "damaged.hdr", random_rows(8, 16), way)
    data = bytearray(path.read_bytes())
    for place, byte in changes:
        data[int(place * (len(data) - 1))] = byte
    path.write_bytes(data)
    try:
        found = read_environment(path)
    except FileError as error:
        refused = str(error)
    else:
        refused = ""
        assert np.isfinite(found).all()
        assert found.shape[1] == 2 * found.shape[0]
    assert "\n" not in refused
