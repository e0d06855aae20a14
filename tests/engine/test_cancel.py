"""Cancelling: soon, with the device idle, and the engine ready for the next picture, which has the bits of any other."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

import clfractal
from benchmarks.cancel import waits
from clfractal.cli.bench import HAST
from clfractal.device import isolate, launch, program
from clfractal.device.launch import Pace
from clfractal.device.orbit import ORBIT
from clfractal.device.quirks import sees_host_writes
from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.device.watched import CANCELLED, Watched, is_watched
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.engine.refine import pass_ranges
from clfractal.engine.run import Progress, run
from clfractal.formulas.catalog import load_chain
from clfractal.integrators import points
from clfractal.integrators.lanes import best_lanes
from clfractal.integrators.passes import SAMPLING
from tests.calls import raising
from tests.engine.small_pictures import BULB, VOLUME, changed, equal
from tests.render.passes import RENDERERS, SIZE, scene_with
from tests.render.shots import job_of, plan_of, shoot, stacked
from tests.variants import one_of


def stopped_after(seconds: float, work: Callable[[clfractal.CancelToken], object]) -> float:
    """When work ends that is cancelled after a while, seconds since it began."""
    token = clfractal.CancelToken()
    timer = threading.Timer(seconds, token.cancel)
    start = time.perf_counter()
    timer.start()
    with pytest.raises(clfractal.Stopped):
        work(token)
    timer.join()
    return time.perf_counter() - start


def rendered(
    job: Job, executor: LocalExecutor, samples: tuple[int, int] | None = None, **settings: Any
) -> clfractal.Framebuffer:
    """The picture of a job of one view, after a pass of so many samples; settings as for `run`."""
    image, plan = job.scene.image, job.views[0].plan
    framebuffer = clfractal.Framebuffer(plan.channels, (image.width, image.height), plan.region)
    run(job, [framebuffer], executor, samples=samples, **settings)
    return framebuffer


def test_a_token_is_set_by_any_thread() -> None:
    token = clfractal.CancelToken()
    assert not token.cancelled
    assert not token()
    token.check()
    thread = threading.Thread(target=token.cancel)
    thread.start()
    thread.join()
    assert token.cancelled
    assert token()
    with pytest.raises(clfractal.Stopped):
        token.check()


def test_cancels_at_random_moments(device: Device) -> None:
    """Ten times looser than `python -m benchmarks.cancel` measures, and in seconds of processors: other tests run, too."""
    budget = 0.02
    size = ["image.width=500", "image.height=500", "renderer.samples=4"]
    scene = clfractal.load_scene(HAST, overrides=size)
    with clfractal.Engine(device, budget_seconds=budget) as engine:
        found = waits(engine, scene, 12, clock=time.process_time)
        equal(engine.render(changed(BULB)), clfractal.render(changed(BULB)))
    units = device.info.compute_units
    assert np.median(found) < 4 * budget * units
    assert max(found) < 10 * budget * units


@pytest.mark.parametrize("text", [BULB, VOLUME])
def test_a_token_that_is_set_starts_nothing(text: str, device: Device) -> None:
    token = clfractal.CancelToken()
    token.cancel()
    with clfractal.Engine(device) as engine:
        with pytest.raises(clfractal.Stopped):
            engine.render(changed(text), token=token)
        equal(engine.render(changed(text)), clfractal.render(changed(text)))


def test_many_samples_of_few_pixels(device: Device) -> None:
    """One tile with 60,000 samples, which take a minute: its samples are split, or nothing could end it."""
    scene = changed(BULB, "image.width=32", "image.height=32")
    with clfractal.Engine(device, budget_seconds=0.02) as engine:
        engine.render(scene)
        assert stopped_after(0.2, lambda token: engine.render(scene, samples=60_000, token=token)) < 10


def test_a_build_is_left(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiling goes on in a child; who waits for it need not."""
    compiled, ended = program._compile, []
    token = clfractal.CancelToken()

    def cancelled(*arguments: Any, **settings: Any) -> Any:
        timer = threading.Timer(0.3, token.cancel)
        timer.start()
        try:
            found = compiled(*arguments, **settings)
            ended.append("waited for")
            return found
        except clfractal.Stopped:
            ended.append("left")
            raise
        finally:
            timer.join()

    # A formula that nobody has compiled, and large.
    formula = "{variables: [x, y, z], map: ["
    terms = " + ".join(f"sin({number}.125 * x) * cos({number}.25 * y)" for number in range(60))
    formula += (
        f"'{terms} + x*x - {time.time_ns() % 10**6}', '2*x*y', '2*x*z'], add: point, degree: 2, bailout: 4,"
    )
    formula += " bounds: {center: [0, 0, 0], radius: 2}}"
    scene = clfractal.load_scene(BULB, overrides=[f"formula={{iterations: 8, inline: {formula}}}"])
    with clfractal.Engine(device) as engine:
        engine.render(changed(BULB))  # lanes are measured
        with monkeypatch.context() as patch:
            patch.setattr(program, "_compile", cancelled)
            with pytest.raises(clfractal.Stopped):
                engine.render(scene, token=token)
        assert set(ended) == {"left"}
        engine.render(changed(BULB))
    isolate.end_children()


