"""Edits of a checked scene equal loading its file with `--set`, for right values and for wrong ones."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.errors import ClfractalError, SceneError
from clfractal.files import resources
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.viewer.editing import edited, replaced, value_at
from tests.viewer.sessions import scene_of

SCENES = (
    "mandelbulb",
    "four_views",
    "stereo_bulb",
    "volume_alabaster",
    "cut_mandelbrot",
    "lamplit_shells",
    "cobalt_mirror",
)


def shipped(name: str, *overrides: str) -> Scene:
    return load_scene(resources.folder("scenes") / f"{name}.yaml", overrides=overrides)


def vector(low: float = -3, high: float = 3) -> st.SearchStrategy[list[float]]:
    return st.lists(st.floats(low, high).map(lambda value: round(value, 4)), min_size=3, max_size=3)


VALUES: dict[str, st.SearchStrategy[Any]] = {
    "camera.position": vector(),
    "camera.target": vector(),
    "camera.up": vector(),
    "camera.fov": st.floats(-10, 200),
    "formula.iterations": st.integers(-1, 200),
    "formula.name": st.sampled_from(["mandelbulb", "mandelbox", "hast", "no such formula"]),
    "formula.live": st.sampled_from([[], ["power"], ["nothing"]]),
    "deep": st.sampled_from([None, {}, {"center": ["0.1", 0.2, "3e-1"]}, {"center": ["x", 0, 0]}, {"at": 3}]),
    "deep.magnification": st.floats(0.5, 1e121),
    "image.width": st.integers(-1, 4000),
    "renderer.samples": st.integers(0, 70_000),
    # (Of another type are other keys: panels replace the section.)
    "renderer": st.sampled_from(
        [{"type": "surface"}, {"type": "volume"}, {"type": "cut_plane"}, {"type": "x"}, {}]
    ),
    "renderer.nothing": st.just(1),
    "lights.0.intensity": st.floats(-1, 5),
    "lights.0.direction": vector(-1, 1),
    "lights.7.intensity": st.just(1.0),
    "material.color": vector(-0.5, 1.5),
    "material.ambient": st.floats(-0.5, 2),
    "material": st.sampled_from([{}, {"ambient": 0.2}, {"gloss": 1}, 3]),
    "coloring.by": st.sampled_from(["solid", "iterations", "trap", "normal", "taste"]),
    "coloring.palette": st.sampled_from(["amber", "ocean", "no palette"]),
    "background": st.sampled_from(["transparent", {"top": [0, 0, 1]}, [0, 0]]),
    "fog": st.sampled_from([None, {"density": 0.1}, {"colour": 1}]),
    "environment": st.sampled_from([None, {"name": "studio"}, {"name": "nowhere"}]),
    "cut_planes": st.sampled_from([[], [{"cut": True}], [{"cut": 2}]]),
    "stereo": st.sampled_from([None, {"mode": "rows"}, {"mode": "smell"}]),
    "stereo.mode": st.sampled_from(["anaglyph", "split_half", "rows"]),
    "output.exposure": st.floats(-30, 30),
    "output.png_bits": st.sampled_from([8, 16, 12]),
    "bookmarks": st.sampled_from([{}, {"here": {"position": [0, -3, 0]}}, {"here": {"fov": 500}}]),
    "nowhere": st.just(1),
}


def result(make: Callable[[], Scene]) -> tuple[Scene | None, str]:
    """The scene, or the error's message."""
    try:
        return make(), ""
    except ClfractalError as error:
        return None, error.message


@pytest.mark.parametrize("name", SCENES)
def test_a_single_edit_is_as_set(name: str) -> None:
    scene = shipped(name)

    @given(st.data())
    def same(data: st.DataObject) -> None:
        path = data.draw(st.sampled_from(sorted(VALUES)))
        value = data.draw(VALUES[path])
        check(scene, name, {path: value})

    same()


def check(scene: Scene, name: str, values: dict[str, Any]) -> None:
    by_edit = result(lambda: edited(scene, values))
    by_set = result(lambda: shipped(name, *(f"{path}={json.dumps(value)}" for path, value in values.items())))
    assert (by_edit[0] is None) == (by_set[0] is None), (values, by_edit[1], by_set[1])
    if by_edit[0] is not None and by_set[0] is not None:
        assert by_edit[0] == by_set[0]
        assert by_edit[0].resolved() == by_set[0].resolved()
    elif not by_edit[1].startswith("there is no such"):
        assert by_edit[1] == by_set[1], (values, by_edit, by_set)


