"""Pictures on the device have the bits of framebuffers, wherever their tiles come from and however often canvases
change.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.truth.noise import smoothed
from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS, Canvas, CanvasKernels, CanvasStore, Part
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import run
from clfractal.engine.show import Arrangement, Look, Shower, smoothing_of
from clfractal.errors import DeviceError
from clfractal.images.tiled import Floats
from clfractal.images.tiles import TILE, Region, TileGrid
from clfractal.integrators.plan import PlannedView
from clfractal.scene.layout import Place
from tests.calls import raising
from tests.engine.canvases import LAYOUT, drawn, job_of, look_of, painted, scene_of, shown
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
        patch.setattr(Device, "buffer", raising(DeviceError("no room", status=2)))
        with pytest.raises(DeviceError):
            canvas.fit(job.views)
    assert_as_films(drawn(job, device, canvas), job, device)


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


# --- less noise under way: one step of diffusion ---


STRANGE = (np.nan, np.inf, -np.inf, 3e38, -3e38, 2e30)
COVERS: dict[str, tuple[float, ...]] = {
    "covered": (1.0,),
    "a sample met it or not": (0.0, 1.0),
    "halves": (0.0, 0.5, 1.0),
    "little apart": (0.5, 0.6, 0.7),
    "no number": (np.nan, 1.0, 0.9),
}


@pytest.fixture(scope="module")
def shower(device: Device) -> Shower:
    return Shower(device)


def diffused(
    device: Device, shower: Shower, pictures: list[npt.NDArray[np.float32]], strengths: list[float]
) -> list[npt.NDArray[np.float32]]:
    """What the kernel makes of pictures, each (height, width, 4), that lie on one canvas one behind the other."""
    canvas, parts, places, offset = Canvas(device), [], [], 0
    for picture in pictures:
        height, width = picture.shape[:2]
        parts.append(Part(offset, Region(0, 0, width, height), 1))
        places.append(Place(0, 0, width, height))
        offset += width * height
    whole = np.concatenate([picture.reshape(-1, 4) for picture in pictures])
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    canvas.parts, canvas.colors = tuple(parts), cl.Buffer(device.context, flags, hostbuf=whole)
    arrangement = Arrangement((64, 64), (0,) * len(parts), tuple(places))
    _, views = shower.records(canvas, arrangement, Look(), smoothing=strengths)
    shower._views.put(shower.queue, views)
    out = np.empty_like(whole)
    cl.enqueue_copy(shower.queue, out, shower._smooth(canvas, views))
    ends = np.cumsum([part.pixels for part in parts])[:-1]
    pieces = zip(np.split(out, ends), pictures, strict=True)
    return [piece.reshape(picture.shape) for piece, picture in pieces]


def picture_of(
    random: np.random.Generator, size: tuple[int, int], covers: tuple[float, ...], strange: float
) -> npt.NDArray[np.float32]:
    """Light of many magnitudes, (height, width, 4), a share of it no light at all."""
    found = 10.0 ** random.uniform(-3, 2, (size[1], size[0], 4))
    odd = random.random(found.shape) < strange
    found[odd] = random.choice(STRANGE, int(odd.sum()))
    found[..., 3] = random.choice(covers, found.shape[:2])
    return found.astype(np.float32)


@given(
    sizes=st.lists(st.tuples(st.integers(1, 40), st.integers(1, 12)), min_size=1, max_size=3),
    covers=st.sampled_from(sorted(COVERS)),
    strange=st.sampled_from([0.0, 0.02, 0.3]),
    strengths=st.tuples(*[st.sampled_from([1.0, 2 / 3, 1 / 3, 0.0])] * 3),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_step_of_diffusion_keeps_the_mean(
    sizes: list[tuple[int, int]],
    covers: str,
    strange: float,
    strengths: tuple[float, ...],
    seed: int,
    device: Device,
    shower: Shower,
) -> None:
    """Of each view alone, whatever its outlines and its size; what is no light stays, and goes nowhere."""
    random = np.random.default_rng(seed)
    pictures = [picture_of(random, size, COVERS[covers], strange) for size in sizes]
    found = diffused(device, shower, pictures, list(strengths[: len(sizes)]))
    for before, after, strength in zip(pictures, found, strengths, strict=False):
        model = smoothed(before[..., :3], before[..., 3], strength)
        np.testing.assert_allclose(after[..., :3], model, rtol=1e-6, atol=1e-9)
        if "Portable" in device.info.platform:
            np.testing.assert_array_equal(after[..., :3], model)
        np.testing.assert_array_equal(after[..., 3], before[..., 3])
        light = (np.abs(before[..., :3]) <= 1e30).all(axis=-1)
        np.testing.assert_array_equal(after[~light], before[~light])
        assert (np.abs(after[light][:, :3]) <= 1e30).all()
        sums = [each[light][:, :3].sum(axis=0, dtype=np.float64) for each in (before, after)]
        np.testing.assert_allclose(sums[1], sums[0], rtol=1e-5)
        if strength == 0:
            np.testing.assert_array_equal(after, before)


def test_noise_becomes_less_and_outlines_stay(device: Device, shower: Shower) -> None:
    """Independent noise keeps the root of the sum of the squared shares; nothing crosses an outline."""
    random = np.random.default_rng(4)
    noise = np.ones((512, 512, 4), np.float32)
    noise[..., :3] += random.normal(0, 0.1, (512, 512, 3)).astype(np.float32)
    shares = [0.625, *[1 / 16] * 4, *[1 / 32] * 4]
    found = diffused(device, shower, [noise], [1.0])[0]
    left = found[1:-1, 1:-1, :3].std() / noise[..., :3].std()
    assert left == pytest.approx(np.sqrt(np.square(shares).sum()), rel=0.01)
    rows, columns = np.mgrid[:40, :50]
    ball = (np.hypot(rows - 20, columns - 25) < 15).astype(np.float32)
    outline = np.stack([ball * 5, ball, ball * 0.1, ball], axis=-1)
    np.testing.assert_array_equal(diffused(device, shower, [outline], [1.0])[0], outline)


def test_how_strongly_a_picture_is_smoothed() -> None:
    assert smoothing_of(1) == 1
    assert [smoothing_of(samples) for samples in (2, 3)] == pytest.approx([2 / 3, 1 / 3])
    assert [smoothing_of(samples) for samples in (4, 5, 64)] == [0, 0, 0]


def pictures_for(job: Job) -> list[dict[str, Floats]]:
    random = np.random.default_rng(8)
    found = []
    for view in job.views:
        shape = (view.plan.region.height, view.plan.region.width)
        planes = {name: random.random(shape).astype(np.float32) for name in CHANNELS}
        found.append({**planes, "A": random.choice([0, 1], shape).astype(np.float32)})
    return found


def smoothed_planes(planes: dict[str, Floats], strength: float) -> dict[str, Floats]:
    colors = smoothed(np.stack([planes[name] for name in "RGB"], axis=-1), planes["A"], strength)
    return {**planes, **{name: colors[..., index] for index, name in enumerate("RGB")}}


CASES: dict[str, tuple[int, dict[str, Any], tuple[str, ...]]] = {
    "whole": (1, {}, ()),
    "lighter, with a curve": (1, {}, ("output.exposure=1", "output.tone=agx")),
    "coarse": (4, {}, ()),
    "coarse and reduced": (4, {"reduced": True}, ()),
    "layout": (1, {}, (LAYOUT,)),
    "coarse layout": (2, {}, (LAYOUT,)),
    "anaglyph": (1, {}, (STEREO,)),
    "rows": (2, {}, (STEREO, "stereo.mode=rows")),
}


@pytest.mark.parametrize("name", CASES)
def test_what_is_shown_is_the_smoothed_canvas(name: str, device: Device, shower: Shower) -> None:
    """Before anything is enlarged, exposed or put together; each view by itself, and the canvas stays what it is."""
    divider, how, overrides = CASES[name]
    scene = scene_of(*overrides)
    job = job_of(scene, device)
    small = job if divider == 1 else job.coarse(divider)
    arrangement, look, pictures = Arrangement.of(job), look_of(scene), pictures_for(small)
    strengths = [1.0, 0.0, 1 / 3][: len(pictures)]
    canvas = painted(small, device, pictures)
    plain = shown(canvas, arrangement, look, shower, **how)
    found = shown(canvas, arrangement, look, shower, **how, smoothing=strengths)
    expected = [smoothed_planes(each, share) for each, share in zip(pictures, strengths, strict=True)]
    wanted = shown(painted(small, device, expected), arrangement, look, shower, **how)
    assert (found != plain).mean() > 0.1
    np.testing.assert_array_equal(found, wanted)
    for same in (
        shown(canvas, arrangement, look, shower, **how),
        shown(canvas, arrangement, look, shower, **how, smoothing=[0.0] * len(pictures)),
    ):
        np.testing.assert_array_equal(same, plain)


def test_who_wants_pixels_as_they_are_has_them(device: Device, shower: Shower) -> None:
    scene = scene_of()
    job = job_of(scene, device)
    canvas, look = painted(job, device, pictures_for(job)), look_of(scene)
    rough = replace(look, smooth=False)
    found = shown(canvas, Arrangement.of(job), rough, shower, smoothing=[1.0])
    np.testing.assert_array_equal(found, shown(canvas, Arrangement.of(job), look, shower))
