"""What a window shows of a canvas: the numbers of the picture's file, for every mode, look and value."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any, get_args

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS, Canvas
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import run
from clfractal.engine.show import Arrangement, Look, Shower, can_reduce
from clfractal.files.srgb import encode8
from clfractal.files.tone import toned
from clfractal.files.tone_names import TONES, Tone
from clfractal.images.outputs import png_bytes
from clfractal.images.tiled import Floats
from clfractal.scene.stereo import APART, Mode, Stereo
from tests.engine.canvases import LAYOUT, drawn, framebuffers_of, job_of, look_of, painted, scene_of, shown
from tests.scenes import STEREO

COMPOSED = tuple(mode for mode in get_args(Mode) if mode not in APART)
METHODS = ("color", "half_color", "gray", "dubois")
GLASSES = ("red_cyan", "green_magenta", "amber_blue")
CASES: dict[str, tuple[str, ...]] = {
    "mono": (),
    "odd size": ("image.width=77", "image.height=41"),
    "lighter": ("output.exposure=1.3",),
    "darker": ("output.exposure=-2.7",),
    **{
        f"{tone} {name}": (f"output.tone={tone}", *more)
        for tone in ("reinhard", "agx")
        for name, more in {
            "lighter": ("output.exposure=2.3",),
            "layout": (LAYOUT, "output.exposure=1.5"),
            "anaglyph": (STEREO, "output.exposure=2.3"),
            "swapped": (STEREO, "stereo.method=gray", "stereo.swap=true"),
            "chessboard": (STEREO, "stereo.mode=anaglyph_chessboard", "output.exposure=1"),
            "over under": (STEREO, "stereo.mode=over_under"),
            "stereo layout": (LAYOUT, STEREO, "output.exposure=1"),
        }.items()
    },
    "layout": (LAYOUT,),
    "stereo layout": (LAYOUT, STEREO),
    "squeezed layout": (LAYOUT, STEREO, "stereo.mode=over_under_half", "output.exposure=0.5"),
    **{mode: (STEREO, f"stereo.mode={mode}") for mode in COMPOSED},
    **{f"{mode} swapped": (STEREO, f"stereo.mode={mode}", "stereo.swap=true") for mode in COMPOSED},
    **{
        f"{method} {glasses}": (STEREO, f"stereo.method={method}", f"stereo.glasses={glasses}")
        for method in METHODS
        for glasses in GLASSES
    },
}


@pytest.fixture(scope="module")
def shower(device: Device) -> Shower:
    return Shower(device)


def file_pixels(framebuffers: JobFramebuffers) -> npt.NDArray[np.uint8]:
    """What a PNG has."""
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png_bytes(framebuffers.picture()))).convert("RGB"))


def assert_same(found: npt.NDArray[np.uint8], wanted: npt.NDArray[np.uint8], device: Device) -> None:
    """At most one step apart, in at most 0.01 % of the bytes; equal on PoCL."""
    assert found.shape == wanted.shape
    apart = np.abs(found.astype(int) - wanted)
    if "Portable" in device.info.platform:
        assert apart.max() == 0, f"{(apart > 0).sum()} of {apart.size} bytes differ"
    assert apart.max() <= 1
    assert (apart > 0).mean() <= 1e-4


@pytest.mark.parametrize("name", CASES)
def test_a_window_shows_what_the_file_has(name: str, device: Device, shower: Shower) -> None:
    scene = scene_of(*CASES[name])
    job = job_of(scene, device)
    framebuffers = JobFramebuffers(job)
    run(job, framebuffers.framebuffers, LocalExecutor(device))
    found = shown(drawn(job, device), Arrangement.of(job), look_of(scene), shower)
    assert found.std() > 5
    assert_same(found, file_pixels(framebuffers), device)


@pytest.mark.parametrize("mode", [mode for mode in COMPOSED if not mode.endswith("half")])
def test_a_pair_is_shown_in_every_mode_without_new_rays(mode: str, device: Device, shower: Shower) -> None:
    """A job whose eyes stay apart is what a window renders; full-size modes are made of it."""
    pair, single = (job_of(scene_of(STEREO, f"stereo.mode={m}"), device) for m in ("pair", mode))
    framebuffers = JobFramebuffers(single)
    run(single, framebuffers.framebuffers, LocalExecutor(device))
    look = look_of(single.scene)
    assert_same(
        shown(drawn(pair, device), Arrangement.of(pair), look, shower), file_pixels(framebuffers), device
    )


def noise(job: Job, seed: int, span: float = 6) -> list[dict[str, Floats]]:
    """Pictures of numbers of every size, zeros, negative ones, infinities and those that are no numbers."""
    random = np.random.default_rng(seed)
    found = []
    for view in job.views:
        shape = (view.plan.region.height, view.plan.region.width)
        planes = {}
        for name in CHANNELS:
            values = 10.0 ** random.uniform(-span, 1, shape)
            kind = random.integers(0, 40, shape)
            for number, odd in enumerate(
                (np.nan, np.inf, -np.inf, -0.5, 0.0, -0.0, 1.0, 3e38, 1e-45, -3e38, 2e30)
            ):
                values = np.where(kind == number, odd, values)
            with np.errstate(over="ignore"):
                planes[name] = values.astype(np.float32)
        planes["A"] = random.uniform(0, 1, shape).astype(np.float32)
        found.append(planes)
    return found


@pytest.mark.parametrize("name", CASES)
def test_strange_numbers_are_shown_as_files_have_them(name: str, device: Device, shower: Shower) -> None:
    """Not a number, infinite, negative, and beyond any light."""
    scene = scene_of(*CASES[name])
    job = job_of(scene, device)
    pictures = noise(job, seed=len(name))
    with np.errstate(all="ignore"):
        wanted = file_pixels(framebuffers_of(job, pictures))
    found = shown(painted(job, device, pictures), Arrangement.of(job), look_of(scene), shower)
    assert_same(found, wanted, device)


def test_every_threshold_of_the_dither(device: Device, shower: Shower) -> None:
    """A grey ramp over all 256 places of the pattern, for values between all codes."""
    scene = scene_of("image.width=256", "image.height=64")
    job = job_of(scene, device)
    for exposure in (0.0, 0.37):
        values = np.linspace(0, 1.1, 256 * 64, dtype=np.float32).reshape(64, 256)
        values = np.random.default_rng(1).permutation(values.ravel()).reshape(values.shape)
        planes = dict.fromkeys(CHANNELS, values)
        found = shown(painted(job, device, [planes]), Arrangement.of(job), Look(exposure), shower)
        wanted = encode8(np.stack([values] * 3, axis=-1) * np.float32(2.0**exposure))
        np.testing.assert_array_equal(found, wanted)


def test_a_constant_shows_bayers_pattern(device: Device, shower: Shower) -> None:
    """Of a value between two codes the share of the higher one is its distance from the lower, on every 16 x 16."""
    job = job_of(scene_of("image.width=64", "image.height=48"), device)
    code = 100.25
    linear = ((code / 255 + 0.055) / 1.055) ** 2.4
    planes = dict.fromkeys(CHANNELS, np.full((48, 64), linear, np.float32))
    found = shown(painted(job, device, [planes]), Arrangement.of(job), Look(), shower)[..., 0]
    assert set(np.unique(found)) == {100, 101}
    blocks = (found == 101).reshape(3, 16, 4, 16).mean(axis=(1, 3))
    np.testing.assert_allclose(blocks, 0.25, atol=0.02)
    np.testing.assert_array_equal(found[:16, :16], found[16:32, 32:48])


def enlarged(coarse: Floats, divider: int, size: tuple[int, int], *, smooth: bool) -> Floats:
    """The model: bilinear between the pixels at the corners of blocks, or the nearest; float64."""
    rows, columns = np.arange(size[1]), np.arange(size[0])
    height, width = coarse.shape[:2]
    if not smooth:
        nearest: Floats = coarse[np.minimum(rows // divider, height - 1)]
        return nearest[:, np.minimum(columns // divider, width - 1)]
    y, x = np.minimum(rows / divider, height - 1), np.minimum(columns / divider, width - 1)
    upper, left = y.astype(int), x.astype(int)
    lower, right = np.minimum(upper + 1, height - 1), np.minimum(left + 1, width - 1)
    down, across = (y - upper)[:, None, None], (x - left)[None, :, None]
    top = coarse[upper][:, left] * (1 - across) + coarse[upper][:, right] * across
    bottom = coarse[lower][:, left] * (1 - across) + coarse[lower][:, right] * across
    found: Floats = top * (1 - down) + bottom * down
    return found


def coarse_job(job: Job, divider: int) -> Job:
    from dataclasses import replace

    return replace(job, views=tuple(view.coarse(divider) for view in job.views))


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("divider", [2, 3, 8, 16])
@pytest.mark.parametrize("size", [(96, 64), (77, 41)])
def test_a_coarse_picture_is_enlarged(
    size: tuple[int, int], divider: int, smooth: bool, device: Device, shower: Shower
) -> None:
    job = job_of(scene_of(f"image.width={size[0]}", f"image.height={size[1]}"), device)
    small = coarse_job(job, divider)
    region = small.views[0].plan.region
    random = np.random.default_rng(divider)
    planes = {name: random.random((region.height, region.width)).astype(np.float32) for name in CHANNELS}
    canvas = painted(small, device, [planes])
    found = shown(canvas, Arrangement.of(job), Look(smooth=smooth), shower)
    colors = np.stack([planes[name] for name in "RGB"], axis=-1)
    wanted = encode8(enlarged(colors, divider, size, smooth=smooth).astype(np.float32))
    apart = np.abs(found.astype(int) - wanted)
    assert apart.max() <= 1
    assert (apart > 0).mean() < (5e-3 if smooth else 1e-9)


def test_coarse_views_of_a_layout_stay_in_their_places(device: Device, shower: Shower) -> None:
    job = job_of(scene_of(LAYOUT), device)
    small = coarse_job(job, 4)
    pictures = []
    for number, view in enumerate(small.views):
        shape = (view.plan.region.height, view.plan.region.width)
        pictures.append({name: np.full(shape, 0.2 * (number + 1), np.float32) for name in CHANNELS})
    found = shown(painted(small, device, pictures), Arrangement.of(job), Look(), shower)
    whole = [
        {
            name: np.full((v.plan.region.height, v.plan.region.width), 0.2 * (n + 1), np.float32)
            for name in CHANNELS
        }
        for n, v in enumerate(job.views)
    ]
    np.testing.assert_array_equal(found, file_pixels(framebuffers_of(job, whole)))


@pytest.mark.parametrize("mode", [None, "anaglyph", "left"])
def test_a_reduced_picture_has_the_pixels_of_the_canvas(
    mode: str | None, device: Device, shower: Shower
) -> None:
    """For showing a coarse picture it is enough: its own pixels, dithered where they are."""
    scene = scene_of() if mode is None else scene_of(STEREO, f"stereo.mode={mode}")
    job = job_of(scene, device)
    small = coarse_job(job, 4)
    canvas, arrangement, look = drawn(small, device), Arrangement.of(job), look_of(scene)
    assert can_reduce(canvas, arrangement, look)
    found = shown(canvas, arrangement, look, shower, reduced=True)
    assert found.shape == (16, 24, 3)
    # Every fourth pixel of the picture that is enlarged without interpolation, apart from the dither.
    large = shown(canvas, arrangement, look_of(scene, smooth=False), shower)[::4, ::4]
    assert np.abs(found.astype(int) - large).max() <= 1


@pytest.mark.parametrize(
    "mode", ["split", "rows", "columns", "checkerboard", "over_under", "anaglyph_chessboard"]
)
def test_pictures_that_enlarging_would_mix_are_not_reduced(mode: str, device: Device) -> None:
    scene = scene_of(STEREO, f"stereo.mode={mode}")
    job = job_of(scene, device)
    small = coarse_job(job, 4)
    canvas = Canvas(device)
    canvas.fit(small.views)
    assert not can_reduce(canvas, Arrangement.of(job), look_of(scene))
    canvas.fit(job.views)
    assert not can_reduce(canvas, Arrangement.of(job), Look())


@pytest.mark.parametrize("tone", TONES)
@pytest.mark.parametrize("exposure", [0.0, 2.0])
def test_a_transparent_background_shows_a_board(
    exposure: float, tone: Tone, device: Device, shower: Shower
) -> None:
    """Behind premultiplied colours, as bright at any exposure; where nothing shines through it changes nothing."""
    job = job_of(scene_of(), device)
    random = np.random.default_rng(5)
    cover = random.choice([0.0, 0.25, 1.0, np.nan], (64, 96)).astype(np.float32)
    planes = {name: np.where(cover > 0, 0.4 * cover, 0).astype(np.float32) for name in CHANNELS} | {
        "A": cover
    }
    canvas, arrangement = painted(job, device, [planes]), Arrangement.of(job)
    found = shown(canvas, arrangement, Look(exposure, transparent=True, tone=tone), shower)
    rows, columns = np.mgrid[:64, :96]
    behind = np.where((rows // 8 + columns // 8) % 2 == 1, 0.13, 0.10)
    shines = np.where(np.isnan(cover), 0, 1 - cover)
    # The curve bends the colour itself, which is multiplied by its coverage afterwards.
    bright = np.full((64, 96), 0.4 * 2.0**exposure, np.float32)
    own = toned(bright, bright, bright, tone)[0] * np.where(cover > 0, cover, 0)
    wanted = own + shines * behind
    encoded = encode8(np.stack([wanted.astype(np.float32)] * 3, axis=-1))
    assert np.abs(found.astype(int) - encoded).max() <= 1
    opaque = shown(canvas, arrangement, Look(exposure, tone=tone), shower)
    np.testing.assert_array_equal(found[~(cover < 1)], opaque[~(cover < 1)])


@pytest.mark.parametrize("swap", [False, True])
def test_an_anaglyph_is_covered_where_either_eye_is(swap: bool, device: Device, shower: Shower) -> None:
    """The board shows only where it shines through both eyes' pictures."""
    scene = scene_of(STEREO, f"stereo.swap={str(swap).lower()}")
    job = job_of(scene, device)
    black = {name: np.zeros((64, 96), np.float32) for name in CHANNELS}
    random = np.random.default_rng(6)
    covers = [random.choice([0.0, 0.5, 1.0], (64, 96)).astype(np.float32) for _ in range(2)]
    canvas = painted(job, device, [{**black, "A": cover} for cover in covers])
    found = shown(canvas, Arrangement.of(job), look_of(scene, transparent=True), shower)
    rows, columns = np.mgrid[:64, :96]
    behind = np.where((rows // 8 + columns // 8) % 2 == 1, 0.13, 0.10)
    wanted = (1 - np.maximum(*covers)) * behind
    encoded = encode8(np.stack([wanted.astype(np.float32)] * 3, axis=-1))
    assert np.abs(found.astype(int) - encoded).max() <= 1


def stereo_of(mode: str, **values: Any) -> Stereo:
    return Stereo.model_validate({"mode": mode, **values})


MODES: tuple[str | None, ...] = (None, "pair", *COMPOSED)


@pytest.mark.parametrize(
    ("rendered", "size"),
    [
        *((mode, (96, 64)) for mode in (None, "pair", "split_half", "over_under_half", "left", "right")),
        *((mode, (77, 41)) for mode in (None, "pair", "left", "right")),
    ],
)
def test_a_picture_is_shown_whatever_is_chosen_next(
    rendered: str | None, size: tuple[int, int], device: Device, shower: Shower
) -> None:
    """Until the picture of a new mode is there the old one is shown, in a way that it can be: no error, nothing empty."""
    stereo = () if rendered is None else (STEREO, f"stereo.mode={rendered}")
    job = job_of(scene_of(*stereo, f"image.width={size[0]}", f"image.height={size[1]}"), device)
    pictures: list[Mapping[str, Floats]] = [
        {name: np.full((view.plan.region.height, view.plan.region.width), 1, np.float32) for name in CHANNELS}
        for view in job.views
    ]
    canvas, arrangement = painted(job, device, pictures), Arrangement.of(job)
    for mode in MODES:
        look = Look(stereo=None if mode is None else stereo_of(mode, colors=((1, 1, 1), (1, 1, 1))))
        found = shown(canvas, arrangement, look, shower)
        assert found.shape[:2] == arrangement.size(look)[::-1]
        assert (found == 255).all(), f"{rendered} shown as {mode}"


def test_eyes_that_stay_apart_are_shown_beside_each_other(device: Device) -> None:
    job = job_of(scene_of(STEREO, "stereo.mode=pair"), device)
    arrangement = Arrangement.of(job)
    for mode in APART:
        assert arrangement.size(Look(stereo=stereo_of(mode))) == (192, 64)
