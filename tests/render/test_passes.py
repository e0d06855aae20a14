"""A picture in passes has the bits of one that is made at once, for every renderer, however its samples are split."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import run
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.passes import kept_numbers
from clfractal.integrators.plan import Plan, PlannedView
from clfractal.scene.model import Scene
from tests.render.passes import RENDERERS, SIZE, scene_with
from tests.render.shots import CHANNELS, job_of, plan_of, shoot, stacked

NOISY: dict[str, Any] = {"samples": 16, "noise": 0.02, "min_samples": 4}
SPLITS = ((1, 1, 2, 12), (16,), (4, 4, 4, 4), (5, 11), (3, 1, 8, 4))


def in_passes(
    scene: Scene, plan: Plan, device: Device, split: tuple[int, ...], executor: LocalExecutor
) -> Iterator[Framebuffer]:
    """The picture after each of some passes."""
    done = 0
    for count in split:
        framebuffer = Framebuffer(plan.channels, SIZE, plan.region)
        run(job_of(scene, plan, device), [framebuffer], executor, samples=(done, done + count))
        done += count
        yield framebuffer


@pytest.mark.parametrize(
    ("kind", "precision", "channels", "settings"),
    [
        *((kind, "float32", CHANNELS, settings) for kind in RENDERERS for settings in ({}, NOISY)),
        *((kind, "float64", CHANNELS, NOISY) for kind in ("surface", "cut_plane")),
        ("surface", "float32", ("Z", "B"), NOISY),
    ],
)
def test_passes_have_the_bits_of_one(
    kind: str, precision: Precision, channels: tuple[str, ...], settings: dict[str, Any], device: Device
) -> None:
    scene = scene_with(kind, **settings)
    plan = plan_of(scene, device, precision, channels=channels)
    framebuffer = shoot(scene, device, precision)
    if settings and kind != "cut_plane":
        assert len(np.unique(framebuffer["samples"])) > 1
    whole, executor = stacked(framebuffer, channels), LocalExecutor(device)
    for split in SPLITS:
        *_, last = in_passes(scene, plan, device, split, executor)
        np.testing.assert_array_equal(
            stacked(last, channels).view(np.uint32), whole.view(np.uint32), str(split)
        )


def test_a_pass_is_the_picture_of_its_samples(device: Device) -> None:
    """After n of 16 samples each pixel is the mean of its first n: sums of differences tell the single samples."""
    scene = scene_with("surface")
    framebuffers = list(
        in_passes(scene, plan_of(scene, device), device, (1, 1, 2, 12), LocalExecutor(device))
    )
    assert [float(framebuffer["samples"].max()) for framebuffer in framebuffers] == [1, 2, 4, 16]
    sums = [framebuffer["R"] * framebuffer["samples"] for framebuffer in framebuffers]
    assert all((after - before >= -1e-5).all() for before, after in pairwise(sums))
    assert np.abs(framebuffers[0]["R"] - framebuffers[-1]["R"]).max() > 0.01


def test_what_passes_keep_follows_from_the_channels(device: Device) -> None:
    """70 bytes a pixel with all channels and noise; colours alone need 16."""
    precision: Precision = "float32"
    all_of_it = plan_of(scene_with("surface"), device, precision)
    colors = plan_of(scene_with("surface"), device, precision, channels=("R", "G", "B"))
    plain, noisy = scene_with("surface").renderer, scene_with("surface", **NOISY).renderer
    assert len(kept_numbers(all_of_it, noisy)) == 18
    assert kept_numbers(colors, plain) == ("red", "green", "blue", "samples")
    assert kept_numbers(colors, noisy) == (
        *("red", "green", "blue", "coverage", "samples"),
        *("brightness", "brightness_square", "coverage_square"),
    )


@pytest.mark.parametrize("divider", [2, 4, 8])
@pytest.mark.parametrize("kind", RENDERERS)
def test_a_coarse_picture_is_every_nth_pixel(kind: str, divider: int, device: Device) -> None:
    """The very rays of the picture's pixels in the middle of each block, also where the size is no multiple."""
    scene = scene_with(kind, samples=1)
    scene = scene.model_copy(update={"image": {"width": 75, "height": 53}})
    small = PlannedView(scene, plan_of(scene, device)).coarse(divider)
    assert small.size == (-(-75 // divider), -(-53 // divider))
    framebuffer = Framebuffer(small.plan.channels, small.size, small.plan.region)
    run(job_of(scene, small.plan, device), [framebuffer], LocalExecutor(device))
    # (Not the colours: soft shadows have other random places in another pixel.)
    names = ("A", "Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "iterations")
    fine = stacked(shoot(scene, device), names)[divider // 2 :: divider, divider // 2 :: divider]
    # At the rim a block's middle may lie outside the picture.
    coarse = stacked(framebuffer, names)[: fine.shape[0], : fine.shape[1]]
    # Coordinates are rounded in another order, which at a rim or a border of counts decides.
    same = np.isclose(coarse, fine, rtol=1e-3, atol=1e-3).all(axis=-1)
    assert same.mean() > (0.9 if kind == "cut_plane" else 0.95)


def test_points_of_a_coarse_pixel_lie_all_over_its_block(device: Device) -> None:
    scene = scene_with("surface", samples=1, points={"count": 9})
    small = PlannedView(scene, plan_of(scene, device)).coarse(4)
    framebuffer = Framebuffer(small.plan.channels, small.size, small.plan.region)
    run(job_of(scene, small.plan, device), [framebuffer], LocalExecutor(device))
    blocks = shoot(scene, device)["A"].reshape(12, 4, 18, 4).mean(axis=(1, 3))
    # A block's rays have cones as wide as it is, and touch a little earlier.
    assert np.abs(framebuffer["A"] - blocks).mean() < 0.08
    rim = (blocks > 0.2) & (blocks < 0.8)
    assert rim.sum() > 5
    # (Nine rays may all miss what some of the block's pixels meet.)
    assert (framebuffer["A"][rim] > 0).mean() > 0.9
    assert (framebuffer["A"] <= 1).all()
