"""One picture, however it is cut, ordered, interrupted or packed: the same bits."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.launch import Pace
from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.engine import drawing
from clfractal.engine import local_executor as local
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import run
from clfractal.engine.stages import Span
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.tiles import TILE, TileGrid
from clfractal.integrators.passes import kept_numbers
from clfractal.integrators.plan import Plan, PlannedView
from clfractal.scene.model import Scene
from tests.render.bits import close, same
from tests.render.passes import RENDERERS, scene_with
from tests.render.passes import SIZE as PASS_SIZE
from tests.render.planes import plane_scene
from tests.render.shots import (
    BALL,
    CHANNELS,
    job_of,
    plan_of,
    render_planned,
    render_tile,
    shoot,
    stacked,
)
from tests.scenes import scene_of
from tests.variants import combinations, one_of

Variant = tuple[Precision, int | None]

SIZE = (100, 75)  # no multiple of a tile's side, in neither direction
LIGHTS: list[dict[str, Any]] = [
    {"direction": [-1, 1, -1]},
    {"type": "point", "position": [2, -2, 1], "color": [0.3, 0.4, 0.6], "falloff": "inverse_square"},
]
CAMERA = {"position": [1.3, -2.6, 1.6], "target": [0, 0, 0], "fov": 45}
SHADOWS = [{"direction": [-1, 1, -1], "shadow": True}, {"type": "point", "position": [2, -2, 3]}]
HAST = {"name": "hast", "iterations": 12}
BOX = {"center": [-0.2, 0, 0], "size": [2.4, 2.6, 2.8]}
VOLUME = {"type": "volume", "box": BOX, "resolution": [45, 52, 48], "shadows": True}
FOG = {"opacity": [{"at": 0.1, "opacity": 0}, {"at": 1, "opacity": 0.4}]}
PLANES = [
    {"plane": {"center": [0, -0.2, 0], "normal": [0.2, -1, 0.3]}, "opacity": 0.5},
    {"plane": {"center": [0.2, 0, 0], "normal": [1, -0.3, 0.2]}, "cut": True, "opacity": 0.3},
]
UNSEEN = {"plane": {"center": [0, 0, 9]}, "opacity": 0}
SCENES: dict[str, Scene] = {
    # Coloured as the scenes of the library that show it, whose programs have the same text.
    "mandelbulb": scene_of(
        {"name": "mandelbulb", "iterations": 8},
        CAMERA,
        SIZE,
        lights=LIGHTS,
        coloring={"by": "iterations"},
    ),
    "hast": scene_of(
        {"name": "hast", "iterations": 20}, CAMERA, SIZE, lights=LIGHTS, renderer={"samples": 3}
    ),
    # Paths are scattered within the set, and beside it.
    "milk": scene_of(
        {"name": "quaternion_julia", "iterations": 6},
        CAMERA,
        SIZE,
        lights=LIGHTS,
        renderer={"samples": 2},
        lighting={"mode": "path", "bounces": 2},
        materials={"milk": {"transmission": {"weight": 1, "depth": 0.3, "scatter": [0.9, 0.8, 0.7]}}},
        material={"name": "milk"},
        objects={"ball": {"type": "sphere", "position": [0.8, -3, 0.6], "radius": 0.4, "material": "milk"}},
    ),
    # Of programs and grids that other tests need, too.
    "volume": scene_of(HAST, CAMERA, SIZE, lights=SHADOWS, renderer=VOLUME, cut_planes=PLANES[1:]),
    "fog": scene_of(
        HAST,
        CAMERA,
        SIZE,
        lights=SHADOWS,
        renderer={**VOLUME, "transfer": FOG, "samples": 3},
        background="transparent",
    ),
    "cut object": scene_of(BALL, CAMERA, SIZE, lights=SHADOWS, cut_planes=[*PLANES, UNSEEN, UNSEEN]),
    # Rays end while a hit is being proved: what they would find later must not count if others of their packet go on.
    "hast, few steps": scene_of(
        {"name": "hast", "iterations": 20},
        CAMERA,
        SIZE,
        lights=LIGHTS,
        renderer={"samples": 3, "max_steps": 14},
    ),
}


@pytest.fixture(scope="module")
def wholes(device: Device) -> dict[str, npt.NDArray[np.float32]]:
    """Each scene in one go."""
    return {name: stacked(shoot(scene, device)) for name, scene in SCENES.items()}


@pytest.mark.parametrize("name", SCENES)
def test_tile_by_tile(device: Device, wholes: dict[str, npt.NDArray[np.float32]], name: str) -> None:
    """By an executor, which knows nothing of the other tiles."""
    scene = SCENES[name]
    plan = plan_of(scene, device)
    grid = TileGrid(plan.region)
    assert grid.count == 12
    for index in (0, 3, 5, 6, 11):
        tile = grid.tile(index)
        pixels = np.moveaxis(render_tile(scene, plan, device, tile), 0, -1)
        expected = wholes[name][tile.y : tile.y + tile.height, tile.x : tile.x + tile.width]
        assert same(np.ascontiguousarray(pixels), np.ascontiguousarray(expected))


@pytest.mark.parametrize(
    "region", [(0, 0, 100, 75), (13, 7, 50, 41), (33, 40, 1, 1), (64, 32, 36, 43), (99, 0, 1, 75)]
)
@pytest.mark.parametrize("name", SCENES)
def test_regions(
    device: Device, wholes: dict[str, npt.NDArray[np.float32]], name: str, region: tuple[int, int, int, int]
) -> None:
    """A part is the part of the whole, wherever it begins in its tiles."""
    x, y, width, height = region
    part = stacked(shoot(SCENES[name], device, region=region))
    assert same(part, np.ascontiguousarray(wholes[name][y : y + height, x : x + width]))


@pytest.mark.parametrize("capacity", [1, 3, 12])
@pytest.mark.parametrize("name", SCENES)
def test_batches(
    device: Device,
    wholes: dict[str, npt.NDArray[np.float32]],
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    capacity: int,
) -> None:
    """How many tiles are launched at once, in which order."""
    monkeypatch.setattr(drawing, "CAPACITY", capacity)
    assert same(stacked(shoot(SCENES[name], device)), wholes[name])


@pytest.mark.parametrize("name", SCENES)
def test_tiles_in_parts(
    device: Device, wholes: dict[str, npt.NDArray[np.float32]], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """A budget so short that every tile takes many launches."""
    monkeypatch.setattr(drawing, "CAPACITY", 1)
    launches: list[int] = []
    scene = SCENES[name]
    plan = plan_of(scene, device)
    framebuffer = Framebuffer(plan.channels, SIZE, plan.region)
    state = render_planned(
        scene,
        plan,
        device,
        framebuffer,
        progress=lambda progress: launches.append(progress.tiles_done),
        budget_seconds=1e-9,
    )
    # One sample of a packet each, once the first two launches have told how long they take.
    assert len(launches) >= 10 * plan.samples * TILE * TILE // plan.lanes
    assert launches == sorted(launches)
    assert state.tiles_done == 12
    assert same(stacked(framebuffer), wholes[name])


@pytest.mark.parametrize("name", SCENES)
def test_groups_of_tiles_in_parts(
    device: Device, wholes: dict[str, npt.NDArray[np.float32]], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """As on GPUs: launches of several tiles with some samples of each, which together are rendered as alone."""
    monkeypatch.setattr(local, "pixels_at_a_time", lambda device, staged: 5 * TILE * TILE)
    spans: list[tuple[int, tuple[int, int]]] = []
    start = drawing.Drawing.start

    def noted(self: drawing.Drawing, span: Span) -> object:
        spans.append((len(span.tiles), span.samples))
        return start(self, span)

    monkeypatch.setattr(drawing.Drawing, "start", noted)
    scene = SCENES[name]
    plan = plan_of(scene, device)
    framebuffer = Framebuffer(plan.channels, SIZE, plan.region)
    # No launch teaches the next one another size: of four tiles with one sample.
    monkeypatch.setattr(Pace, "learn", lambda *about: None)
    monkeypatch.setattr(
        Pace, "begin", lambda self: setattr(self, "size", 4.0 * TILE * TILE // plan.lanes + 1)
    )
    state = render_planned(scene, plan, device, framebuffer)
    assert spans == [(4, (sample, sample + 1)) for _ in range(3) for sample in range(plan.samples)]
    assert state.rays == plan.samples * SIZE[0] * SIZE[1]
    assert same(stacked(framebuffer), wholes[name])


# Of few iterations: folds of hast are finer than float32 soon.
FEW = {
    name: scene_of({"name": name, "iterations": 4}, CAMERA, SIZE, lights=LIGHTS)
    for name in ("hast", "mandelbulb")
}
# In float64, because at the set's border a rounding of float32 is another count.
WHOLE = {"center": [-0.5, 0, 0], "width": 3, "height": 3}
COUNTS = plane_scene(size=(40, 40), plane=WHOLE, colors={"mode": "stepped"})
SINGLE: Variant = ("float32", None)
DOUBLE: Variant = ("float64", None)


@pytest.mark.parametrize(
    ("scene", "usual", "others", "off"),
    [
        (SCENES["volume"], SINGLE, [DOUBLE], 0.005),
        (SCENES["fog"], SINGLE, [("float32", 4)], 0.005),
        (FEW["hast"], SINGLE, [DOUBLE], 0.005),
        (COUNTS, DOUBLE, [("float64", 1)], 0.001),
        *combinations(
            [
                (SCENES["volume"], SINGLE, [("float32", lanes) for lanes in (1, 4, 8, 16)], 0.005),
                (SCENES["fog"], SINGLE, [("float32", lanes) for lanes in (1, 8, 16)], 0.005),
                (SCENES["mandelbulb"], SINGLE, [("float32", lanes) for lanes in (1, 4, 8, 16)], 0.005),
                (FEW["mandelbulb"], SINGLE, [DOUBLE], 0.005),
            ]
        ),
    ],
)
def test_lanes_and_number_types_are_close(
    device: Device, scene: Scene, usual: Variant, others: list[Variant], off: float
) -> None:
    """Other packets are another program: the last bits differ, and with them what decides at a rim."""
    whole, *found = (
        stacked(shoot(scene, device, precision, lanes=lanes))
        for precision, lanes in (usual, *others)
        if (lanes or 1) in accepted_lanes(device, precision)
    )
    for each in found:
        close(each, whole, off)


def test_statistics_do_not_depend_on_batches(device: Device) -> None:
    """Rays, steps and applications are counted once each, in parts of tiles too."""
    scene = SCENES["hast"]
    plan = plan_of(scene, device)

    def counted(budget_seconds: float | None = None) -> tuple[int, int, int, int]:
        framebuffer = Framebuffer(plan.channels, SIZE, plan.region)
        state = render_planned(scene, plan, device, framebuffer, budget_seconds=budget_seconds)
        return state.rays, state.steps, state.iterations, state.bad_distances

    at_once = counted()
    assert at_once[0] == 3 * 100 * 75
    assert counted(1e-9) == at_once
    assert counted(2e-3) == at_once


def test_the_rest_of_a_film(device: Device, wholes: dict[str, npt.NDArray[np.float32]]) -> None:
    """A framebuffer half filled with another render's tiles is completed, and what is there stays."""
    scene = SCENES["mandelbulb"]
    plan = plan_of(scene, device)
    framebuffer = Framebuffer(plan.channels, SIZE, plan.region)
    for index in (1, 5, 6, 10):
        framebuffer.put(index, render_tile(scene, plan, device, framebuffer.grid.tile(index)))
    marked = framebuffer.grid.tile(11)
    framebuffer.put(11, np.full((len(CHANNELS), marked.height, marked.width), 7, np.float32))
    seen: list[tuple[int, int]] = []
    render_planned(
        scene, plan, device, framebuffer, progress=lambda p: seen.append((p.tiles_before, p.tiles_done))
    )
    assert all(before == 5 for before, _ in seen)
    assert seen[-1] == (5, 12)
    result = stacked(framebuffer)
    assert (result[marked.y :, marked.x :] == 7).all()
    result[marked.y :, marked.x :] = wholes["mandelbulb"][marked.y :, marked.x :]
    assert same(result, wholes["mandelbulb"])


