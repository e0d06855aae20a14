"""Layers of pictures: albedo, emission, direct and indirect light, against the picture, closed forms and each other."""

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
from clfractal.files.channels import (
    ALBEDO,
    CRYPTOMATTE_MATERIALS,
    CRYPTOMATTE_OBJECTS,
    ID_CHANNELS,
    NORMAL,
    NUMBERED,
    RAY_CHANNELS,
    SURFACE_LAYERS,
)
from clfractal.files.exr import read_exr
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators import path_state
from clfractal.integrators.passes import kept_numbers
from clfractal.integrators.state import state_numbers
from clfractal.integrators.surface import program_texts
from clfractal.shading.cryptomatte import bits_of, identifier, murmur3, ranked
from tests.render.path_scenes import BLACK, path, scene_of
from tests.render.shots import Floats, plan_of, shoot
from tests.variants import one_of

SHINES = (0.5, 0.25, 0.0)
CLAY: dict[str, Any] = {"base": {"color": [0.6, 0.3, 0.1]}, "specular": {"weight": 0}}
GLOWING: dict[str, Any] = {**CLAY, "emission": {"luminance": 0.5, "color": [1, 0.5, 0]}}
SKY = {"top": [0.3, 0.4, 0.5], "bottom": [0.1, 0.1, 0.1]}
SUN = {"direction": [-1, 1, -1], "intensity": 2}
# Menger's sponge: light goes on from wall to wall.
HOLLOW = {"name": "menger_sponge", "iterations": 3}


def rendered(material: dict[str, Any], *, samples: int = 8, **sections: Any) -> Framebuffer:
    """The picture with all channels, of `scene_of` with a material."""
    renderer = {"samples": samples, **sections.pop("renderer", {})}
    values = {"lighting": path(3), "lights": [SUN], "renderer": renderer, **sections}
    scene = scene_of(materials={"m": material}, material={"name": "m"}, **values)
    return clfractal.render(scene, channels=[*RAY_CHANNELS, *SURFACE_LAYERS])


def layer(framebuffer: Framebuffer, name: str, parts: str = "RGB") -> Floats:
    """A layer, shape (height, width, 3); the picture itself if the name is empty."""
    names = [f"{name}.{part}" if name else part for part in parts]
    return np.stack([framebuffer[each] for each in names], axis=-1).astype(np.float64)


def light(framebuffer: Framebuffer) -> Floats:
    """The sum of the three layers of light."""
    return layer(framebuffer, "emission") + layer(framebuffer, "direct") + layer(framebuffer, "indirect")


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("formula", [None, HOLLOW])
def test_the_layers_of_light_are_the_picture(formula: dict[str, Any] | None, precision: str) -> None:
    """To rounding, in every pixel, where nothing else is in the picture."""
    more: dict[str, Any] = (
        {} if formula is None else {"formula": formula, "camera": {"position": [2, -3, 1.5], "fov": 40}}
    )
    framebuffer = rendered(GLOWING, background="transparent", renderer={"precision": precision}, **more)
    whole = layer(framebuffer, "")
    assert whole.max() > 0.5
    assert np.abs(light(framebuffer) - whole).max() < 2e-6 * whole.max()
    indirect = layer(framebuffer, "indirect")
    assert indirect.min() >= 0
    assert layer(framebuffer, "direct").min() >= 0
    if formula is not None:
        assert indirect.max() > 0.05


def test_the_rest_is_the_background() -> None:
    framebuffer = rendered(GLOWING, background={"top": [0.3, 0.4, 0.5], "bottom": [0.3, 0.4, 0.5]})
    rest = layer(framebuffer, "") - light(framebuffer)
    assert np.allclose(rest, (1 - framebuffer["A"][..., None]) * [0.3, 0.4, 0.5], atol=2e-6)
    assert 0 < framebuffer["A"].mean() < 1


