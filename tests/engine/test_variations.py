"""Variations: reproducible, valid, different from each other, larger where bolder ones are wanted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import clfractal
from clfractal.device.select import Device
from clfractal.engine.variations import (
    KINDS,
    PREVIEW_SIZE,
    STRENGTHS,
    candidates,
    small_scene,
    variations,
    worthwhile,
)
from clfractal.engine.varied import AMOUNT, Kind, Strength, is_locked, rounded
from clfractal.engine.vary_colors import Grade
from clfractal.engine.vary_formula import expanded, moved_value, shown_parameters, slots
from clfractal.formulas import catalog
from clfractal.formulas.definition import Parameter
from clfractal.formulas.opencl import write_formula
from clfractal.scene.palettes import from_oklab, to_oklab
from clfractal.scene.parts import PerspectiveCamera
from clfractal.schema.base import cross, length, minus
from tests.scenes import scene_of
from tests.variants import every

SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("*.yaml"))
BULB = clfractal.load_scene("""version: 1
formula: {name: mandelbulb, parameters: {power: 8, theta_phase: 0.2}, julia: [0.3, 0.2, -0.4], iterations: 8}
image: {width: 48, height: 32}
camera: {position: [1.6, -2.2, 1.0], fov: 48}
lights: [{direction: [1, 1, -1], color: [1, 0.8, 0.6]}, {direction: [-1, 0, 0], shadow: false}]
coloring: {by: iterations, palette: hearth}
""")
# Keys that decide how finely or how fast a picture is made, but not what it shows.
TUNING = {
    *(
        "step_scale",
        "iterations",
        "detail",
        "over_relaxation",
        "samples",
        "precision",
        "max_steps",
        "noise",
        "rays",
    ),
    *(
        "bailout",
        "distance_bailout",
        "firefly_limit",
        "bounces",
        "search",
        "points",
        "normal",
        "filter",
        "step",
    ),
    *(
        "seed",
        "min_samples",
        "filter_width",
        "ambient_occlusion",
        "resolution",
        "sub_points",
        "store",
        "periodicity",
    ),
    *("version", "image", "stereo", "output", "shadow", "live", "name", "count", "up"),
}


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, child in value.items():
            yield from leaves(child, f"{path}.{key}" if path else str(key))
    elif isinstance(value, (list, tuple)):
        for index, child in enumerate(value):
            yield from leaves(child, f"{path}.{index}")
    else:
        yield path, value


def different(one: clfractal.Scene, other: clfractal.Scene) -> set[str]:
    """Dotted paths of the numbers and words in which two scenes differ."""
    first, second = dict(leaves(one.resolved())), dict(leaves(other.resolved()))
    return {path for path in {*first, *second} if first.get(path) != second.get(path)}


def check_twelve(path: Path, strength: Strength) -> None:
    """That there are as many, valid and different."""
    scene = clfractal.load_scene(path)
    found = variations(scene, strength=strength)
    assert len(found) == 12
    texts = [clfractal.dump_scene(each.scene) for each in found]
    assert len({*texts, clfractal.dump_scene(scene)}) == 13
    for each, text in zip(found, texts, strict=True):
        assert clfractal.load_scene(text, folder=scene.folder) == each.scene
        assert each.remark
        assert "\n" not in each.remark


@pytest.mark.parametrize(
    ("path", "strength"),
    list(zip(SCENES[1::3], cycle(STRENGTHS), strict=False)),
    ids=lambda value: Path(value).stem,
)
def test_shipped_scenes_have_twelve_valid_different_ones(path: Path, strength: Strength) -> None:
    check_twelve(path, strength)


@pytest.mark.combination
@pytest.mark.parametrize("strength", STRENGTHS)
def test_every_shipped_scene_has_them_at_every_strength(strength: Strength) -> None:
    for path in SCENES:
        check_twelve(path, strength)


@pytest.mark.parametrize("path", every(3, SCENES), ids=lambda path: str(path.stem))
def test_nothing_that_tunes_the_search_changes(path: Path) -> None:
    scene = clfractal.load_scene(path)
    for each in variations(scene, strength="heavy", seed=3):
        found = different(expanded(scene), each.scene)
        assert found
        assert not {part for name in found for part in name.split(".")} & TUNING - {"normal", "up"}
        # (A cut plane's own normal and top do change.)
        assert not {name for name in found if name.endswith((".normal", ".up")) and "plane" not in name}


def test_every_change_is_named() -> None:
    for each in variations(BULB, strength="heavy", seed=1):
        for name in different(BULB, each.scene):
            assert is_locked(name, each.changes), name
        for name, value in each.changes.items():
            found = each.scene.resolved()
            for part in name.split("."):
                found = found[int(part)] if isinstance(found, list) else found[part]
            assert found == value


@given(seed=st.integers(0, 2**40), strength=st.sampled_from(STRENGTHS), count=st.integers(1, 5))
def test_the_same_arguments_give_the_same_ones_and_fewer_are_the_first(
    seed: int, strength: Strength, count: int
) -> None:
    found = variations(BULB, count=count, strength=strength, seed=seed)
    again = variations(BULB, count=6, strength=strength, seed=seed)
    assert [each.changes for each in found] == [each.changes for each in again[:count]]
    assert [each.scene for each in found] == [each.scene for each in again[:count]]


def test_another_seed_gives_others() -> None:
    first, second = variations(BULB, seed=1), variations(BULB, seed=2)
    assert not {repr(each.changes) for each in first} & {repr(each.changes) for each in second}


def formula_size(scene: clfractal.Scene, before: clfractal.Scene) -> float:
    """The change of parameters, as parts of their ranges, and of the constant."""
    total = 0.0
    for slot, old in zip(slots(scene), slots(before), strict=True):
        for parameter in shown_parameters(slot.bound.formula):
            low, high = parameter.minimum or 0.0, parameter.maximum or 1.0
            total += abs(slot.bound.values[parameter.name] - old.bound.values[parameter.name]) / (high - low)
        total += math.dist(slot.bound.julia or (), old.bound.julia or ())
    return total


def camera_size(scene: clfractal.Scene, before: clfractal.Scene) -> float:
    return math.dist(scene.camera.position, before.camera.position)


def colors_size(scene: clfractal.Scene, before: clfractal.Scene) -> float:
    """How far the lights' colours are apart in Oklab, and how far their directions."""
    total = 0.0
    for light, old in zip(scene.lights, before.lights, strict=True):
        total += float(np.linalg.norm(to_oklab(np.array(light.color)) - to_oklab(np.array(old.color))))
        total += math.dist(light.model_dump()["direction"], old.model_dump()["direction"])
    return total + abs(scene.coloring.offset - before.coloring.offset)


