"""One picture of a volume or with cut planes, however it is cut, batched, packed, pooled or sampled; zooms; files askew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from clfractal.voxels import pool
from tests import scenes
from tests.render.bits import same
from tests.render.shots import BALL, PERSPECTIVE, points_of, shoot, stacked
from tests.render.volumes import FLAT, LIT, keep, middles, volume_scene

SIZE = (70, 40)
FOG = {"opacity": [{"at": 0.1, "opacity": 0}, {"at": 1, "opacity": 0.4}]}
WHITE = [{"at": 0, "color": [1, 1, 1]}, {"at": 1, "color": [1, 1, 1]}]
LIGHTS = [{"direction": [-1, 1, -1], "shadow": True}, {"type": "point", "position": [2, -2, 3]}]
HAST = {"name": "hast", "iterations": 12}
CAMERA = {"position": [1.5, -2.5, 1.5], "target": [0, 0, 0], "fov": 45}


def scene_of(**sections: Any) -> Scene:
    usual: dict[str, Any] = {"formula": {"inline": BALL, "iterations": 4}, "camera": CAMERA, "size": SIZE}
    return scenes.scene_of(**{**usual, "lights": LIGHTS, **sections})


def shaded(look: dict[str, Any]) -> dict[str, Any]:
    """With shadows, as the other fog of this file: the same program."""
    return {**look, "lights": [{**light, "shadow": True} for light in look["lights"]]}


@pytest.mark.parametrize("parts", [2, 4])
def test_a_grid_in_several_pools(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parts: int
) -> None:
    """Larger than the device's largest buffer: values and normals come from the right part."""
    values = np.random.default_rng(5).uniform(0, 255, (33, 41, 50)).astype(np.uint8)
    values[:12] //= 16
    keep(tmp_path / "a.nrrd", values, [-1.2, -1, -0.8], [0.05] * 3)
    transfer = {"opacity": [{"at": 20, "opacity": 0}, {"at": 255, "opacity": 0.5}]}
    scene = volume_scene(
        PERSPECTIVE,
        folder=tmp_path,
        file="a.nrrd",
        look=shaded(LIT),
        transfer=transfer,
        shadows=True,
        size=(40, 40),
    )
    whole = stacked(shoot(scene, device))
    usual = pool.plan_pools
    monkeypatch.setattr(
        "clfractal.voxels.dense.plan_pools",
        lambda *given: replace(usual(*given), part_slots=-(-usual(*given).slots // parts)),
    )
    assert same(stacked(shoot(scene, device)), whole)
    assert (whole[..., 3] > 0.9).mean() > 0.1


@pytest.mark.parametrize("scales", [[4], [2, 2]])
def test_a_zoom_shows_the_small_box_as_large_as_the_first(device: Device, scales: list[int]) -> None:
    """The same voxels as of the small box by itself, seen by a camera that is as much nearer."""
    middle = np.array([-0.4, 0.1, 0.05])
    first = {"center": list(middle), "size": [2.4, 2.0, 1.6]}
    small = middle + np.array([-0.3, 0.25, 0.2])
    light = {"lights": [{"direction": [-1, 1, -1]}], "formula": HAST}
    eye = np.array([1.2, -2.8, 1.6])
    common = {"type": "volume", "resolution": [48, 40, 32], "value": "coverage", "precision": "float32"}
    zoomed = scene_of(
        **light,
        renderer={**common, "box": first, "zoom": [{"center": list(small), "scale": s} for s in scales]},
    )
    zoomed = zoomed.model_copy(
        update={
            "camera": zoomed.camera.model_copy(
                update={"position": tuple(middle + eye), "target": tuple(middle)}
            )
        }
    )
    itself = scene_of(**light, renderer={**common, "box": {"center": list(small), "size": [0.6, 0.5, 0.4]}})
    itself = itself.model_copy(
        update={
            "camera": itself.camera.model_copy(
                update={"position": tuple(small + eye / 4), "target": tuple(small)}
            )
        }
    )
    near, far = shoot(zoomed, device), shoot(itself, device)
    hit = (near["A"] > 0) & (far["A"] > 0)
    assert hit.mean() > 0.1
    assert ((near["A"] > 0) != (far["A"] > 0)).mean() < 0.01
    both = points_of(near)[hit], points_of(far)[hit]
    off = np.linalg.norm((both[0] - middle) / 4 - (both[1] - small), axis=-1)
    assert np.percentile(off, 98) < 1e-4
    different = np.abs(stacked(near, "RGB") - stacked(far, "RGB")).max(-1)[hit]
    assert np.percentile(different, 98) < 1e-2
    np.testing.assert_allclose(near["Z"][hit][off < 1e-4] / 4, far["Z"][hit][off < 1e-4], atol=2e-4)


def test_samples(device: Device, tmp_path: Path) -> None:
    """With many samples a pixel's coverage is the part of it that a box covers; data channels are of one sample."""
    keep(tmp_path / "full.nrrd", np.full((8, 8, 8), 200, np.uint8), [-0.5, -0.5, -0.5], [0.125] * 3)
    camera = {"projection": "orthographic", "position": [0, -3, 0], "height": 1.6}
    solid = {"opacity": [{"at": 0, "opacity": 1}]}
    scene = volume_scene(
        camera,
        folder=tmp_path,
        file="full.nrrd",
        look=shaded(FLAT),
        transfer=solid,
        shadows=True,
        samples=64,
        size=(15, 15),
    )
    framebuffer = shoot(scene, device)
    edges = np.clip((np.arange(16) - 7.5) * 1.6 / 15, -0.5, 0.5)
    part = np.diff(edges) / (1.6 / 15)
    np.testing.assert_allclose(framebuffer["A"], part[:, None] * part[None], atol=0.05)
    assert framebuffer["A"].sum() * (1.6 / 15) ** 2 == pytest.approx(1, rel=5e-3)
    color = np.array(FLAT["material"]["color"])
    np.testing.assert_allclose(stacked(framebuffer, "RGB"), framebuffer["A"][..., None] * color, atol=1e-5)
    assert (framebuffer["samples"] == 64).all()
    # A ray that nothing changes needs no more samples than the fewest.
    scene = volume_scene(
        camera,
        folder=tmp_path,
        file="full.nrrd",
        transfer=solid,
        samples=256,
        noise=0.02,
        min_samples=8,
        size=(15, 15),
    )
    framebuffer = shoot(scene, device)
    assert set(framebuffer["samples"][4:11, 4:11].flat) == {8}
    assert framebuffer["samples"][2, 4:11].min() > 30


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("transfer", [{**FOG, "color": WHITE}, {}], ids=["fog", "surface"])
def test_values_that_are_no_numbers(
    device: Device, tmp_path: Path, transfer: dict[str, Any], value: float
) -> None:
    """A few of them leave the rest of the picture as it is, and make no pixel a NaN."""
    corner, spacing = [-1.0, -1, -1], [0.0625] * 3
    distance = np.linalg.norm(middles((32, 32, 32), corner, spacing), axis=-1)
    values = np.clip(0.5 + (0.7 - distance) / 0.0625, 0, 1).astype(np.float32)
    keep(tmp_path / "good.nrrd", values, corner, spacing)
    values[3:5, 4, 5] = value
    values[16, 16, 16] = value
    keep(tmp_path / "bad.nrrd", values, corner, spacing)
    scenes = [
        volume_scene(PERSPECTIVE, folder=tmp_path, file=f"{name}.nrrd", transfer=transfer)
        for name in ("good", "bad")
    ]
    good, bad = (stacked(shoot(scene, device), "RGBA") for scene in scenes)
    assert np.isfinite(bad).all()
    assert (np.abs(good - bad).max(-1) > 0.01).mean() < 0.05
