"""The tree of lamps: with which probability each is chosen, and pictures of many lamps beside closed forms."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal
from clfractal.device.select import Device, choose
from clfractal.device.structs import Precision
from clfractal.scene.model import Scene
from clfractal.schema.kinds import members
from clfractal.schema.light import SingleLight
from clfractal.shading import light_tree
from clfractal.shading.light_tree import Lamps, lamps_of
from tests.render.bits import same
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import PERSPECTIVE, Floats, points_of, rays, shoot, stacked
from tests.scenes import scene_of
from tests.small_kernels import LOADS, SmallKernels
from tests.variants import one_of

_TEXT = f"""\
#include "device/lanes.h"
#include "formulas/numbers/real.h"
#include "device/vectors.h"
#include "shading/light_tree.h"
{LOADS}
// Planes of `count` numbers. In: a place, a normal, where the choice lies or a lamp. Out: a lamp, the parts
// that it has.
__kernel void look(__global const scalar *in, __global scalar *out, __global const float *tree, int known,
                   int count) {{
    const int lane = (int)get_global_id(0) * LANES;
    in += lane;
    out += lane;
    const vec from = vec_of(load(in), load(in + count), load(in + 2 * count));
    const vec normal = vec_of(load(in + 3 * count), load(in + 4 * count), load(in + 5 * count));
    const tree_choice found = tree_descent(&from, &normal, known, load(in + 6 * count), less(R(0.0), R(1.0)), tree);
    store(out, found.lamp);
    store(out + count, found.share);
    store(out + 2 * count, found.even);
}}
"""
# Of each lane's ray the lamps that it asks: how many, and the sum of squares of their numbers.
_MET_TEXT = f"""\
#include "device/lanes.h"
#include "formulas/numbers/real.h"
#include "device/vectors.h"
#include "shading/light_tree.h"
{LOADS}
__kernel void meet(__global const scalar *in, __global scalar *out, __global const float *tree, int nodes, int count) {{
    const int lane = (int)get_global_id(0) * LANES;
    in += lane;
    out += lane;
    const vec origin = vec_of(load(in), load(in + count), load(in + 2 * count));
    const vec inverse = vec_of(tree_inverse(load(in + 3 * count)), tree_inverse(load(in + 4 * count)),
                               tree_inverse(load(in + 5 * count)));
    lamp_turn turn = {{0, 0}};
    real found = R(0.0), which = R(0.0);
    for (;;) {{
        mask asks;
        const int i = next_lamp(&turn, 0, nodes, tree, origin, inverse, load(in + 6 * count), &asks);
        if (i < 0) break;
        const real number = (real)((scalar)i);
        found += pick(asks, R(1.0), R(0.0));
        which += pick(asks, number * number, R(0.0));
    }}
    store(out, found);
    store(out + count, which);
}}
"""
COUNT = 37
GLOW = {"shadow": False, "visible": False}


def lamps(count: int = COUNT) -> list[dict[str, Any]]:
    """Lamps of all kinds with a place, over a plane; so small that none hides others."""
    random = np.random.default_rng(2)
    found: list[dict[str, Any]] = []
    for number in range(count):
        position = [*random.uniform(-2, 2, 2), random.uniform(0.3, 1.5)]
        bright = float(random.uniform(0.2, 2))
        kinds: list[dict[str, Any]] = [
            {"type": "point", "falloff": "inverse_square", "intensity": 0.1 * bright, "shadow": False},
            {"type": "sphere", "radius": 0.005, "intensity": 4000 * bright, **GLOW},
            {
                "type": "spot",
                "angle": 60,
                "direction": random.normal(size=3).tolist(),
                "intensity": 0.2 * bright,
            },
            {"type": "rectangle", "width": 0.01, "height": 0.02, "intensity": 2000 * bright, **GLOW},
        ]
        kinds[3]["direction"] = [*random.uniform(-0.5, 0.5, 2), -1]
        found.append({"position": [float(x) for x in position], **kinds[number % 4]})
    return found


def lit(lights: list[dict[str, Any]], **sections: Any) -> Scene:
    """A white floor that lamps light."""
    white = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
    usual: dict[str, Any] = {
        "lighting": {"mode": "path", "bounces": 0},
        "background": [0, 0, 0],
        "materials": {"white": white},
        "objects": {"floor": {"type": "plane", "position": [0, 0, 0], "material": "white"}},
        "lights": lights,
    }
    return scene_of(NOWHERE, sections.pop("camera", PERSPECTIVE), (32, 32), **{**usual, **sections})


@cache
def tree() -> Lamps:
    return lamps_of(lit(lamps()))


@cache
def places() -> tuple[Floats, Floats]:
    """Near lamps, among them, and far away; with normals, and without."""
    random = np.random.default_rng(4)
    points = random.normal(size=(24, 3)) * np.geomspace(0.5, 30, 24)[:, None]
    points[:3] = np.array([each["position"] for each in lamps()[:3]]) + 0.01
    normals = random.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals[::3] = 0
    return points, normals


def look(given: Floats, known: int, precision: Precision, lanes: int) -> Floats:
    """For rows of places, normals and a number each: lamps, and their parts with the normal and without."""
    kernels = SmallKernels(choose(), _TEXT, precision, lanes)
    planes = kernels.planes(given.T)
    out = np.full((3, planes.shape[1]), np.nan, precision)
    kernels.run("look", planes, out, tree().nodes, np.int32(known), np.int32(planes.shape[1]), result=out)
    return np.asarray(out.T.astype(float)[: len(given)])


@pytest.mark.parametrize(("precision", "lanes"), one_of(("float32", 8), ("float32", 1), ("float64", 4)))
def test_all_lamps_are_chosen_as_they_say(precision: Precision, lanes: int) -> None:
    points, normals = places()
    fine = 4096
    asked = [
        np.column_stack(
            [np.tile(point, (fine, 1)), np.tile(normal, (fine, 1)), (np.arange(fine) + 0.5) / fine]
        )
        for point, normal in zip(points, normals, strict=True)
    ]
    chosen = look(np.concatenate(asked), 0, precision, lanes).reshape(len(points), fine, 3)
    numbers = np.arange(COUNT, dtype=float)
    met = [
        np.column_stack([np.tile(point, (COUNT, 1)), np.tile(normal, (COUNT, 1)), numbers])
        for point, normal in zip(points, normals, strict=True)
    ]
    known = look(np.concatenate(met), 1, precision, lanes).reshape(len(points), COUNT, 3)
    assert (known[:, :, 0] == numbers).all()
    for part in (1, 2):
        np.testing.assert_allclose(known[:, :, part].sum(axis=1), 1, atol=1e-5)
    for row, parts in zip(chosen, known, strict=True):
        which = row[:, 0].astype(int)
        np.testing.assert_allclose(row[:, 1:], parts[which, 1:], rtol=1e-4)
        np.testing.assert_allclose(np.bincount(which, minlength=COUNT) / fine, parts[:, 1], atol=2.5 / fine)


def test_what_shines_on_a_place_may_be_chosen_and_most_of_it_is() -> None:
    """By what each lamp brings, exactly."""
    points, _ = places()
    brings = np.stack([irradiance(light, points) for light in tree().lights], axis=1)
    numbers = np.arange(COUNT, dtype=float)
    given = [np.column_stack([np.tile(point, (COUNT, 1)), np.zeros((COUNT, 3)), numbers]) for point in points]
    even = look(np.concatenate(given), 1, "float32", 8).reshape(len(points), COUNT, 3)[:, :, 2]
    assert (even[brings > 0] > 0).all()
    total = brings.sum(axis=1)
    # The second moment of an estimate beside its mean's square: 1 for exact weights, the count for any at random.
    moment = np.divide(brings**2, even, out=np.zeros_like(brings), where=even > 0).sum(axis=1) / total**2
    assert moment.mean() < 3
    assert moment.max() < 15


def irradiance(light: SingleLight, points: Floats) -> Floats:
    """What a lamp brings to what faces it at points, shape (..., 3)."""
    offset = points - np.array(light.stands_at)
    square = (offset**2).sum(axis=-1)
    strength = np.asarray(light.intensity * light.given(1e4) * 1e8 / square)
    if light.beam is None:
        return strength
    cosine = offset @ (np.array(light.beam[0]) / np.linalg.norm(light.beam[0])) / np.sqrt(square)
    if light.tag == "rectangle":
        return np.asarray(strength * np.maximum(cosine, 0))
    t = np.clip((30 - np.degrees(np.arccos(cosine))) / 6, 0, 1)
    return np.asarray(strength * t * t * (3 - 2 * t))


@pytest.mark.light
def test_a_thousand_lamps_light_a_floor(device: Device) -> None:
    """Of each what it brings by the cosine: all small, so none has a size to speak of."""
    above = {"position": [0, 0, 8], "target": [0, 0, 0], "up": [0, 1, 0]}
    camera = {"projection": "orthographic", **above, "height": 3}
    scene = lit(lamps(1000), renderer={"samples": 256}, camera=camera)
    film = shoot(scene, device)
    points = points_of(film)
    wanted = np.zeros(points.shape[:2])
    for light in lamps_of(scene).lights:
        toward = np.array(light.stands_at) - points
        cosine = np.maximum(toward[..., 2], 0) / np.linalg.norm(toward, axis=-1)
        wanted += irradiance(light, points) * cosine
    found = film["R"].astype(float)
    assert found.mean() == pytest.approx(wanted.mean(), rel=0.003)
    blocks = found.reshape(8, 4, 8, 4).mean(axis=(1, 3)) / wanted.reshape(8, 4, 8, 4).mean(axis=(1, 3))
    assert np.abs(blocks - 1).max() < 0.03


@pytest.mark.light
@pytest.mark.parametrize("roughness", [0.1, 0.6])
def test_what_is_asked_for_and_what_is_met_add_up(
    device: Device, roughness: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A gloss shows balls as it does where each is weighed by itself."""
    balls = [
        {
            "type": "sphere",
            "position": [x, y, 1.5],
            "radius": 0.3,
            "intensity": 1 + (x + y) % 3,
            "visible": False,
        }
        for x in range(-2, 3)
        for y in range(-2, 3)
    ]
    steel = {"base": {"color": [0.9, 0.9, 0.9], "metalness": 1}, "specular": {"roughness": roughness}}
    found = []
    for most in (light_tree.MOST_WEIGHED, 99):
        monkeypatch.setattr(light_tree, "MOST_WEIGHED", most)
        scene = lit(
            balls,
            materials={"white": steel},
            lighting={"mode": "path", "bounces": 1},
            renderer={"samples": 256},
        )
        assert bool(len(lamps_of(scene).nodes)) == (most < 99)
        found.append(shoot(scene, device)["R"].astype(float))
    one, other = (each.reshape(8, 4, 8, 4).mean(axis=(1, 3)) for each in found)
    assert one.mean() == pytest.approx(other.mean(), rel=0.004)
    np.testing.assert_allclose(one, other, rtol=0.06, atol=0.02 * other.max())


