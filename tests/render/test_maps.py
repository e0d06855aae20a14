"""Materials that differ from place to place, against the same curves, palettes and pictures in NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

import clfractal
from clfractal.device.select import choose
from clfractal.device.structs import Precision
from clfractal.engine.prepare import prepare
from clfractal.files.srgb import decode
from clfractal.scene.load import dump_scene
from clfractal.scene.model import Scene
from clfractal.shading.maps import level_sizes, levels_of
from tests.devices import check_usable
from tests.render import reliefs
from tests.render.bits import alike_by_lanes
from tests.render.path_scenes import GREY, path, scene_of, seen
from tests.render.reliefs import BULB, Floats, ramp
from tests.variants import one_of

pytestmark = pytest.mark.light


DARK: dict[str, Any] = {"base": {"weight": 0}, "specular": {"weight": 0}}
RAMP = [[0.1, 0.5, 0.9], [0.7, 0.2, 0.3], [0.2, 0.8, 0.4]]


def shining(emission: dict[str, Any], **sections: Any) -> Scene:
    """A ball that only shines: one sample of a pixel is its emission at one spot.

    With this little detail light is computed where the ray has met the ball, which the channel P tells.
    """
    return scene_of(
        **{
            "lighting": path(),
            "materials": {"m": {**DARK, "emission": emission}},
            "material": {"name": "m"},
            "renderer": {"samples": 1, "detail": 0.01},
            **sections,
        }
    )


def shown(scene: Scene, **options: Any) -> tuple[Floats, dict[str, Floats]]:
    """Colours, shape (n, 3), of the pixels that see the set; what else their only samples have found there."""
    found = reliefs.facts(scene, **options)
    return found["color"], found


BY: dict[str, dict[str, Any]] = {
    "normal": {"direction": [1, 0, 2], "range": [-0.5, 1]},
    "height": {"direction": [0, 1, -3], "range": [1, -1]},
    "distance": {"center": [0.4, -1, 0.3], "range": [0.3, 1.4]},
}


@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_colors_follow_quantities(by: str, precision: Precision) -> None:
    check_usable(precision)
    colors, facts = shown(
        shining({"luminance": 1, "color": {"by": by, "palette": RAMP, **BY[by]}}), precision=precision
    )
    low, high = BY[by]["range"]
    vector = np.array(BY[by].get("direction") or BY[by]["center"])
    known = {
        "normal": facts["N"] @ vector / np.linalg.norm(vector),
        "height": facts["P"] @ vector / np.linalg.norm(vector),
        "distance": np.linalg.norm(facts["P"] - vector, axis=-1),
    }
    place = (known[by] - low) / (high - low)
    assert place.min() < 0.15
    assert place.max() > 0.8
    assert np.abs(colors - ramp(np.clip(place, 0, 1), RAMP)).max() < 0.005


def test_iterations_of_a_fractal() -> None:
    scene = shining({"luminance": 1, "color": {"by": "iterations", "range": [2, 5], "palette": RAMP}}, **BULB)
    colors, facts = shown(scene)
    place = (facts["iterations"][:, 0] - 2) / 3
    assert np.ptp(place) > 0.2
    assert np.abs(colors - ramp(np.clip(place, 0, 1), RAMP)).max() < 0.004


def test_numbers_follow_curves() -> None:
    curve = [[0, 0.2], [0.25, 0.9], [1, 0.4]]
    scene = shining({"luminance": {"by": "normal", "curve": curve}, "color": [1, 0.5, 0.25]})
    colors, facts = shown(scene)
    at, values = zip(*curve, strict=True)
    expected = np.interp((facts["N"][:, 2] + 1) / 2, at, values)
    assert np.abs(colors - expected[:, None] * [1, 0.5, 0.25]).max() < 0.005


def test_a_map_repeats() -> None:
    """With `repeat` the last colour blends into the first, in the last 256th."""
    color = {"by": "normal", "range": [0, 0.25], "repeat": True, "palette": [[0, 0, 0], [1, 1, 1]]}
    colors, facts = shown(shining({"luminance": 1, "color": color}))
    place = (facts["N"][:, 2] / 0.25) % 1
    inside = (place > 0.02) & (place < 0.98)
    assert np.abs(colors[inside, 0] - place[inside] * 256 / 255).max() < 0.01


def test_the_formula_is_asked() -> None:
    """A ball's mean curvature is 1 / radius everywhere, its thickness its diameter, a trap's distance that of its plane."""
    for by, expected, tolerance in (("curvature", 1.0, 0.02), ("thickness", 2.0, 0.03)):
        scene = shining({"luminance": {"by": by, "range": [0, 4]}, "color": [4, 4, 4]})
        colors, _ = shown(scene)
        assert np.abs(colors - expected).max() < tolerance, by


@pytest.mark.combination
def test_every_lane_is_alone() -> None:
    emission = {
        "luminance": {"by": "trap", "trap": {"shape": "plane"}, "range": [0, 0.5]},
        "color": {"by": "normal", "palette": RAMP},
    }
    alike_by_lanes(shining(emission, **BULB), choose(), share=0.95, apart=2e-4)


@pytest.mark.combination
def test_two_questions_have_their_own_answers() -> None:
    """Two traps in one material: the picture is the product of the pictures of each."""
    one = {"by": "trap", "trap": {"shape": "plane"}, "range": [0, 0.5]}
    two = {"by": "trap", "trap": {"shape": "axis"}, "range": [0, 1], "palette": RAMP}
    both = shown(shining({"luminance": one, "color": two}, **BULB))[0]
    first = shown(shining({"luminance": one}, **BULB))[0]
    second = shown(shining({"luminance": 1, "color": two}, **BULB))[0]
    assert first.std() > 0.05
    assert np.abs(both - first * second).max() < 2e-3


@pytest.mark.combination
@pytest.mark.parametrize("mask", one_of(1, 0))
def test_a_blend_at_its_ends_is_its_part(mask: int) -> None:
    """Bit for bit, nested as well."""
    parts: dict[str, Any] = {
        "a": {"base": {"color": [0.2, 0.5, 0.8]}, "coat": {"weight": 0.5}},
        "b": {"base": {"color": [0.9, 0.6, 0.2], "metalness": 1}, "emission": {"luminance": 0.5}},
    }
    nested: dict[str, Any] = {
        **parts,
        "c": {"blend": ["b", "a"], "mask": 1 - mask},
        "m": {"blend": ["a", "c"], "mask": mask},
    }
    sky: dict[str, Any] = {"lighting": path(1), "background": GREY}
    blend = seen(scene_of(materials=nested, material={"name": "m"}, **sky), 4)[0]
    # The part in the same program: a blend with itself.
    alone = {**parts, "m": {"blend": ["ab"[mask], "ab"[mask]], "mask": mask}}
    assert np.array_equal(blend, seen(scene_of(materials=alone, material={"name": "m"}, **sky), 4)[0])
    plain = seen(scene_of(materials=parts, material={"name": "ab"[mask]}, **sky), 4)[0]
    assert np.abs(blend - plain).max() < 1e-4


RED = [0.9, 0.1, 0.1]
HALVES: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any]]] = {
    "coat": (
        {"coat": {"weight": 1, "color": RED, "roughness": 0.4, "ior": 1.9}},
        {},
        {"coat": {"weight": 0.5, "color": RED, "roughness": 0.4, "ior": 1.9}},
    ),
    "coats of two weights": (
        {"coat": {"weight": 0.9, "color": RED}},
        {"coat": {"weight": 0.3, "color": [0.1, 0.1, 0.9]}},
        {"coat": {"weight": 0.6, "color": [0.7, 0.1, 0.3]}},
    ),
    "fuzz": (
        {"fuzz": {"weight": 0.8, "color": RED, "roughness": 0.9}},
        {},
        {"fuzz": {"weight": 0.4, "color": RED, "roughness": 0.9}},
    ),
    "film": (
        {"thin_film": {"weight": 1, "thickness": 0.4}},
        {},
        {"thin_film": {"weight": 0.5, "thickness": 0.4}},
    ),
    "glass": (
        {"transmission": {"weight": 1, "color": RED}, "base": {"color": [1, 1, 1]}},
        {"base": {"color": [0.1, 0.2, 0.9]}},
        {"transmission": {"weight": 0.5, "color": RED}, "base": {"color": [0.1, 0.2, 0.9]}},
    ),
    "glass and metal": (
        {"transmission": {"weight": 1, "color": RED}, "base": {"color": [1, 1, 1]}},
        {"base": {"color": [0.1, 0.2, 0.9], "metalness": 1}},
        {"transmission": {"weight": 0.5, "color": RED}, "base": {"color": [0.1, 0.2, 0.9], "metalness": 0.5}},
    ),
    "skin": (
        {"subsurface": {"weight": 1, "color": RED, "radius": 0.3, "radius_scale": [1, 0.2, 0.2]}},
        {"base": {"color": [0.1, 0.2, 0.9]}},
        {
            "subsurface": {"weight": 0.5, "color": RED, "radius": 0.3, "radius_scale": [1, 0.2, 0.2]},
            "base": {"color": [0.1, 0.2, 0.9]},
        },
    ),
}


@pytest.mark.parametrize("name", HALVES)
def test_what_a_part_has_counts_by_its_weight(name: str) -> None:
    """Half of one and half of another is the material of half the weight, with the numbers of the one that has it."""
    one, other, half = HALVES[name]
    materials = {"one": one, "other": other, "m": {"blend": ["one", "other"], "mask": 0.5}}
    sky: dict[str, Any] = {"lighting": path(4), "background": GREY, "lights": [{"direction": [-1, 1, -1]}]}
    blend = seen(scene_of(materials=materials, material={"name": "m"}, **sky), 4)[0]
    plain = seen(scene_of(materials={"m": half}, material={"name": "m"}, **sky), 4)[0]
    assert blend.std() > 0.02
    # (A path in some hundred goes another way where a number differs in its last digits.)
    assert (np.abs(blend - plain).max(axis=1) < 2e-3).mean() > 0.98
    assert blend.mean(axis=0) == pytest.approx(plain.mean(axis=0), rel=2e-3)


def test_a_mask_mixes_what_its_parts_shine() -> None:
    parts = {
        "a": {**DARK, "emission": {"luminance": 2, "color": [1, 0, 0]}},
        "b": {**DARK, "emission": {"luminance": 4, "color": [0, 0, 1]}},
        "m": {"blend": ["a", "b"], "mask": {"by": "normal", "range": [0, 0.5]}},
    }
    colors, facts = shown(
        scene_of(lighting=path(), materials=parts, material={"name": "m"}, renderer={"samples": 1})
    )
    share = np.clip(facts["N"][:, 2] / 0.5, 0, 1)
    assert np.abs(colors[:, 0] - 2 * (1 - share)).max() < 0.02
    assert np.abs(colors[:, 2] - 4 * share).max() < 0.04


# -- pictures


@pytest.fixture
def picture(tmp_path: Path) -> npt.NDArray[np.uint8]:
    """Codes of a picture that is nowhere the same, saved as tile.png."""
    random = np.random.default_rng(4)
    codes = random.integers(0, 256, (7, 12, 3), dtype=np.uint8)
    Image.fromarray(codes).save(tmp_path / "tile.png")
    return codes


def look_up(pixels: Floats, u: Floats, v: Floats) -> Floats:
    """A picture that repeats, blended linearly; u to the right and v down, in pictures."""
    height, width, _ = pixels.shape
    x, y = (u % 1) * width - 0.5, (v % 1) * height - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    right, low = (x - column)[:, None], (y - row)[:, None]

    def at(i: int, j: int) -> Floats:
        return np.asarray(pixels[(row + j) % height, (column + i) % width])

    upper = at(0, 0) * (1 - right) + at(1, 0) * right
    lower = at(0, 1) * (1 - right) + at(1, 1) * right
    return np.asarray(upper * (1 - low) + lower * low)


def from_three_sides(pixels: Floats, facts: dict[str, Floats], scale: float, sharpness: float) -> Floats:
    p, high = facts["P"] / scale, facts["P"] / scale * pixels.shape[1] / pixels.shape[0]
    weights = np.abs(facts["N"]) ** sharpness
    weights /= weights.sum(axis=1, keepdims=True)
    sides = (
        look_up(pixels, p[:, 1], -high[:, 2]),
        look_up(pixels, p[:, 0], -high[:, 2]),
        look_up(pixels, p[:, 0], -high[:, 1]),
    )
    return np.asarray(sum(weights[:, i : i + 1] * side for i, side in enumerate(sides)))


def placed(tmp_path: Path, emission: dict[str, Any], **sections: Any) -> Scene:
    """As `shining`, in the folder of the pictures."""
    scene = shining(emission, **sections)
    return clfractal.load_scene(dump_scene(scene.placed(tmp_path)), folder=tmp_path)


def test_a_picture_is_shown_from_three_sides(tmp_path: Path, picture: npt.NDArray[np.uint8]) -> None:
    emission = {"luminance": 1, "color": {"texture": "tile.png", "scale": 1.5, "sharpness": 3}}
    colors, facts = shown(placed(tmp_path, emission))
    expected = from_three_sides(decode(picture / 255), facts, 1.5, 3)
    assert np.abs(colors - expected).max() < 0.02
    assert np.ptp(expected) > 0.3


def test_numbers_are_codes(tmp_path: Path, picture: npt.NDArray[np.uint8]) -> None:
    """A picture's grey is a number as its codes say, through the curve."""
    number = {"texture": "tile.png", "scale": 1.5, "curve": [[0, 1], [1, 3]]}
    colors, facts = shown(placed(tmp_path, {"luminance": number}))
    grey = np.repeat((picture / 255 @ [0.2126, 0.7152, 0.0722])[..., None], 3, axis=-1)
    assert np.abs(colors - 1 - 2 * from_three_sides(grey, facts, 1.5, 4)).max() < 0.04


