"""The transfer function against its definition, the dither against what it promises."""

from __future__ import annotations

import numpy as np
import pytest

from clfractal.files.srgb import decode, encode, encode8, encode16


def plane(values: np.ndarray, rows: int = 64) -> np.ndarray:
    """The values along a row, repeated over rows and three components."""
    return np.broadcast_to(values.astype(np.float32)[None, :, None], (rows, len(values), 3)).copy()


def test_published_values() -> None:
    # IEC 61966-2-1: the two pieces meet at 0.0031308; middle grey 0.18 is code 0.4613561...
    assert encode(np.array([0.0031308]))[0] == pytest.approx(0.04045, abs=1e-5)
    assert encode(np.array([0.18]))[0] == pytest.approx(0.46135613, abs=1e-7)
    assert encode(np.array([0.0, 1.0])).tolist() == pytest.approx([0.0, 1.0])


def test_encode_and_decode_are_inverse() -> None:
    codes = np.linspace(0, 1, 10001)
    assert np.abs(encode(decode(codes)) - codes).max() < 1e-6


def test_what_8_bits_hold_exactly_is_never_dithered() -> None:
    codes = np.arange(256)
    linear = plane(decode(codes / 255))
    for origin in ((0, 0), (3, 5)):
        assert np.array_equal(
            encode8(linear, origin=origin), np.broadcast_to(codes[None, :, None], (64, 256, 3))
        )


def test_what_16_bits_hold_exactly_is_kept() -> None:
    codes = np.arange(65536)
    linear = plane(decode(codes / 65535), rows=1)
    assert np.array_equal(encode16(linear)[0, :, 0], codes)


def test_dither_keeps_the_mean_and_is_off_by_less_than_one_step() -> None:
    exact = np.linspace(0.2, 254.8, 997)
    linear = plane(np.repeat(decode(exact / 255), 16), rows=16)
    codes = encode8(linear)[..., 0].astype(np.float64)
    blocks = codes.reshape(16, len(exact), 16).transpose(1, 0, 2).reshape(len(exact), 256)
    assert np.abs(blocks - exact[:, None]).max() < 1
    # A 16 x 16 block has 256 thresholds; 4 of 256 at either end are kept free, and the table adds 3.
    assert np.abs(blocks.mean(axis=1) - exact).max() < 8 / 256


def test_a_dark_gradient_does_not_band() -> None:
    # From code 10 to code 12 over 1024 columns: rounded, 512 columns in a row look the same.
    exact = np.linspace(10, 12, 1024)
    codes = encode8(plane(decode(exact / 255), rows=16))[..., 0]
    blocks = codes.reshape(16, 64, 16).transpose(1, 0, 2).reshape(64, 256)
    wanted = exact.reshape(64, 16).mean(axis=1)
    assert np.abs(blocks.mean(axis=1) - wanted).max() < 12 / 256
    between = np.abs(wanted - np.rint(wanted)) > 0.1
    assert (blocks.min(axis=1) < blocks.max(axis=1))[between].all()


def test_the_pattern_belongs_to_the_picture_not_to_the_crop() -> None:
    linear = np.random.default_rng(1).random((80, 90, 3)).astype(np.float32)
    whole = encode8(linear)
    assert np.array_equal(encode8(linear[17:70, 21:], origin=(21, 17)), whole[17:70, 21:])


def test_out_of_range_and_not_numbers() -> None:
    values = np.array([-1.0, -0.0, 0.0, 1.0, 2.0, np.inf, -np.inf, np.nan, 1e-30], dtype=np.float32)
    row = plane(values, rows=16)
    wanted = np.array([0, 0, 0, 1, 1, 1, 0, 0, 0])
    assert np.array_equal(encode8(row), np.broadcast_to(wanted[None, :, None] * 255, row.shape))
    assert np.array_equal(encode16(row), np.broadcast_to(wanted[None, :, None] * 65535, row.shape))
