"""The display: frames reach the window as files have them, the newest of those that are asked for, whatever fails."""

from __future__ import annotations

import io
import threading
import time

import numpy as np
import pyopencl as cl
import pytest

from clfractal.device.select import Device
from clfractal.engine.show import Look
from clfractal.images.outputs import png_bytes
from clfractal.viewer.display import CopyTarget, Display
from tests.scenes import STEREO
from tests.viewer.sessions import BULB, framebuffers_of, scene_of, session_on, shown_frame, wait_for


@pytest.mark.parametrize("overrides", [(), (STEREO,), ("image.width=77", "output.exposure=1.5")])
def test_a_frame_arrives_as_files_have_it(overrides: tuple[str, ...], device: Device) -> None:
    from PIL import Image

    scene = scene_of(BULB, *overrides)
    with session_on(device) as watch:
        frame = watch.finished(scene)
        shown, pixels = shown_frame(device, watch, frame, Look(scene.output.stops, scene.stereo))
        wanted = np.asarray(
            Image.open(io.BytesIO(png_bytes(framebuffers_of(frame).picture()))).convert("RGB")
        )
        depths = [frame.canvas.read(device.transfers, n)["Z"] for n in range(len(frame.views))]
    np.testing.assert_array_equal(pixels[..., :3], wanted)
    assert shown.frame is frame
    for found, depth in zip(shown.depths, depths, strict=True):
        np.testing.assert_array_equal(found, depth)


class SlowTarget(CopyTarget):
    """A target that takes its time, or fails."""

    error: Exception | None = None
    seconds = 0.0

    def begin(self, queue: cl.CommandQueue) -> None:
        time.sleep(self.seconds)
        if self.error is not None:
            raise self.error
        super().begin(queue)


def test_only_the_newest_frame_is_shown_and_targets_come_back(device: Device) -> None:
    with session_on(device) as watch:
        frame = watch.finished(scene_of())
        display = Display(device, watch.session.pool, lambda: None, to_image=False)
        targets = [SlowTarget(device, (96, 64)) for _ in range(4)]
        for target in targets:
            target.seconds = 0.1
        looks = [Look(exposure=float(number)) for number in range(4)]
        for target, look in zip(targets, looks, strict=True):
            assert display.show(frame, look, target)
        wait_for(lambda: display._shown is not None and display._shown.look == looks[-1])
        shown = display.take()
        assert shown is not None
        assert shown.target is targets[-1]
        assert display.take() is None
        assert {id(each) for each in display.spare()} == {id(each) for each in targets[:-1]}
        assert display.spare() == []
        assert not any(watch.session.pool._held.values())
        display.close()


@pytest.mark.parametrize("error", [ValueError("mistake"), cl.LogicError("clEnqueue failed: INVALID_VALUE")])
def test_a_frame_that_cannot_be_shown_is_told_and_the_next_one_shown(
    error: Exception, device: Device
) -> None:
    with session_on(device) as watch:
        frame = watch.finished(scene_of())
        display = Display(device, watch.session.pool, lambda: None, to_image=False)
        bad, good = SlowTarget(device, (96, 64)), CopyTarget(device, (96, 64))
        bad.error = error
        assert display.show(frame, Look(), bad)
        wait_for(lambda: display.problem is not None)
        wait_for(lambda: not any(watch.session.pool._held.values()))
        assert display.spare() == [bad]
        assert display.show(frame, Look(), good)
        wait_for(lambda: display.take() is not None)
        display.close()
        assert not display.show(frame, Look(), good)


def test_a_frame_that_is_gone_is_refused(device: Device) -> None:
    """Its canvas has another picture by now."""
    with session_on(device) as watch:
        old = watch.finished(scene_of())
        for step in range(1, 4):
            newest = watch.finished(scene_of(BULB, f"camera.fov={30 + step}"))
        display = Display(device, watch.session.pool, lambda: None, to_image=False)
        target = CopyTarget(device, (96, 64))
        assert not display.show(old, Look(), target)
        assert display.spare() == []
        assert display.show(newest, Look(), target)
        display.close()


def test_frames_of_all_sizes_while_they_are_made(device: Device) -> None:
    """A window that is resized while it draws: every frame that is accepted is shown whole."""
    random = np.random.default_rng(4)
    with session_on(device) as watch:
        display = Display(device, watch.session.pool, lambda: None, to_image=False)
        arrived, tries = 0, 0
        # Of a hundred sizes, and for as long as it takes until some have arrived.
        while arrived <= 10 or tries < 100:
            tries += 1
            assert tries < 5000
            width, height = (int(each) for each in random.integers(16, 200, 2))
            watch.session.request(
                scene_of(BULB, f"image.width={width}", f"image.height={height}"),
                moving=bool(random.integers(2)),
            )
            for _ in range(4):
                time.sleep(random.random() * 0.01)
                frame = watch.session.frame
                if frame is not None:
                    time.sleep(random.random() * 0.005)
                    look = Look(stereo=None)
                    display.show(frame, look, CopyTarget(device, frame.arrangement.size(look)))
                assert display.problem is None, display.problem
                shown = display.take()
                if shown is not None:
                    arrived += 1
                    parts = shown.frame.views
                    assert [each.shape for each in shown.depths] == [
                        (view.plan.region.height, view.plan.region.width) for view in parts
                    ]
        watch.rest()
        display.close()
    assert "clfractal-display" not in {thread.name for thread in threading.enumerate()}
