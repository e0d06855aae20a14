"""The list of formulas: chosen by keys or by the pointer, and what is seen of a formula that was chosen."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from clfractal.camera.views import scene_view
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.viewer.panels import formula, formula_library
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.pointer import project
from tests.viewer.panel_clicks import Seen
from tests.viewer.panel_harness import Stage, make_ui, opened

pytestmark = pytest.mark.usefixtures("drawing_context")


@pytest.fixture
def stage(monkeypatch: pytest.MonkeyPatch) -> Stage:
    """The formula's panel of a Mandelbulb, with the list open."""
    seen = Seen(monkeypatch)
    found = Stage(opened("scenes/mandelbulb.yaml"), formula.draw)
    seen.click(found, next(name for name in seen.places if name.endswith("##formula")))
    return found


def _names(text: str = "") -> list[str]:
    """What the list shows for a text that is searched for, from the top."""
    return [name for name, title in formula_library.titles().items() if text in f"{name} {title}".lower()]


def test_enter_takes_what_was_searched_for(stage: Stage) -> None:
    stage.type("menger")
    stage.press(imgui.Key.enter)
    assert stage.ui.studio.scene.formula.name == _names("menger")[0]
    assert not imgui.is_popup_open("", imgui.PopupFlags_.any_popup)


def test_arrows_go_through_what_was_found_and_stop_at_its_ends(stage: Stage) -> None:
    stage.type("box")
    names = _names("box")
    assert 2 < len(names) < 50
    for _ in range(60):
        stage.press(imgui.Key.down_arrow)
    stage.press(imgui.Key.enter)
    assert stage.ui.studio.scene.formula.name == names[-1]


def test_enter_takes_nothing_where_nothing_was_found(stage: Stage) -> None:
    stage.type("no such formula")
    stage.press(imgui.Key.enter)
    assert stage.ui.studio.scene.formula.name == "mandelbulb"
    assert stage.ui.studio.history.depth("scene") == (0, 0)


# What is seen


@pytest.mark.parametrize("name", ["menger_sponge", "mandelbox", "quaternion_julia", "amazing_surf"])
def test_a_new_formula_is_framed_and_undo_brings_the_camera_back(name: str) -> None:
    if name not in formula_library.titles():
        pytest.fail(f"{name} is no formula of the library")
    ui, _ = make_ui(load_scene("scenes/mandelbulb.yaml", overrides=["camera.position=[0.3, -1.2, 0.2]"]))
    before = ui.studio.scene
    assert formula_library.take(ui.studio, {"name": name, "iterations": 8})
    after = ui.studio.scene
    assert after.formula.name == name
    assert _height(after) == pytest.approx(0.9, abs=0.02)
    # From the same side.
    assert np.allclose(scene_view(after).axis, scene_view(before).axis)
    assert ui.studio.undo("scene")
    assert ui.studio.scene == before
    assert ui.studio.redo("scene")
    assert ui.studio.scene == after


def _height(scene: Scene) -> float:
    """The part of the picture's height that the bounds' outline fills, about its middle."""
    view, (center, radius) = scene_view(scene), scene.bounds
    size = (scene.image.width, scene.image.height)
    middle = np.array(project(view, center, size))
    assert np.allclose(middle[:2], (size[0] / 2, size[1] / 2), atol=1e-6 * size[0])
    assert view.eye is not None
    # Rays that touch the ball: tan(angle) = radius / sqrt(distance^2 - radius^2).
    slope = radius / np.sqrt(float(middle[2]) ** 2 - radius**2)
    return float(2 * slope * np.linalg.norm(view.center - view.eye) / view.height)


def test_a_camera_that_a_film_moves_stays() -> None:
    keys = "[{time: 0, value: [0, -3, 0]}, {time: 1, value: [0, -5, 0]}]"
    text = f"{{fps: 10, duration: 1, tracks: {{camera.position: {{keys: {keys}}}}}}}"
    ui, _ = make_ui(load_scene("scenes/mandelbulb.yaml", overrides=[f"animation={text}"], posed=False))
    before = ui.studio.scene.camera
    assert formula_library.take(ui.studio, {"name": "mandelbox", "iterations": 8})
    assert ui.studio.scene.camera == before


def test_a_formula_that_is_refused_tells_why() -> None:
    ui: Ui = make_ui("scenes/mandelbulb.yaml")[0]
    assert not formula_library.take(ui.studio, {"name": "mandelbulb", "iterations": 0})
    assert "formula" in ui.studio.problems
