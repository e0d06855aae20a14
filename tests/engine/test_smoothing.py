"""Pictures under way with less noise: one step of diffusion, which keeps the mean, outlines, and what is no light."""

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
from clfractal.engine.canvas import CHANNELS, Canvas, Part
from clfractal.engine.job import Job
from clfractal.engine.show import Arrangement, Look, Shower, smoothing_of
from clfractal.images.tiled import Floats
from clfractal.images.tiles import Region
from clfractal.scene.layout import Place
from tests.engine.canvases import LAYOUT, job_of, look_of, painted, scene_of, shown
from tests.scenes import STEREO

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