def test_far_pictures_are_their_mean(tmp_path: Path, picture: npt.NDArray[np.uint8]) -> None:
    """Where a pixel covers a whole picture there is nothing left to shimmer."""
    colors, _ = shown(placed(tmp_path, {"luminance": 1, "color": {"texture": "tile.png", "scale": 0.02}}))
    assert np.abs(colors - decode(picture / 255).mean(axis=(0, 1))).max() < 1e-3


@pytest.mark.parametrize("shape", [(7, 12), (1, 5), (64, 64), (3, 1)])
def test_levels_keep_the_mean(shape: tuple[int, int]) -> None:
    pixels = np.random.default_rng(1).random((*shape, 3), np.float32)
    levels = levels_of(pixels)
    assert [level.shape[1::-1] for level in levels] == level_sizes(shape[1], shape[0])
    for level in levels:
        assert np.allclose(level.mean(axis=(0, 1)), pixels.mean(axis=(0, 1)), atol=1e-5)


# -- what is told


def test_a_scene_with_maps_is_written_and_read(tmp_path: Path, picture: npt.NDArray[np.uint8]) -> None:
    scene = placed(tmp_path, {"luminance": {"texture": "tile.png"}, "color": {"by": "trap", "palette": RAMP}})
    assert clfractal.load_scene(dump_scene(scene), folder=tmp_path) == scene
    assert tmp_path / "tile.png" in scene.files


def test_work_on_another_picture_is_other_work(tmp_path: Path, picture: npt.NDArray[np.uint8]) -> None:
    """The scene only names its pictures; of a scene that moves they are not read again."""
    emission = {"luminance": 1, "color": {"texture": "tile.png"}}

    def known_by() -> dict[str, Any]:
        return prepare(placed(tmp_path, emission), choose(), precision="float32").identity(0)

    before = known_by()
    assert known_by() == before
    scene = placed(tmp_path, emission)
    Image.fromarray(255 - picture).save(tmp_path / "tile.png")
    after = known_by()
    assert {key for key in before if before[key] != after[key]} == {"textures"}
    moved = scene.model_copy(update={"materials": {**scene.materials, "other": {}}})
    assert moved.textures["tile.png"] is scene.textures["tile.png"]
