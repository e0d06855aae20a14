"""Cut planes through several solids that are joined, and through those beside them that they name, against NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.formulas import reference
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject
from tests import scenes
from tests.variants import one_of
from tests.voxels.joined import EVERY_JOIN, belongs, held_by, own_places

SIDE = 96
OBJECTS = {name: EVERY_JOIN[name] for name in ("egg", "hole", "julia", "box")}


def scene_of(renderer: dict[str, Any], **plane: Any) -> Any:
    """A plane across the set and all objects at y = 0.1, seen straight on: pixels are 4 / SIDE wide."""
    named = ["egg", "box"] if renderer["type"] == "surface" else []
    place = {"center": [0, 0.1, 0], "normal": [0, -1, 0], "width": 4, "height": 4}
    usual = {"cut": True, "objects": named, "opacity": 1, "colors": {"mode": "stepped"}}
    return scenes.scene_of(
        {"name": "mandelbulb", "iterations": 7},
        {"projection": "orthographic", "position": [0, -5, 0], "height": 4},
        (SIDE, SIDE),
        renderer=renderer,
        objects=OBJECTS,
        cut_planes=[{"plane": place, **usual, **plane}],
    )


def points_of_pixels() -> np.ndarray[Any, np.dtype[np.float64]]:
    along = (np.arange(SIDE) + 0.5) / SIDE * 4 - 2
    x, z = np.meshgrid(along, -along)
    return np.stack([x, np.full_like(x, 0.1), z], axis=-1)


def counts_of(scene: Scene, at: Any, limit: int | None) -> Any:
    """Whole counts: the largest of what is beside each other; the limit inside, also of what the plane names; 0 where
    something is cut out of the set."""
    most = limit or scene.formula.iterations
    found = reference.escape(scene.chain, at.reshape(-1, 3), most)[0].reshape(at.shape[:-1])
    for name, each in scene.joined.items():
        if isinstance(each, FormulaObject):
            chain, own = scene.joined_chains[name], limit or each.formula.iterations
            more, within = reference.escape(chain, own_places(each, at).reshape(-1, 3), own)
            more = np.where(within, most, np.minimum(more, most)).reshape(at.shape[:-1])
        else:
            more = np.where(held_by(each, at), most, 0)
        found = np.where(more < most, found, 0) if each.join == "cut" else np.maximum(found, more)
    return np.where(held_beside(scene, at), most, found)


def held_beside(scene: Scene, at: Any) -> Any:
    """Which points are in what a plane names."""
    named = [scene.objects[name] for plane in scene.cut_planes for name in plane.cut_objects]
    return np.any([np.zeros(at.shape[:-1], bool), *(held_by(each, at) for each in named)], axis=0)


@pytest.mark.parametrize("limit", [None, 12])
@pytest.mark.parametrize("renderer", one_of("volume", "surface"))
def test_counts_on_the_plane(renderer: str, limit: int | None) -> None:
    settings = {
        "type": renderer,
        **({"resolution": 128, "box": {"size": 4.0}} if renderer == "volume" else {}),
    }
    scene = scene_of(settings, iterations=limit)
    film = clfractal.render(scene, channels=["iterations", "A", "P.Y"])
    expected = counts_of(scene, points_of_pixels(), limit)
    np.testing.assert_allclose(film["P.Y"], 0.1, atol=1e-5)
    # Of a grid a rim of voxels stands out of the set.
    assert (film["iterations"] != expected).mean() < (3e-3 if renderer == "surface" else 1.5e-2)
    assert len(np.unique(expected)) >= 6


def test_its_face_is_all_of_the_set() -> None:
    """With a rectangle that is not seen, the faces alone are: what belongs to the set, but not to the hole, and
    what the plane names beside it, which is whole there."""
    inside = [0.25, 0.5, 0.75]
    scene = scene_of({"type": "surface"}, opacity=0, colors={"inside": inside, "mode": "stepped"})
    film = clfractal.render(scene, channels=["R", "G", "B", "P.Y"])
    face = np.abs(film["P.Y"] - 0.1) < 1e-4
    expected = belongs(scene, points_of_pixels()) | held_beside(scene, points_of_pixels())
    assert 0.08 < expected.mean() < 0.6
    assert (face != expected).mean() < 4e-3
    np.testing.assert_allclose(
        np.stack([film[c] for c in "RGB"], -1)[face & expected].mean(0), inside, atol=1e-3
    )


def test_what_is_not_named_stands_whole() -> None:
    named = scene_of({"type": "surface"}, objects=["box"])
    assert list(named.joined) == ["hole", "julia"]
    film = clfractal.render(named, channels=["P.X", "P.Y", "P.Z", "A"])
    x, z = np.moveaxis(points_of_pixels()[..., [0, 2]], -1, 0)
    at = np.stack([x, np.full_like(x, -0.2), z], axis=-1)
    egg = held_by(named.objects["egg"], at)
    assert egg.sum() > 100
    assert (film["P.Y"][egg] < 0.09).all(), "the egg is in front of the plane"


@pytest.mark.combination
def test_a_named_object_keeps_its_colour_behind_the_plane() -> None:
    """Beside the face it is seen as it was, where the plane's rectangle does not stand."""
    scene = {
        "version": 1,
        "formula": {"name": "mandelbulb", "iterations": 4},
        "camera": {"projection": "orthographic", "position": [0, -3, 4], "target": [0, 0, 0], "height": 4},
        "image": {"width": 128, "height": 128},
        "lights": [{"direction": [0, 1, -1], "shadow": False}],
        "materials": {"red": {"base": {"color": [0.8, 0.1, 0.05]}, "specular": {"weight": 0}}},
        "objects": {"ball": {"type": "sphere", "position": [1.5, 0, 0], "radius": 0.4, "material": "red"}},
        "cut_planes": [{"plane": {"normal": [0, -1, 0]}, "cut": True, "objects": ["ball"], "opacity": 0}],
    }
    film = clfractal.render(scene, channels=["R", "G", "P.X", "P.Y", "P.Z", "A"])
    away = np.linalg.norm(np.stack([film[f"P.{axis}"] for axis in "XYZ"], -1) - [1.5, 0, 0], axis=-1)
    own = (film["A"] == 1) & (np.abs(away - 0.4) < 0.02) & (film["P.Y"] > 0.02)
    assert own.sum() > 60
    np.testing.assert_allclose(film["R"][own] / film["G"][own], 8, rtol=1e-3)
    assert not ((film["P.Y"] < -0.01) & (film["P.X"] > 1.1) & (film["A"] == 1)).any(), "half of it is gone"


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_a_picture_of_the_plane_alone(precision: str) -> None:
    place = {"center": [0, 0.1, 0], "normal": [0, -1, 0], "width": 4, "height": 4}
    renderer = {"type": "cut_plane", "plane": place, "colors": {"mode": "stepped"}, "iterations": 9}
    scene = scene_of({"type": "surface"}).resolved() | {"renderer": renderer, "cut_planes": []}
    film = clfractal.render(scene, channels=["iterations"], precision=precision)
    expected = counts_of(load_scene(scene), points_of_pixels(), 9)
    assert (film["iterations"] != expected).mean() < 3e-3
    alone = clfractal.render(scene | {"objects": {}}, channels=["iterations"], precision=precision)
    assert (film["iterations"] != alone["iterations"]).mean() > 0.05