def test_fog_dims_the_layers_like_the_picture() -> None:
    """Black fog takes light away and brings none."""
    framebuffer = rendered(GLOWING, background="transparent", fog={"color": [0, 0, 0], "density": 0.4})
    clear = rendered(GLOWING, background="transparent")
    assert np.allclose(light(framebuffer), layer(framebuffer, ""), atol=2e-6)
    full = framebuffer["A"] == 1
    assert (light(framebuffer)[full].sum(axis=-1) < 0.6 * light(clear)[full].sum(axis=-1)).all()
    # Emission is the same everywhere, so it tells what comes through.
    comes = layer(framebuffer, "emission")[full][:, :1] / layer(clear, "emission")[full][:, :1]
    for name, parts in (("albedo", "RGB"), ("normal", "XYZ")):
        assert np.allclose(
            layer(framebuffer, name, parts)[full], comes * layer(clear, name, parts)[full], atol=1e-3
        )


def test_a_plane_in_front_dims_the_layers_like_the_picture() -> None:
    """A quad that lets 0.4 of the light through, in one half of the picture."""
    black = {"palette": ["#000000", "#000000"], "inside": [0, 0, 0]}
    place = {"center": [1, -2, 0], "normal": [0, -1, 0], "width": 2, "height": 4}
    quad = {"plane": place, "colors": black, "opacity": 0.6}
    framebuffer = rendered(GLOWING, background="transparent", cut_planes=[quad])
    clear = rendered(GLOWING, background="transparent")
    assert np.allclose(light(framebuffer), layer(framebuffer, ""), atol=2e-6)
    assert layer(clear, "")[:, 26:].max() > 0.5
    for name in ("", "albedo", "direct", "indirect", "emission"):
        assert np.allclose(layer(framebuffer, name)[:, 26:], 0.4 * layer(clear, name)[:, 26:], atol=1e-5)


def test_emission_is_what_the_material_shines_with() -> None:
    framebuffer = rendered(GLOWING, background=BLACK, lights=[])
    full = framebuffer["A"] == 1
    assert np.allclose(layer(framebuffer, "emission")[full], SHINES, rtol=1e-6)
    # A ball lights nothing of itself.
    assert not layer(framebuffer, "direct")[full].any()


def test_direct_light_of_a_sun_is_lamberts() -> None:
    """A matt ball under one sun: colour x intensity x cosine, and nothing more."""
    framebuffer = rendered(CLAY, background=BLACK, samples=1)
    toward = np.array([1, -1, 1]) / math.sqrt(3)
    cosine = np.clip(layer(framebuffer, "N", "XYZ") @ toward, 0, None)
    full = (framebuffer["A"] == 1) & (cosine > 0.05)
    wanted = 2 * cosine[..., None] * [0.6, 0.3, 0.1]
    assert full.sum() > 200
    assert np.allclose(layer(framebuffer, "direct")[full], wanted[full], rtol=2e-3)
    assert not layer(framebuffer, "emission").any()


def test_what_a_sky_brings_is_direct() -> None:
    """A white sky lights a matt ball as brightly from everywhere: its colour. Found by chance, at the next spot."""
    white = {"top": [1, 1, 1], "bottom": [1, 1, 1]}
    framebuffer = rendered(CLAY, background=white, lights=[], lighting=path(0), samples=64)
    full = framebuffer["A"] == 1
    assert np.allclose(layer(framebuffer, "direct")[full].mean(axis=0), [0.6, 0.3, 0.1], rtol=5e-3)
    assert not layer(framebuffer, "indirect")[full].any()


@pytest.mark.parametrize(
    ("material", "albedo"),
    [
        (CLAY, (0.6, 0.3, 0.1)),
        ({"base": {"color": [0.9, 0.6, 0.3], "metalness": 1, "weight": 0.5}}, (0.45, 0.3, 0.15)),
        (
            {"base": {"color": [0.8, 0.8, 0.8]}, "coat": {"weight": 0.5, "color": [1, 0.5, 0]}},
            (0.8, 0.6, 0.4),
        ),
    ],
)
def test_albedo_is_the_materials(material: dict[str, Any], albedo: tuple[float, float, float]) -> None:
    framebuffer = rendered(material, background=SKY, samples=4)
    cover = framebuffer["A"][..., None]
    assert np.allclose(layer(framebuffer, "albedo"), cover * albedo, atol=1e-5)
    assert cover.max() == 1


