"""Palettes: 256 colours in linear light."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from clfractal.errors import SceneError
from clfractal.files.srgb import decode
from clfractal.scene.coloring import Coloring
from clfractal.scene.palette import palette_table
from clfractal.scene.palettes import PALETTES, Palette, table


def coloring(palette: object) -> Coloring:
    return Coloring.model_validate({"by": "iterations", "palette": palette})


def test_stops_are_mixed_in_linear_light() -> None:
    table = palette_table(
        coloring(
            [
                {"at": 0.2, "color": [0, 1, 0]},
                {"at": 0.6, "color": [1, 0, 4]},
                {"at": 0.6, "color": [0, 0, 0]},
            ]
        )
    )
    assert table.shape == (256, 3)
    assert table.dtype == np.float32
    place = np.arange(256) / 255
    inside = (place > 0.2) & (place < 0.6)
    mix = (place[inside] - 0.2) / 0.4
    expected = np.stack([mix, 1 - mix, 4 * mix], axis=1)
    np.testing.assert_allclose(table[inside], expected, atol=1e-6)
    np.testing.assert_array_equal(table[place <= 0.2], np.tile([0, 1, 0], (52, 1)))
    assert not table[place > 0.6].any()


def test_a_named_palette_is_turned_into_linear_light() -> None:
    table = palette_table(coloring("gray"))
    # sRGB 188/255 is linear 0.5029 (IEC 61966-2-1), and 10/255 lies on the straight part: (10/255)/12.92.
    np.testing.assert_allclose(table[188], 0.50289, atol=2e-3)
    np.testing.assert_allclose(table[10], 10 / 255 / 12.92, rtol=2e-2)
    assert (table[0] == 0).all()
    np.testing.assert_allclose(table[255], 1, atol=1e-6)
    assert (np.diff(table[:, 0]) > 0).all()


def test_the_table_is_the_callers_own() -> None:
    palette_table(coloring("viridis"))[:] = 0
    assert palette_table(coloring("viridis")).any()


@pytest.mark.parametrize("by", ["solid", "normal"])
def test_no_palette_is_loaded_when_none_is_needed(by: str) -> None:
    """Loading cmap, yaml's writer or OpenEXR would cost a plain render its start-up time."""
    code = f"""
import sys
from clfractal.scene.load import load_scene
load_scene({{"version": 1, "formula": {{"name": "hast"}}, "camera": {{}}, "coloring": {{"by": "{by}"}}}})
print([name for name in ("cmap", "OpenEXR", "pyopencl", "mpmath", "png") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# --- the project's own palettes ---


@pytest.mark.parametrize("name", PALETTES)
def test_an_own_palette(name: str) -> None:
    """256 colours a screen can show, without a jump; a periodic one has none at its seam either."""
    found = palette_table(coloring(name))
    assert found.shape == (256, 3)
    assert found.dtype == np.float32
    assert found.min() >= 0
    assert found.max() <= 1
    assert np.abs(np.diff(found, axis=0)).max() < 0.03
    ends = np.abs(found[0] - found[-1]).max()
    assert ends == 0 if PALETTES[name].periodic else ends > 0.5


@pytest.mark.parametrize("name", PALETTES)
def test_an_own_palette_goes_through_its_colours(name: str) -> None:
    palette = PALETTES[name]
    codes = [list(bytes.fromhex(color)) for color in palette.colors.split()]
    if palette.periodic:
        codes.append(codes[0])
    np.testing.assert_allclose(table(palette, len(codes)), decode(np.array(codes) / 255), atol=1e-6)


def test_an_own_palette_is_even_to_the_eye() -> None:
    """Between black and white Oklab's lightness rises evenly, and with it the cube root of linear light."""
    found = table(Palette("000000 ffffff"), 101)
    np.testing.assert_allclose(np.cbrt(found), np.linspace(0, 1, 101)[:, None].repeat(3, 1), atol=1e-6)
    # Red to green passes through yellow, not through the dark olive that mixing their codes gives.
    assert table(Palette("ff0000 00ff00"), 3)[1].max() > 0.5


def test_those_from_dark_to_light_never_turn_back() -> None:
    for name, palette in PALETTES.items():
        if not palette.periodic:
            luminance = palette_table(coloring(name)) @ [0.2126, 0.7152, 0.0722]
            assert (np.diff(luminance) > 0).all(), name


def test_an_own_palette_backwards_as_those_of_cmap() -> None:
    for name in ("hearth", "gray"):
        forwards, backwards = palette_table(coloring(name)), palette_table(coloring(name + "_r"))
        np.testing.assert_allclose(backwards, forwards[::-1], atol=1e-6)


def test_a_misspelt_own_palette() -> None:
    with pytest.raises(SceneError, match="unknown palette 'verdigri'; did you mean 'verdigris'"):
        palette_table(coloring("verdigri"))
    with pytest.raises(SceneError, match=r"known: hearth, .*, and the names of cmap's catalog"):
        palette_table(coloring("0123456789"))
