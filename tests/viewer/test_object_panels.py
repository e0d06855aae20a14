"""The panels of cut planes and objects: what is added, edited and removed there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from clfractal.scene.load import load_scene
from clfractal.scene.objects import VolumeObject
from clfractal.scene.rectangle import rotated
from clfractal.viewer.panels import cut_planes, objects, renderer, scene_dock, transfer
from clfractal.viewer.panels.ui import Ui
from tests.render.volumes import keep
from tests.viewer.panel_harness import Stage, make_ui, opened

pytestmark = pytest.mark.usefixtures("drawing_context")


# Cut planes


def test_a_new_plane_faces_the_camera_and_cuts() -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    assert ui.studio.edit({"cut_planes": [cut_planes._first_plane(ui)]})
    plane, camera = ui.studio.scene.cut_planes[0], ui.studio.scene.camera
    away = np.array(camera.position) - np.array(plane.plane.center)
    assert plane.cut
    assert away @ np.array(plane.plane.normal) > 0


@pytest.mark.parametrize("axis", ["normal", "side", "up", "x", "y", "z"])
def test_a_plane_is_rotated_by_its_buttons(axis: str) -> None:
    ui, _ = make_ui("scenes/cut_geode.yaml")
    ui.size = (1280, 3000)
    before = ui.studio.scene.cut_planes[0].plane
    path = "cut_planes.0.plane"
    places: dict[str, tuple[float, float]] = {}
    plain = cut_planes._step

    def step(ui: Ui, path: str, label: str, change: Any, about: str = "") -> None:
        corner = imgui.get_cursor_screen_pos()
        places[label] = (corner.x + 255, corner.y + 10)
        plain(ui, path, label, change, about)

    cut_planes._step = step
    try:
        stage = Stage(ui, lambda ui: cut_planes.place(ui, path))
        label = f"Axis {axis}" if axis in "xyz" else f"Own {axis}"
        stage.click(*places[label])
    finally:
        cut_planes._step = plain
    after = ui.studio.scene.cut_planes[0].plane.placed
    wanted = rotated(before, axis, 5.0).placed  # type: ignore[arg-type]
    for name in ("center", "normal", "up"):
        assert getattr(after, name) == pytest.approx(getattr(wanted, name), abs=1e-12)


def test_objects_are_added_given_a_material_and_removed() -> None:
    ui = opened("scenes/mandelbulb.yaml")
    ui.size = (1280, 4000)
    for kind in ("plane", "water", "sphere", "box", "cylinder", "sphere"):
        objects._add(ui, kind, {"type": kind})
    assert list(ui.studio.scene.objects) == ["plane", "water", "sphere", "box", "cylinder", "sphere 2"]
    assert ui.studio.edit({"materials.red": {"base": {"color": [0.7, 0, 0]}}, "objects.box.material": "red"})
    ui.memory["object"] = "box"
    before = ui.studio.scene
    Stage(ui, scene_dock.draw, window=False)
    assert ui.studio.scene is before
    # What another renderer cannot show comes back with the surface, at its place.
    assert renderer.switch(ui, "volume")
    assert list(ui.studio.scene.objects) == ["plane", "sphere", "box", "cylinder", "sphere 2"]
    Stage(ui, scene_dock.draw, window=False)
    assert renderer.switch(ui, "cut_plane")
    assert list(ui.studio.scene.objects) == ["plane", "sphere", "box", "cylinder", "sphere 2"]
    Stage(ui, scene_dock.draw, window=False)
    assert renderer.switch(ui, "surface")
    assert ui.studio.scene.objects == before.objects
    assert list(ui.studio.scene.objects) == list(before.objects)
    assert renderer.switch(ui, "volume")
    assert ui.studio.edit({"objects.box.position": [0.0, 0.0, 3.0], "objects.cylinder.radius": 0.1})
    assert renderer.switch(ui, "surface")
    assert ui.studio.scene.objects["box"].position == (0, 0, 3)
    assert ui.studio.scene.objects["water"] == before.objects["water"]
    # Another scene does not get what this one has hidden.
    assert renderer.switch(ui, "volume")
    ui.studio.open(load_scene(Path("scenes/mandelbulb.yaml")))
    assert renderer.switch(ui, "volume")
    assert renderer.switch(ui, "surface")
    assert not ui.studio.scene.objects


def test_a_plane_names_the_objects_that_it_cuts() -> None:
    ui = opened("scenes/mandelbulb.yaml")
    ui.size = (1280, 4000)
    for kind in ("box", "water"):
        objects._add(ui, kind, {"type": kind})
    assert ui.studio.edit({"cut_planes": [{"cut": True}]})
    ui.memory["open.cut_planes"] = True
    Stage(ui, scene_dock.draw, window=False)
    assert ui.studio.edit({"cut_planes.0.objects": ["box"]})
    Stage(ui, scene_dock.draw, window=False)
    assert ui.studio.edit({"cut_planes.0.set": False})
    Stage(ui, scene_dock.draw, window=False)
    (plane,) = ui.studio.scene.cut_planes
    assert (plane.cuts_set, plane.cut_objects) == (False, ("box",))
    assert not ui.studio.edit({"cut_planes.0.objects": ["water"]})
    # Along paths its faces have one of the materials.
    assert ui.studio.edit({"lighting": {"mode": "path"}, "materials": {"gold": {}}})
    Stage(ui, scene_dock.draw, window=False)
    assert ui.studio.edit({"cut_planes.0.material": "gold"})
    Stage(ui, scene_dock.draw, window=False)


def test_a_formula_beside_the_set_is_edited() -> None:
    ui = opened("scenes/mandelbulb.yaml")
    ui.size = (1280, 4000)
    objects._add(ui, "formula", {"type": "formula", "formula": {"name": "mandelbulb", "iterations": 6}})
    ui.memory["object"] = "formula"
    before = ui.studio.scene
    Stage(ui, scene_dock.draw, window=False)
    assert ui.studio.scene is before
    path = "objects.formula"
    assert ui.studio.edit({f"{path}.formula.parameters.power": 5.0, f"{path}.join": "smooth_union"})
    assert ui.studio.scene.joined_chains["formula"].first.values["power"] == 5
    Stage(ui, scene_dock.draw, window=False)
    assert ui.studio.edit({f"{path}.join": "cut"})
    assert ui.studio.edit({f"{path}.formula": {"name": "hast", "iterations": 9}})
    assert renderer.switch(ui, "volume")
    assert list(ui.studio.scene.joined) == ["formula"]


def test_a_volume_is_a_surface_or_a_cloud(tmp_path: Path) -> None:
    """It is added by a file beside the scene; a cloud has no material, and brings light along paths."""
    keep(tmp_path / "grid.nrrd", np.arange(60, dtype=np.float32).reshape(3, 4, 5), [0, 0, 0], [1, 1, 1])
    (tmp_path / "below").mkdir()
    keep(tmp_path / "below" / "other.npy", np.ones((2, 2, 2), np.uint8), [0, 0, 0], [1, 1, 1])
    (tmp_path / "scene.yaml").write_text(
        "{version: 1, formula: {name: mandelbulb}, camera: {}, materials: {clay: {}}}"
    )
    assert objects.grid_files(tmp_path) == ["below/other.npy", "grid.nrrd"]
    ui = opened(str(tmp_path / "scene.yaml"))
    ui.size = (1280, 4000)
    objects._add(ui, "volume", {"type": "volume", "file": "grid.nrrd", "material": "clay", "size": 2.0})
    ui.memory["object"] = "volume"
    before = ui.studio.scene
    Stage(ui, scene_dock.draw, window=False)
    assert ui.studio.scene is before
    grid = before.grids["grid.nrrd"]
    values = transfer.Values("objects.volume", grid.low, grid.high, lambda: None)
    transfer._switch_opacity(ui, values, True)
    scene = ui.studio.scene
    cloud = scene.objects["volume"]
    assert isinstance(cloud, VolumeObject)
    assert cloud.is_cloud
    assert cloud.material is None
    assert scene.lighting.mode == "path"
    assert scene.grids["grid.nrrd"] is grid  # which is not read again
    Stage(ui, scene_dock.draw, window=False)
    transfer._switch_color(ui, values, True)
    Stage(ui, scene_dock.draw, window=False)
    transfer._switch_opacity(ui, values, False)
    again = ui.studio.scene.objects["volume"]
    assert isinstance(again, VolumeObject)
    assert again.transfer.color is None
    assert not again.is_cloud
    assert not ui.studio.edit({"objects.volume.level": 59.5})
    assert ui.studio.edit({"objects.volume.level": 10.0})