@given(st.dictionaries(st.sampled_from(sorted(VALUES)), st.none(), min_size=2, max_size=4), st.data())
def test_several_edits_at_once_are_as_set(paths: dict[str, None], data: st.DataObject) -> None:
    # One error at most: which of several is told first is left open.
    roots = {path.split(".")[0] for path in paths}
    if len(roots) < len(paths):
        return
    values = {path: data.draw(VALUES[path]) for path in paths}
    scene = shipped("mandelbulb")
    alone = [result(partial(edited, scene, {path: value})) for path, value in values.items()]
    if sum(each[0] is None for each in alone) == 0:
        check(scene, "mandelbulb", values)


# Of a scene that has most things, so that most checks across sections have something to say.
RICH: dict[str, Any] = {
    "version": 1,
    "formula": {"name": "mandelbulb", "iterations": 6},
    "camera": {"position": [0, -3, 0.5]},
    "lights": [{"type": "point", "position": [0.5, -2, 1]}, {"direction": [1, 1, -1]}],
    "materials": {"gold": {"base": {"metalness": 1}}, "glass": {"transmission": {"weight": 1}}},
    "material": {"name": "gold"},
    "lighting": {"mode": "path"},
    "objects": {
        "ball": {"type": "sphere", "position": [1.3, 0, 0], "radius": 0.3, "material": "glass"},
        "hole": {"type": "box", "join": "cut", "size": [0.5, 0.5, 0.5]},
    },
    "cut_planes": [{"objects": ["ball"]}],
}
FILM: dict[str, Any] = {
    "animation": {
        "frames": 5,
        "tracks": {
            "lights.0.position": {
                "keys": [{"frame": 0, "value": [0.5, -2, 1]}, {"frame": 4, "value": [0, -2, 0]}]
            },
            "camera.fov": {"expression": "40 + frame"},
        },
    }
}
STEPS: dict[str, st.SearchStrategy[Any]] = {
    "camera.position": vector(-1.5, 1.5),
    "camera.fov": st.floats(1, 100),
    "camera.frame": st.sampled_from(["all", None]),
    "formula.iterations": st.integers(1, 8),
    "formula.name": st.sampled_from(["mandelbulb", "mandelbox", "no such formula"]),
    "lights.0.position": vector(-1.5, 1.5),
    "lights.0.type": st.sampled_from(["point", "sphere", "set"]),
    "lights.1.intensity": st.floats(-1, 5),
    "lighting.mode": st.sampled_from(["path", "direct"]),
    "materials.gold.base.metalness": st.floats(-0.2, 1.2),
    "materials.gold.specular.roughness": st.sampled_from([0.3, {"by": "trap", "curve": [[0, 0], [1, 1]]}]),
    "materials.glass": st.sampled_from([{}, {"transmission": {"weight": 0.5}}, {"blend": ["gold", "glass"]}]),
    "materials.glass.transmission.weight": st.floats(0, 1),
    "material.name": st.sampled_from(["gold", "glass", "lead", None]),
    "objects.ball.position": vector(-2, 2),
    "objects.ball.material": st.sampled_from(["glass", "gold", "lead", None]),
    "objects.ball.join": st.sampled_from(["union", "cut", "smooth_union"]),
    "objects.ball.radius": st.floats(-0.1, 2).map(lambda value: round(value, 3)),
    "objects.sea": st.sampled_from([{"type": "water", "position": [0, 0, -1]}, {"type": "lake"}]),
    "cut_planes.0.objects.0": st.sampled_from(["ball", "hole", "sea"]),
    "cut_planes.0.cut": st.booleans(),
    "renderer.type": st.sampled_from(["surface", "volume"]),
    "renderer.points": st.sampled_from([None, {"pattern": "grid", "count": 4}]),
    "renderer.step": st.floats(0, 5),
    "coloring.by": st.sampled_from(["solid", "residual", "iterations", "taste"]),
    "coloring.palette": st.sampled_from(["amber", "no palette"]),
    "environment": st.sampled_from([None, {"name": "studio"}, {"name": "nowhere"}]),
    "layout": st.sampled_from([None, {"views": [{}, {"renderer": {"type": "cut_plane"}}]}, {"views": []}]),
    "stereo": st.sampled_from([None, {"mode": "rows"}]),
    "glow": st.sampled_from([None, {"width": 0.1}, {"width": -1}]),
    "mist": st.sampled_from([None, {"width": 0.1}, {"by": "iterations", "end": 1}]),
    "output.channels": st.sampled_from([["R", "G", "B"], ["Z"], ["albedo.R"], ["nothing"]]),
}