@pytest.mark.parametrize(
    ("kind", "size"), [("formula", formula_size), ("camera", camera_size), ("colors", colors_size)]
)
def test_bolder_ones_differ_more(kind: Kind, size: Any) -> None:
    means = []
    for strength in STRENGTHS:
        found = variations(BULB, count=40, strength=strength, kinds=[kind])
        means.append(np.mean([size(each.scene, BULB) for each in found]))
    assert 0 < 1.5 * means[0] < means[1] < means[2] / 1.5


@pytest.mark.parametrize("kind", KINDS)
def test_only_the_kinds_that_are_wanted_change(kind: Kind) -> None:
    own = {
        "formula": {"formula"},
        "camera": {"camera"},
        "colors": {"coloring", "lights", "background", "material"},
    }
    for each in variations(BULB, strength="heavy", kinds=[kind]):
        # (The camera follows a formula whose bounds grow.)
        allowed = own[kind] | ({"camera"} if kind == "formula" else set())
        assert {name.split(".")[0] for name in each.changes} <= allowed


def test_what_is_locked_stays() -> None:
    locked = ["camera.position", "formula.parameters.power", "lights", "coloring.palette"]
    for each in variations(BULB, strength="heavy", locked=locked):
        assert each.scene.camera.position == BULB.camera.position
        assert each.scene.formula.parameters["power"] == 8
        assert each.scene.lights == BULB.lights
        assert each.scene.coloring.palette == "hearth"
    with pytest.raises(clfractal.SceneError, match="nothing can be varied"):
        variations(BULB, locked=["formula", "camera", "coloring", "lights", "background", "material"])


def test_a_set_without_numbers_has_no_variations_of_its_formula() -> None:
    scene = clfractal.load_scene({"version": 1, "formula": {"name": "makin_brot"}, "camera": {}})
    with pytest.raises(clfractal.SceneError, match="nothing can be varied: the scene has no formula"):
        variations(scene, kinds=["formula"])
    assert len(variations(scene)) == 12


