"""The panels of the dock: every one draws every scene, writes only what the schema knows, and can be undone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.engine.local_executor import LocalExecutor
from clfractal.scene.load import load_scene
from clfractal.scene.palette import named_table
from clfractal.scene.palettes import PALETTES
from clfractal.scene.volume import Transfer
from clfractal.viewer.controls import Controls
from clfractal.viewer.histogram import BINS, Histogram, HistogramTask, histogram_of
from clfractal.viewer.motion import Motion
from clfractal.viewer.panels import device as device_panel
from clfractal.viewer.panels import (
    differences,
    palette_editor,
    renderer,
    scene_dock,
    stereo,
    transfer,
    volume,
    widgets,
)
from clfractal.viewer.panels.number_box import Change
from clfractal.viewer.panels.ui import Ui
from tests.variants import one_of
from tests.viewer.panel_harness import INFO, Stage, background, make_ui, opened, screenshot

pytestmark = pytest.mark.usefixtures("drawing_context")

SCENES = sorted(str(path) for path in Path("scenes").glob("*.yaml"))
KINDS = [
    "scenes/mandelbulb.yaml",
    "scenes/stereo_volume.yaml",
    "scenes/cut_mandelbrot.yaml",
    "scenes/cut_geode.yaml",
]


# Drawing


@pytest.mark.parametrize("scene", SCENES)
def test_every_panel_draws_every_scene_and_changes_nothing(scene: str) -> None:
    ui = opened(scene)
    before = ui.studio.scene
    Stage(ui, scene_dock.draw, window=False)
    assert ui.studio.scene is before
    assert ui.studio.problems == {}
    assert ui.studio.messages == []


def test_hidden_panels_draw_nothing() -> None:
    ui = opened(KINDS[0])
    ui.show.clear()
    stage = Stage(ui, scene_dock.draw, window=False)
    stage.move(150, 100)
    assert not imgui.get_io().want_capture_mouse
    ui.show.add("panels")
    stage.frame()
    stage.move(151, 100)
    assert imgui.get_io().want_capture_mouse


def test_panels_know_neither_windows_nor_opengl() -> None:
    folder = Path(scene_dock.__file__).parent
    for path in folder.glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert "import glfw" not in text, path
        assert "OpenGL" not in [
            word for line in text.splitlines() if "import" in line for word in line.split()
        ], path


# Editing: whatever is clicked


class _Watched:
    """A studio whose edits are checked as they are made."""

    def __init__(self, ui: Ui) -> None:
        self.failed: list[tuple[Mapping[str, Any], dict[str, str]]] = []
        self.count = 0
        plain = ui.studio.edit

        def edit(values: Mapping[str, Any], gesture: str | None = None) -> bool:
            self.count += 1
            done = plain(values, gesture)
            if not done:
                self.failed.append((values, {path: ui.studio.problems.get(path, "") for path in values}))
            return done

        ui.studio.edit = edit  # type: ignore[method-assign]


@pytest.mark.parametrize("scene", one_of("scenes/mengerbulb.yaml", "scenes/stereo_bulb.yaml", *KINDS))
def test_all_that_is_clicked_is_accepted_by_the_schema_and_undone(scene: str) -> None:
    """Clicks down the whole dock, at switches, choices and buttons; then everything is taken back."""
    ui = opened(scene)
    before, watched = ui.studio.scene, _Watched(ui)
    stage = Stage(ui, scene_dock.draw, window=False)
    random = np.random.default_rng(7)
    for _ in range(160):
        stage.quick_click(float(random.uniform(30, 298)), float(random.uniform(50, 2600)))
        if random.random() < 0.3:
            # Whatever has opened is used, or closed.
            stage.quick_click(float(random.uniform(30, 420)), float(random.uniform(50, 2600)))
        if ui.memory.get("boxes") is not None and ui.memory["boxes"].typing:
            stage.press(imgui.Key.escape)
    assert watched.count > 20
    unknown = [
        each
        for each in watched.failed
        if any("no such" in text or "unknown" in text for text in each[1].values())
    ]
    assert unknown == []
    while ui.studio.undo("scene") or ui.studio.undo("camera"):
        pass
    assert ui.studio.scene == before


@pytest.mark.parametrize("scene", one_of(*KINDS))
def test_all_that_is_dragged_is_accepted_and_undone(scene: str) -> None:
    ui = opened(scene)
    before, watched = ui.studio.scene, _Watched(ui)
    stage = Stage(ui, scene_dock.draw, window=False)
    random = np.random.default_rng(11)
    for _ in range(150):
        x, y = float(random.uniform(130, 290)), float(random.uniform(50, 2600))
        stage.drag(
            (x, y), (x + float(random.uniform(-150, 150)), y + float(random.uniform(-10, 10))), steps=3
        )
        if ui.memory["boxes"].typing:
            stage.press(imgui.Key.escape)
    assert watched.count > 40
    assert len(watched.failed) <= 0.15 * watched.count, watched.failed
    while ui.studio.undo("scene") or ui.studio.undo("camera"):
        pass
    assert ui.studio.scene == before


# The renderer


def test_switching_the_renderer_keeps_samples_and_comes_back() -> None:
    ui, _ = make_ui("scenes/cut_geode.yaml")
    before = ui.studio.scene
    assert renderer.switch(ui, "volume")
    assert ui.studio.scene.renderer.samples == before.renderer.samples
    assert ui.studio.scene.renderer.filter == before.renderer.filter
    assert renderer.switch(ui, "cut_plane")
    assert ui.studio.scene.cut_planes == ()
    assert renderer.switch(ui, "surface")
    assert ui.studio.scene.renderer == before.renderer
    assert ui.studio.scene.cut_planes == before.cut_planes
    assert ui.studio.history.depth("scene") == (3, 0)


# Palettes


@pytest.mark.parametrize("name", ["opal", "hearth", "viridis", "viridis_r"])
def test_stops_of_a_palette_come_near_to_it(name: str) -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    stops = palette_editor.stops_of(name)
    assert ui.studio.edit({"coloring.palette": stops})
    shown = named_table(ui.studio.scene.coloring.palette)
    # Between stops they mix linearly, and the palette by name smoothly.
    assert np.abs(shown - named_table(name)).max() < 0.11
    own = PALETTES.get(name)
    if own is not None:
        assert np.allclose(shown[0], named_table(name)[0], atol=1e-4)


stops = st.lists(
    st.tuples(st.floats(0, 1).map(lambda at: round(at, 4)), st.floats(0, 1)), min_size=2, max_size=9
).map(lambda pairs: [{"at": at, "color": [c, c, 0.0]} for at, c in sorted(pairs)])


@given(stops, st.data(), st.floats(-0.5, 1.5))
def test_a_moved_stop_stays_in_order_and_is_followed(
    made: list[dict[str, Any]], data: Any, at: float
) -> None:
    index = data.draw(st.integers(0, len(made) - 1))
    found, place = palette_editor.moved(made, index, at)
    places = [stop["at"] for stop in found]
    assert places == sorted(places)
    assert found[place]["color"] == made[index]["color"]
    assert found[place]["at"] == pytest.approx(min(max(at, 0), 1), abs=1e-4)
    assert len(found) == len(made)


@given(stops, st.floats(0, 1))
def test_an_added_stop_changes_no_colour(made: list[dict[str, Any]], at: float) -> None:
    found, place = palette_editor.added(made, at)
    assert found[place]["at"] == round(at, 4)
    places = np.linspace(0, 1, 101)
    for axis in range(3):
        before, after = (
            np.interp(places, [s["at"] for s in each], [s["color"][axis] for s in each])
            for each in (made, found)
        )
        steep = any(b["at"] - a["at"] < 0.02 for a, b in pairwise(found))
        assert steep or np.abs(before - after).max() < 0.02


@given(stops)
def test_reversing_twice_changes_nothing(made: list[dict[str, Any]]) -> None:
    twice = palette_editor.reversed_stops(palette_editor.reversed_stops(made))
    assert [s["color"] for s in twice] == [s["color"] for s in made]
    assert [s["at"] for s in twice] == pytest.approx([s["at"] for s in made], abs=1e-6)


def test_stops_are_dragged_added_and_pulled_off_the_strip() -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    made = [{"at": at, "color": [at, 0.5, 0.1]} for at in (0.0, 0.5, 1.0)]
    assert ui.studio.edit({"coloring.palette": made})
    stage = Stage(ui, lambda ui: palette_editor.draw(ui, "coloring.palette"))
    # The strip begins 18 points from the window's edge, 7 more to the first handle.
    left, right, y = 8 + 10 + 11 + 7, 8 + 300 - 10 - 7, 64
    middle = (left + right) / 2
    steps = ui.studio.history.depth("scene")[0]
    stage.drag((middle, y), (middle + 0.25 * (right - left), y))
    palette = ui.studio.scene.coloring.palette
    assert not isinstance(palette, str)
    assert [stop.at for stop in palette] == pytest.approx([0, 0.75, 1], abs=0.02)
    assert ui.studio.history.depth("scene")[0] == steps + 1
    stage.double_click(left + 0.25 * (right - left), 50)
    palette = ui.studio.scene.coloring.palette
    assert len(palette) == 4
    assert palette[1].at == pytest.approx(0.25, abs=0.02)  # type: ignore[union-attr]
    stage.drag((left + 0.25 * (right - left), y), (left + 0.25 * (right - left), y + 90))
    assert len(ui.studio.scene.coloring.palette) == 3


def test_a_grid_is_filled_once_its_resolution_is_let_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not at every place of a drag, which would fill a grid each."""
    ui, _ = make_ui("scenes/stereo_volume.yaml")
    path, plain, drag = "renderer.resolution.0", widgets.number_box, list[Change]()

    def number_box(boxes: Any, name: str, *rest: Any, **options: Any) -> Change:
        usual = plain(boxes, name, *rest, **options)
        return drag.pop(0) if name == path and drag else usual

    monkeypatch.setattr(widgets, "number_box", number_box)
    stage = Stage(ui, volume.draw)
    before = ui.studio.scene
    drag += [Change(value=100.0, dragging=True), Change(value=96.0, dragging=True), Change(ended=True)]
    stage.frame()
    stage.frame()
    assert ui.studio.scene is before
    stage.frame()
    assert ui.studio.scene.renderer.resolution == 96  # type: ignore[union-attr]