def test_a_pace_begins_with_what_is_safe_for_the_heaviest() -> None:
    """The last tiles of a picture are light; the first of the next one are not."""
    pace = Pace(10.0, seconds=0.05)
    pace.learn(10, 100)
    assert pace.size == pytest.approx(5)
    for _ in range(10):
        pace.learn(pace.size, 0.1)
    assert pace.size > 1000
    pace.begin()
    assert pace.size == pytest.approx(5)


def test_a_launch_of_many_kernels_is_no_small_one(device: Device) -> None:
    """With less time than its kernels' own each launch would be smaller than the one before, down to a packet."""
    scene = {
        "version": 1,
        "formula": "none",
        "image": {"width": 80, "height": 80},
        "camera": {"position": [0, -4, 0]},
        "lighting": {"mode": "path", "bounces": 128},
        "objects": {"ball": {"type": "sphere"}},
        "renderer": {"samples": 1},
    }
    executor = LocalExecutor(device)
    job = prepare(clfractal.load_scene(scene), device)
    run(job, JobFramebuffers(job).framebuffers, executor)
    (drawing,) = executor._drawings.values()
    assert drawing.kernels > 500
    assert drawing.view is not None
    for _ in range(10):
        drawing.pace.learn(drawing.pace.size, 1000)
    assert drawing.pace.size * drawing.view.plan.lanes > 4096
    assert drawing.pace.seconds > 0.1


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_after_an_error_the_device_is_idle(
    error: type[BaseException], device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At once, not when the launches' generator happens to be collected."""
    ended: list[int] = []
    end = launch._end

    def noted(flying: Any, *others: Any) -> None:
        end(flying, *others)
        ended.append(len(flying))

    monkeypatch.setattr(launch, "_end", noted)

    scene = changed(BULB, "image.width=640", "image.height=480", "renderer.samples=4")
    with clfractal.Engine(device, budget_seconds=0.001) as engine:
        with pytest.raises(error) as raised:
            engine.render(scene, raising(error))
        # (The exception is still alive, and with it all frames that it went through.)
        assert raised.value.__traceback__ is not None
        assert ended == [2]


# --- passes that are interrupted and done anew ---


NOISY: dict[str, Any] = {"noise": 0.02, "min_samples": 4}


class Impatient(clfractal.CancelToken):
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

    def __init__(self, job: Job, executor: LocalExecutor, seed: int) -> None:
        self.job, self.executor = job, executor
        self.random = np.random.default_rng(seed)
        self.stops = 0

    def framebuffer(self, ranges: list[tuple[int, int]], tries: int) -> clfractal.Framebuffer:
        """The picture; each pass is tried so many times until it may be finished."""
        for samples in ranges:
            for _ in range(tries):
                self.try_once(samples)
            self.attempt(Impatient(int(self.random.integers(0, 3))), samples)
            framebuffer = rendered(self.job, self.executor, samples)
        return framebuffer

    def try_once(self, samples: tuple[int, int]) -> None:
        """A pass that is told to end after a random number of launches, or at a random time within one."""
        token = clfractal.CancelToken()
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
        self,
        token: clfractal.CancelToken,
        samples: tuple[int, int],
        progress: Callable[[Progress], None] | None = None,
    ) -> None:
        try:
            rendered(self.job, self.executor, samples, token=token, progress=progress)
        except clfractal.Stopped:
            self.stops += 1


