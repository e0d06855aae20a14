"""Colours as "#rrggbb": exact by the transfer function of sRGB, wherever a colour is taken, kept as written."""

from __future__ import annotations

from pathlib import Path

import mpmath
import numpy as np
import pytest

import clfractal
from clfractal.files.srgb import encode8, encode16
from clfractal.scene.load import dump_scene, load_scene
from clfractal.schema.hex_color import linear_color
from clfractal.viewer.saving import open_source, scene_text

HEAD = "version: 1\nformula: {name: mandelbulb, iterations: 8}\ncamera: {position: [0, -3, 0]}\n"


def by_the_standard(code: int) -> float:
    """IEC 61966-2-1, clause 5.2, with 30 digits."""
    with mpmath.workdps(30):
        value = mpmath.mpf(code) / 255
        if value <= mpmath.mpf("0.04045"):
            return float(value / mpmath.mpf("12.92"))
        return float(((value + mpmath.mpf("0.055")) / mpmath.mpf("1.055")) ** mpmath.mpf("2.4"))


def test_every_code_is_exact_and_comes_back() -> None:
    for code in range(256):
        found = linear_color(f"#{code:02x}00{255 - code:02X}")
        assert found is not None
        assert found == pytest.approx([by_the_standard(code), 0.0, by_the_standard(255 - code)], rel=1e-14)
        light = np.array([[found]], dtype=np.float32)
        assert encode8(light, origin=(code, 3)).ravel().tolist() == [code, 0, 255 - code]
        assert encode16(light).ravel().tolist() == [257 * code, 0, 257 * (255 - code)]
    assert linear_color("#fff") == [1.0, 1.0, 1.0]


def test_three_digits_are_six() -> None:
    assert linear_color("#f80") == linear_color("#ff8800") == linear_color("#FF8800")
    for wrong in ("", "#", "#ff", "#ffff", "#fffffff", "ffffff", "#ggg", "#ffffff\n"):
        assert linear_color(wrong) is None, wrong


def test_wherever_a_colour_is_taken() -> None:
    text = HEAD + (
        "material: {color: '#f80'}\n"
        "lights: [{color: '#f80'}, {type: point, position: [3, 3, 3], color: '#f80'}]\n"
        "background: {top: '#f80', bottom: '#f80'}\n"
        "fog: {color: '#f80'}\n"
        "coloring: {palette: [{at: 0, color: '#f80'}, {at: 1, color: '#f80'}]}\n"
        "cut_planes: [{colors: {inside: '#f80', palette: ['#f80', '#f80']}}]\n"
        "layout: {background: '#f80', views: [{background: '#f80', material: {color: '#f80'}}]}\n"
        "stereo: {colors: ['#f80', '#f80']}\n"
    )
    as_numbers = text.replace("'#f80'", str(linear_color("#f80")))
    scene = load_scene(text)
    assert scene == load_scene(as_numbers)
    assert load_scene(dump_scene(scene)) == scene
    volume = HEAD + "renderer: {type: volume, transfer: {color: [{at: 0, color: '#f80'}]}}\n"
    assert load_scene(volume) == load_scene(volume.replace("'#f80'", str(linear_color("#f80"))))


def test_a_background_of_one_colour_has_that_colour_in_the_picture() -> None:
    small = HEAD + "image: {width: 24, height: 16}\nbackground: '#336699'\n"
    picture = clfractal.render(small).to_rgb8()
    for y, x in ((0, 0), (0, 23), (15, 0), (15, 23)):
        assert picture[y, x].tolist() == [0x33, 0x66, 0x99]
    assert load_scene(HEAD, overrides=["background=#336699"]).background == load_scene(small).background
    assert (
        load_scene(HEAD + "background: [0.1, 0.2, 0.3]\n").background
        == load_scene(HEAD + "background: {top: [0.1, 0.2, 0.3], bottom: [0.1, 0.2, 0.3]}\n").background
    )


def test_a_palette_of_colours_alone_has_stops_at_equal_distances() -> None:
    short = load_scene(HEAD + "coloring: {palette: ['#000', '#f80', [1, 1, 1], '#fff', '#00f']}\n").coloring
    assert not isinstance(short.palette, str)
    assert [stop.at for stop in short.palette] == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert [list(stop.color) for stop in short.palette][1] == linear_color("#f80")
    # A stop among them keeps its own place.
    mixed = load_scene(HEAD + "coloring: {palette: ['#000', {at: 0.9, color: '#f80'}, '#fff']}\n").coloring
    assert [stop.at for stop in mixed.palette if not isinstance(stop, str)] == [0.0, 0.9, 1.0]


WRITTEN = """\
# mine
version: 1
formula: {name: mandelbulb}
camera: {}
material:
  color: "#ff8800"   # orange
  diffuse: 0.7
background: "#102030"  # night
coloring: {by: trap, palette: ["#000", "#f80", "#fff"]}
lights:
  - {color: "#fff", direction: [1, 2, 3]}  # key
  - {color: "#00f"}
"""


def test_saving_leaves_colours_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(WRITTEN)
    source = open_source(file)
    scene = source.loaded
    assert scene is not None
    assert scene_text(source, scene) == WRITTEN
    darker = scene.model_copy(update={"material": scene.material.model_copy(update={"diffuse": 0.2})})
    assert scene_text(source, darker) == WRITTEN.replace("diffuse: 0.7", "diffuse: 0.2")
    other = scene.model_copy(
        update={"material": scene.material.model_copy(update={"color": (0.1, 0.2, 0.3)})}
    )
    assert scene_text(source, other) == WRITTEN.replace('"#ff8800"', "[0.1, 0.2, 0.3]")
    slope = scene.model_copy(update={"background": {"top": (0, 0, 0), "bottom": (1, 1, 1)}})
    assert scene_text(source, slope) == WRITTEN.replace('"#102030"', "{top: [0, 0, 0], bottom: [1, 1, 1]}")
    fewer = scene.model_copy(update={"lights": [scene.lights[1]]})
    assert scene_text(source, fewer) == WRITTEN.replace(
        '  - {color: "#fff", direction: [1, 2, 3]}  # key\n', ""
    )
