"""Grids of scenes with objects, against NumPy: values, the octree's proofs, normals, colours of meshes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import has_float64
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.integrators import points
from clfractal.integrators.plan import make_plan
from clfractal.integrators.volume import grid_key
from clfractal.scene.objects import FormulaObject
from tests import scenes
from tests.devices import device
from tests.render.joined_oracle import SIMPLE, Distance, Floats, a_sphere, ball, normal_at, smooth, solids
from tests.render.shots import BALL, SOLIDS
from tests.variants import one_of
from tests.voxels.grids import ROUNDED, decoded, differing_voxels, filled, voxel_points
from tests.voxels.joined import EVERY_JOIN, JULIA, SPONGE, belongs, own_places


def scene_of(
    objects: dict[str, Any], formula: dict[str, Any] | None = None, **settings: Any
) -> clfractal.Scene:
    renderer = {"type": "volume", "box": {"size": 4.0}, "resolution": 48, **settings}
    own = formula if formula is not None else {"name": "mandelbulb", "iterations": 6}
    return scenes.scene_of(own, {"position": [0, -4, 0]}, None, renderer=renderer, objects=objects)


def check(scene: clfractal.Scene, **options: Any) -> Any:
    grid = filled(scene, **options)
    expected = belongs(scene, voxel_points(grid.place))
    assert 0.02 < expected.mean() < 0.9
    assert (grid.dense().astype(bool) != expected).mean() <= ROUNDED
    return grid


def test_every_voxel_against_numpy() -> None:
    check(scene_of(EVERY_JOIN, resolution=64))


@pytest.mark.combination
def test_every_lane_count_and_number_type() -> None:
    scene = scene_of(EVERY_JOIN)
    for lanes in accepted_lanes(device(), "float32"):
        check(scene, lanes=lanes)
    if has_float64(device().info):
        precision: Precision = "float64"
        check(scene, precision=precision, lanes=4)


def test_values_are_shares_of_what_is_joined() -> None:
    scene = scene_of(EVERY_JOIN, resolution=24, value="coverage", sub_points=2)
    grid = filled(scene)
    share = np.zeros((24, 24, 24))
    for z in (0.25, 0.75):
        for y in (0.25, 0.75):
            for x in (0.25, 0.75):
                share += belongs(scene, voxel_points(grid.place, (x, y, z)))
    off = np.abs(grid.dense() - np.rint(share / 8 * 255))
    assert (off > 0).mean() < 1e-3
    assert ((share > 0) & (share < 8)).mean() > 0.02


SMOOTH = {**SIMPLE["sphere"][0], "join": "smooth_union", "smoothness": 0.4}
# Objects, and the own formula.
PROOFS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "every join": (EVERY_JOIN, {"name": "mandelbulb", "iterations": 8}),
    "flowing": (
        {"drop": SMOOTH, "cut": {**SIMPLE["box"][0], "join": "cut"}},
        {"name": "hast", "iterations": 20},
    ),
    "two formulas": (
        {"julia": JULIA},
        {"name": "burning_ship", "iterations": 8},
    ),
    "in common": (
        {"other": {**JULIA, "join": "intersection", "scale": 1.2}},
        {"name": "hast", "iterations": 12},
    ),
    "a shape": (
        {"other": {**SPONGE, "scale": 1.5, "position": [0, 0, 0]}},
        {"name": "hast", "iterations": 16},
    ),
}


@pytest.mark.parametrize("name", one_of(*PROOFS))
def test_the_octree_leaves_out_nothing(name: str) -> None:
    octree, brute = (
        filled(scene_of(*PROOFS[name], resolution=128, fill=fill)) for fill in ("octree", "brute")
    )
    # (Most of "flowing" is near the set: with the certain share of its distances 0.72 of its voxels are asked.)
    assert octree.stats.evaluated_voxels < 0.75 * brute.stats.evaluated_voxels
    assert differing_voxels(octree, brute) <= 128**3 // 1_000_000
    np.testing.assert_array_equal(octree.table_entries < 0, brute.table_entries < 0)


def test_a_box_beyond_the_formulas_own_ball_is_searched() -> None:
    """What belongs to the set is what the box shows, as for a formula by itself."""
    far = {"type": "sphere", "position": [40, 0, 0], "radius": 0.5}
    formula = {"inline": {**SOLIDS, "bounds": {"center": [0, 0, 0], "radius": 0.5}}, "iterations": 3}
    alone = filled(scene_of({}, formula))
    np.testing.assert_array_equal(filled(scene_of({"far": far}, formula)).dense(), alone.dense())
    assert alone.dense().any()


def test_what_flows_together_is_where_its_smooth_minimum_is_below_0() -> None:
    formula = {"inline": SOLIDS, "iterations": 3}
    drop = {"type": "sphere", "position": [0.9, -0.7, 0.4], "radius": 0.35, "join": "smooth_union"}
    grid = filled(scene_of({"drop": {**drop, "smoothness": 0.4}}, formula, resolution=64))
    at = voxel_points(grid.place)
    parts = np.maximum(solids(at), 0), a_sphere([0.9, -0.7, 0.4], 0.35)(at)
    expected = smooth(*parts, 0.4) <= 0
    assert (grid.dense().astype(bool) != expected).mean() <= 2e-4  # its distances are estimates
    assert (expected & (np.minimum(*parts) > 0)).sum() > 50, "something flows"


def test_counts_are_the_largest_of_what_is_beside_each_other() -> None:
    objects = {
        "julia": JULIA,
        "hole": {"type": "sphere", "position": [0.5, -0.5, 0.3], "radius": 0.6, "join": "cut"},
        "ball": {"type": "sphere", "position": [-1.2, 0.9, 0.4], "radius": 0.4},
    }
    scene = scene_of(
        objects, {"name": "hast", "iterations": 16}, value="iterations", store="float", resolution=24
    )
    grid = filled(scene)
    at = voxel_points(grid.place).reshape(-1, 3)

    def counts(chain: Any, at: Floats, limit: int) -> Floats:
        found = points.distances(chain, at, limit, device=device(), lanes=4)
        return np.where(found.inside, 16, np.minimum(found.smooth, 16))

    julia, hole, lump = scene.objects.values()
    assert isinstance(julia, FormulaObject)
    theirs = counts(scene.joined_chains["julia"], own_places(julia, at), 20)
    most = np.maximum(counts(scene.chain, at, 16), theirs)
    cut = np.linalg.norm(at - hole.position, axis=-1) < 0.6
    held = np.linalg.norm(at - lump.position, axis=-1) < 0.4
    expected = np.where(held, 16, np.where(cut, 0, most))
    assert (np.abs(grid.dense().reshape(-1) - expected) > 1e-3).mean() < 2e-3
    assert len(np.unique(np.rint(expected))) > 6


def cut_ball(at: Floats) -> Floats:
    return np.maximum(ball(at), -SIMPLE["sphere"][1](at))


@pytest.mark.parametrize("normals", one_of("least_squares", "exact"))
def test_normals_are_those_of_the_distance(normals: str) -> None:
    objects = {"hole": {**SIMPLE["sphere"][0], "join": "cut"}}
    settings = {"resolution": 48, "box": {"size": 2.2}, "normals": normals, "value": "inside"}
    scene = scene_of(objects, {"inline": BALL, "iterations": 20}, **settings)
    grid = filled(scene)
    at = voxel_points(grid.place)
    shown, known = decoded(grid.dense_normals())
    shown /= np.maximum(np.linalg.norm(shown, axis=-1, keepdims=True), 1e-9)
    near = known & (np.abs(cut_ball(at)) < 0.04)
    # Both surfaces meet in an edge, which has no normal.
    near &= np.abs(np.abs(ball(at)) - np.abs(SIMPLE["sphere"][1](at))) > 0.1
    assert near.sum() > 2000
    angle = np.degrees(np.arccos(np.clip((shown * normal_at(cut_ball, at)).sum(-1), -1, 1)))[near]
    assert np.median(angle) < 1
    assert np.percentile(angle, 95) < 4


def test_a_mesh_has_the_normals_and_colours_of_each_object() -> None:
    objects = {
        "red": {"type": "sphere", "position": [1.6, 0, 0], "radius": 0.5, "material": "paint"},
        "hole": {**SIMPLE["sphere"][0], "join": "cut", "material": "wall"},
    }
    materials = {"paint": {"base": {"color": [0.8, 0.1, 0.05]}}, "wall": {"base": {"color": [0.1, 0.2, 0.7]}}}
    surface = clfractal.Scene(
        version=1,
        formula={"inline": BALL, "iterations": 20},
        camera={"position": [0, -4, 0]},
        material={"color": [0.5, 0.5, 0.5]},
        objects=objects,
        materials=materials,
    )
    mesh = clfractal.mesh(surface, resolution=64)
    assert mesh.colors is not None
    assert mesh.normals is not None
    parts: list[Distance] = [a_sphere([1.6, 0, 0], 0.5), lambda at: -SIMPLE["sphere"][1](at), ball]
    found = np.argmin([np.abs(part(np.asarray(mesh.vertices, float))) for part in parts], axis=0)
    colors = np.array([[0.8, 0.1, 0.05], [0.1, 0.2, 0.7], [0.5, 0.5, 0.5]])
    away = np.abs(ball(mesh.vertices) + SIMPLE["sphere"][1](mesh.vertices)) > 0.15  # from the edge of the cut
    for number, part in enumerate(parts):
        own = (found == number) & away
        assert own.sum() > 200
        assert (np.abs(mesh.colors[own] - colors[number]) < 1e-6).all(axis=1).mean() > 0.975
        assert np.abs(part(np.asarray(mesh.vertices[own], float))).max() < 0.06
        exact = normal_at(part, np.asarray(mesh.vertices[own], float))
        assert np.percentile((mesh.normals[own] * exact).sum(-1), 1) > 0.97


def test_a_volume_file_gives_objects_their_colours_again(tmp_path: Path) -> None:
    paint = {"base": {"color": [0.8, 0.1, 0.05]}}
    scene = clfractal.Scene(
        version=1,
        formula={"inline": BALL, "iterations": 12},
        camera={"position": [0, -4, 0]},
        objects={"red": {"type": "box", "position": [1.6, 0, 0], "material": "paint"}},
        materials={"paint": paint},
    )
    volume = clfractal.voxelize(scene, resolution=32)
    mesh = clfractal.mesh(volume)
    assert mesh.colors is not None
    red = (np.abs(mesh.colors - [0.8, 0.1, 0.05]) < 1e-6).all(axis=1)
    assert 0.1 < red.mean() < 0.9
    assert (mesh.vertices[red][:, 0] > 0.9).all()


@pytest.mark.combination
def test_a_picture_of_voxels_lies_where_the_surface_does() -> None:
    objects = {"egg": EVERY_JOIN["egg"], "hole": EVERY_JOIN["hole"], "sponge": SPONGE}
    scene = scene_of(objects, resolution=160)
    camera = {"position": [0.6, -4.6, 2.0], "target": [0, 0, 0], "fov": 40}
    image = {"width": 96, "height": 72}
    changed = scene.resolved() | {"camera": camera, "image": image}
    volume = clfractal.render(changed, channels=["Z", "A"])
    surface = clfractal.render({**changed, "renderer": {"type": "surface"}}, channels=["Z", "A"])
    both = (volume["A"] == 1) & (surface["A"] == 1)
    assert ((volume["A"] > 0.5) == (surface["A"] > 0.5)).mean() > 0.97
    assert both.mean() > 0.2
    assert np.percentile(np.abs(volume["Z"][both] - surface["Z"][both]), 80) < 0.05  # two voxels


def test_another_place_of_an_object_is_another_grid() -> None:
    scene = scene_of({"egg": EVERY_JOIN["egg"]})
    moved = scene_of({"egg": {**EVERY_JOIN["egg"], "position": [1.3, 0, 0.4]}})
    keys = {
        grid_key(each, make_plan(each, precision="float32", lanes=4)) for each in (scene, moved, scene_of({}))
    }
    assert len(keys) == 3


@pytest.mark.parametrize(
    ("own", "settings", "where", "message"),
    [
        ({"type": "water"}, {}, "objects.own.type", "cannot be water with renderer volume"),
        (
            {"type": "plane", "join": "smooth_union"},
            {},
            "objects.own.join",
            "cannot be smooth_union for a plane",
        ),
        (EVERY_JOIN["egg"], {"file": "a.npy"}, "objects", "are not joined to a grid from a file"),
    ],
)
def test_what_cannot_be_filled_is_told_at_its_place(
    own: dict[str, Any],
    settings: dict[str, Any],
    where: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("a.npy", np.zeros((4, 4, 4), np.float32))
    with pytest.raises(clfractal.SceneError, match=message) as caught:
        scene_of({"own": own}, **settings)
    assert caught.value.where.path == where


def test_grids_do_not_leave_water_out_without_a_word() -> None:
    """A surface scene becomes one of a volume, which water cannot be a part of."""
    scene = clfractal.Scene(
        version=1, formula={"name": "hast"}, camera={}, objects={"sea": {"type": "water"}}
    )
    for make in (clfractal.mesh, clfractal.voxelize):
        with pytest.raises(clfractal.SceneError, match="cannot be water with renderer volume"):
            make(scene)
