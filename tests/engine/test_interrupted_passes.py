"""Passes that are interrupted and done anew: the picture has the bits of one that nobody disturbed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.refine import pass_ranges
from clfractal.engine.run import Progress, run
from clfractal.errors import Stopped
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.plan import Plan
from clfractal.scene.model import Scene
from tests.render.passes import RENDERERS, SIZE, scene_with
from tests.render.shots import job_of, plan_of, shoot, stacked
from tests.variants import one_of

NOISY: dict[str, Any] = {"noise": 0.02, "min_samples": 4}


class Impatient(CancelToken):
    """Ends work when it was asked so many times whether to: within a pass of one launch, too."""

    def __init__(self, questions: int) -> None:
        super().__init__()
        self.questions = questions

    def _ask(self) -> None:
        self.questions -= 1
        if self.questions < 0:
            self.cancel()

    def __call__(self) -> bool:
        self._ask()
        return super().__call__()

    def check(self) -> None:
        self._ask()
        super().check()


class Interrupted:
    """Renders a picture in passes, of which each is interrupted a few times."""

    def __init__(self, scene: Scene, plan: Plan, device: Device, executor: LocalExecutor, seed: int) -> None:
        self.job, self.plan, self.executor = job_of(scene, plan, device), plan, executor
        self.size = (scene.image.width, scene.image.height)
        self.random = np.random.default_rng(seed)
        self.stops = 0

    def framebuffer(self, ranges: list[tuple[int, int]], tries: int) -> Framebuffer:
        """The picture; each pass is tried so many times until it may be finished."""
        for samples in ranges:
            for _ in range(tries):
                self.try_once(samples)
            self.attempt(Impatient(int(self.random.integers(0, 3))), samples)
            framebuffer = Framebuffer(self.plan.channels, self.size, self.plan.region)
            run(self.job, [framebuffer], self.executor, samples=samples)
        return framebuffer

    def try_once(self, samples: tuple[int, int]) -> None:
        """A pass that is told to end after a random number of launches, or at a random time within one."""
        token = CancelToken()
        launches = int(self.random.integers(0, 12))
        timer = threading.Timer(float(self.random.random() ** 2 * 0.02), token.cancel)
        seen = 0

        def progress(_: Progress) -> None:
            nonlocal seen
            seen += 1
            if seen > launches:
                token.cancel()

        by_time = self.random.random() < 0.5
        if by_time:
            timer.start()
        self.attempt(token, samples, None if by_time else progress)
        timer.cancel()

    def attempt(
        self, token: CancelToken, samples: tuple[int, int], progress: Callable[[Progress], None] | None = None
    ) -> None:
        framebuffer = Framebuffer(self.plan.channels, self.size, self.plan.region)
        try:
            run(self.job, [framebuffer], self.executor, token=token, samples=samples, progress=progress)
        except Stopped:
            self.stops += 1


def same_bits(found: Framebuffer, wanted: Framebuffer) -> None:
    np.testing.assert_array_equal(stacked(found).view(np.uint32), stacked(wanted).view(np.uint32))


@pytest.mark.parametrize("budget", one_of(0.002, 1e-7))
@pytest.mark.parametrize("adaptive", [False, True])
@pytest.mark.parametrize("kind", RENDERERS)
def test_an_interrupted_pass_done_anew(kind: str, adaptive: bool, budget: float, device: Device) -> None:
    """With so little time that tiles are rendered in parts, too: packets of a tile then have different samples."""
    size = (20, 17) if budget < 1e-5 else SIZE
    scene = scene_with(kind, size, **(NOISY if adaptive else {}))
    plan = plan_of(scene, device)
    wanted = shoot(scene, device)
    work = Interrupted(scene, plan, device, LocalExecutor(device, budget_seconds=budget), seed=len(kind))
    same_bits(work.framebuffer(pass_ranges(16), tries=4), wanted)
    same_bits(work.framebuffer([(0, 5), (5, 16)], tries=4), wanted)
    assert work.stops > 0


@pytest.mark.parametrize("kind", ["surface", "volume", "cut_plane"])
def test_in_float64(kind: str, device: Device) -> None:
    precision: Precision = "float64"
    scene = scene_with(kind, **NOISY)
    work = Interrupted(scene, plan_of(scene, device, precision), device, LocalExecutor(device), seed=1)
    same_bits(work.framebuffer(pass_ranges(16), tries=5), shoot(scene, device, precision))
    assert work.stops > 0


@pytest.mark.combination
@pytest.mark.parametrize("lanes", [4, 1, 16])
def test_with_any_number_of_lanes(lanes: int, device: Device) -> None:
    """Lanes of one packet that have different numbers of samples, because some of their pixels are done."""
    scene = scene_with("surface", **NOISY)
    plan = plan_of(scene, device, lanes=lanes)
    whole = Framebuffer(plan.channels, SIZE, plan.region)
    run(job_of(scene, plan, device), [whole], LocalExecutor(device))
    assert len(np.unique(whole["samples"])) > 1
    executor = LocalExecutor(device, budget_seconds=1e-4)
    same_bits(
        Interrupted(scene, plan, device, executor, seed=lanes).framebuffer(pass_ranges(16), tries=4), whole
    )


def test_a_pass_within_a_heavy_tile(device: Device) -> None:
    """Told to end within a launch of many samples: packets that had ended keep them, the others do not."""
    scene = scene_with("surface", (64, 64), samples=1024)
    plan = plan_of(scene, device)
    wanted = shoot(scene, device)
    job, executor = job_of(scene, plan, device), LocalExecutor(device, budget_seconds=0.3)
    stops = 0
    for samples in ((0, 128), (128, 1024)):
        for wait in (0.01, 0.03, 0.06, 0.1, 0.15):
            token = CancelToken()
            timer = threading.Timer(wait, token.cancel)
            timer.start()
            try:
                framebuffer = Framebuffer(plan.channels, (64, 64), plan.region)
                run(job, [framebuffer], executor, token=token, samples=samples)
            except Stopped:
                stops += 1
            timer.join()
        framebuffer = Framebuffer(plan.channels, (64, 64), plan.region)
        run(job, [framebuffer], executor, samples=samples)
    assert stops >= 4
    same_bits(framebuffer, wanted)


def test_a_pass_that_was_finished_can_be_done_again(device: Device) -> None:
    """As after a cancel that came just behind the last launch."""
    scene = scene_with("surface", **NOISY)
    plan = plan_of(scene, device)
    executor = LocalExecutor(device)
    for samples in ((0, 1), (0, 1), (1, 4), (1, 4), (1, 4), (4, 16), (4, 16)):
        framebuffer = Framebuffer(plan.channels, SIZE, plan.region)
        run(job_of(scene, plan, device), [framebuffer], executor, samples=samples)
    same_bits(framebuffer, shoot(scene, device))


def test_an_interrupted_whole_picture(device: Device) -> None:
    """All samples in one pass: it begins anew with the first."""
    scene = scene_with("surface", **NOISY)
    plan = plan_of(scene, device)
    executor = LocalExecutor(device, budget_seconds=1e-5)
    job = job_of(scene, plan, device)
    for wait in (0.001, 0.003, 0.01):
        token = CancelToken()
        threading.Timer(wait, token.cancel).start()
        with pytest.raises(Stopped):
            run(job, [Framebuffer(plan.channels, SIZE, plan.region)], executor, token=token, samples=(0, 16))
        time.sleep(wait)
    framebuffer = Framebuffer(plan.channels, SIZE, plan.region)
    run(job, [framebuffer], executor, samples=(0, 16))
    same_bits(framebuffer, shoot(scene, device))


def test_what_was_kept_goes_with_a_view_that_could_not_be_taken(device: Device) -> None:
    """An executor tells that passes cannot go on, so that nobody continues with what is not there."""
    scene = scene_with("volume")
    plan = plan_of(scene, device)
    executor = LocalExecutor(device)
    job = job_of(scene, plan, device)
    assert not executor.keeps(1)
    run(job, [Framebuffer(plan.channels, SIZE, plan.region)], executor, samples=(0, 1))
    assert executor.keeps(1)
    assert not executor.keeps(2)
    executor.kept = type(executor.kept)()
    token = CancelToken()
    token.cancel()
    with pytest.raises(Stopped):
        run(job, [Framebuffer(plan.channels, SIZE, plan.region)], executor, samples=(1, 2), token=token)
    assert not executor.keeps(1)
    executor.forget()