def test_few_choices_are_all_found_and_then_it_ends() -> None:
    scene = clfractal.load_scene(
        {"version": 1, "formula": {"name": "hast"}, "camera": {"position": [0, -4, 0]}}
    )
    found = variations(scene, kinds=["formula"], strength="heavy")
    assert sorted(each.scene.formula.parameters["power"] for each in found) == [4, 8]


def test_whole_powers_and_whole_numbers_stay_whole() -> None:
    found = variations(BULB, count=40, strength="heavy", kinds=["formula"])
    powers = {each.scene.formula.parameters["power"] for each in found}
    assert len(powers) > 3
    assert all(power == round(power) and 4 <= power <= 12 for power in powers)


@pytest.mark.parametrize(
    ("name", "power"), [("quaternion_julia", "power"), ("hast", "power"), ("polyhedral_ifs", "order")]
)
def test_slight_ones_keep_a_number_whose_next_value_is_far(name: str, power: str) -> None:
    scene = clfractal.load_scene(
        {"version": 1, "formula": {"name": name}, "camera": {"position": [0, -4, 0]}}
    )
    for each in variations(scene, count=40, strength="slight"):
        assert power not in each.scene.formula.parameters
    heavy = variations(scene, count=40, strength="heavy")
    assert any(power in each.scene.formula.parameters for each in heavy)


def test_a_chain_of_the_library_is_written_out_with_its_picture() -> None:
    scene = clfractal.load_scene({"version": 1, "formula": {"name": "bulbox", "iterations": 6}, "camera": {}})
    assert expanded(scene).chain == scene.chain
    changes = [name for each in variations(scene, kinds=["formula"]) for name in each.changes]
    assert {"formula.inline.chain.0.parameters.power", "formula.inline.chain.1.parameters.scale"} <= {
        *changes
    }


@pytest.mark.parametrize("name", [name for name in catalog.names() if not catalog.is_chain(name)])
def test_parameters_of_the_library_all_shape_the_set(name: str) -> None:
    formula = catalog.load(name)
    assert shown_parameters(formula) == list(formula.parameters)


def test_a_parameter_of_bounds_alone_is_a_setting_of_the_search() -> None:
    inline = {
        "variables": ["x", "y", "z"],
        "parameters": {name: {"type": "real", "default": 1} for name in ("turn", "size", "care")},
        "let": {"c": "cos(turn)"},
        "map": ["x*x - y*y - z*z + c", "2*x*y", "2*x*z"],
        "add": "point",
        "degree": 2,
        "bounds": {"center": [0, 0, 0], "radius": "2 + abs(size)"},
        "bailout": 4,
        "step_scale": "where(care > 0, 0.5, 1)",
    }
    scene = clfractal.load_scene(
        {"version": 1, "formula": {"inline": inline}, "camera": {"position": [0, -9, 0]}}
    )
    assert [parameter.name for parameter in shown_parameters(slots(scene)[0].bound.formula)] == ["turn"]


REAL = st.builds(
    lambda low, span, part: (low, low + span, low + part * span),
    st.floats(-10, 10),
    st.floats(0.01, 20),
    st.floats(0, 1),
)


@given(REAL, st.floats(0.01, 1), st.booleans())
def test_a_moved_parameter_stays_in_its_range(
    numbers: tuple[float, float, float], size: float, negative: bool
) -> None:
    low, high, value = numbers
    parameter = Parameter("a", "real", default=value, minimum=low, maximum=high)
    moved = moved_value(parameter, value, -size if negative else size)
    assert low <= moved <= high
    assert moved != value
    assert abs(moved - value) <= 0.6 * (high - low)


def test_the_camera_keeps_its_target_and_does_not_turn_over() -> None:
    for each in variations(BULB, count=60, strength="heavy", kinds=["camera"]):
        camera = each.scene.camera
        assert isinstance(camera, PerspectiveCamera)
        assert camera.target == BULB.camera.target
        assert camera.up == BULB.camera.up
        away = minus(camera.position, camera.target)
        assert 0.6 < length(away) / length(minus(BULB.camera.position, BULB.camera.target)) < 1.5
        tilt = math.degrees(math.asin(length(cross(away, camera.up)) / length(away)))
        assert tilt > 7
        assert 12 <= camera.fov <= 100


def test_the_camera_follows_a_set_that_grows() -> None:
    scene = scene_of({"name": "mandelbox", "parameters": {"scale": 2}}, {"position": [0, -20, 0]}, None)
    grown = [
        each
        for each in variations(scene, strength="heavy", kinds=["formula"])
        if "camera.position" in each.changes
    ]
    assert grown
    for each in grown:
        ratio = each.scene.chain.radius / scene.chain.radius
        assert each.scene.camera.position[1] == pytest.approx(-20 * ratio, rel=0.01)


