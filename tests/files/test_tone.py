"""Tone curves, and the transfer function with its dither: what they promise of greys and of colours."""

from __future__ import annotations

from typing import get_args

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.files import srgb, tone
from clfractal.files.srgb import decode, encode, encode8, encode16
from clfractal.files.tone import LUMINANCE, MIDDLE, WHITE, toned
from clfractal.files.tone_names import TONES, Tone
from clfractal.images.develop import Development
from clfractal.scene.parts import Output

CURVES: tuple[Tone, ...] = ("reinhard", "agx")
# Linear Rec. 709: the primaries, their sums, and lights of fires, lamps and skies.
LIGHTS = [
    (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 0.4, 0), (1, 0.2, 0.05),
    (0.1, 0.4, 1), (0.4, 0, 1), (1, 0.7, 0.4), (0.3, 1, 0.1), (1, 0, 0.4),
]  # fmt: skip

Doubles = npt.NDArray[np.float64]


def through(colors: npt.ArrayLike, by: Tone) -> Doubles:
    """Colours of shape (..., 3) through a curve."""
    given = np.asarray(colors, np.float32)
    planes = [np.ascontiguousarray(plane) for plane in given.reshape(-1, 3).T]
    found: Doubles = np.stack(toned(planes[0], planes[1], planes[2], by), axis=-1).astype(np.float64)
    return found.reshape(given.shape)


def greys(by: Tone, values: npt.ArrayLike) -> Doubles:
    found: Doubles = through(np.repeat(np.asarray(values)[..., None], 3, axis=-1), by)
    return found


def test_the_scene_knows_every_curve() -> None:
    assert get_args(Output.model_fields["tone"].annotation) == TONES
    assert TONES[0] == Output.model_validate({}).tone == "linear"


def test_the_linear_curve_changes_nothing() -> None:
    strange = np.array([[-1.0, 0.0, np.inf], [np.nan, 7.0, -np.inf]], np.float32)
    found = toned(strange, strange, strange, "linear")
    assert all(np.array_equal(plane, strange, equal_nan=True) for plane in found)


@pytest.mark.parametrize("by", CURVES)
def test_black_middle_grey_and_white(by: Tone) -> None:
    found = greys(by, [0.0, 1e-30, MIDDLE, WHITE * 1.01, 1e6, np.inf])
    np.testing.assert_allclose(found[:, 1], [0, 0, MIDDLE, 1, 1, 1], atol=2e-6)
    assert found[0, 0] == 0
    assert greys(by, WHITE * 0.9)[0] < 1


@pytest.mark.parametrize("by", CURVES)
def test_what_is_no_light_is_black(by: Tone) -> None:
    assert (through([[np.nan, -1, -np.inf], [-0.0, np.nan, -3e38]], by) == 0).all()
    one = through([[np.nan, 0.5, -2.0]], by)
    np.testing.assert_array_equal(one, through([[0.0, 0.5, 0.0]], by))
    assert np.isfinite(through([[np.inf, 3e38, 1e30], [np.inf, 0, 0]], by)).all()


@pytest.mark.parametrize("by", CURVES)
def test_a_neutral_stays_neutral_and_never_falls(by: Tone) -> None:
    ramp = np.concatenate([[0], np.geomspace(1e-7, 100, 40_001)])
    found = greys(by, ramp)
    assert (found == found[:, :1]).all()
    assert np.diff(found[:, 0]).min() >= -2e-7  # a unit in the last place of an interpolated number
    shown = encode16(found[:, None].astype(np.float32)).astype(int)
    assert np.diff(shown[:, 0, 0]).min() >= -1
    assert 0 <= found.min() <= found.max() <= 1 + 1e-6


def reinhard_of_the_paper(light: Doubles) -> Doubles:
    """Eq. 4, with the key that leaves middle grey as it is, found by bisection."""
    low, high = 1.0, 2.0

    def curve(values: Doubles, key: float) -> Doubles:
        scaled = key * values
        found: Doubles = scaled * (1 + scaled / (key * WHITE) ** 2) / (1 + scaled)
        return found

    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if curve(np.array(MIDDLE), middle) < MIDDLE else (low, middle)
    return curve(light, low)


