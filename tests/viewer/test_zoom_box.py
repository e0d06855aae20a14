"""The cube that marks the next zoom: where it is drawn is what the zoom shows."""

from __future__ import annotations

from math import inf, nan, prod

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.camera.views import camera_view
from clfractal.errors import SceneError
from clfractal.geometry.planes import zoom_of
from clfractal.scene.checks import used_boxes
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer, Zoom
from clfractal.viewer import zoom_box
from clfractal.viewer.navigation import project
from clfractal.viewer.zoom_box import Stage, ZoomBox, stage_of
from tests.scenes import scene_of
from tests.viewer.cameras import SIZE, AnyCamera, assert_same_place, cameras, numbers

vectors = st.tuples(*[numbers(-1, 1)] * 3)


def volume(**renderer: object) -> Scene:
    """A volume scene whose first box is no cube."""
    box = {"center": [0.5, -0.2, 0.1], "size": [4, 3, 2]}
    grid = {"type": "volume", "box": box, **renderer}
    return scene_of("hast", size=None, iterations=20, renderer=grid)


START = volume()


def settings_of(scene: Scene) -> VolumeRenderer:
    assert isinstance(scene.renderer, VolumeRenderer)
    return scene.renderer


def zoomed(scene: Scene, box: ZoomBox) -> Scene:
    """The scene with the box applied, checked as a loaded one is."""
    zooms = zoom_box.applied(settings_of(scene), box)
    after = scene.model_copy(update={"renderer": settings_of(scene).model_copy(update={"zoom": zooms})})
    used_boxes(after, settings_of(after))
    return after


@st.composite
def boxes(draw: st.DrawFn, stage: Stage, most: float = 1000.0) -> ZoomBox:
    """Boxes inside the present one."""
    scale = draw(numbers(1, most))
    wanted = np.array(stage.filled.center) + np.array(draw(vectors)) * stage.filled.sides
    return zoom_box.within(ZoomBox(tuple(wanted.tolist()), scale), stage)


@given(st.data())
def test_every_applied_box_is_within_the_one_before_and_fills_its_place(data: st.DataObject) -> None:
    scene = START
    for _ in range(4):
        stage = stage_of(scene)
        box = data.draw(boxes(stage))
        drawn = zoom_box.edges(box, stage)
        after = zoomed(scene, box)
        grown = stage_of(after)
        assert grown.magnification == pytest.approx(zoom_box.next_magnification(settings_of(scene), box))
        # What was inside the marked cube is shown in the place of the first box.
        corners = grown.to_picture(stage.to_formula(drawn))
        first = np.array(START.renderer.box.center), np.array(START.renderer.box.sides)  # type: ignore[union-attr]
        lost = 1e-15 * grown.magnification
        np.testing.assert_allclose(corners.min((0, 1)), first[0] - first[1] / 2, atol=1e-9 + 4 * lost)
        np.testing.assert_allclose(corners.max((0, 1)), first[0] + first[1] / 2, atol=1e-9 + 4 * lost)
        scene = after


@given(st.data(), vectors)
def test_the_stage_is_where_cut_planes_evaluate_the_formula(
    data: st.DataObject, point: tuple[float, float, float]
) -> None:
    scene = zoomed(START, data.draw(boxes(stage_of(START))))
    zoom, origin = zoom_of(scene)
    stage = stage_of(scene)
    np.testing.assert_allclose(stage.to_formula(point), origin + zoom * np.array(point), atol=1e-15)
    np.testing.assert_allclose(stage.to_picture(stage.to_formula(point)), point, atol=1e-11)


def test_the_edges_are_those_of_the_box() -> None:
    stage = stage_of(START)
    drawn = zoom_box.edges(ZoomBox((1.0, 0.0, 0.0), 2.0), stage)
    assert drawn.shape == (12, 2, 3)
    along = np.abs(drawn[:, 1] - drawn[:, 0])
    assert (np.count_nonzero(along, axis=1) == 1).all()
    for axis, side in enumerate((2.0, 1.5, 1.0)):
        assert np.count_nonzero(np.isclose(along[:, axis], side)) == 4
    np.testing.assert_allclose(drawn.min((0, 1)), (0, -0.75, -0.5))
    np.testing.assert_allclose(drawn.max((0, 1)), (2, 0.75, 0.5))
    ends = {tuple(end) for end in drawn.reshape(-1, 3).tolist()}
    assert len(ends) == 8
    assert len({frozenset(map(tuple, edge)) for edge in drawn.tolist()}) == 12


