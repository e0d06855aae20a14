"""What a text has once and uses at several places is one thing in the window: in every edit, in undo, in what is saved."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from clfractal.files import resources
from clfractal.scene.load import load_scene
from clfractal.viewer.aim import Aim
from clfractal.viewer.controls import Controls
from clfractal.viewer.motion import Motion
from clfractal.viewer.plane_moves import shift
from clfractal.viewer.saving import SceneSource, scene_text
from clfractal.viewer.scene_operators import SceneOperators
from clfractal.viewer.settings import Settings
from clfractal.viewer.shared import groups_of
from clfractal.viewer.studio import Studio
from tests.viewer.panel_harness import make_ui

FIGURE = (resources.folder("scenes") / "figure9.yaml").read_text()
IN_OBJECT, CUT = "cut_planes.0.plane", "layout.views.1.renderer.plane"
MANY = """version: 1
formula: {name: mandelbulb, iterations: &few 3}
camera: &view {position: [0, -4, 0], fov: 30}
lights:
  - {direction: [0, 1, 0], color: &warm [1, 0.8, 0.6]}
  - {direction: [1, 0, 0], color: *warm}
material: {color: *warm, diffuse: &half 0.5}
materials:
  one: {base: {color: *warm, diffuse_roughness: *half}}
cut_planes:
  - plane: &first {width: 1, height: 1}
    iterations: *few
  - plane: &second {width: 2, height: 2}
layout:
  columns: 2
  views:
    - {camera: *view}
    - renderer: {type: cut_plane, plane: *second}