# The transfer function


@given(stops, st.data(), st.floats(-2, 2))
def test_points_of_the_transfer_function_stay_in_order(
    made: list[dict[str, Any]], data: Any, at: float
) -> None:
    index = data.draw(st.integers(0, len(made) - 1))
    found = transfer.placed(made, index, at)
    assert [s["at"] for s in found] == sorted(s["at"] for s in found)
    longer, place = transfer.inserted(made, at, color=[0, 0, 0])
    assert [s["at"] for s in longer] == sorted(s["at"] for s in longer)
    assert longer[place]["at"] == at


def test_a_point_is_dragged_over_the_histogram() -> None:
    ui, _ = make_ui("scenes/stereo_volume.yaml")
    made = [{"at": 0.0, "opacity": 0.0}, {"at": 4.0, "opacity": 0.5}, {"at": 8.0, "opacity": 1.0}]
    assert ui.studio.edit({"renderer.transfer.opacity": made, "renderer.transfer.color": None})
    high = ui.studio.scene.renderer.value_range(ui.studio.scene.formula.iterations)[1]  # type: ignore[union-attr]
    stage = Stage(ui, transfer.draw)
    left, width, top, height = 8 + 10 + 11 + 6, 300 - 20 - 11 - 12, 8 + 10 + 27 + 6, 108
    x, y = left + width * 4 / high, top + 0.5 * height
    stage.drag((x, y), (x + width / high, y - 0.25 * height))
    found = ui.studio.scene.renderer.transfer.opacity[1]  # type: ignore[union-attr, index]
    assert found.at == pytest.approx(5.0, abs=0.15)
    assert found.opacity == pytest.approx(0.75, abs=0.03)


