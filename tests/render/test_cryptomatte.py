"""Which things pixels show: coverage against areas, Cryptomatte against its specification."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.errors import SceneError
from clfractal.files.channels import CRYPTOMATTE_MATERIALS, CRYPTOMATTE_OBJECTS, ID_CHANNELS, NUMBERED
from clfractal.files.exr import read_exr
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators import path_state
from clfractal.integrators.state import state_numbers
from clfractal.integrators.surface import program_texts
from clfractal.shading.cryptomatte import bits_of, identifier, murmur3, ranked
from tests.render.path_scenes import path, scene_of
from tests.render.shots import Floats, plan_of
from tests.variants import one_of

PIXELS, HEIGHT = 48, 3.2
# A ball of radius 1 is the set; one of 0.5 stands before its rim, and one of 0.4 behind, so that half of it is hidden.
OBJECTS: dict[str, Any] = {
    "near": {"type": "sphere", "position": [1, -3, 0.2], "radius": 0.5, "material": "red"},
    "far": {"type": "sphere", "position": [-1, 3, 0], "radius": 0.4},
    "third": {"type": "box", "position": [0.2, -3, -1.2], "size": [0.6, 0.2, 0.4], "material": "red"},
}
SECTIONS: dict[str, Any] = {
    "objects": OBJECTS,
    "materials": {"red": {"base": {"color": [1, 0, 0]}}, "blue": {}},
    "camera": {"projection": "orthographic", "position": [0, -8, 0], "height": HEIGHT},
    "background": "transparent",
    "renderer": {"samples": 64, "detail": 0.05},
}


def coverage(framebuffer: Framebuffer, layer: str, name: str) -> Floats:
    """What a name covers of each pixel."""
    wanted, sums = np.float32(identifier(name)), np.zeros(framebuffer["A"].shape)
    for rank in range(6):
        of, part = (f"{layer}{rank // 2:02d}.{'RGBA'[2 * (rank % 2) + place]}" for place in (0, 1))
        sums += np.where(framebuffer[of] == wanted, framebuffer[part], 0)
    return sums


def lens(radius: float, other: float, apart: float) -> float:
    """The area that two discs share."""
    one = math.acos((apart**2 + radius**2 - other**2) / (2 * apart * radius))
    two = math.acos((apart**2 + other**2 - radius**2) / (2 * apart * other))
    root = math.sqrt(
        (-apart + radius + other)
        * (apart + radius - other)
        * (apart - radius + other)
        * (apart + radius + other)
    )
    return radius**2 * one + other**2 * two - root / 2


@pytest.mark.parametrize("lighting", [{}, path(1)])
@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_areas_of_things(lighting: dict[str, Any], precision: str) -> None:
    channels = ["A", *ID_CHANNELS]
    framebuffer = clfractal.render(
        scene_of(**SECTIONS, lighting=lighting), channels=channels, precision=precision
    )
    pixel = (HEIGHT / PIXELS) ** 2
    areas = {name: coverage(framebuffer, "CryptoObject", name).sum() * pixel for name in ("set", *OBJECTS)}
    apart = math.hypot(1, 0.2)
    box = 0.6 * 0.4
    assert areas["near"] == pytest.approx(math.pi * 0.25, rel=0.01)
    assert areas["third"] == pytest.approx(box, rel=0.01)
    assert areas["far"] == pytest.approx(math.pi * 0.16 - lens(1, 0.4, 1), rel=0.02)
    behind_box = sum(1 for x, z in grid() if math.hypot(x, z) < 1) / 10_000 * box
    assert areas["set"] == pytest.approx(math.pi - lens(1, 0.5, apart) - behind_box, rel=0.01)
    red = coverage(framebuffer, "CryptoMaterial", "red").sum() * pixel
    assert red == pytest.approx(areas["near"] + areas["third"], rel=1e-6)
    for layer in (CRYPTOMATTE_OBJECTS, CRYPTOMATTE_MATERIALS):
        parts = np.stack([framebuffer[name] for name in layer[1::2]])
        np.testing.assert_allclose(parts.sum(axis=0), framebuffer["A"], atol=1e-6)
        assert (np.diff(parts, axis=0) <= 0).all()
        assert (parts[1] > 0).any()
    middle = PIXELS // 2
    assert (framebuffer["object"][middle, middle], framebuffer["material"][middle, middle]) == (1, 3)
    right = middle + round(1 / (HEIGHT / PIXELS))
    assert (framebuffer["object"][middle, right], framebuffer["material"][middle, right]) == (2, 1)
    assert (framebuffer["object"][0, 0], framebuffer["material"][0, 0]) == (0, 0)


def grid() -> list[tuple[float, float]]:
    """10,000 places of the box, as the eye sees it."""
    steps = (np.arange(100) + 0.5) / 100 - 0.5
    return [(0.2 + 0.6 * x, -1.2 + 0.4 * z) for x in steps for z in steps]


def test_adaptive_pixels_have_all_of_their_coverage() -> None:
    sections = {**SECTIONS, "renderer": {"samples": 64, "noise": 0.02}}
    framebuffer = clfractal.render(
        scene_of(**sections), channels=["R", "G", "B", "A", "samples", "CryptoObject"]
    )
    assert framebuffer["samples"].min() < framebuffer["samples"].max()
    parts = sum(framebuffer[name] for name in CRYPTOMATTE_OBJECTS[1::2])
    np.testing.assert_allclose(parts, framebuffer["A"], atol=1e-6)


@pytest.mark.parametrize("lighting", [{}, path(1)])
def test_lights_that_are_seen_are_nothing(lighting: dict[str, Any]) -> None:
    lamp = {"type": "sphere", "position": [0, -2.5, 0], "radius": 0.15}
    framebuffer = clfractal.render(
        scene_of(lights=[lamp], lighting=lighting), channels=["A", "object", "CryptoObject"]
    )
    assert framebuffer["A"][24, 24] == 1
    assert framebuffer["object"][24, 24] == 0
    assert framebuffer["CryptoObject00.G"][24, 24] == 0
    assert framebuffer["object"][24, 32] == 1


def test_files_follow_the_specification(tmp_path: Path) -> None:
    scene = scene_of(**SECTIONS)
    framebuffer = clfractal.render(
        scene, channels=["R", "G", "B", "A", *NUMBERED, "CryptoObject", "CryptoMaterial"]
    )
    framebuffer.save(tmp_path / "a.exr")
    planes, header = read_exr(tmp_path / "a.exr")
    assert {planes[name].dtype for name in CRYPTOMATTE_OBJECTS} == {np.dtype(np.float32)}
    assert header["clfractalObjects"] == ("set", *OBJECTS)
    assert header["clfractalMaterials"] == ("red", "blue", "material")
    for layer, names in (
        ("CryptoObject", ["set", *OBJECTS]),
        ("CryptoMaterial", ["red", "blue", "material"]),
    ):
        key = f"cryptomatte/{murmur3(layer.encode()):08x}"[:19]
        told = {"name": layer, "hash": "MurmurHash3_32", "conversion": "uint32_to_float32"}
        assert {name: header[f"{key}/{name}"] for name in told} == told
        manifest = json.loads(header[f"{key}/manifest"])
        assert list(manifest) == names
        for name, told in manifest.items():
            assert np.uint32(int(told, 16)).view(np.float32) == np.float32(identifier(name))
    np.testing.assert_array_equal(planes["CryptoObject00.R"], framebuffer["CryptoObject00.R"])
    framebuffer.save(tmp_path / "a.png")
    assert b"cryptomatte" not in (tmp_path / "a.png").read_bytes()


@pytest.mark.parametrize(
    ("name", "bits"),
    [
        ("", 0),
        ("hello", 0x248BFA47),
        ("bunny", 0x13851A76),
        ("default", 0x42C9679F),
        ("hello, world", 0x149BBB7F),
    ],
)
def test_hashes(name: str, bits: int) -> None:
    """Of the specification's example and of MurmurHash3's own tests."""
    assert murmur3(name.encode()) == bits
    if name:
        assert bits_of(name) == bits


def test_no_identifier_is_infinite_zero_or_denormal() -> None:
    for number in range(3000):
        found = np.float32(identifier(f"thing {number}"))
        assert np.isfinite(found)
        assert abs(found) >= np.finfo(np.float32).tiny


def test_ranks_join_what_has_the_same_name() -> None:
    pairs = np.array([3, 0.2, 1, 0.1, 2, 0.3, 4, 0.05, 0, 0, 0, 0], np.float32)[None, :, None, None]
    names = np.array([0, 1, 2, 1, 3])
    made = ranked(pairs, names, np.array([10, 20, 30], np.float32))[0, :, 0, 0]
    np.testing.assert_allclose(made, [10, 0.3, 20, 0.3, 30, 0.05, 0, 0, 0, 0, 0, 0], rtol=1e-6)


def test_pictures_without_them_keep_nothing_for_them(device: Device) -> None:
    """The programs are the same, and what pixels carry is less."""
    scene = scene_of(**SECTIONS)
    without, with_them = (
        plan_of(scene, device, channels=names) for names in (("R", "A"), ("R", "A", "object"))
    )
    assert program_texts(scene, without) == program_texts(scene, with_them)
    assert state_numbers(scene, without) + path_state.CRYPTOMATTE.numbers == state_numbers(scene, with_them)


@pytest.mark.parametrize(
    ("sections", "channels", "message"),
    [
        ({"renderer": {"type": "volume"}}, ["CryptoObject"], "CryptoObject00.R is known of surfaces only"),
        ({}, ["CryptoObject00.R", "R"], "CryptoObject is one thing: name CryptoObject, which brings all"),
        ({}, ["CryptoObjekt"], "unknown channel 'CryptoObjekt'; did you mean 'CryptoObject'?"),
        ({}, ["albedo", "albedo.G"], "channel 'albedo.G' is given twice"),
    ],
)
def test_what_cannot_be_is_told(sections: dict[str, Any], channels: list[str], message: str) -> None:
    with pytest.raises(SceneError, match=re.escape(message)):
        clfractal.render(scene_of(**sections), channels=channels)


def test_layers_in_scene_files() -> None:
    text = "version: 1\nformula: {name: hast}\ncamera: {}\noutput:\n  channels: [R, CryptoObject, N]\n"
    scene = clfractal.load_scene(text)
    assert scene.output.channels == ("R", *CRYPTOMATTE_OBJECTS, "N.X", "N.Y", "N.Z")
    with pytest.raises(SceneError, match=r"channel 'N.Y' is given twice") as caught:
        clfractal.load_scene(text.replace("N]", "N, N.Y]"))
    assert caught.value.where.line == 5