def test_a_measured_lamp_is_as_strong_as_a_point_of_its_candela(tmp_path: Path) -> None:
    head = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 1 1 2 0 0 0\n1 1 0\n"
    (tmp_path / "lamp.ies").write_text(head + "0 180\n0\n2000 2000\n")
    measured = {"type": "ies", "file": "lamp.ies", "intensity": 0.1, "shadow": False}
    point = {"type": "point", "falloff": "inverse_square", "intensity": 0.2, "shadow": False}
    lights = [{**(measured if number % 2 else point), "position": [number, 0, 1]} for number in range(20)]
    text = {**lit(lamps(1)).resolved(), "lights": lights}
    path = tmp_path / "scene.yaml"
    path.write_text(json.dumps(text))
    nodes = lamps_of(clfractal.load_scene(path)).nodes
    alone = nodes[nodes[:, 18] == np.arange(len(nodes)) + 1]
    assert alone[:, 4] == pytest.approx(alone[0, 4])


def test_lamps_that_rays_meet_say_how_far_they_reach() -> None:
    for kind in members("lights"):
        if issubclass(kind, SingleLight) and "position" in kind.model_fields and kind.is_seen:
            light = kind.checked({"type": kind.tag, "position": [0, 0, 0]})
            assert max(light.extent) > 0, kind.tag


