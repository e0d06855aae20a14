"""Fog around the set, by distances and by escape counts, against sums along the rays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.bits import alike_by_lanes
from tests.render.misty import BEHIND, expected, misty, sure
from tests.render.shots import BALL, ORTHOGRAPHIC, rays, shoot, stacked, to_sphere
from tests.variants import every

RED, GREEN, BLUE = [1.0, 0.1, 0.05], [0.1, 0.9, 0.2], [0.05, 0.2, 1.0]
COLORS = [{"at": 0, "color": RED}, {"at": 0.3, "color": GREEN}, {"at": 1, "color": BLUE}]
COUNTS = [{"at": 2, "color": BLUE}, {"at": 5, "color": GREEN}, {"at": 7, "color": RED}]
MIST: dict[str, Any] = {"density": 1.2, "width": 0.15, "colors": COLORS}
BY_COUNTS = {"by": "iterations", "density": 12, "start": 1.5, "end": 7, "colors": COUNTS}
CASES: dict[str, dict[str, Any]] = {
    "near": {"mist": MIST},
    "thick": {"mist": {**MIST, "density": 20}},
    "a shell": {"mist": {**MIST, "density": 5, "width": 0.05, "distance": 0.3}},
    "of one colour": {"mist": {"density": 2, "colors": [{"at": 0.5, "color": GREEN}]}},
    "a jump": {"mist": {**MIST, "colors": [{"at": 0.2, "color": RED}, {"at": 0.2, "color": BLUE}]}},
    "parallel": {"mist": MIST, "camera": ORTHOGRAPHIC},
    "in fog": {"mist": {**MIST, "density": 4}, "fog": {"density": 0.3, "color": [0.9, 0.2, 0.5]}},
    "paths": {"mist": MIST, "lighting": {"mode": "path", "bounces": 1}},
    "far out": {"mist": {**MIST, "density": 0.4, "width": 0.8}, "formula": BALL, "iterations": 9},
    "counts": {"mist": BY_COUNTS, "formula": BALL, "iterations": 9},
    "the formula's counts": {
        "mist": {"by": "iterations", "start": 0.5, "density": 40, "colors": COUNTS},
        "formula": BALL,
        "iterations": 6,
    },
}


@pytest.mark.parametrize(
    ("case", "precision"),
    [
        *((case, "float32") for case in CASES),
        *every(9, ((case, "float64") for case in CASES)),
    ],
)
def test_mist_is_the_integral(device: Device, case: str, precision: Any) -> None:
    scene = misty(64, **CASES[case])
    seen = stacked(shoot(scene, device, precision), ("R", "G", "B")).astype(float)
    wanted, inner = expected(scene), sure(scene)
    assert np.abs(wanted[inner] - BEHIND).max() > 0.2
    assert seen[inner].mean(axis=0) == pytest.approx(wanted[inner].mean(axis=0), rel=0.01, abs=0.002)
    # (Where a colour changes at once, rays that just touch the place have the most noise.)
    alike = np.isclose(seen[inner], wanted[inner], rtol=0.03, atol=0.02).all(axis=-1)
    assert alike.mean() > 0.98


def without(scene: Scene) -> Scene:
    return scene.model_copy(update={"mist": None})


def test_where_there_is_none_nothing_changes(device: Device) -> None:
    """To the last bit: fog of no density, and what is seen past its end."""
    names = ("R", "G", "B", "A", "Z", "N.X", "P.Y")
    for more in ({}, {"fog": {"density": 0.2}}, {"background": "transparent"}):
        scene = misty(4, mist={"density": 0}, **more)
        one, other = (stacked(shoot(each, device), names) for each in (scene, without(scene)))
        np.testing.assert_array_equal(one, other)
    narrow = misty(4, mist={**MIST, "width": 0.002})
    one, other = (stacked(shoot(each, device), ("R", "G", "B")) for each in (narrow, without(narrow)))
    origin, way, _ = rays(narrow)
    _, nearest = to_sphere(np.broadcast_to(origin, way.shape), way, [0, 0, 0], 1)
    beyond = nearest > narrow.bounds[1] + 0.2
    assert beyond.sum() > 100
    np.testing.assert_array_equal(one[beyond], other[beyond])
    assert (one[nearest < 0.7] != other[nearest < 0.7]).any(axis=-1).all()


def test_fog_that_leaves_the_background_out_leaves_it_to_the_mist(device: Device) -> None:
    """Before the ball both are seen, past it the mist alone."""
    fog = {"density": 0.3, "color": [0.9, 0.2, 0.5]}
    both = misty(64, mist=MIST, fog={**fog, "background": False})
    covered, clear = (
        both.model_copy(update=more)
        for more in ({"fog": {**fog, "background": True}}, {"fog": {**fog, "density": 0}})
    )
    found, wanted, past = (stacked(shoot(each, device), ("R", "G", "B")) for each in (both, covered, clear))
    hit = shoot(both, device)["A"] == 1
    np.testing.assert_array_equal(found[hit], wanted[hit])
    free = shoot(both, device)["A"] == 0
    assert (found[free] <= past[free] + 1e-6).all()
    assert (found[free] > 0.5 * past[free]).all()


def test_its_light_is_emission(device: Device) -> None:
    """The layers are the picture's light, without what the background adds."""
    scene = misty(16, mist=MIST, background={"top": [0, 0, 0], "bottom": [0, 0, 0]})
    names = ("R", "G", "B")
    layers = tuple(f"{layer}.{name}" for layer in ("emission", "direct", "indirect") for name in names)
    found = shoot(scene, device, channels=(*names, *layers))
    parts = stacked(found, layers).reshape(*found["R"].shape, 3, 3).sum(axis=2)
    np.testing.assert_allclose(parts, stacked(found, names), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    "sections",
    [{"mist": MIST}, {"mist": {**BY_COUNTS, "start": 4.2}, "formula": BALL, "iterations": 9}],
    ids=["distances", "counts"],
)
def test_joined_solids_have_one_mist(device: Device, sections: dict[str, Any]) -> None:
    """A ball with a hollow that nobody sees has that of the ball. (Counts are known within the bounds.)"""
    hollow = {"type": "sphere", "radius": 0.4, "join": "cut"}
    alone = misty(64, **sections)
    joined = misty(64, **sections, objects={"hollow": hollow})
    one, other = (stacked(shoot(each, device), ("R", "G", "B")).astype(float) for each in (alone, joined))
    inner = sure(alone)
    np.testing.assert_allclose(one[inner], other[inner], rtol=0.05, atol=0.03)


@pytest.mark.combination
def test_steps_do_not_show(device: Device) -> None:
    alike_by_lanes(misty(64, mist=MIST), device, share=1, rtol=1e-3, atol=1e-4)