def same_bits(found: clfractal.Framebuffer, wanted: clfractal.Framebuffer) -> None:
    np.testing.assert_array_equal(stacked(found).view(np.uint32), stacked(wanted).view(np.uint32))


@pytest.mark.parametrize("budget", one_of(0.002, 1e-7))
@pytest.mark.parametrize("adaptive", [False, True])
@pytest.mark.parametrize("kind", RENDERERS)
def test_an_interrupted_pass_done_anew(kind: str, adaptive: bool, budget: float, device: Device) -> None:
    """With so little time that tiles are rendered in parts, too: packets of a tile then have different samples."""
    size = (20, 17) if budget < 1e-5 else SIZE
    scene = scene_with(kind, size, **(NOISY if adaptive else {}))
    job, wanted = job_of(scene, plan_of(scene, device), device), shoot(scene, device)
    work = Interrupted(job, LocalExecutor(device, budget_seconds=budget), seed=len(kind))
    same_bits(work.framebuffer(pass_ranges(16), tries=4), wanted)
    same_bits(work.framebuffer([(0, 5), (5, 16)], tries=4), wanted)
    assert work.stops > 0


@pytest.mark.parametrize("kind", ["surface", "volume", "cut_plane"])
def test_in_float64(kind: str, device: Device) -> None:
    precision: Precision = "float64"
    scene = scene_with(kind, **NOISY)
    job = job_of(scene, plan_of(scene, device, precision), device)
    work = Interrupted(job, LocalExecutor(device), seed=1)
    same_bits(work.framebuffer(pass_ranges(16), tries=5), shoot(scene, device, precision))
    assert work.stops > 0


@pytest.mark.combination
@pytest.mark.parametrize("lanes", [4, 1, 16])
def test_with_any_number_of_lanes(lanes: int, device: Device) -> None:
    """Lanes of one packet that have different numbers of samples, because some of their pixels are done."""
    scene = scene_with("surface", **NOISY)
    job = job_of(scene, plan_of(scene, device, lanes=lanes), device)
    whole = rendered(job, LocalExecutor(device))
    assert len(np.unique(whole["samples"])) > 1
    work = Interrupted(job, LocalExecutor(device, budget_seconds=1e-4), seed=lanes)
    same_bits(work.framebuffer(pass_ranges(16), tries=4), whole)


