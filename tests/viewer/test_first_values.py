"""What is added in the window: it is seen where it is put, and lights light what they are added to."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

pytest.importorskip("imgui_bundle")

from clfractal.camera.views import scene_view
from clfractal.engine.engine import Engine
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.schema.kinds import members
from clfractal.schema.shape import solids
from clfractal.viewer.editing import edited
from clfractal.viewer.panels import first, lights
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.sight import Sight
from tests.viewer.panel_clicks import Seen
from tests.viewer.panel_harness import Stage, make_ui

pytestmark = pytest.mark.usefixtures("drawing_context")

SCENE = """
version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 160, height: 90}
camera: {position: [0, -4, 0.6], target: [0, 0, 0], fov: 45}
renderer: {samples: 1}
lights:
  - {direction: [0.5, 1, -0.6]}
"""
NEAR = ("camera.position=[0.4, -1.5, 0.2]", "camera.target=[0.3, 0, 0]")
BELOW = ("camera.position=[0, -3.2, -2.2]",)
FLAT = ("camera={position: [0, -4, 0.6], projection: orthographic, height: 3}",)
ASIDE = ("camera.target=[-3, 0, 0]",)
BESIDE = ("objects.ball={type: sphere, position: [1.6, 0, 0], radius: 0.3}",)
PLACED = [kind.tag for kind in members("lights") if "position" in kind.model_fields]
VIEWS = pytest.mark.parametrize(
    "view", [(), NEAR, BELOW, FLAT, ASIDE], ids=["", "near", "below", "flat", "aside"]
)
SOLIDS = (*(kind.tag for kind in solids()), "formula")


@pytest.fixture(scope="module")
def engine() -> Engine:
    return Engine("pthread")


def _depths(engine: Engine, scene: Scene) -> npt.NDArray[np.float64]:
    return np.asarray(engine.render(scene, samples=1, channels=("Z",))["Z"], float)


def _looking(engine: Engine, monkeypatch: pytest.MonkeyPatch, *overrides: str) -> Ui:
    """The panels of a window that shows the scene."""
    scene = load_scene(SCENE, overrides=overrides)
    ui, _ = make_ui(scene)
    depths, size = _depths(engine, scene), (scene.image.width, scene.image.height)

    def sight(ui: Ui) -> Sight:
        left, top, right, bottom = first.free(ui)
        area = (left * size[0], top * size[1], right * size[0], bottom * size[1])
        return Sight(scene_view(scene), size, depths, area, scene.extent)

    monkeypatch.setattr(first, "sight", sight)
    return ui


@VIEWS
def test_objects_are_seen_whole_where_no_panel_is(
    engine: Engine, monkeypatch: pytest.MonkeyPatch, view: tuple[str, ...]
) -> None:
    ui = _looking(engine, monkeypatch, *view)
    before, seen = ui.studio.scene, first.sight(ui)
    for kind in SOLIDS:
        values = {"type": kind, **first.objects(ui)[kind]}
        # Alone there would be no more to see of it.
        alone = edited(before, {"objects.new": values, "camera": before.camera.model_dump(mode="json")})
        changed = _depths(engine, alone) < (0.97 if kind == "formula" else 0.999) * seen.depths  # type: ignore[operator]
        rows, columns = np.nonzero(changed)
        assert len(rows) > 12, kind
        # (Beside another set, some of the first is found a little elsewhere.)
        least = 0.06 if kind == "formula" else 0.0
        assert np.quantile(columns, least) >= seen.free[0] - 1, kind
        assert np.quantile(columns, 1 - least) < seen.free[2], kind
        assert np.quantile(rows, least) >= seen.free[1] - 1, kind
        if kind == "sphere":
            radius = _radius(seen, values)
            assert len(rows) == pytest.approx(np.pi * radius**2, rel=0.2)


def _radius(seen: Sight, values: dict[str, Any]) -> float:
    """A ball's outline, pixels; about, since a perspective makes it an ellipse."""
    depth = float((np.array(values["position"]) - seen.view.origin) @ seen.view.axis)
    return float(values["radius"]) / seen.pixel(depth)


@VIEWS
def test_a_floor_is_seen_and_hides_not_all(
    engine: Engine, monkeypatch: pytest.MonkeyPatch, view: tuple[str, ...]
) -> None:
    ui = _looking(engine, monkeypatch, *view)
    seen = first.sight(ui)
    plane = edited(ui.studio.scene, {"objects.new": {"type": "plane", **first.objects(ui)["plane"]}})
    changed = _depths(engine, plane) < 0.999 * seen.depths  # type: ignore[operator]
    part = changed[:, int(seen.free[0]) :]
    assert 0.03 < part.mean() < 0.9