"""


class Desk:
    """A scene in the window without a picture, and the text that it came from."""

    def __init__(self, text: str) -> None:
        self.source = SceneSource("scene", None, text, load_scene(text))
        self.studio: Studio = make_ui(text)[0].studio
        self.studio.shared_in_text = lambda: self.source.shared

    def value(self, path: str) -> Any:
        return self.studio.value(path)

    def same(self, *paths: str) -> Any:
        """The value of all of some places, which have to be equal."""
        values = [self.value(path) for path in paths]
        assert all(value == values[0] for value in values), values
        return values[0]

    @property
    def text(self) -> str:
        """What Ctrl+S would write."""
        found = scene_text(self.source, self.studio.document)
        assert load_scene(found) == self.studio.document
        return found

    def keys(self, aim: Callable[[], Aim | None]) -> SceneOperators:
        motion = Motion(self.studio)
        controls = Controls(self.studio, Settings(), motion)
        return SceneOperators(self.studio, controls, motion, aim, lambda: 0.0)


@pytest.fixture
def figure() -> Desk:
    return Desk(FIGURE)


def test_which_values_a_text_shares() -> None:
    found = {frozenset(map(".".join, group)) for group in groups_of(MANY)}
    colors = {"lights.0.color", "lights.1.color", "material.color", "materials.one.base.color"}
    assert frozenset(colors) in found
    assert frozenset({"camera", "layout.views.0.camera"}) in found
    assert frozenset({"formula.iterations", "cut_planes.0.iterations"}) in found
    assert len(found) == 5
    assert groups_of("a: [") == ()


@pytest.mark.parametrize("half", [IN_OBJECT, CUT])
@pytest.mark.parametrize("key", ["move_out", "move_right", "turn_up", "spin_left", "larger"])
def test_the_plane_in_the_object_is_the_one_that_is_cut(figure: Desk, key: str, half: str) -> None:
    """Whichever half the pointer is in: Page Up, Ctrl+Right, Alt+Up and the others move one plane, as one step."""
    before = figure.same(IN_OBJECT, CUT)

    def aim() -> Any:
        renderer = figure.studio.scene.layout.views[1].renderer  # type: ignore[union-attr]
        return SimpleNamespace(plane_path=CUT, plane=renderer.plane) if half == CUT else None  # type: ignore[union-attr]

    figure.keys(aim).operators[key]()
    after = figure.same(IN_OBJECT, CUT)
    assert after != before
    text = figure.text
    assert "plane: &plane {" in text
    assert "plane: *plane" in text
    assert [line for line in text.splitlines() if line not in FIGURE.splitlines()] == [
        next(line for line in text.splitlines() if "&plane" in line)
    ]
    figure.studio.undo()
    assert figure.same(IN_OBJECT, CUT) == before
    figure.studio.redo()
    assert figure.same(IN_OBJECT, CUT) == after


def test_drags_and_panels_too(figure: Desk) -> None:
    plane = load_scene(FIGURE).cut_planes[0].plane
    for step in (0.1, 0.2):
        figure.studio.edit({CUT: shift(plane, normal=step).model_dump(mode="json")}, "plane")
    figure.same(IN_OBJECT, CUT)
    figure.studio.end_gesture()
    figure.studio.edit({"cut_planes.0.iterations": 90})
    assert figure.same("cut_planes.0.iterations", "layout.views.1.renderer.iterations") == 90
    figure.studio.edit({"layout.views.1.renderer.colors": {"palette": "viridis"}})
    figure.same("cut_planes.0.colors", "layout.views.1.renderer.colors")
    planes = figure.value("cut_planes")
    figure.studio.edit({"cut_planes": [{**planes[0], "plane": {**planes[0]["plane"], "width": 1.5}}]})
    assert figure.same(IN_OBJECT, CUT)["width"] == 1.5
    text = figure.text
    for name in ("plane", "limit", "colors"):
        assert text.count(f"&{name} ") == text.count(f"*{name}") == 1
    figure.studio.undo()
    figure.studio.undo()
    figure.studio.undo()
    figure.studio.undo()
    assert figure.studio.document == load_scene(FIGURE)


def test_every_anchor() -> None:
    """Numbers, colours, cameras, in lists and in mappings; with other defaults beside them."""
    desk = Desk(MANY)
    desk.studio.edit({"lights.1.color.2": 0.25})
    colors = ("lights.0.color", "lights.1.color", "material.color", "materials.one.base.color")
    assert desk.same(*colors) == [1.0, 0.8, 0.25]
    desk.studio.edit({"materials.one.base.diffuse_roughness": 0.125})
    assert desk.same("material.diffuse", "materials.one.base.diffuse_roughness") == 0.125
    desk.studio.edit({"formula.iterations": 4})
    assert desk.same("formula.iterations", "cut_planes.0.iterations") == 4
    desk.studio.set_camera(desk.studio.scene.camera.model_copy(update={"fov": 20.0}))
    assert desk.same("camera.fov", "layout.views.0.camera.fov") == 20
    text = desk.text
    for name in ("warm", "half", "few", "view", "second"):
        assert f"&{name} " in text
        assert text.count(f"*{name}") == MANY.count(f"*{name}")


def test_a_plane_before_it_goes_and_comes_back() -> None:
    desk = Desk(MANY)
    second = "cut_planes.1.plane"
    planes = desk.value("cut_planes")
    desk.studio.edit({"cut_planes": planes[1:]})
    assert desk.same("cut_planes.0.plane", CUT)["width"] == 2
    desk.studio.edit({"cut_planes.0.plane.width": 3.0})
    assert desk.same("cut_planes.0.plane", CUT)["width"] == 3
    assert desk.text
    desk.studio.undo()
    desk.studio.undo()
    desk.studio.edit({CUT + ".width": 4.0})
    assert desk.same(second, CUT)["width"] == 4
    assert desk.value("cut_planes.0.plane.width") == 1


def test_a_plane_that_goes_takes_nothing_with_it() -> None:
    desk = Desk(MANY)
    desk.studio.edit({"cut_planes": desk.value("cut_planes")[:1]})
    assert desk.value(CUT)["width"] == 2
    desk.studio.edit({"cut_planes.0.plane.width": 5.0})
    assert desk.value(CUT)["width"] == 2
    desk.studio.undo()
    desk.studio.undo()
    desk.studio.edit({"cut_planes.1.plane.width": 6.0})
    assert desk.same("cut_planes.1.plane", CUT)["width"] == 6


def test_what_the_command_line_made_two_stays_two() -> None:
    desk = Desk(FIGURE)
    studio = make_ui(load_scene(FIGURE, overrides=[f"{CUT}.width=2"]))[0].studio
    studio.shared_in_text = lambda: desk.source.shared
    studio.edit({IN_OBJECT + ".width": 2.5})
    assert studio.value(CUT + ".width") == 2
    studio.edit({IN_OBJECT + ".height": 2.5})  # this part is still one
    assert studio.value(CUT + ".height") == 2.5


def test_a_value_that_is_not_possible_at_the_other_place_is_refused() -> None:
    """A focus may be anywhere, a power has a range."""
    text = MANY.replace("name: mandelbulb", "name: mandelbulb, parameters: {power: &p 1.6}").replace(
        "plane: &first {width: 1, height: 1}", "plane: {width: 1, height: 1}\n    spacing: 1"
    )
    desk = Desk(text.replace("fov: 30}", "fov: 30, focus_distance: *p}"))
    assert desk.studio.edit({"formula.parameters.power": 4.0})
    assert desk.value("camera.focus_distance") == 4
    assert not desk.studio.edit({"camera.focus_distance": 100.0})
    assert "formula.parameters.power" in desk.studio.problems["camera.focus_distance"]
    assert desk.value("camera.focus_distance") == 4


def test_keys_that_are_merged_are_one_thing_too() -> None:
    text = MANY.replace(
        "lights:\n", "lights:\n  - &key {type: point, position: [9, 0, 0]}\n  - {<<: *key, intensity: 2}\n"
    )
    desk = Desk(text)
    desk.studio.edit({"lights.1.position.1": 3.0})
    assert desk.same("lights.0.position", "lights.1.position") == [9, 3, 0]
    desk.studio.edit({"lights.0.intensity": 5.0})
    assert desk.value("lights.1.intensity") == 2
    assert "{<<: *key, intensity: 2}" in desk.text


def test_in_a_film_what_no_track_moves_stays_one() -> None:
    film = FIGURE + (
        "animation: {duration: 2, fps: 2, tracks: {cut_planes.0.plane.width: "
        "{keys: [{frame: 0, value: 2.9}, {frame: 3, value: 2}]}}}\n"
    )
    desk = Desk(film)
    desk.studio.go_to_frame(3.0)
    desk.studio.edit({CUT + ".center": [0.0, 0.0, 0.1]})
    assert desk.same(IN_OBJECT + ".center", CUT + ".center") == [0, 0, 0.1]
    assert (desk.value(IN_OBJECT + ".width"), desk.value(CUT + ".width")) == (2, 2.9)