@pytest.mark.parametrize("key", ["color", "emission"])
def test_colours_and_light_of_values_are_dragged_and_added(key: str) -> None:
    ui, _ = make_ui("scenes/stereo_volume.yaml")
    path = f"renderer.transfer.{key}"
    made = [{"at": at, key: [0.02 * at, 0.01, 0.0]} for at in (0.0, 4.0, 8.0)]
    assert ui.studio.edit({"renderer.transfer.color": None, "renderer.transfer.emission": None, path: made})
    before = ui.studio.scene
    found = plain_stops(ui, key)
    stage = Stage(ui, lambda ui: transfer._strip(ui, path, plain_stops(ui, key), 0.0, 8.0))
    assert ui.studio.scene is before
    left, width, y = 8 + 10 + 11 + 6, 300 - 20 - 11 - 12, 8 + 10 + 16
    middle = left + width / 2
    stage.drag((middle, y), (middle + width / 8, y))
    found = plain_stops(ui, key)
    assert [stop["at"] for stop in found] == pytest.approx([0, 5, 8], abs=0.3)
    assert [stop[key] for stop in found] == [stop[key] for stop in made]
    stage.double_click(left + width / 4, y)
    found = plain_stops(ui, key)
    assert [stop["at"] for stop in found] == pytest.approx([0, 2, 5, 8], abs=0.3)
    assert found[1][key][0] == pytest.approx(0.08 * found[1]["at"] / found[2]["at"], rel=0.05)