@given(st.data(), cameras(), numbers(-20, 20), numbers(-20, 20))
def test_a_dragged_box_follows_the_pointer(
    data: st.DataObject, camera: AnyCamera, dx: float, dy: float
) -> None:
    scene = zoomed(START, ZoomBox((0.25, 0.5, 0.0), 50.0))
    stage = stage_of(scene)
    box = data.draw(boxes(stage))
    view = camera_view(camera, *SIZE)
    before = project(view, stage.to_picture(box.center), SIZE)
    moved = zoom_box.dragged(box, stage, view, SIZE, dx, dy)
    assert moved == zoom_box.within(moved, stage)
    assert moved.scale == box.scale
    after = project(view, stage.to_picture(moved.center), SIZE)
    side, sides = np.array(stage.filled.sides) / box.scale, np.array(stage.filled.sides)
    room = 0.5 * (sides - side) - np.abs(np.array(moved.center) - stage.filled.center)
    if np.isfinite(before[0]) and (room > 1e-9 * sides).all() and before[2] > 0.1:
        assert_same_place(after, (before[0] + dx, before[1] + dy, before[2]))


@given(cameras(), numbers(-0.2, 0.2), numbers(-0.2, 0.2), numbers(-0.2, 0.2))
def test_keys_move_a_box_along_the_view_and_back(
    camera: AnyCamera, right: float, up: float, forward: float
) -> None:
    stage = stage_of(zoomed(START, ZoomBox((0.25, 0.5, 0.0), 50.0)))
    box = zoom_box.first_box(stage)
    view = camera_view(camera, *SIZE)
    there = zoom_box.stepped(box, stage, view, right=right, up=up, forward=forward)
    way = stage.to_picture(there.center) - stage.to_picture(box.center)
    expected = np.array([right, up, forward]) * 4.0 / box.scale
    np.testing.assert_allclose([way @ view.side, way @ view.up, way @ view.axis], expected, atol=1e-9)
    back = zoom_box.stepped(there, stage, view, right=-right, up=-up, forward=-forward)
    np.testing.assert_allclose(back.center, box.center, atol=1e-12)


@given(st.data(), numbers(0.01, 100))
def test_scaling_keeps_the_middle_where_there_is_room(data: st.DataObject, factor: float) -> None:
    stage = stage_of(START)
    box = data.draw(boxes(stage))
    changed = zoom_box.scaled(box, stage, factor)
    assert changed.scale == pytest.approx(max(box.scale / factor, 1))
    if factor <= 1:
        assert changed.center == box.center
    zoomed(START, changed)


@pytest.mark.parametrize("factor", [0.0, -1.0, inf, nan])
def test_a_factor_that_is_none_scales_nothing(factor: float) -> None:
    stage = stage_of(START)
    box = zoom_box.first_box(stage)
    assert zoom_box.scaled(box, stage, factor) == box


def test_a_box_is_not_smaller_than_its_coordinates_can_tell() -> None:
    scene = START
    for _ in range(6):
        stage = stage_of(scene)
        box = zoom_box.scaled(zoom_box.first_box(stage), stage, 1e-9)
        scene = zoomed(scene, box)
    filled = stage_of(scene).filled
    assert min(filled.sides) == pytest.approx(1e-14 * 0.5, rel=1e-6, abs=0)


def test_stepping_back_undoes_a_zoom_and_marks_it_again() -> None:
    box = ZoomBox((0.25, 0.5, 0.0), 50.0)
    scene = zoomed(START, box)
    assert zoom_box.stepped_back(settings_of(scene)) == ((), box)
    assert zoom_box.stepped_back(settings_of(START)) == ((), None)


def test_past_the_last_zoom_the_last_takes_up_the_next() -> None:
    scene = volume(zoom=[{"center": [0.5, -0.2, 0.1], "scale": 1.01}] * 64)
    stage = stage_of(scene)
    box = zoom_box.within(ZoomBox((0.6, -0.2, 0.1), 3.0), stage)
    after = zoomed(scene, box)
    zooms = settings_of(after).zoom
    assert len(zooms) == 64
    assert settings_of(after).magnification == pytest.approx(3 * 1.01**64)
    assert prod(zoom.scale for zoom in zooms[:-1]) == pytest.approx(1.01**63)
    full = settings_of(scene).model_copy(
        update={"zoom": (*settings_of(scene).zoom[:-1], Zoom(center=(0.5, -0.2, 0.1), scale=1e15))}
    )
    with pytest.raises(SceneError, match="used up"):
        zoom_box.applied(full, box)


def test_only_volumes_of_a_formula_are_zoomed() -> None:
    surface = load_scene({"version": 1, "formula": {"name": "hast"}, "camera": {}})
    with pytest.raises(SceneError, match="must be a volume"):
        stage_of(surface)
    given_grid = START.model_copy(
        update={"renderer": VolumeRenderer.model_validate({"type": "volume", "file": "grid.nrrd"})}
    )
    with pytest.raises(SceneError, match="a grid from a file"):
        stage_of(given_grid)