def test_the_tables_are_the_mathematics() -> None:
    """Of sixteen bits a part of one step, apart from the corner at white."""
    light = np.geomspace(2.0**-15, WHITE * 0.99, 30_011)
    reinhard = greys("reinhard", light)[:, 0]
    np.testing.assert_allclose(reinhard, reinhard_of_the_paper(light), atol=4e-6)
    np.testing.assert_allclose(greys("agx", light)[:, 0], tone.agx(light), atol=4e-6)


def test_the_slopes_at_middle_grey() -> None:
    """AgX leaves the contrast there nearly as it is (2.4 * 2.4 / 16.5 stops / code, per stop); Reinhard makes it softer."""
    d = 1e-3
    ends = np.array([MIDDLE * (1 - d), MIDDLE * (1 + d)])
    slopes = [
        np.diff(np.log(curve(ends)))[0] / np.diff(np.log(ends))[0] for curve in (tone.reinhard, tone.agx)
    ]
    exact = 2.4 * 2.4 / 16.5 / MIDDLE ** (1 / 2.4) / np.log(2)
    np.testing.assert_allclose(slopes, [0.8206, exact], rtol=1e-3)


def test_agx_spans_its_stops() -> None:
    assert tone.agx(np.array([MIDDLE * 2.0**-10.01, 0.0])).max() == 0
    assert 0 < tone.agx(np.array([MIDDLE * 2.0**-9.5]))[0] < 1e-3


def hue(colors: Doubles) -> Doubles:
    """Hue and chroma of linear Rec. 709 in Oklab (B. Ottosson, 2020), shape (..., 2); degrees."""
    cones = np.array(
        [[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566],
         [0.0883024619, 0.2817188376, 0.6299787005]]
    )  # fmt: skip
    lab = np.array(
        [[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099],
         [0.0259040371, 0.7827717662, -0.8086757660]]
    )  # fmt: skip
    found = np.cbrt(colors @ cones.T) @ lab.T
    a, b = found[..., 1], found[..., 2]
    return np.stack([np.degrees(np.arctan2(b, a)), np.hypot(a, b)], axis=-1)


def turned(colors: Doubles, shown: Doubles) -> Doubles:
    """By how many degrees of hue what is shown differs; 0 where it is nearly grey."""
    before, after = hue(colors), hue(np.clip(shown, 0, 1))
    turn = np.abs((after[..., 0] - before[..., 0] + 180) % 360 - 180)
    found: Doubles = np.where(after[..., 1] < 0.03, 0, turn)
    return found


@pytest.mark.parametrize("light", LIGHTS)
def test_saturated_lights_keep_their_hue(light: tuple[float, float, float]) -> None:
    """From dark to far too bright; where a cut-off would turn them to the next primary."""
    lights = np.array(light, float) * np.geomspace(0.02, 40, 120)[:, None]
    assert turned(lights, through(lights, "reinhard")).max() < 25
    assert turned(lights, through(lights, "agx")).max() < 36
    cut_off = turned(lights, lights).max()
    if cut_off > 25:
        assert turned(lights, through(lights, "reinhard")).max() < 0.4 * cut_off
        assert turned(lights, through(lights, "agx")).max() < cut_off


@pytest.mark.parametrize("light", LIGHTS)
def test_reinhard_mixes_a_colour_with_white_alone(light: tuple[float, float, float]) -> None:
    """The middle component's place between the least and the largest stays, and so does the curve's luminance."""
    lights = np.array(light, float) * np.geomspace(0.02, 14, 60)[:, None]
    found = through(lights, "reinhard")
    assert found.min() >= -1e-6
    assert found.max() <= 1 + 1e-6
    order = np.argsort(light)
    span = found[:, order[2]] - found[:, order[0]]
    middle = (found[:, order[1]] - found[:, order[0]]) / np.maximum(span, 1e-9)
    exact = (light[order[1]] - light[order[0]]) / (light[order[2]] - light[order[0]])
    np.testing.assert_allclose(middle[span > 1e-3], exact, atol=2e-3)
    weights = np.array(LUMINANCE, np.float64)
    np.testing.assert_allclose(found @ weights, tone.reinhard(lights @ weights), atol=1e-5)