def plain_stops(ui: Ui, key: str) -> list[dict[str, Any]]:
    stops = ui.studio.value(f"renderer.transfer.{key}")
    assert isinstance(stops, list)
    return stops


def test_a_histogram_counts_every_finite_voxel() -> None:
    values = np.array([0.0, 0.1, 0.5, 1.0, 2.0, np.nan, -1.0])
    found = histogram_of(values.reshape(1, 1, 7), 0, 1)
    assert found.shares.shape == (BINS,)
    assert found.shares.sum() == pytest.approx(1)
    assert found.shares[0] == pytest.approx(2 / 6)
    assert found.shares[-1] == pytest.approx(2 / 6)


def test_the_histogram_of_a_formula(device: Device) -> None:
    """The share of voxels inside is the mean of the shares of each voxel that is inside."""
    executor = LocalExecutor(device)
    found: dict[str, Histogram] = {}
    for value in ("inside", "coverage"):
        scene = load_scene("scenes/stereo_volume.yaml").model_copy(update={"stereo": None})
        renderer = scene.renderer.model_copy(
            update={"value": value, "transfer": Transfer.model_validate({}), "level": None}
        )
        task = HistogramTask(scene.model_copy(update={"renderer": renderer}))
        task.work(executor, CancelToken(), lambda line: None)
        assert task.finished
        assert task.found is not None
        found[value] = task.found
    shares = found["inside"].shares
    assert shares[0] + shares[-1] == pytest.approx(1)
    middles = (np.arange(BINS) + 0.5) / BINS
    assert 0.02 < shares[-1] < 0.9
    assert found["coverage"].shares @ middles == pytest.approx(shares[-1], abs=0.02)


def test_a_histogram_that_a_lost_device_was_to_count_is_counted_by_the_next() -> None:
    ui, _ = make_ui("scenes/stereo_volume.yaml")
    assert transfer.histogram(ui) is None
    first = ui.memory["histogram.task"][1]
    assert transfer.histogram(ui) is None
    assert ui.memory["histogram.task"][1] is first
    other, _ = make_ui("scenes/stereo_volume.yaml")
    ui.studio.session = other.studio.session
    transfer.histogram(ui)
    assert ui.memory["histogram.task"][1] is not first


def test_the_next_magnification_is_that_of_the_marked_cube() -> None:
    ui = opened("scenes/stereo_volume.yaml")
    zooms = [{"center": [0.0, 0.0, 0.0], "scale": 4.0}]
    assert ui.studio.edit({"renderer.zoom": zooms})
    controls = Controls(ui.studio, ui.settings, Motion(ui.studio, 1.0))
    ui.memory["controls"] = controls
    told: list[tuple[str, str]] = []
    with patch.object(widgets, "reading", lambda ui, label, text, color=None: told.append((label, text))):
        Stage(ui, volume.draw)
        assert dict(told)["Magnification"] == "4 x"
        assert "After the next" not in dict(told)
        controls.mark()
        Stage(ui, volume.draw)
        assert controls.box is not None
        assert dict(told)["After the next"] == volume.magnified(4 * controls.box.scale)