def test_albedo_without_paths_is_the_surfaces_colour() -> None:
    for coloring in ({}, {"by": "normal"}):
        scene = scene_of(material={"color": [0.8, 0.5, 0.2]}, coloring=coloring, renderer={"samples": 1})
        framebuffer = clfractal.render(scene, channels=["A", "N.X", "N.Y", "N.Z", *ALBEDO, *NORMAL])
        full = framebuffer["A"] == 1
        found = layer(framebuffer, "albedo")[full]
        if coloring:
            assert found.std(axis=0).max() > 0.1
        else:
            assert np.allclose(found, [0.8, 0.5, 0.2], atol=1e-6)
        assert np.array_equal(layer(framebuffer, "normal", "XYZ"), layer(framebuffer, "N", "XYZ"))


def test_a_lamp_that_is_seen_is_emission_and_white() -> None:
    lamp = {"type": "sphere", "position": [0, -2.5, 0], "radius": 0.3, "intensity": 3}
    framebuffer = rendered(CLAY, background=BLACK, lights=[lamp], samples=4)
    middle = (24, 24)
    assert np.allclose(layer(framebuffer, "emission")[middle], 3, rtol=1e-5)
    assert np.allclose(layer(framebuffer, "albedo")[middle], 1)
    assert not layer(framebuffer, "direct")[middle].any()


@pytest.mark.parametrize(
    ("names", "sections", "message"),
    [
        (("direct.R",), {}, "direct.R needs lighting: {mode: path}"),
        (("albedo.G",), {"renderer": {"type": "volume"}}, "albedo.G is known of surfaces only"),
        (("R", "noisy.R"), {}, "noisy.R is what was denoised; it needs output.denoise: true"),
        (("CryptoObject",), {"renderer": {"type": "volume"}}, "CryptoObject00.R is known of surfaces only"),
        (("CryptoObject00.R", "R"), {}, "CryptoObject is one thing: name CryptoObject, which brings all"),
        (("CryptoObjekt",), {}, "unknown channel 'CryptoObjekt'; did you mean 'CryptoObject'?"),
        (("albedo", "albedo.G"), {}, "channel 'albedo.G' is given twice"),
    ],
)
def test_channels_that_a_scene_cannot_have(
    names: tuple[str, ...], sections: dict[str, Any], message: str
) -> None:
    with pytest.raises(SceneError, match=re.escape(message)) as caught:
        clfractal.render(scene_of(**sections), channels=names)
    assert caught.value.where.path == "channels"


def test_every_number_of_a_pixel_is_kept_under_its_own_name(device: Device) -> None:
    """18 numbers of a pixel and the 15 of its layers, in the order of the kernels' structs."""
    plan = plan_of(scene_of(lighting=path(1)), device, channels=(*RAY_CHANNELS, *SURFACE_LAYERS))
    renderer = scene_of(renderer={"samples": 8, "noise": 0.01}).renderer
    assert len(kept_numbers(plan, renderer)) == 33


AROUND = {"color": [1, 0.5, 0.1], "intensity": 0.25, "width": 0.05}


@pytest.mark.parametrize("lanes", one_of(None, 1, 4))
@pytest.mark.parametrize(("mist", "points"), one_of((False, 1), (True, 1), (False, 4)))
def test_the_glow_is_light_that_is_seen_at_once(
    device: Device, lanes: int | None, mist: bool, points: int
) -> None:
    """The layers have it too: before the surface, and where rays meet nothing. What the set reflects of it is direct."""
    more: dict[str, Any] = {"fog": {"color": [0, 0, 0], "density": 0.3}} if mist else {}
    scene = scene_of(
        formula={"name": "mandelbulb", "iterations": 4},
        camera={"position": [1.9, -3.3, 0.9], "fov": 40},
        image={"width": 48, "height": 40},
        lighting=path(4),
        glow=AROUND,
        background="transparent",
        renderer={"samples": 4, "points": {"count": points, "pattern": "grid"}},
        **more,
    )
    framebuffer = shoot(scene, device, channels=(*RAY_CHANNELS, *SURFACE_LAYERS), lanes=lanes)
    whole = layer(framebuffer, "")
    assert np.abs(light(framebuffer) - whole).max() < 1e-5 * whole.max()
    nothing = framebuffer["A"] == 0
    assert whole[nothing].max() > 0.03
    np.testing.assert_allclose(layer(framebuffer, "emission")[nothing], whole[nothing], atol=1e-6)


