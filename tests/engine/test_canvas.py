"""Pictures on the device have the bits of framebuffers, wherever their tiles come from and however often canvases
change.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pyopencl as cl
import pytest

from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS, Canvas, CanvasKernels, CanvasStore
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import run
from clfractal.errors import DeviceError
from clfractal.images.tiles import TILE, Region, TileGrid
from clfractal.integrators.plan import PlannedView
from tests.engine.canvases import LAYOUT, drawn, job_of, painted, scene_of
from tests.scenes import STEREO

SIZES = [(96, 64), (77, 41), (1, 1), (33, 1), (1, 70), (32, 32), (65, 33)]


def sized(width: int, height: int, *overrides: str) -> list[str]:
    return [f"image.width={width}", f"image.height={height}", *overrides]


def assert_as_films(canvas: Canvas, job: Job, device: Device) -> None:
    framebuffers = JobFramebuffers(job)
    run(job, framebuffers.framebuffers, LocalExecutor(device))
    depths, read = canvas.start_reading_depths(device.transfers)
    read.wait()
    for number, framebuffer in enumerate(framebuffers.framebuffers):
        found = canvas.read(device.transfers, number)
        for name in CHANNELS:
            np.testing.assert_array_equal(
                found[name].view(np.uint32), framebuffer[name].view(np.uint32), name
            )
        np.testing.assert_array_equal(depths[number], framebuffer["Z"])


@pytest.mark.parametrize("size", SIZES)
def test_a_canvas_has_the_bits_of_a_film(size: tuple[int, int], device: Device) -> None:
    job = job_of(scene_of(*sized(*size)), device)
    assert_as_films(drawn(job, device), job, device)


@pytest.mark.parametrize(
    "overrides", [(LAYOUT,), (STEREO,), (LAYOUT, STEREO), ("renderer.precision=float64",)]
)
@pytest.mark.parametrize("size", [(96, 64), (75, 47)])
def test_several_views_of_one_canvas(
    overrides: tuple[str, ...], size: tuple[int, int], device: Device
) -> None:
    job = job_of(scene_of(*sized(*size, *overrides)), device)
    canvas = drawn(job, device)
    assert len(canvas.parts) == len(job.views)
    assert canvas.pixels == sum(view.plan.region.pixels for view in job.views)
    assert_as_films(canvas, job, device)


def test_one_canvas_for_pictures_of_all_sizes(device: Device) -> None:
    canvas = Canvas(device)
    for size in (*SIZES, *reversed(SIZES)):
        job = job_of(scene_of(*sized(*size)), device)
        drawn(job, device, canvas)
        assert_as_films(canvas, job, device)


def test_memory_stays_when_a_picture_shrinks(device: Device) -> None:
    canvas = Canvas(device)
    canvas.fit(job_of(scene_of(), device).views)
    buffer = canvas.colors
    canvas.fit(job_of(scene_of(*sized(20, 10)), device).views)
    assert canvas.colors is buffer
    assert canvas.pixels == 200


def test_without_memory_it_says_so_and_can_be_used_again(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    canvas, job = Canvas(device), job_of(scene_of(), device)
    drawn(job_of(scene_of(*sized(20, 10)), device), device, canvas)
    with monkeypatch.context() as patch:
        patch.setattr(Device, "buffer", refusing)
        with pytest.raises(DeviceError):
            canvas.fit(job.views)
    assert_as_films(drawn(job, device, canvas), job, device)


def refusing(*_: object, **__: object) -> None:
    raise DeviceError("no room", status=2)


@pytest.mark.parametrize("divider", [2, 3, 8])
def test_coarse_views(divider: int, device: Device) -> None:
    job = job_of(scene_of(*sized(77, 41)), device)
    job = replace(job, views=tuple(view.coarse(divider) for view in job.views))
    canvas = drawn(job, device)
    assert canvas.parts[0].divider == divider
    assert (canvas.parts[0].region.width, canvas.parts[0].region.height) == (
        -(-77 // divider),
        -(-41 // divider),
    )
    assert_as_films(canvas, job, device)


def clipped(view: PlannedView, region: Region) -> PlannedView:
    return replace(view, plan=replace(view.plan, region=region))


REGIONS = [
    Region(0, 0, 96, 64),
    Region(5, 7, 1, 1),
    Region(31, 31, 2, 2),
    Region(40, 0, 56, 64),
    Region(33, 20, 31, 44),
]


@pytest.mark.parametrize("region", REGIONS)
def test_a_part_of_a_picture_leaves_the_rest(region: Region, device: Device) -> None:
    """Tiles at the rim of a region hold unfinished pixels, which must not reach the canvas."""
    job = job_of(scene_of(), device)
    whole = drawn(job, device).read(device.transfers, 0)
    before = {name: np.full((64, 96), 0.25 + number, np.float32) for number, name in enumerate(CHANNELS)}
    canvas = painted(job, device, [before])
    view = clipped(job.views[0], region)
    part = replace(job, views=(view,))
    writer, executor = CanvasKernels(device), LocalExecutor(device)
    executor.outlet = lambda _, framebuffer, places, tiles: writer.place(
        canvas, 0, region, framebuffer, places, tiles
    )
    run(part, [CanvasStore(canvas, view, 0)], executor)
    device.queue.finish()
    found = canvas.read(device.transfers, 0)
    inside = np.zeros((64, 96), bool)
    inside[region.y : region.bottom, region.x : region.right] = True
    for name in CHANNELS:
        np.testing.assert_array_equal(found[name][inside], whole[name][inside], name)
        np.testing.assert_array_equal(found[name][~inside], before[name][~inside], name)


@pytest.mark.parametrize("held", [Region(0, 0, 96, 64), Region(7, 9, 70, 50)])
def test_tiles_are_placed_as_they_are(held: Region, device: Device) -> None:
    """Tiles that are made up: every number comes to its place, and a canvas behind another one's room stays."""
    job = job_of(scene_of(), device)
    views = (clipped(job.views[0], held), clipped(job.views[0], held))
    canvas = Canvas(device)
    canvas.fit(views)
    cl.enqueue_fill_buffer(device.queue, canvas.colors, np.array(-7, np.float32), 0, 16 * canvas.pixels)
    cl.enqueue_fill_buffer(device.queue, canvas.depths, np.array(-7, np.float32), 0, 4 * canvas.pixels)
    grid = TileGrid(held)
    random = np.random.default_rng(2)
    tiles = random.random((grid.count, len(CHANNELS), TILE, TILE)).astype(np.float32)
    places = np.zeros((grid.count, 4), np.int32)
    places[:, 0] = (grid.first_column + np.arange(grid.count) % grid.columns) * TILE
    places[:, 1] = (grid.first_row + np.arange(grid.count) // grid.columns) * TILE
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    buffers = [cl.Buffer(device.context, flags, hostbuf=data) for data in (tiles, places)]
    CanvasKernels(device).place(canvas, 1, held, buffers[0], buffers[1], grid.count)
    device.queue.finish()
    wanted = np.zeros((len(CHANNELS), 128, 128), np.float32)
    for tile, (x, y, *_) in zip(tiles, places, strict=True):
        wanted[:, y : y + TILE, x : x + TILE] = tile
    found = canvas.read(device.transfers, 1)
    for number, name in enumerate(CHANNELS):
        shown = wanted[number, held.y : held.bottom, held.x : held.right]
        np.testing.assert_array_equal(found[name], shown, name)
        assert (canvas.read(device.transfers, 0)[name] == -7).all()


@pytest.mark.parametrize("new", SIZES)
@pytest.mark.parametrize("old", [(96, 64), (12, 8), (1, 1), (77, 41)])
def test_an_older_picture_fills_a_canvas(old: tuple[int, int], new: tuple[int, int], device: Device) -> None:
    """Each pixel takes the old one at the same place of the picture."""
    random = np.random.default_rng(3)
    jobs = [job_of(scene_of(*sized(*size)), device) for size in (old, new)]
    planes = {name: random.random(old[::-1]).astype(np.float32) for name in CHANNELS}
    before, canvas = painted(jobs[0], device, [planes]), Canvas(device)
    canvas.fit(jobs[1].views)
    CanvasKernels(device).enlarge(before, canvas)
    device.queue.finish()
    found = canvas.read(device.transfers, 0)
    rows, columns = (nearest(new[axis], old[axis]) for axis in (1, 0))
    for name in CHANNELS:
        np.testing.assert_array_equal(found[name], planes[name][np.ix_(rows, columns)])


def nearest(new: int, old: int) -> npt.NDArray[np.int64]:
    """The old pixel below the left end of each new one."""
    at = np.arange(new, dtype=np.float32) * np.float32(old / new)
    return np.minimum(at.astype(np.int64), old - 1)


def test_an_older_picture_of_several_views(device: Device) -> None:
    job = job_of(scene_of(LAYOUT), device)
    coarse = replace(job, views=tuple(view.coarse(4) for view in job.views))
    small, canvas = drawn(coarse, device), Canvas(device)
    canvas.fit(job.views)
    CanvasKernels(device).enlarge(small, canvas)
    device.queue.finish()
    for number, view in enumerate(job.views):
        width, height = view.size
        old = coarse.views[number].plan.region
        rows, columns = nearest(height, old.height), nearest(width, old.width)
        before, found = (each.read(device.transfers, number) for each in (small, canvas))
        for name in CHANNELS:
            np.testing.assert_array_equal(found[name], before[name][np.ix_(rows, columns)])


def test_a_store_counts_tiles_and_reads_the_device(device: Device) -> None:
    job = job_of(scene_of(), device)
    canvas = drawn(job, device)
    store = CanvasStore(canvas, job.views[0], 0)
    assert not store.done.any()
    store.put_tiles(np.array([0, 2], np.int32), np.zeros(0, np.float32))
    assert store.done.tolist() == [True, False, True] + [False] * (store.grid.count - 3)
    ((row, planes),) = store.bands()
    assert row == 0
    np.testing.assert_array_equal(planes["R"], canvas.read(device.transfers, 0)["R"])
