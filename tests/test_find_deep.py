"""Deep places that are found: as deep as wanted, exact, at the set's border, and told as scenes that load again."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.engine.finding import find
from clfractal.engine.found import FoundView
from clfractal.errors import SceneError
from clfractal.formulas import reference
from clfractal.formulas.deep import drawn_out
from clfractal.scene.model import Scene
from tests.shell import InProcess, works

BOX = """\
version: 1
formula: {name: mandelbox, parameters: {scale: -1.5}, iterations: 8}
image: {width: 64, height: 40}
camera: {position: [3, -7, 4]}
lights: [{direction: [1, 0.6, -1.2]}, {direction: [-1, 0.5, 0.2], intensity: 0.35}]
renderer: {max_steps: 2000}
"""
DEEP = 1e8


@pytest.fixture(scope="module")
def box() -> tuple[Scene, FoundView]:
    scene = clfractal.load_scene(BOX)
    (found,) = find(scene, count=1, magnification=DEEP)
    return scene, found


def test_a_place_is_as_deep_as_wanted_and_at_the_border(box: tuple[Scene, FoundView]) -> None:
    scene, found = box
    deep = found.scene.deep
    assert deep is not None
    assert deep.magnification == DEEP
    assert found.score > 0.12
    # Each application magnifies by 1.5 where no fold does: so many more tell as much apart.
    assert found.scene.formula.iterations > scene.formula.iterations + 8
    # What is seen there, small as it is, is the set's border: a ray from the eye to the middle of the picture hits it.
    picture = clfractal.render(found.scene, samples=1, channels=("R", "G", "B", "A", "Z"))
    assert (picture["A"] > 0.5).mean() > 0.3
    eye = np.array([found.scene.camera.position])
    assert reference.distance(found.scene.chain, eye, found.scene.formula.iterations)[0] > 0
    # The place itself is one of the set, so much that nothing around it is far from the set.
    center = np.array([[float(Fraction(each)) for each in deep.center]])
    assert reference.distance(scene.chain, center, scene.formula.iterations)[0] < 0.1
    # What else the scene has stays.
    assert found.scene.lights == scene.lights
    assert found.scene.renderer == scene.renderer


def test_the_same_seed_finds_the_same_place(box: tuple[Scene, FoundView]) -> None:
    scene = box[0]
    (one,), (other,) = (find(scene, count=1, seed=seed, magnification=64) for seed in (1, 1))
    assert one.scene == other.scene
    (third,) = find(scene, count=1, seed=2, magnification=64)
    assert third.scene.deep != one.scene.deep


def test_forms_are_drawn_out_where_the_map_does_not_keep_angles() -> None:
    place = {"center": ["0.3", "0.45", "0.55"], "magnification": 1e4}

    def of(name: str) -> float:
        scene = {"version": 1, "formula": {"name": name, "iterations": 20}, "camera": {}, "deep": place}
        return drawn_out(clfractal.load_scene(scene).chain)

    assert of("sierpinski_tetrahedron") == pytest.approx(1, rel=1e-9)
    assert of("mandelbulb") > 1.05


def test_places_are_written_as_scenes(clf: InProcess) -> None:
    Path("box.yaml").write_text(BOX)
    works(
        clf(
            "find", "box.yaml", "-n", "1", "--magnification", "1e3", "--size", "32x20", "-o", "out", "--quiet"
        )
    )
    assert sorted(path.name for path in Path("out").iterdir()) == ["box-01.png", "box-01.yaml"]
    scene = clfractal.load_scene(Path("out/box-01.yaml"))
    assert scene.deep is not None
    assert scene.deep.magnification == 1000
    assert scene.image.width == 64
    assert clfractal.load_scene(Path("out/box-01.png")) == scene


REFUSED = {
    ("--magnification", "0.5"): "--magnification: must be at least 1, got 0.5",
    ("--magnification", "1e121"): "--magnification: must be at most 1e+120, got 1e+121",
    ("--magnification", "nan"): "--magnification: must be a finite number",
    ("--magnification", "9", "--set", "deep.magnification=10"): "--magnification: must be at least 10, got 9",
    ("--magnification", "9", "-o", "views.yaml"): "--magnification: views.yaml: bookmarks have no iterations of their own",
    ("--magnification", "9", "--set", "objects.floor.type=plane"): "box.yaml: objects: would stand in the way",
    ("--magnification", "9", "--set", "lights=[]"): "box.yaml: no place was found at a magnification of 9",
}  # fmt: skip


@pytest.mark.parametrize("options", REFUSED, ids=" ".join)
def test_what_is_refused(clf: InProcess, options: tuple[str, ...]) -> None:
    Path("box.yaml").write_text(BOX)
    assert clf("find", "box.yaml", "--quiet", "-n", "1", *options).is_one_line(2, REFUSED[options])
    assert not [path for path in Path().iterdir() if path.name not in ("box.yaml", "scene.yaml")]


def test_a_set_that_is_not_shown_is_refused() -> None:
    with pytest.raises(SceneError, match="magnification: must be a number"):
        find(BOX, magnification="much")  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="formula: has no deep places"):
        find("version: 1\nformula: none\ncamera: {}\n", magnification=10)