def test_light_before_and_behind_planes_is_dimmed_by_them(device: Device) -> None:
    """A plane of a picture takes the same part of the layers as of what is seen through it."""
    plane = {"center": [0, -1.5, 0], "normal": [0, -1, 0], "width": 8, "height": 8}
    behind = {"center": [0, 1.5, 0], "normal": [0, -1, 0], "width": 8, "height": 8}
    scene = scene_of(
        lighting=path(1),
        lights=[SUN],
        glow={**AROUND, "width": 0.3},
        background="transparent",
        cut_planes=[{"plane": plane, "opacity": 0.5}, {"plane": behind, "opacity": 0.25}],
        renderer={"samples": 1},
    )
    without = shoot(
        scene.model_copy(update={"cut_planes": []}), device, channels=(*RAY_CHANNELS, *SURFACE_LAYERS)
    )
    framebuffer = shoot(scene, device, channels=(*RAY_CHANNELS, *SURFACE_LAYERS))
    through = np.where(without["A"] == 1, 0.5, 0.375)[..., None]
    np.testing.assert_allclose(light(framebuffer), light(without) * through, atol=1e-4)


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


def test_the_face_of_a_cut_has_the_material_of_its_plane() -> None:
    """A disc where it opens the ball, and a rectangle where it opens a box; other planes leave the thing's material."""
    plane = {"plane": {"center": [0, -0.6, 0], "normal": [0, -1, 0]}, "cut": True, "objects": ["slab"]}
    unseen = {"plane": {"center": [0, 0.9, 0], "normal": [0, 1, 0]}, "cut": True, "material": "red"}
    slab = {"type": "box", "position": [1.2, -0.5, 0], "size": [0.2, 0.4, 0.5], "material": "red"}
    sections = {**SECTIONS, "objects": {"slab": slab}, "lighting": path(1)}
    found = {}
    for material in ("blue", None):
        scene = scene_of(**{**sections, "cut_planes": [unseen, {**plane, "material": material}]})
        film = clfractal.render(scene, channels=["A", *ID_CHANNELS])
        pixel = (HEIGHT / PIXELS) ** 2
        found[material] = [
            coverage(film, layer, name).sum() * pixel
            for layer, name in [
                ("CryptoObject", "set"),
                ("CryptoObject", "slab"),
                ("CryptoMaterial", "blue"),
                ("CryptoMaterial", "red"),
                ("CryptoMaterial", "material"),
            ]
        ]
        middle = PIXELS // 2
        assert film["object"][middle, middle] == 1
        assert film["material"][middle, middle] == (2 if material else 3)
    disc, box = math.pi * 0.64, 0.2 * 0.5
    assert found["blue"] == pytest.approx([math.pi, box, disc + box, 0, math.pi - disc], rel=0.01, abs=0.004)
    assert found[None] == pytest.approx([math.pi, box, 0, box, math.pi], rel=0.01, abs=0.004)


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


def test_layers_in_scene_files() -> None:
    text = "version: 1\nformula: {name: hast}\ncamera: {}\noutput:\n  channels: [R, CryptoObject, N]\n"
    scene = clfractal.load_scene(text)
    assert scene.output.channels == ("R", *CRYPTOMATTE_OBJECTS, "N.X", "N.Y", "N.Z")
    with pytest.raises(SceneError, match=r"channel 'N.Y' is given twice") as caught:
        clfractal.load_scene(text.replace("N]", "N, N.Y]"))
    assert caught.value.where.line == 5
