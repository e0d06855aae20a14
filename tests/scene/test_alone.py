"""Scenes of objects alone, `formula: none`: what they are read as, what they frame, and what needs a formula."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.errors import ClfractalError, FormulaError, SceneError
from clfractal.files.volume_file import Volume, write_volume
from clfractal.formulas.catalog import description, names
from clfractal.scene.checks import inside_solid
from clfractal.scene.load import dump_scene, load_scene
from clfractal.schema.kinds import members
from tests.scene.errors import cases, error_of, marked
from tests.scenes import HEAD
from tests.shell import InProcess

HEAD_DATA = {"version": 1, "camera": {}}
ALONE = HEAD.replace("{name: mandelbulb}", "none")
# In the texts below the sign § stands where the message must point to.
CASES = cases(
    """
coloring: {by: §trap} => coloring.by: trap needs a formula, and the scene's is none; use solid, normal or residual
coloring: {by: §iterations}
=> coloring.by: iterations needs a formula, and the scene's is none; use solid, normal or residual
lighting: {mode: path}
materials: {m: {specular: {roughness: {by: §thickness}}}}
=> materials.m.specular.roughness.by: thickness needs a formula, and the scene's is none; use another quantity, or a
 texture
glow: §{} => glow: needs a formula, and the scene's is none; remove it
mist: §{} => mist: needs a formula, and the scene's is none; remove it
lights: [{}, {type: §set}] => lights.1.type: set needs a formula, and the scene's is none; remove this light
objects: {b: {}}
cut_planes: [{opacity: 0, cut: true, objects: [b]}, {opacity: §0.5}]
=> cut_planes.1.opacity: shows counts of a formula, and the scene's is none; 0 only cuts objects
objects: {b: {join: §cut}}
=> objects.b.join: cut needs a formula, and the scene's is none; remove it, and the object stands for itself
layout: {views: [{}, {coloring: {by: §trap}}]}
=> layout.views.1.coloring.by: trap needs a formula, and the scene's is none; use solid, normal or residual
""",
)


@pytest.mark.parametrize(("text", "expected"), CASES, ids=[expected[:60] for _, expected in CASES])
def test_messages(text: str, expected: str) -> None:
    plain, place = marked(ALONE + text)
    assert error_of(plain) == f"{place}: {expected}"


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("{chain: [{name: mandelbulb}, {name: §none}]}", ".chain.1.name: none cannot be a member of a chain; remove it"),
        ("{name: none, parameters: {§power: 2}}", ".parameters.power: unknown parameter 'power'; known: none"),
        ("§none\nrenderer: {type: volume}", ": none is for surface renderers, got a volume; name a formula"),
        ("§none\nobjects: {b: {type: formula, formula: {name: hast}}}\nrenderer: {type: volume}",
         ": none is for surface renderers, got a volume; name a formula"),
        ("§none\nrenderer: {type: cut_plane}", ": none is for surface renderers, got a cut_plane; name a formula"),
        ("§none\nlayout: {views: [{}, {renderer: {type: volume}}]}",
         ": none is for surface renderers, got a volume; name a formula (for layout.views.1)"),
        ("§nothing", ": must be a mapping, got 'nothing'"),
    ],
)  # fmt: skip
def test_messages_of_the_formula(formula: str, expected: str) -> None:
    plain, place = marked(HEAD.replace("{name: mandelbulb}", formula))
    assert error_of(plain) == f"{place}: formula{expected}"


def test_an_object_cannot_be_none() -> None:
    plain, place = marked(HEAD + "objects: {b: {type: formula, formula: {name: §none}}}")
    expected = "objects.b.formula.name: none is for the scene's own formula; remove this object"
    assert error_of(plain) == f"{place}: {expected}"


def test_the_word_and_the_name_are_the_same_scene() -> None:
    scene = load_scene(ALONE)
    assert not scene.has_set
    for text in (HEAD.replace("mandelbulb", "none"), dump_scene(scene)):
        assert load_scene(text) == scene
    assert load_scene(HEAD, overrides=["formula=none"]) == scene
    assert load_scene(HEAD).has_set


def test_none_is_no_name_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "formulas").mkdir()
    (tmp_path / "formulas" / "none.yaml").write_text("no formula at all")
    assert not load_scene(ALONE, folder=tmp_path).has_set
    assert not load_scene(HEAD.replace("mandelbulb", "none"), folder=tmp_path).has_set
    assert "none" not in names()


def test_what_a_formula_says_of_itself_decides_and_not_its_name() -> None:
    """Written into the scene, as pictures have it, it is the same; and any other formula may say so."""
    inline = {**description("none"), "title": "Nobody"}
    scene = load_scene({**HEAD_DATA, "formula": {"inline": inline}})
    assert not scene.has_set
    assert load_scene({**HEAD_DATA, "formula": {"inline": {**inline, "alone": False}}}).has_set
    with pytest.raises(SceneError, match=r"^coloring.by: trap needs a formula"):
        load_scene({**HEAD_DATA, "formula": {"inline": inline}, "coloring": {"by": "trap"}})
    with pytest.raises(FormulaError, match="is for scenes of objects alone"):
        clfractal.distances(inline, np.zeros((1, 3)))
    with pytest.raises(ClfractalError, match=r"alone: must be true or false$"):
        load_scene({**HEAD_DATA, "formula": {"inline": {**inline, "alone": "yes"}}})


def test_kinds_of_colours_that_need_a_set() -> None:
    needing = {"trap", "iterations", "thickness", "curvature", "layer_distance", "carried"}
    assert {kind.tag for kind in members("colorings") if kind.needs_set()} == needing


def test_of_none_nothing_can_be_asked() -> None:
    for formula in ("none", {"name": "none"}):
        with pytest.raises(FormulaError, match="none is for scenes of objects alone"):
            clfractal.distances(formula, np.zeros((1, 3)))


def test_a_camera_frames_all_objects_that_have_an_end(tmp_path: Path) -> None:
    objects = "objects: {a: {position: [3, 0, 0], radius: 1}, b: {position: [-1, 0, 0], radius: 1}, p: {type: plane}"
    scene = load_scene(f"{ALONE.replace('camera: {}', 'camera: {frame: all}')}{objects}}}")
    assert scene.bounds[0] == pytest.approx((1, 0, 0))
    # (A ball's own box has corners farther out.)
    assert 3 <= scene.bounds[1] < 4
    assert scene.camera.target == pytest.approx((1, 0, 0))
    write_volume(tmp_path / "grid.nrrd", Volume(np.eye(8, dtype=np.float32).reshape(1, 8, 8).repeat(8, 0)))
    grid = "v: {type: volume, file: grid.nrrd, size: 2, position: [0, 9, 0]}"
    scene = load_scene(f"{ALONE}objects: {{{grid}}}", folder=tmp_path)
    assert scene.bounds[0] == pytest.approx((0, 9, 0))
    assert scene.bounds[1] == pytest.approx(3**0.5)
    assert load_scene(ALONE).bounds == ((0, 0, 0), 1)


FORMULAS = """objects:
  a: {type: formula, formula: {name: hast}, position: [3, 0, 0], scale: 0.5, rotation: [0, 0, 90]}
  b: {type: formula, formula: {name: menger_sponge}, position: [-1, 0, 0], join: %s}
  c: {join: cut, radius: 0.1}