def test_a_pass_within_a_heavy_tile(device: Device) -> None:
    """Told to end within a launch of many samples: packets that had ended keep them, the others do not."""
    scene = scene_with("surface", (64, 64), samples=1024)
    wanted = shoot(scene, device)
    job = job_of(scene, plan_of(scene, device), device)
    executor = LocalExecutor(device, budget_seconds=0.3)
    stops = 0
    for samples, enough in (((0, 128), 2), ((128, 1024), 5)):
        tries = 0
        # As often as it takes: on a loaded machine a timer may come when the pass is done.
        while stops < enough:
            tries += 1
            assert tries < 100
            wait = (0.01, 0.03, 0.06, 0.1, 0.15)[tries % 5] / (1 + tries // 5)
            token = clfractal.CancelToken()
            timer = threading.Timer(wait, token.cancel)
            timer.start()
            try:
                rendered(job, executor, samples, token=token)
            except clfractal.Stopped:
                stops += 1
            timer.join()
        framebuffer = rendered(job, executor, samples)
    same_bits(framebuffer, wanted)


def test_a_pass_that_was_finished_can_be_done_again(device: Device) -> None:
    """As after a cancel that came just behind the last launch."""
    scene = scene_with("surface", **NOISY)
    job, executor = job_of(scene, plan_of(scene, device), device), LocalExecutor(device)
    for samples in ((0, 1), (0, 1), (1, 4), (1, 4), (1, 4), (4, 16), (4, 16)):
        framebuffer = rendered(job, executor, samples)
    same_bits(framebuffer, shoot(scene, device))


def test_an_interrupted_whole_picture(device: Device) -> None:
    """All samples in one pass: it begins anew with the first."""
    scene = scene_with("surface", **NOISY)
    job = job_of(scene, plan_of(scene, device), device)
    executor = LocalExecutor(device, budget_seconds=1e-5)
    for questions in (1, 3, 10):
        with pytest.raises(clfractal.Stopped):
            rendered(job, executor, (0, 16), token=Impatient(questions))
    for wait in (0.001, 0.003, 0.01):
        token = clfractal.CancelToken()
        timer = threading.Timer(wait, token.cancel)
        timer.start()
        with suppress(clfractal.Stopped):
            rendered(job, executor, (0, 16), token=token)
        timer.join()
    same_bits(rendered(job, executor, (0, 16)), shoot(scene, device))


def test_what_was_kept_goes_with_a_view_that_could_not_be_taken(device: Device) -> None:
    """An executor tells that passes cannot go on, so that nobody continues with what is not there."""
    scene = scene_with("volume")
    job, executor = job_of(scene, plan_of(scene, device), device), LocalExecutor(device)
    assert not executor.keeps(1)
    rendered(job, executor, (0, 1))
    assert executor.keeps(1)
    assert not executor.keeps(2)
    executor.kept = type(executor.kept)()
    token = clfractal.CancelToken()
    token.cancel()
    with pytest.raises(clfractal.Stopped):
        rendered(job, executor, (1, 2), token=token)
    assert not executor.keeps(1)
    executor.forget()


# --- orbits of a million applications ---


LONG = """
version: 1
formula: {name: hast, iterations: 1000000}
image: {width: 96, height: 96}
camera: {position: [0, -2.5, 0.3]}
"""
ENDLESS = {
    "surface": "renderer: {}\n",
    "steps": "renderer: {search: steps}\n",
    "plane": "renderer: {type: cut_plane, plane: {width: 3, height: 3}, periodicity: false}\n",
}


def test_which_records_are_watched() -> None:
    assert is_watched(np.zeros(2, ORBIT.dtype("float32")))
    assert is_watched(np.zeros((), SAMPLING.dtype("float64")))
    assert not is_watched(np.zeros(2))


def test_the_flag_reaches_the_device(device: Device) -> None:
    import pyopencl as cl

    if not sees_host_writes(device.info):
        pytest.skip(f"{device.info.name} does not see what the host writes while a kernel runs")
    records = np.zeros(3, ORBIT.dtype("float32"))
    records["iterations"] = 7
    watched = Watched(device, records)
    for cancelled in (True, False):
        watched.cancel(cancelled)
        found = np.empty_like(records)
        cl.enqueue_copy(device.queue, found, watched.buffer)
        assert (found[CANCELLED] == int(cancelled)).all()
        assert (found["iterations"] == 7).all()


@pytest.mark.parametrize("kind", ENDLESS)
def test_a_cancel_ends_long_orbits(kind: str, device: Device) -> None:
    """Whole launches would take minutes. (Bounds are far above the milliseconds that it takes on an idle machine.)"""
    if not sees_host_writes(device.info):
        pytest.skip(f"{device.info.name} does not see what the host writes while a kernel runs")
    scene = clfractal.load_scene(LONG + ENDLESS[kind])
    short = scene.model_copy(update={"formula": scene.formula.model_copy(update={"iterations": 20})})
    expected = clfractal.render(short)
    with clfractal.Engine(device, budget_seconds=0.02) as engine:
        equal(engine.render(short), expected)
        assert stopped_after(0.4, lambda token: engine.render(scene, token=token)) < 20
        # Nothing of it is left: the next picture is right.
        equal(engine.render(short), expected)


def test_lists_of_points_are_cancelled(device: Device) -> None:
    chain = load_chain("hast")
    places = np.random.default_rng(1).uniform(-0.1, 0.1, (200_000, 3))
    lanes = best_lanes(device, "float32")

    def endless(token: clfractal.CancelToken) -> object:
        return points.escape(chain, places, 1_000_000, device=device, lanes=lanes, token=token)

    assert stopped_after(0.3, endless) < 20
    counts, inside = points.escape(chain, places[:100], 50, device=device, lanes=lanes)
    assert inside.all()
    assert (counts == 50).all()
