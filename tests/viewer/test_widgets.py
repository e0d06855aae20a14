"""Widgets of panels: what the schema tells them, how numbers are dragged and typed, colours, and undo."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from clfractal.scene.animation import Animation, Track
from clfractal.scene.model import Scene
from clfractal.schema.base import Section
from clfractal.viewer.editing import plain
from clfractal.viewer.panels import material, metadata, timeline_inspector
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.number_box import Scale, bar_part, moved_by, text_of, typed_number
from tests.viewer.fields import BOX, DOT, LABEL, SCENE, stage_of
from tests.viewer.panel_harness import Stage, make_ui

pytestmark = pytest.mark.usefixtures("drawing_context")

finite = st.floats(-1e9, 1e9)


# What the schema tells


def test_every_field_of_every_section_is_understood() -> None:
    known = {"number", "whole", "flag", "choice", "text", "vector", "color", "section", "other"}
    by_hand = {
        "lights",
        "background",
        "cut_planes",
        "bookmarks",
        "center",
        "materials",
        "blend",
        "curve",
        "objects",
        "inline",
        "parameters",
        "live",
        "julia",
        "chain",
        "palette",
        "channels",
        "precision",
        "zoom",
        "resolution",
        "size",
        "opacity",
        "emission",
        "views",
        "area",
        "colors",
        "corners",
        "transform",
        "color",
    }
    for section in metadata.all_sections():
        for name, meta in metadata.metas(section).items():
            assert meta.kind in known
            if section in timeline_inspector.EDITED:  # the timeline's, with widgets of its own
                assert name in timeline_inspector.EDITED[section], f"{section.__name__}.{name} has no widget"
            elif meta.kind == "other":
                assert name in by_hand, f"{section.__name__}.{name} has no widget"
            if meta.kind == "choice":
                assert meta.choices
            if meta.kind in ("vector", "color"):
                assert meta.size in (2, 3, 4)
            if meta.usual is not None:
                low, high = meta.usual
                assert low < high
                assert meta.low is None or meta.low <= low
                assert meta.high is None or high <= meta.high


def test_sections_are_found_everywhere_in_the_schema() -> None:
    names = {section.__name__ for section in metadata.all_sections()}
    assert {
        "Scene",
        "PointLight",
        "Transfer",
        "Trap",
        "Ball",
        "ChainLink",
        "StereoPlane",
        "Transform",
    } <= names


def test_defaults_are_those_of_the_schema() -> None:
    for section in metadata.all_sections():
        for name, meta in metadata.metas(section).items():
            field = section.model_fields[name]
            if field.is_required():
                assert meta.default is None
            elif not isinstance(field.default, Section) and field.default_factory is None:
                assert meta.default == plain(field.default)


def test_bounds_are_those_that_validation_has() -> None:
    from pydantic import ValidationError

    for section in metadata.all_sections():
        if any(field.is_required() for field in section.model_fields.values()):
            continue
        for name, meta in metadata.metas(section).items():
            if meta.kind not in ("number", "whole") or meta.high is None or section.__name__ == "Transform":
                continue
            beyond = int(meta.high) + 1 if meta.kind == "whole" else math.nextafter(meta.high, math.inf)
            with pytest.raises(ValidationError, match=name):
                section.model_validate({name: beyond})


def test_find_follows_sections_lists_and_mappings() -> None:
    ui, _ = make_ui(SCENE)
    assert w.value(ui, "lights.1.intensity") == ui.studio.scene.lights[1].intensity
    assert w.value(ui, "lights.9.intensity") is None
    assert w.value(ui, "fog.color") is None
    assert w.value(ui, "no_such.key") is None


# Numbers


@given(finite, st.floats(-500, 500), st.sampled_from([(0.0, 1.0), (-2.0, 2.0), (-180.0, 180.0)]))
def test_a_drag_stays_within_hard_bounds(start: float, travel: float, bounds: tuple[float, float]) -> None:
    scale = Scale(*bounds, usual=bounds)
    start = min(max(start, bounds[0]), bounds[1])
    assert bounds[0] <= moved_by(start, travel, 150, scale) <= bounds[1]


@given(st.floats(0, 1), st.floats(-100, 100), st.booleans())
def test_open_bounds_are_never_reached(start: float, travel: float, log: bool) -> None:
    scale = Scale(0, 2, (0.05, 1.9) if log else (0, 2), log, open=(True, True))
    assert 0 < moved_by(max(start, 0.01), 30 * travel, 150, scale) < 2


@given(st.floats(0.002, 900), st.floats(-60, 60))
def test_a_bar_follows_the_pointer(start: float, travel: float) -> None:
    """The bar's end moves by as many points as the pointer, up to the rounding of the value."""
    for scale, low, high in (
        (Scale(usual=(0, 1000)), 0, 1000),
        (Scale(usual=(0.001, 1000), log=True), 0.001, 1000),
    ):
        before, after = bar_part(start, scale), bar_part(moved_by(start, travel, 150, scale), scale)
        assert before is not None
        assert after is not None
        expected = min(max(before + travel / 150, 0.0), 1.0)
        assert after == pytest.approx(expected, abs=0.01), (low, high)


