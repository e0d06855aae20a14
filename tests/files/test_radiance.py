"""Radiance's pictures: written here by the format's words, in each of its three ways, and read again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.errors import FileError
from clfractal.files.environment_map import read_environment

Pixels = npt.NDArray[Any]


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


def write(
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
    found = read_environment(write(tmp_path / "a.hdr", rows, way))
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
        path = write(tmp_path / "a.hdr", np.ascontiguousarray(stored), size=size)
        assert np.allclose(read_environment(path), expected, rtol=1e-6), size


def test_exposures_are_taken_back(tmp_path: Path) -> None:
    rows = random_rows(4, 8)
    path = write(tmp_path / "a.hdr", rows, head="EXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 0.5 2\n")
    assert np.allclose(read_environment(path), value(rows) / 8 / [1, 0.5, 2], rtol=1e-6)


def test_colours(tmp_path: Path) -> None:
    """XYZ goes back to itself through Rec. 709 (SMPTE RP 177); Rec. 2020 has the same white and a red outside."""
    rows = np.zeros((4, 8, 4), np.uint8)
    rows[...] = (243, 255, 255, 128)
    white = value(rows)[0, 0]
    found = read_environment(write(tmp_path / "a.hdr", rows, kind="xyze"))[0, 0]
    back = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    assert np.allclose(back @ found, white, rtol=1e-3)
    rows[...] = (128, 128, 128, 128)
    given_primaries = "PRIMARIES=0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290\n"
    grey = read_environment(write(tmp_path / "a.hdr", rows, head=given_primaries))[0, 0]
    assert np.allclose(grey, value(rows)[0, 0], rtol=1e-4)
    rows[...] = (128, 0, 0, 128)
    red = read_environment(write(tmp_path / "a.hdr", rows, head=given_primaries))[0, 0]
    assert red[0] > 0.5
    assert red[1] == 0


@pytest.mark.parametrize(
    ("head", "size", "cut", "message"),
    [
        (
            "",
            "-Y 4 +X 9",
            0,
            "must be twice as wide as high, as latitude-longitude maps are, got 9 x 4 pixels",
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
    path = write(tmp_path / "a.hdr", random_rows(4, 8), head=head, size=size)
    path.write_bytes(path.read_bytes()[: -cut or None])
    with pytest.raises(FileError) as caught:
        read_environment(path)
    assert str(caught.value) == f"{path}: {message}"


@settings(max_examples=200, deadline=None)
@given(
    st.sampled_from(sorted(WAYS)),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=4),
)
def test_damaged_files_end_in_one_line(
    tmp_path_factory: Any, way: str, changes: list[tuple[float, int]]
) -> None:
    path = write(tmp_path_factory.getbasetemp() / "damaged.hdr", random_rows(8, 16), way)
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