def test_water_and_planes_are_level_as_the_camera_is(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    ui = _looking(
        engine, monkeypatch, "camera={position: [-4, 0, 0.6], up: [1, 0.01, 0], target: [0, 0, 0.1]}"
    )
    for kind in ("plane", "water"):
        assert ui.studio.edit({f"objects.{kind}": {"type": kind, **first.objects(ui)[kind]}}), (
            ui.studio.problems
        )
        normal = np.array(ui.studio.scene.objects[kind].normal)  # type: ignore[attr-defined]
        assert normal @ [1, 0.01, 0] == pytest.approx(np.linalg.norm(normal), rel=1e-3)


# Lights


def _light(engine: Engine, scene: Scene, light: dict[str, Any]) -> npt.NDArray[np.float64]:
    """The mean light, linear, of what the set's pixels show, shape (rows, columns); 0 where it is not seen."""
    # Of lights on the set, each sample asks few.
    samples = 64 if light.get("type") == "set" else 1
    film = engine.render(edited(scene, {"lights": [light]}), samples=samples, channels=("R", "G", "B", "A"))
    colors, covered = np.asarray(film, np.float64)[..., :3], np.asarray(film["A"]) > 0.5
    return np.asarray(colors.mean(axis=-1) * covered, np.float64)


@pytest.mark.parametrize("kind", lights.KINDS)
@pytest.mark.parametrize("view", [(), NEAR, BESIDE], ids=["", "near", "beside a ball"])
def test_a_new_light_lights_what_is_seen(
    engine: Engine, monkeypatch: pytest.MonkeyPatch, kind: str, view: tuple[str, ...]
) -> None:
    ui = _looking(engine, monkeypatch, "material={ambient: 0}", *view)
    scene = ui.studio.scene
    light = first.light(ui, kind)
    usual = _light(engine, scene, {"direction": [0.5, 1, -0.6], "shadow": False})
    found = _light(engine, scene, light)
    there = usual > 0
    assert (found[there] > 0.1 * usual[there]).mean() > {"spot": 0.1, "set": 0.2}.get(kind, 0.35)
    # Neither much darker nor much lighter than the light that every scene has.
    lit = there & (found < 0.5 * light["intensity"] if kind in ("sphere", "set") else there)
    assert 0.1 < found[lit].mean() / usual[lit].mean() < 3


@pytest.mark.parametrize("kind", PLACED)
@VIEWS
def test_a_new_light_stands_where_it_is_seen(
    engine: Engine, monkeypatch: pytest.MonkeyPatch, kind: str, view: tuple[str, ...]
) -> None:
    ui = _looking(engine, monkeypatch, *view)
    seen, light = first.sight(ui), first.light(ui, kind)
    x, y, _, depth = np.append(light["position"], 1.0) @ seen.view.world_to_ndc()
    x, y = x / depth * seen.size[0], y / depth * seen.size[1]
    left, top, right, bottom = seen.free
    assert left - 1 <= x <= right + 1
    assert top - 1 <= y <= bottom + 1
    ahead = float((np.array(light["position"]) - seen.view.origin) @ seen.view.axis)
    assert 0 < ahead <= seen.depth_at(x, y)
    if kind == "sphere":  # and so the eye sees a bright disc
        film = engine.render(edited(ui.studio.scene, {"lights": [light]}), channels=("R",))
        assert float(np.asarray(film["R"]).max()) > 0.5 * light["intensity"]


@pytest.mark.parametrize("kind", [kind for kind in PLACED if kind != "point"])
def test_a_light_of_another_kind_gives_as_much_light(
    engine: Engine, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """What a point light becomes lights the point that it looks at as bright as that did."""
    ui = _looking(engine, monkeypatch, "material={ambient: 0, specular: 0}", "formula.iterations=2")
    scene = edited(
        ui.studio.scene, {"lights": [{**first.light(ui, "point"), "intensity": 2.0, "shadow": False}]}
    )
    after = {**first.light(ui, kind, scene.lights[0]), "shadow": False}
    assert after["position"] == list(scene.lights[0].stands_at or ())
    before = _light(engine, scene, scene.lights[0].model_dump(mode="json"))
    found = _light(engine, scene, after)
    # The middle of the picture is what it looks at.
    middle = np.s_[45:46, 80:81]
    assert found[middle].mean() == pytest.approx(before[middle].mean(), rel=0.2)


def test_lights_are_added_from_a_list_and_their_kinds_are_read_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = Seen(monkeypatch)
    ui, _ = make_ui(load_scene(SCENE))
    stage = Stage(ui, lights.draw)
    for kind in lights.KINDS:
        lights._add(ui, kind, [{"direction": [0.5, 1, -0.6]}])
        assert ui.studio.scene.lights[1].tag == kind, ui.studio.problems
    assert "lights" in ui.show  # where they are is shown
    seen.fresh(stage)
    cut = [text for text in lights.KINDS.values() if text not in drawn(stage)]
    assert cut == []


def drawn(stage: Stage) -> set[str]:
    """The words of segments that were drawn whole."""
    from clfractal.viewer.panels import buttons

    plain, found = buttons.clipped, set[str]()

    def clipped(text: str, width: float) -> str:
        shown = plain(text, width)
        found.add(shown)
        return shown

    buttons.clipped = clipped
    try:
        stage.frame()
    finally:
        buttons.clipped = plain
    return found


def test_set_lights_are_possible_on_every_set(engine: Engine) -> None:
    for name in ("mandelbulb", "mandelbox", "menger_sponge", "quaternion_julia"):
        scene = load_scene({"version": 1, "formula": {"name": name, "iterations": 6}, "camera": {}})
        ui, _ = make_ui(scene)
        lights._add(ui, "set", [])
        assert [light.tag for light in ui.studio.scene.lights] == ["set"], ui.studio.problems