@given(st.floats(1e-12, 1e6), st.floats(-300, 300))
def test_positive_numbers_without_a_range_never_reach_zero(start: float, travel: float) -> None:
    assert moved_by(start, travel, 150, Scale(low=0, open=(True, False))) > 0


@given(st.integers(-1000, 1000), st.floats(-300, 300))
def test_whole_numbers_stay_whole(start: int, travel: float) -> None:
    found = moved_by(float(start), travel, 150, Scale(whole=True))
    assert found == round(found)


def test_a_drag_deep_in_a_fractal_keeps_double_precision() -> None:
    """Where a 32-bit float has no digits left, a drag still moves by what was asked for."""
    scale = Scale(step=1e-13)
    found = moved_by(-1.2345678901234, 10, 150, scale)
    assert found == pytest.approx(-1.2345678901234 + 1e-12, abs=1e-14)


@given(finite)
def test_a_number_is_typed_as_it_is_shown(value: float) -> None:
    shown = typed_number(text_of(value, Scale(unit=" px")), Scale(unit=" px"))
    assert shown == pytest.approx(value, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1/3", 1 / 3),
        ("2*pi", 2 * math.pi),
        ("-sqrt(2)", -math.sqrt(2)),
        ("1e-3", 1e-3),
        ("0,5", 0.5),
        ("2**10", 1024.0),
        ("(1+2)*3", 9.0),
        ("\u22123", -3.0),
    ],
)
def test_sums_may_be_typed(text: str, value: float) -> None:
    assert typed_number(text, Scale()) == pytest.approx(value)


@pytest.mark.parametrize(
    "text",
    ["", "x", "1/0", "__import__('os')", "1 if 1 else 2", "9**9**9", "nan", "sqrt(-1)", "(" * 500, "True"],
)
def test_other_texts_are_no_numbers(text: str) -> None:
    assert typed_number(text, Scale()) is None


def test_what_is_typed_is_in_the_unit_that_is_shown() -> None:
    scale = Scale(unit=" mm", factor=1000.0)
    assert text_of(0.063, scale) == "63 mm"
    assert typed_number("65 mm", scale) == pytest.approx(0.065)
    assert typed_number("65", scale) == pytest.approx(0.065)


# Events


def test_a_drag_is_one_step_of_undo() -> None:
    stage = stage_of("material.diffuse")
    studio, before = stage.ui.studio, stage.ui.studio.scene
    stage.drag(BOX, (BOX[0] - 40, BOX[1]))
    assert studio.scene.material.diffuse < before.material.diffuse
    assert studio.history.depth("scene") == (1, 0)
    assert studio.undo("scene")
    assert studio.scene == before
    assert not studio.undo("scene")


def test_only_drags_make_pictures_coarse() -> None:
    stage = stage_of("material.diffuse")
    requests = stage.ui.studio.session.requests  # type: ignore[attr-defined]
    requests.clear()
    stage.drag(BOX, (BOX[0] - 40, BOX[1]))
    assert requests
    assert all(moving for _, moving in requests)
    requests.clear()
    stage.click(*BOX)
    stage.type("0.3")
    stage.press(imgui.Key.enter)
    assert [moving for _, moving in requests] == [False]


def _travelled(*held: imgui.Key) -> float:
    stage = stage_of("material.diffuse")
    stage.ui.studio.edit({"material.diffuse": 0.5})
    stage.rest()
    stage.move(*BOX)
    stage.button(True)
    stage.move(BOX[0] + 3, BOX[1])
    for key in held:
        stage.hold(key, True)
    start = stage.ui.studio.scene.material.diffuse
    stage.move(BOX[0] + 13, BOX[1])
    found = stage.ui.studio.scene.material.diffuse - start
    for key in held:
        stage.hold(key, False)
    stage.button(False)
    return found


def test_shift_drags_finely_and_control_coarsely() -> None:
    plain = _travelled()
    assert plain > 0
    assert _travelled(imgui.Key.mod_shift) == pytest.approx(plain / 10, abs=0.002)
    assert _travelled(imgui.Key.mod_ctrl) > 3 * plain


@pytest.mark.parametrize("way", ["click", "double_click", "control"])
def test_numbers_are_typed_after_a_click(way: str) -> None:
    stage = stage_of("material.diffuse")
    if way == "control":
        stage.hold(imgui.Key.mod_ctrl, True)
        stage.click(*BOX)
        stage.hold(imgui.Key.mod_ctrl, False)
    else:
        getattr(stage, way)(*BOX)
    stage.type("1/4")
    assert stage.ui.studio.scene.material.diffuse == 0.9
    stage.press(imgui.Key.enter)
    assert stage.ui.studio.scene.material.diffuse == 0.25
    assert stage.ui.studio.undo("scene")
    assert stage.ui.studio.scene.material.diffuse == 0.9