COLORS = st.tuples(*[st.floats(0.01, 1)] * 3)


@given(COLORS, st.floats(-180, 180))
def test_a_turned_hue_keeps_the_lightness(color: tuple[float, float, float], hue: float) -> None:
    found = Grade(hue, 1.0, 0.0, 0.0).color(color, largest=1.0)
    assert all(0 <= x <= 1 for x in found)
    before, after = to_oklab(np.array(color)), to_oklab(np.array(found))
    assert after[0] == pytest.approx(before[0], abs=2e-3)
    # Never more colourful than it was.
    assert np.hypot(*after[1:]) <= np.hypot(*before[1:]) + 2e-3


@given(COLORS)
def test_oklab_and_back(color: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(from_oklab(to_oklab(np.array(color))), color, atol=1e-7)


def test_white_is_white_in_oklab() -> None:
    np.testing.assert_allclose(to_oklab(np.ones(3)), [1, 0, 0], atol=1e-6)


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e3))
def test_rounding_is_fine_against_the_step(value: float, step: float) -> None:
    assert abs(rounded(value, step) - value) <= 0.01 * step


def test_words_and_amounts_agree() -> None:
    assert set(AMOUNT) == set(get_args(Strength))
    assert sorted(AMOUNT, key=lambda word: AMOUNT[word]) == list(STRENGTHS)


# --- pictures ---


def framebuffer(lightness: Any, covered: Any = 1.0) -> clfractal.Framebuffer:
    width, height = PREVIEW_SIZE
    found = clfractal.Framebuffer(("R", "G", "B", "A"), PREVIEW_SIZE)
    shades = np.broadcast_to(np.asarray(lightness, np.float32), (height, width))
    found.fill({**dict.fromkeys("RGB", shades), "A": np.broadcast_to(np.float32(covered), (height, width))})
    return found


def test_what_a_worthwhile_picture_is() -> None:
    width, height = PREVIEW_SIZE
    ramp = np.linspace(0, 1, width)[None, :]
    assert worthwhile(framebuffer(ramp))
    assert not worthwhile(framebuffer(0.2))  # the inside of a solid
    assert not worthwhile(framebuffer(ramp * 1e-4))  # darkness
    assert not worthwhile(framebuffer(ramp, covered=0.0))  # a background alone
    spot = np.zeros((height, width))
    spot[20:40, 30:60] = 1
    assert worthwhile(framebuffer(np.random.default_rng(1).random((height, width)), spot))
    assert not worthwhile(framebuffer(0.5 + spot / 2, spot))  # a flat thing before a background


def test_previews_of_pictures_that_show_something_and_nothing(device: Device) -> None:
    away = BULB.model_copy(update={"camera": {"position": [0, -3, 0], "target": [0, -9, 0]}})
    with clfractal.Engine(device) as engine:
        channels = ["R", "G", "B", "A"]
        assert worthwhile(engine.render(small_scene(BULB, *PREVIEW_SIZE), channels=channels))
        assert not worthwhile(engine.render(small_scene(away, *PREVIEW_SIZE), channels=channels))


@pytest.mark.parametrize("name", ["mandelbulb", "kaleidoscopic_ifs", "bulbox", "quaternion_julia", "hast"])
def test_previews_of_variations_share_one_program(name: str) -> None:
    scene = clfractal.load_scene(
        {"version": 1, "formula": {"name": name}, "camera": {"position": [0, -9, 0]}}
    )
    found = variations(scene, strength="heavy", kinds=["formula"])
    texts = {write_formula(small_scene(each.scene, 16, 9).chain).text for each in found}
    assert texts == {write_formula(small_scene(scene, 16, 9).chain).text}
    assert len({write_formula(each.scene.chain).constants for each in found}) > 1


def test_a_preview_is_small_and_for_one_eye() -> None:
    for path in SCENES:
        scene = clfractal.load_scene(path)
        small = small_scene(scene, 96, 54)
        assert (small.image.width, small.image.height, small.stereo) == (96, 54, None)
        assert small.renderer.samples <= 4
        assert small.camera == scene.camera


def test_candidates_go_on() -> None:
    found = [each for each, _ in zip(candidates(BULB, seed=5), range(50), strict=False)]
    assert len({repr(each.changes) for each in found}) == 50