def test_rays_meet_the_nearest(device: Device) -> None:
    random = np.random.default_rng(6)
    middles = random.uniform(-0.9, 0.9, (300, 3))
    balls: list[dict[str, Any]] = [
        {"type": "sphere", "position": place.tolist(), "radius": 0.05, "intensity": 1.0 + number}
        for number, place in enumerate(middles)
    ]
    scene = lit(balls, objects={}, renderer={"samples": 1})
    origin, way, _ = rays(scene)
    offset = middles - np.broadcast_to(origin, way.shape)[0, 0]
    along = np.einsum("hwi,ni->hwn", way, offset)
    inside = 0.05**2 - (offset**2).sum(axis=1) + along**2
    far = np.where(inside > 0, along - np.sqrt(np.maximum(inside, 0)), np.inf)
    clear = (np.abs(inside) > 1e-4).all(axis=2)
    wanted = np.where(np.isfinite(far.min(axis=2)), far.argmin(axis=2) + 1, 0)
    assert (wanted > 0).sum() > 100
    seen = shoot(scene, device)["R"]
    assert (np.abs(seen - wanted) < 0.01)[clear].all()


@pytest.mark.parametrize("lanes", one_of(8, 16))
def test_a_lane_asks_the_lamps_of_its_own_ray(lanes: int) -> None:
    """Whichever boxes its neighbours open: the same as alone, and every lamp whose box it goes through."""
    random = np.random.default_rng(3)
    middles = random.uniform(-1, 1, (64, 3))
    balls = [{"type": "sphere", "position": each.tolist(), "radius": 0.2, "intensity": 1} for each in middles]
    nodes = lamps_of(lit(balls)).nodes
    count = 4096
    origins = random.uniform(-2, 2, (count, 3))
    # To corners of boxes, where the last bit decides.
    leaves = nodes[nodes[:, 18] == np.arange(len(nodes)) + 1]
    corners = np.where(
        random.random((count, 3)) < 0.5,
        *leaves[random.integers(64, size=count), 12:18].reshape(-1, 2, 3).swapaxes(0, 1),
    )
    ways = corners - origins
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    given = np.column_stack([origins, ways, np.full(count, 1e9)]).T

    def met(order: npt.NDArray[np.intp], lanes: int) -> Floats:
        kernels = SmallKernels(choose(), _MET_TEXT, "float32", lanes)
        planes = kernels.planes(given[:, order])
        out = np.full((2, count), np.nan, "float32")
        kernels.run("meet", planes, out, nodes, np.int32(len(nodes)), np.int32(count), result=out)
        back = np.empty((2, count))
        back[:, order] = out
        return back

    straight = met(np.arange(count), lanes)
    np.testing.assert_array_equal(met(random.permutation(count), lanes), straight)
    inverse = 1 / ways
    slabs = np.stack([(leaves[:, None, i : i + 3] - origins) * inverse for i in (12, 15)])
    entry, exit = slabs.min(axis=0).max(axis=-1), slabs.max(axis=0).min(axis=-1)
    surely = ((entry + 1e-4 < exit) & (exit > 1e-4)).sum(axis=0)
    assert (straight[0] >= surely).all()
    assert straight[0].sum() < 1.2 * surely.sum()


def test_a_part_of_a_picture_of_many_lamps_has_its_bits(device: Device) -> None:
    """Other lanes are neighbours there."""
    balls = [
        {**each, "type": "sphere", "radius": 0.05, "visible": True} for each in lamps(60) if "radius" in each
    ]
    points = [each for each in lamps(60) if each["type"] == "point"]
    steel = {"base": {"metalness": 1}, "specular": {"roughness": 0.3}}
    scene = lit(
        [*balls, *points],
        materials={"white": steel},
        lighting={"mode": "path", "bounces": 2},
        renderer={"samples": 4},
    )
    assert len(lamps_of(scene).nodes) > 0
    whole = stacked(shoot(scene, device, lanes=8))
    for x, y, width, height in [(5, 3, 17, 13), (1, 0, 30, 32)]:
        part = stacked(shoot(scene, device, lanes=8, region=(x, y, width, height)))
        assert same(np.ascontiguousarray(whole[y : y + height, x : x + width]), part)