@pytest.mark.parametrize("more", [{}, FILM], ids=["still", "film"])
def test_one_edit_after_the_other_is_as_the_whole(more: dict[str, Any]) -> None:
    """What has passed in a scene before is not checked again: that must hide no mistake."""
    first = load_scene({**RICH, **more})

    @given(st.lists(st.sampled_from(sorted(STEPS)), min_size=3, max_size=8), st.data())
    @settings(max_examples=50)
    def walk(paths: list[str], data: st.DataObject) -> None:
        scene = first
        for path in paths:
            scene = step(scene, path, data.draw(STEPS[path]))

    walk()


def step(scene: Scene, path: str, value: Any) -> Scene:
    """The scene after an edit, which is what its text gives then; or the same one, if it is refused as the text is."""
    plain = scene.resolved()
    assert load_scene(plain) == scene
    wanted = told(lambda: load_scene(put(plain, path.split("."), value)))
    found = told(lambda: edited(scene, {path: value}))
    if isinstance(found, Scene):
        assert found == wanted, (path, value)
        assert found.resolved() == wanted.resolved()
        return found
    if not found[1].startswith(("there is no such", "a track of the film moves")):
        assert found == wanted, (path, value)
    return scene


def told(make: Callable[[], Scene]) -> Any:
    """The scene, or the path and the message of its error."""
    try:
        return make()
    except ClfractalError as error:
        return error.where.path, error.message


def put(value: Any, path: list[str], new: Any) -> Any:
    """Plain data with another value at a path."""
    if not path:
        return new
    part, *rest = path
    if isinstance(value, list):
        index = int(part)
        return [
            *value[:index],
            put(value[index] if index < len(value) else None, rest, new),
            *value[index + 1 :],
        ]
    value = value or {}
    return {**value, part: put(value.get(part), rest, new)}


def test_an_edit_checks_what_it_changes_alone() -> None:
    scene = edited(load_scene(RICH), {"camera.fov": 41.0})
    checks = [check for check in scene._derived if check.__module__ != "clfractal.scene.model"]
    after = edited(scene, {"background": {"top": [1.0, 0.0, 0.0]}})
    again = [check.__name__ for check in checks if after._derived[check] is not scene._derived[check]]
    assert again == []
    assert all(
        getattr(after, name) is getattr(scene, name) for name in Scene.model_fields if name != "background"
    )
    after = edited(scene, {"materials.gold.specular.roughness": 0.4})
    assert after.materials["glass"] is scene.materials["glass"]
    assert after.materials["gold"].base is scene.materials["gold"].base
    after = edited(scene, {"lights.0.intensity": 2.0})
    again = [check.__name__ for check in checks if after._derived[check] is not scene._derived[check]]
    assert "_check_lights" in again
    assert "_check_steps" not in again


def test_what_an_edit_gives_can_be_rendered_and_written() -> None:
    scene = edited(shipped("mandelbulb"), {"formula.parameters.power": 5, "camera.fov": 33.0})
    assert scene.chain is not None
    assert load_scene(scene.resolved()) == scene
    assert value_at(scene, "formula.parameters.power") == 5


@pytest.mark.parametrize(
    "path", ["lights.2.intensity", "lights.x", "camera.position.9", "material.color.q", "a.b.c"]
)
def test_places_that_do_not_exist(path: str) -> None:
    with pytest.raises(SceneError) as error:
        edited(scene_of(), {path: 1.0})
    assert error.value.where.path
    assert value_at(scene_of(), path) is None


def test_an_edit_leaves_the_scene_before_alone() -> None:
    scene = shipped("four_views")
    before = json.dumps(scene.resolved())
    edited(scene, {"layout.views.0.coloring.scale": 0.7, "lights.0.intensity": 3.0})
    assert json.dumps(scene.resolved()) == before


def test_files_are_read_again_only_where_they_may_have_changed() -> None:
    scene = edited(scene_of(), {"environment": {"name": "studio"}})
    first = scene.surroundings
    assert edited(scene, {"camera.fov": 30.0}).surroundings is first
    assert edited(scene, {"environment": None}).surroundings is None


def test_other_sections_are_checked_with_the_whole() -> None:
    """As undo puts them back: each was right once, together they need not be."""
    stereo = edited(scene_of(), {"stereo": {"mode": "rows"}})
    flat = edited(scene_of(), {"camera": {"projection": "orthographic", "position": [0, -3, 0]}})
    with pytest.raises(ClfractalError):
        replaced(flat, {"stereo": stereo.stereo})
    assert replaced(flat, {"material": stereo.material}) == flat
    assert replaced(scene_of(), {"formula": stereo.formula, "stereo": stereo.stereo}) == stereo