coloring: {by: trap}
glow: {}
mist: {by: iterations}
"""


@pytest.mark.parametrize("join", ["union", "cut"])
def test_formulas_may_be_among_the_objects(join: str) -> None:
    scene = load_scene(ALONE + FORMULAS % join)
    assert scene.has_set
    assert list(scene.joined) == ["a", "b", "c"]
    own = load_scene(HEAD.replace("mandelbulb", "hast"))
    # The scene's own formula has no part in it.
    if join == "cut":
        assert scene.bounds[0] == (3, 0, 0)
        assert scene.bounds[1] == pytest.approx(0.5 * own.bounds[1])
    else:
        assert scene.bounds[1] < 4 + own.bounds[1]
    places = np.random.default_rng(1).uniform(-1, 1, (300, 3))
    turned = 0.5 * places @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + [3, 0, 0]
    held = inside_solid(own, places.tolist())
    hole = np.linalg.norm(turned, axis=1) < 0.1
    assert inside_solid(scene, turned.tolist()) == [a and not b for a, b in zip(held, hole, strict=True)]
    assert inside_solid(scene, [(0.0, 0.0, 0.0), (0.001, 0.0, 0.0)]) == [False, False]


def test_lights_may_be_where_a_set_would_be() -> None:
    assert load_scene(ALONE + "lights: [{type: point, position: [0, 0, 0]}]").lights


@pytest.mark.parametrize("command", ["mesh", "voxelize", "slices"])
def test_commands_that_need_a_formula(command: str, clf: InProcess, tmp_path: Path) -> None:
    (tmp_path / "alone.yaml").write_text(ALONE)
    output, told = {
        "mesh": ("out.ply", "formula: none is for surface renderers"),
        "voxelize": ("out.nrrd", "formula: none is for surface renderers"),
        "slices": ("out.png", "renderer.type: must be cut_plane"),
    }[command]
    ended = clf(command, str(tmp_path / "alone.yaml"), "-o", str(tmp_path / output))
    assert ended.is_one_line(2, "alone.yaml", told)
