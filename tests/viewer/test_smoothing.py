"""What a window smooths: pictures under way with few samples, and nothing of what is finished."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.truth.noise import smoothed
from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS
from clfractal.engine.prepare import prepare
from clfractal.engine.show import Look
from clfractal.viewer.frame import Frame
from clfractal.viewer.gathering import Gathering
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.preparing import Wanted
from tests.viewer.sessions import (
    BALL,
    BULB,
    framebuffers_of,
    planes,
    scene_of,
    session_on,
    shown_frame,
    wait_for,
)

# The second view has fewer samples, and is finished before the first.
UNEQUAL = "layout={columns: 2, gap: 3, views: [{}, {renderer: {type: cut_plane, samples: 1}}]}"


def encoded(frame: Frame, *, smooth: bool) -> np.ndarray:
    """A frame of one view as a file would have its colours, shape (height, width, 3)."""
    from clfractal.files.srgb import encode8

    found = planes(frame)[0]
    colors = np.stack([found[name] for name in "RGB"], axis=-1)
    return encode8(smoothed(colors, found["A"]) if smooth else colors)


def test_a_moving_picture_is_smoothed_and_the_finished_one_is_not(device: Device) -> None:
    scene = scene_of()
    with session_on(device, Pacing(coarsest=1)) as watch:
        number = watch.session.request(scene, moving=True)
        wait_for(lambda: watch.frames and watch.frames[-1].request == number)
        frame = watch.frames[0]
        assert (frame.divider, frame.samples, frame.smoothing) == (1, 1, (1.0,))
        _, pixels = shown_frame(device, watch, frame, Look())
        _, rough = shown_frame(device, watch, frame, Look(smooth=False))
        np.testing.assert_array_equal(pixels[..., :3], encoded(frame, smooth=True))
        np.testing.assert_array_equal(rough[..., :3], encoded(frame, smooth=False))
        assert (pixels != rough).mean() > 0.05
        last = watch.rest()
        assert (last.finished, last.smoothing) == (True, (0.0,))
        _, pixels = shown_frame(device, watch, last, Look())
        np.testing.assert_array_equal(pixels[..., :3], encoded(last, smooth=False))


def test_every_frame_is_smoothed_as_its_samples_need_it(device: Device) -> None:
    scene = scene_of(BULB, "renderer.samples=8")
    with session_on(device, Pacing(seconds_per_pixel=1e-3)) as watch:
        watch.finished(scene)
        frames = watch.frames
    assert frames[0].divider > 1
    for frame in frames:
        wanted = 0.0 if frame.finished or frame.samples >= 4 else {0: 1, 1: 1, 2: 2 / 3}[frame.samples]
        assert list(frame.smoothing) == pytest.approx([wanted])


def test_the_only_sample_is_finished(device: Device) -> None:
    with session_on(device) as watch:
        assert watch.finished(scene_of(BALL)).smoothing == (0.0,)


def gathering(device: Device, *overrides: str, region: tuple[int, int, int, int] | None = None) -> Gathering:
    scene = scene_of(BULB, "renderer.samples=8", *overrides)
    wanted = Wanted(1, scene, False, region, None)
    return Gathering(wanted, prepare(scene, device, channels=CHANNELS), 0.0)


def test_what_has_all_its_samples_is_shown_as_it_is(device: Device) -> None:
    """A view of a layout whose samples are all there, and the pixels of a pass that makes all samples at once."""
    work = gathering(device, UNEQUAL)
    work.begin(in_passes=True)
    assert work.growth().smoothing == (1.0, 0.0)
    work.samples = 2
    assert list(work.growth().smoothing) == pytest.approx([2 / 3, 0])
    assert work.growth(finished=True).smoothing == (0.0, 0.0)
    work = gathering(device)
    work.begin(in_passes=False)
    assert work.growth().smoothing == (0.0,)


def test_beside_a_part_that_is_refined_the_picture_stays(device: Device) -> None:
    work = gathering(device, region=(10, 10, 30, 20))
    work.begin(in_passes=True)
    assert work.growth().smoothing == (0.0,)
    scene = scene_of(BULB, "renderer.samples=8")
    with session_on(device, Pacing(coarsest=1)) as watch:
        before = framebuffers_of(watch.finished(scene)).picture()["R"]
        watch.frames.clear()
        after = watch.finished(scene, region=(10, 10, 30, 20))
        assert {each.smoothing for each in watch.frames} == {(0.0,)}
        np.testing.assert_array_equal(framebuffers_of(after).picture()["R"][40:], before[40:])