@pytest.mark.parametrize(
    ("path", "text", "told"),
    [
        ("camera.fov", "12 apples", "'12 apples' is no number"),
        ("camera.fov", "", "a number is missing"),
        ("material.reflection", "7", "must be at most 1, got 7.0"),
    ],
)
def test_what_is_no_number_or_a_wrong_one_is_told_below_its_field(path: str, text: str, told: str) -> None:
    stage = stage_of(path)
    before = stage.ui.studio.value(path)
    stage.click(*BOX)
    stage.press(imgui.Key.backspace)  # all of it was selected
    stage.type(text)
    stage.press(imgui.Key.enter)
    assert stage.ui.studio.value(path) == before
    assert stage.ui.studio.problems == {path: told}


def test_escape_takes_back_what_was_typed() -> None:
    stage = stage_of("material.diffuse")
    stage.click(*BOX)
    stage.type("0.1")
    stage.press(imgui.Key.escape)
    assert stage.ui.studio.scene.material.diffuse == 0.9
    assert not stage.ui.memory["boxes"].typing


def test_tab_goes_to_the_next_number() -> None:
    stage = stage_of("camera.target")
    stage.click(60, 58)
    stage.type("1")
    stage.press(imgui.Key.tab)
    stage.type("2")
    stage.press(imgui.Key.enter)
    target = stage.ui.studio.scene.camera.target
    assert target[:2] == (1.0, 2.0)


@pytest.mark.parametrize("how", ["label", "dot"])
def test_the_default_comes_back(how: str) -> None:
    stage = stage_of("material.ambient")
    assert stage.ui.studio.scene.material.ambient == 0.002
    if how == "label":
        stage.double_click(*LABEL)
    else:
        stage.click(*DOT)
    assert stage.ui.studio.scene.material.ambient == 0.1
    assert stage.ui.studio.undo("scene")
    assert stage.ui.studio.scene.material.ambient == 0.002


def test_optional_values_are_switched_on_and_off() -> None:
    stage = stage_of("renderer.noise", start=0.02)
    switch = (BOX[0] - 70, BOX[1])
    stage.click(*switch)
    assert stage.ui.studio.scene.renderer.noise == 0.02
    stage.click(*switch)
    assert stage.ui.studio.scene.renderer.noise is None


def test_flags_and_choices_are_set() -> None:
    stage = stage_of("coloring.repeat")
    before = stage.ui.studio.scene.coloring.repeat
    stage.click(BOX[0] - 70, BOX[1])
    assert stage.ui.studio.scene.coloring.repeat is not before
    stage = stage_of("renderer.search", segmented=True)
    stage.click(BOX[0] + 50, BOX[1])
    assert stage.ui.studio.scene.surface.search == "steps"


def test_light_bounces_at_a_click() -> None:
    """The kind of light is a switch, also where a material by OpenPBR is shown."""
    ui, _ = make_ui(SCENE)
    stage = Stage(ui, material.draw)

    def click(across: float) -> str:
        stage.click(BOX[0] + across, BOX[1])
        return str(ui.studio.scene.lighting.mode)

    assert click(50) == "path"
    ui.studio.edit({"materials.gold": {"base": {"metalness": 1}}, "material.name": "gold"})
    stage.frame()
    assert ui.studio.scene.material.name == "gold"
    assert click(-50) == "direct"
    assert click(50) == "path"


def test_first_values_are_valid() -> None:
    """Whatever may be null gets a value that the schema accepts when it is switched on."""
    for section in metadata.all_sections():
        if any(field.is_required() for field in section.model_fields.values()) or section is Scene:
            continue
        if section in (Animation, Track):  # which need more than one key
            continue
        for name, meta in metadata.metas(section).items():
            if (
                not meta.optional
                or meta.kind in ("section", "other", "text")
                or section.__name__
                in (
                    "Environment",
                    "Transform",
                    "LayoutView",
                    "FormulaSpec",
                    "ChainLink",
                    "NumberMap",
                    "ColorMap",
                )
            ):
                continue
            found = section.model_validate({**_needed(section, name), name: w.first_value(meta)})
            assert getattr(found, name) is not None


def _needed(section: type[Section], name: str) -> dict[str, object]:
    """What else the section needs; panels give an `up` beside its plane's normal a start of their own."""
    by_name: dict[str, dict[str, object]] = {
        "min_samples": {"samples": 64},
        "up": {"normal": [0.0, 1.0, 0.0]},
    }
    return by_name.get(name, {})
