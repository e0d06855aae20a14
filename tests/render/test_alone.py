"""Scenes of objects alone: no march is launched, and nothing but the march is missing in their pictures."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import Result, WorkItem
from clfractal.files.exr import read_exr
from clfractal.integrators.surface import PROGRAMS, program_texts
from clfractal.integrators.waves import surface_stages
from tests.render.objects_oracle import NOWHERE, met
from tests.render.shots import PERSPECTIVE, beside, plan_of, rays, shoot
from tests.scenes import scene_of
from tests.shell import InProcess, works
from tests.variants import one_of

OF_FORMULAS = {name for each in PROGRAMS if each.formula for name in each.kernels}
OBJECTS: dict[str, Any] = {
    "floor": {"type": "plane", "position": [0, 0, -0.6]},
    "ball": {"radius": 0.6, "material": "glass"},
    "sea": {"type": "water", "position": [0, 0, -0.5], "material": "sea"},
    "ring": {"type": "torus", "position": [0.9, 0.2, 0], "radius": 0.3, "tube": 0.1},
}
SECTIONS: dict[str, Any] = {
    "objects": OBJECTS,
    "materials": {
        "glass": {"specular": {"roughness": 0}, "transmission": {"weight": 1}},
        "sea": {
            "specular": {"ior": 1.33},
            "transmission": {"weight": 1, "color": [0.5, 0.8, 0.9], "depth": 1},
        },
    },
    "lights": [
        {"direction": [1, 1, -1], "angular_size": 3},
        {"type": "sphere", "position": [1, -2, 3], "radius": 0.4, "intensity": 20},
    ],
    "fog": {"density": 0.05, "scattering": {}},
}
WAYS: dict[str, dict[str, Any]] = {
    "paths": {"lighting": {"mode": "path", "bounces": 6}, "renderer": {"samples": 2}},
    "milk": {
        "lighting": {"mode": "path", "bounces": 6},
        "materials": {
            **SECTIONS["materials"],
            "glass": {"transmission": {"weight": 1, "color": [0.9] * 3, "depth": 0.5, "scatter": [0.8] * 3}},
        },
        "fog": None,
    },
    "direct": {"renderer": {"bounces": 2, "ambient_occlusion": {"rays": 2, "distance": 0.5}}},
    "points": {"renderer": {"points": {"pattern": "grid", "count": 9}, "normal": "least_squares"}},
    "steps": {"renderer": {"search": "steps", "step": 0.1}},
    "cut": {
        "cut_planes": [
            {"opacity": 0, "cut": True, "objects": ["ring"], "plane": {"center": [0.9, 0.2, 0], "normal": [0, -1, 0]}}
        ]
    },
}  # fmt: skip


@pytest.mark.parametrize("lanes", one_of(None, 1))
@pytest.mark.parametrize("way", WAYS)
def test_a_picture_has_the_bits_of_one_with_a_set_that_nobody_sees(
    device: Device, way: str, lanes: int | None
) -> None:
    sections = {**SECTIONS, **WAYS[way]}
    shown = [
        shoot(scene_of(formula, PERSPECTIVE, (32, 24), **sections), device, lanes=lanes)
        for formula in ("none", NOWHERE)
    ]
    for name in ("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"):
        np.testing.assert_array_equal(shown[0][name], shown[1][name])
    assert shown[0]["R"].std() > 0.01


@pytest.mark.parametrize("mode", one_of("direct", "path"))
def test_a_formula_among_the_objects_is_as_the_scene_s_own(device: Device, mode: str) -> None:
    bulb = {"name": "mandelbulb", "iterations": 5}
    part = {"type": "formula", "formula": bulb, "position": [0.3, 0.2, -0.1], "scale": 1.0}
    moved = {**part, "position": [0, 0, 0]}
    sections: dict[str, Any] = {
        "lighting": {"mode": mode},
        "renderer": {"samples": 4},
        "background": [0.1, 0.2, 0.3],
    }
    own, alone = (
        shoot(scene_of(formula, PERSPECTIVE, (48, 40), objects=objects, **sections), device)
        for formula, objects in ((bulb, {}), ("none", {"bulb": moved}))
    )
    hit = own["A"] == 1
    assert hit.mean() > 0.1
    assert (hit != (alone["A"] == 1)).mean() < 0.01
    both = hit & (alone["A"] == 1)
    # (Within a fifth of a pixel: each march ends in its own place of a footprint.)
    assert np.median(abs(own["Z"][both] - alone["Z"][both])) < 0.01
    # Nothing is seen of the empty set, which stands where rays go.
    beside = shoot(
        scene_of("none", PERSPECTIVE, (48, 40), objects={"bulb": {**part, "position": [0, 0, 50]}}), device
    )
    assert beside["A"].max() == 0


def test_a_ball_is_where_its_equation_is_zero(device: Device) -> None:
    scene = scene_of("none", PERSPECTIVE, (48, 40), objects={"ball": {"radius": 0.8}}, background=[0, 0, 0])
    framebuffer = shoot(scene, device)
    t, normal, _ = met(scene, *rays(scene)[:2])
    found = beside(framebuffer, scene, t, normal, 1)
    assert found.both.sum() > 100
    assert found.deep.max() < 5e-6
    assert (found.turned > 1e-3).sum() <= 3


def test_without_objects_the_background_is_seen(device: Device) -> None:
    framebuffer = shoot(scene_of("none", PERSPECTIVE, (16, 12), background=[0.2, 0.4, 0.8]), device)
    assert (framebuffer["A"] == 0).all()
    np.testing.assert_allclose(framebuffer["B"], 0.8, rtol=1e-6)


@pytest.mark.parametrize("way", [name for name in WAYS if name != "cut"])
def test_nothing_that_knows_a_formula_is_launched(device: Device, way: str) -> None:
    scene = scene_of("none", PERSPECTIVE, (32, 24), **{**SECTIONS, **WAYS[way]})
    for lanes in (1, 8):
        plan = plan_of(scene, device, lanes=lanes)
        assert OF_FORMULAS.isdisjoint(stage.kernel for stage in surface_stages(scene, plan, (0, 2)))
        assert not {each.name for each in program_texts(scene, plan)} & {
            each.name for each in PROGRAMS if each.formula
        }


def write_alone(folder: Path) -> Path:
    """A scene of four tiles."""
    scene = folder / "alone.yaml"
    scene.write_text(
        "version: 1\nformula: none\ncamera: {position: [0, -3, 1]}\nimage: {width: 40, height: 36}\n"
        "objects: {floor: {type: plane, position: [0, 0, -0.5]}, ball: {}}\nrenderer: {samples: 2}\n"
    )
    return scene


def check_same(path: Path, whole: Path) -> None:
    for name in "RGBAZ":
        np.testing.assert_array_equal(read_exr(path)[0][name], read_exr(whole)[0][name])


def test_a_picture_is_a_scene_again(clf: InProcess, tmp_path: Path) -> None:
    whole, again = tmp_path / "whole.exr", tmp_path / "again.exr"
    works(clf("render", write_alone(tmp_path), "-o", whole, "--quiet"))
    assert not clfractal.load_scene(whole).has_set
    works(clf("render", whole, "-o", again, "--quiet"))
    check_same(again, whole)


@pytest.mark.parametrize("left", [0, 1, 3])
def test_resume_goes_on_with_the_work_that_was_left(
    left: int, clf: InProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, whole, resumed = write_alone(tmp_path), tmp_path / "whole.exr", tmp_path / "resumed.exr"
    works(clf("render", scene, "-o", whole, "--quiet"))
    if left:
        real = LocalExecutor.execute

        def fails(
            executor: LocalExecutor, job: Job, items: Iterable[WorkItem], *rest: Any
        ) -> Iterator[Result]:
            """After so many tiles."""
            for item in items:
                yield from real(executor, job, [replace(item, tiles=item.tiles[:left])], *rest)
            raise clfractal.DeviceError("the device failed")

        with monkeypatch.context() as patch:
            patch.setattr(LocalExecutor, "execute", fails)
            assert clf("render", scene, "-o", resumed, "--quiet").status == 3
        assert not resumed.exists()
    stats = tmp_path / "stats.json"
    works(clf("render", scene, "-o", resumed, "--quiet", "--resume", "--stats", stats))
    told = json.loads(stats.read_text())
    assert (told["tiles"], told["tiles_resumed"]) == (4, left)
    check_same(resumed, whole)