@pytest.mark.parametrize("by", CURVES)
@pytest.mark.parametrize("light", LIGHTS)
def test_a_brighter_light_is_shown_lighter(by: Tone, light: tuple[float, float, float]) -> None:
    lights = np.array(light, float) * np.geomspace(1e-3, 300, 4000)[:, None]
    shown = np.clip(through(lights, by), 0, 1) @ np.array(LUMINANCE, np.float64)
    assert np.diff(shown).min() > -1e-3
    assert shown[-1] > 0.9


@pytest.mark.parametrize("by", CURVES)
def test_a_bright_gradient_has_no_bands(by: Tone) -> None:
    """From 0 to far beyond white: the mean over the dither's 16 x 16 pixels is the curve to a part of a code."""
    blocks = 256
    light = np.geomspace(0.004, 20, blocks)
    picture = np.repeat(np.repeat(light, 16)[None, :, None], 16, axis=0).repeat(3, axis=2)
    shown = through(picture, by).astype(np.float32)
    code = encode8(shown)[..., 0].reshape(16, blocks, 16).mean(axis=(0, 2))
    exact = greys(by, light)[:, 0]
    wanted = np.where(exact <= 0.0031308, 12.92 * exact, 1.055 * exact ** (1 / 2.4) - 0.055) * 255
    np.testing.assert_allclose(code, np.minimum(wanted, 255), atol=0.06)


def test_a_crop_is_the_same_part() -> None:
    """No pixel depends on its neighbours, nor on how the memory lies."""
    light = np.random.default_rng(3).gamma(0.6, 2, (31, 47, 3)).astype(np.float32)
    for by in CURVES:
        whole = through(light, by)
        np.testing.assert_array_equal(through(light[5:20, 7:30], by), whole[5:20, 7:30])
        np.testing.assert_array_equal(through(light[::-1, ::2], by), whole[::-1, ::2])


@pytest.mark.parametrize("by", CURVES)
def test_coverage_is_left_out_of_the_curve(by: Tone) -> None:
    """A half covered pixel shows half of the colour that a covered one has."""
    color = np.array([2.0, 0.6, 0.1], np.float32)
    cover = np.array([0, 0.25, 0.5, 1, 1.5, np.nan], np.float32)
    planes = {
        name: value * np.where(cover > 0, np.minimum(cover, 1), 1)
        for name, value in zip("RGB", color, strict=True)
    }
    found = Development(1.0, by, premultiplied=True).colors({**planes, "A": cover})
    bare = through(color * 2, by)
    for name, value in zip("RGB", bare, strict=True):
        np.testing.assert_allclose(
            found[name], value * np.array([1, 0.25, 0.5, 1, 1, 1]), rtol=1e-5, atol=1e-7
        )
    plain = Development(1.0, by).colors({**planes, "A": cover})
    np.testing.assert_allclose([plain[name][3] for name in "RGB"], bare, rtol=1e-6)


# --- the transfer function and the dither ---


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


def test_the_table_is_the_transfer_function_in_the_middle_of_each_interval() -> None:
    index = np.arange(srgb.TABLE_LOWEST, srgb.TABLE_ONE + 1, dtype=np.int32)
    middle = ((index << srgb.TABLE_SHIFT) + (1 << (srgb.TABLE_SHIFT - 1))).view(np.float32)
    wanted = np.rint(srgb.encode(np.minimum(middle.astype(np.float64), 1.0)) * 255 * 256)
    wanted[0] = 0
    assert np.array_equal(srgb.table8(), wanted)


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