NOISY: dict[str, Any] = {"samples": 16, "noise": 0.02, "min_samples": 4}
SPLITS = ((1, 1, 2, 12), (16,), (4, 4, 4, 4), (5, 11), (3, 1, 8, 4))


def in_passes(
    scene: Scene, plan: Plan, device: Device, split: tuple[int, ...], executor: LocalExecutor
) -> Iterator[Framebuffer]:
    """The picture after each of some passes."""
    done = 0
    for count in split:
        framebuffer = Framebuffer(plan.channels, PASS_SIZE, plan.region)
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


@pytest.mark.parametrize("budget", one_of(1e-7, 1e-3))
@pytest.mark.parametrize("kind", RENDERERS)
def test_adaptive_tiles_in_parts_have_the_same_bits(
    kind: str, budget: float, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So little time that a launch is one sample of one packet: both are split, and rays counted once."""
    scene = scene_with(kind, **NOISY)
    plan = plan_of(scene, device)
    spans: list[Span] = []
    start = drawing.Drawing.start

    def noted(self: drawing.Drawing, span: Span) -> object:
        spans.append(span)
        return start(self, span)

    monkeypatch.setattr(drawing.Drawing, "start", noted)
    framebuffer = Framebuffer(plan.channels, PASS_SIZE, plan.region)
    state = render_planned(scene, plan, device, framebuffer, budget_seconds=budget)
    whole = shoot(scene, device)
    assert same(stacked(framebuffer), stacked(whole))
    assert state.rays == whole["samples"].sum()
    if budget < 1e-5:
        assert any(span.samples[1] - span.samples[0] < 16 for span in spans)
        assert any(span.packets[1] - span.packets[0] < TILE * TILE // plan.lanes for span in spans)


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