# Device and settings


def test_a_click_on_a_device_chooses_it() -> None:
    ui, done = make_ui("scenes/mandelbulb.yaml")
    other = replace(INFO, index="1:0", name="Another")
    ui.memory["devices"] = [INFO, other]
    stage = Stage(ui, device_panel.draw)
    stage.click(100, 40)
    assert done == []
    stage.click(100, 80)
    assert done == ["device:1:0"]


def test_settings_of_pacing_take_effect_at_once() -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    device_panel._change(ui, "frame_rate", 60.0)
    device_panel._change(ui, "coarse", False)
    assert ui.settings.frame_rate == 60
    assert (ui.studio.pacing.rate, ui.studio.pacing.coarsest) == (60, 1)


# What differs


@pytest.mark.parametrize("scene", SCENES)
def test_everything_can_be_set_back(scene: str) -> None:
    """Every difference but what others need is set back by its button, and then is no difference any more."""
    ui, _ = make_ui(scene)
    left = differences.differences(ui.studio.scene)
    animation = ui.studio.scene.animation
    moved = tuple(animation.tracks) if animation is not None else ()
    refused = []
    for each in left:
        if each.path not in {other.path for other in differences.differences(ui.studio.scene)}:
            continue
        if ui.studio.edit({each.path: each.default}):
            assert each.path not in {other.path for other in differences.differences(ui.studio.scene)}
        else:
            refused.append(each.path)
    # What tracks move has to stay. A position and a direction that depend on each other may have to be set back in another
    # order.
    free = [path for path in refused if not any(name.startswith(f"{path}.") for name in moved)]
    assert len(free) <= 3, free


def test_a_plain_scene_differs_in_nothing() -> None:
    scene = load_scene({"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}})
    assert differences.differences(scene) == []
    scene = load_scene({"version": 1, "formula": {"name": "mandelbulb"}, "camera": {"fov": 30.0}, "fog": {}})
    assert [each.path for each in differences.differences(scene)] == ["camera.fov", "fog"]


# Stereo


@settings(max_examples=25)
@given(st.floats(-0.3, 0.3))
def test_the_parallax_under_the_pointer(depth: float) -> None:
    """0 on the screen's plane, negative before it, positive behind it."""
    ui, _ = make_ui("scenes/stereo_bulb.yaml")
    ui.studio.edit({"stereo.plane": None, "stereo.fit": None, "stereo.mode": "anaglyph"})
    camera = ui.studio.scene.camera
    position, target = np.array(camera.position), np.array(camera.target)
    point = target + depth * (target - position)

    class Found:
        point: Any = None

    Found.point = tuple(point)
    ui.pick = Found()  # type: ignore[assignment]
    found = stereo.under_pointer(ui)
    assert found is not None
    metres, degrees = found
    assert abs(metres) < 1e-9 if abs(depth) < 1e-9 else np.sign(metres) == np.sign(depth)
    assert np.sign(degrees) == np.sign(metres) or abs(depth) < 1e-9
    ui.pick = None
    assert stereo.under_pointer(ui) is None


# In a window


@pytest.mark.usefixtures("screen")
@pytest.mark.parametrize(("size", "scale"), [((1280, 720), 1.0), ((2560, 1440), 2.0)])
def test_the_dock_leaves_the_middle_of_the_picture_free(size: tuple[int, int], scale: float) -> None:
    found = screenshot("scenes/mandelbulb.yaml", scene_dock.draw, size, scale)
    behind = background(size)[:, :, :3]
    edge = round(scale * 310)
    assert (found[:, edge:] == behind[:, edge:]).all()
    panel = found[round(30 * scale) : -round(30 * scale), round(20 * scale) : round(290 * scale)]
    assert panel.mean() < 80
    assert panel.std() > 10
