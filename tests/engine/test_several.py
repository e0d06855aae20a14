"""Several devices render one picture: the halves of the processor, which are devices of one key; how they share tiles."""

from __future__ import annotations

import heapq
import threading
from collections import deque
from collections.abc import Generator, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clfractal
from clfractal.device import program
from clfractal.device.select import Device, by_key, devices, is_simulator
from clfractal.device.tune import first_lanes
from clfractal.engine import several, sharing
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import Result, WorkItem
from clfractal.engine.several import SeveralExecutor
from clfractal.engine.sharing import Shared
from clfractal.integrators import lanes
from tests.calls import counted
from tests.engine.offers import Clock, offer
from tests.engine.small_pictures import SCENE, same
from tests.halves import halves_of
from tests.portability.compare import difference

TILES = 10 * 7


class Failing(LocalExecutor):
    """A device that fails after some tiles."""

    after = 0

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: clfractal.CancelToken | None = None
    ) -> Generator[Result]:
        for result in super().execute(job, items, token):
            self.after -= len(result.tiles)
            yield result
            if self.after <= 0 and len(result.tiles):
                raise clfractal.DeviceError(
                    f"{self.device.info.name}: the device failed while rendering: OUT_OF_ORDER"
                )


def failing(engine: clfractal.Engine, which: Sequence[int], after: int) -> SeveralExecutor:
    """Gives an engine devices of which some fail after so many tiles."""
    shared = engine.executor
    assert isinstance(shared, SeveralExecutor)
    for number in which:
        executor = shared.executors[number]
        assert type(executor) is LocalExecutor
        executor.__class__ = Failing
        executor.after = after  # type: ignore[attr-defined]
    return shared


@pytest.fixture(scope="module")
def whole(device: Device) -> clfractal.Framebuffer:
    with clfractal.Engine(device) as engine:
        return engine.render(SCENE)


def test_halves_give_the_bits_of_the_whole(device: Device, whole: clfractal.Framebuffer) -> None:
    with clfractal.Engine(halves_of(device), budget_seconds=0.01) as engine:
        assert same(engine.render(SCENE), whole)
        framebuffer = engine.render(SCENE)
    assert same(framebuffer, whole)
    shares = framebuffer.stats["devices"]
    assert [each["index"] for each in shares] == [f"{halves_of(device)}#{number}" for number in (1, 2)]
    assert sum(each["tiles"] for each in shares) == TILES
    assert all(each["tiles"] > TILES / 5 for each in shares)
    assert sum(each["rays"] for each in shares) == framebuffer.stats["rays"] == whole.stats["rays"]
    assert framebuffer.remarks == whole.remarks
    # The header tells the same, tile by tile.
    lines = framebuffer.header["devices"].split("\n")
    told = {each["index"]: f"{each['index']} {each['device']}: {each['tiles']} tiles" for each in shares}
    assert sorted(line.partition(": ")[2] for line in lines) == sorted(told.values())
    runs = [tuple(map(int, run.split("*"))) for run in framebuffer.header["tileDevices"].split()]
    counts = {number: sum(length for length, own in runs if own == number) for number in (1, 2)}
    assert {f"{number}: " for number in counts} == {line[:3] for line in lines}
    assert all(f": {counts[int(line[0])]} tiles" in line for line in lines)


def test_one_device_tells_of_no_others(whole: clfractal.Framebuffer) -> None:
    assert not {"devices", "tileDevices"} & set(whole.header)
    assert "devices" not in whole.stats


def test_a_layout_of_every_renderer_for_two_eyes(device: Device) -> None:
    """The bits of one device, in the first picture (a device may still compile) and when both have all programs."""
    scene = SCENE.replace("width: 300, height: 200", "width: 240, height: 100").replace(
        "samples: 5", "samples: 2"
    )
    scene = scene.replace("output: {channels: [R, G, B, A, Z, N.X, P.Y, iterations, steps]}\n", "")
    scene += """stereo: {mode: split, separation: 0.1}
layout:
  views:
  - {}
  - renderer: {type: volume, resolution: 24}
  - renderer: {type: cut_plane, plane: {width: 2.5, height: 2.5}, samples: 2}
"""
    with clfractal.Engine(device) as one, clfractal.Engine(halves_of(device), budget_seconds=0.01) as two:
        alone, first, second = one.render(scene), two.render(scene), two.render(scene)
    assert same(first, alone)
    assert same(second, alone)
    assert len(second.stats["devices"]) == 2


def test_a_stereo_pair(device: Device) -> None:
    stereo = SCENE.replace("width: 300, height: 200", "width: 130, height: 100")
    stereo += "stereo: {mode: anaglyph, separation: 0.1}\n"
    with clfractal.Engine(device) as one, clfractal.Engine(halves_of(device), budget_seconds=0.01) as two:
        framebuffer = two.render(stereo)
        assert same(framebuffer, one.render(stereo))
    assert (
        sum(int(line.split(": ")[2].split()[0]) for line in framebuffer.header["devices"].split("\n"))
        == 2 * 5 * 4
    )


@pytest.mark.parametrize("after", [1, 20])
def test_a_device_that_fails_is_left_out(device: Device, whole: clfractal.Framebuffer, after: int) -> None:
    said: list[str] = []
    with clfractal.Engine(halves_of(device), budget_seconds=0.01, tell=said.append) as engine:
        shared = failing(engine, [0], after)
        framebuffer = engine.render(SCENE)
        assert same(framebuffer, whole)
        assert list(shared.failures) == [0]
        line = f"{halves_of(device)}#1 {device.info.name} is left out, others do its work: {device.info.name}: the"
        assert [each for each in said if each.startswith(line)]
        assert [each for each in framebuffer.remarks if each.startswith(line)]
        # It stays so, and decisions are made for another.
        again = engine.render(SCENE)
        assert same(again, whole)
        assert [each["tiles"] for each in again.stats["devices"]] == [TILES]
        assert engine.device.info.index.endswith("#2")


def test_no_device_is_left(device: Device) -> None:
    with clfractal.Engine(halves_of(device), budget_seconds=0.01) as engine:
        failing(engine, [0, 1], 10)
        with pytest.raises(clfractal.DeviceError, match=r"no device is left: .*OUT_OF_ORDER") as caught:
            engine.render(SCENE)
        assert caught.value.status == 3
        with pytest.raises(clfractal.DeviceError, match="no device is left"):
            engine.render(SCENE)


def test_a_device_that_does_not_work_at_all(
    device: Device, whole: clfractal.Framebuffer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It fails where decisions are made, before anything is rendered."""
    real = lanes.best_lanes

    def best_lanes(chosen: Device, *rest: object, **more: object) -> int:
        if chosen.info.index.endswith("#1"):
            raise clfractal.DeviceError(f"{chosen.info.name}: no kernel works on this device")
        return real(chosen, *rest, **more)  # type: ignore[arg-type]

    monkeypatch.setattr("clfractal.engine.prepare.best_lanes", best_lanes)
    with clfractal.Engine(halves_of(device)) as engine:
        assert same(engine.render(SCENE), whole)
        assert engine.device.info.index.endswith("#2")


@pytest.mark.parametrize("after", [10_000, 75, 150])
def test_passes_stay_on_their_device(device: Device, whole: clfractal.Framebuffer, after: int) -> None:
    """Samples are added on the device that has the earlier ones; with it they are lost, and the tile begins again."""
    with clfractal.Engine(halves_of(device), budget_seconds=0.01) as engine:
        failing(engine, [1], after)
        framebuffers = list(engine.refine(SCENE))
        assert same(framebuffers[-1], whole)
        assert framebuffers[-1].stage == ""
        assert len(framebuffers) == 3 + 4  # every 8th, 4th, 2nd pixel; 1, 2, 4 and 5 samples


def test_devices_of_another_kind_use_their_own_lanes(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    halves_of(device)
    parts = device.divided((1, 1))
    other = Device(replace(parts[1].info, driver="of another version"), parts[1].cl_device)
    monkeypatch.setattr(several, "lanes_of", lambda views, chosen, **more: (4,) * len(views))
    with clfractal.Engine([parts[0], other]) as engine:
        job = engine.prepare(SCENE)
    assert job.on(parts[0].info) is job
    assert job.on(replace(other.info, driver="unknown")) is None
    own = job.on(other.info)
    assert own is not None
    assert [view.plan.lanes for view in own.views] == [4]
    assert job.identity(0)["device"] == "several kinds"
    assert [each["driver"] for each in job.also_continues(0)] == [parts[0].info.key, other.info.key]
    assert own.also_continues(0)[0] == job.identity(0)


def test_two_implementations(device: Device) -> None:
    """Of two drivers for the processor each makes a part of the picture, within what they differ by."""
    kinds: dict[str, str] = {}
    for info in devices():
        with suppress(clfractal.DeviceError):
            if info.kind == "cpu" and not is_simulator(info):
                first_lanes(by_key(info.index, info.key), "float32")
                kinds.setdefault(info.key, info.index)
    if len(kinds) < 2:
        pytest.skip("two drivers of the processor that work are needed")
    names = list(kinds.values())[:2]
    scene = clfractal.load_scene(SCENE, overrides=["renderer.samples=64"])
    with clfractal.Engine(names[0]) as one:
        alone = one.render(scene)
    with clfractal.Engine(names, budget_seconds=0.01) as both:
        for _ in range(5):  # a short picture does not wait for the programs of the second
            framebuffer = both.render(scene)
            if len(framebuffer.stats["devices"]) == 2:
                break
    assert [each["index"] for each in framebuffer.stats["devices"]] == sorted(names)
    assert [remark for remark in framebuffer.remarks if remark.startswith("made by devices of 2 kinds")]
    order = [*"RGBA", *(name for name in framebuffer if name not in "RGBA")]
    pictures = [np.stack([picture[name] for name in order]) for picture in (alone, framebuffer)]
    assert not difference(pictures[0], pictures[1], "float32").fault


def test_float64_is_left_to_those_that_have_it(device: Device, whole: clfractal.Framebuffer) -> None:
    halves_of(device)
    parts = device.divided((1, 1))
    lacking = Device(replace(parts[0].info, driver="without", has_float64=False), parts[0].cl_device)
    said: list[str] = []
    with clfractal.Engine([lacking, parts[1]], tell=said.append) as engine:
        assert engine.device is parts[1]
        framebuffer = engine.render(SCENE, precision="float64", samples=1)
    assert [each["index"] for each in framebuffer.stats["devices"]] == [parts[1].info.index]
    assert f"{lacking.info.index} {lacking.info.name} has no float64, so others do its work" in said


def test_a_token_ends_all_devices(device: Device) -> None:
    token = clfractal.CancelToken()
    heavy = clfractal.load_scene(SCENE, overrides=["renderer.samples=4000"])
    before = set(threading.enumerate())
    with clfractal.Engine(halves_of(device)) as engine:
        engine.render(SCENE)

        def progress(state: object) -> None:
            token.cancel()

        with pytest.raises(clfractal.Stopped):
            engine.render(heavy, progress, token=token)
        left = [each for each in threading.enumerate() if each not in before]
        assert not [each for each in left if each.name.startswith("clfractal-0")]
        assert engine.render(SCENE).done.all()


def test_wrong_lists_of_devices(device: Device) -> None:
    for wrong in ([], [3], [None], 3):
        with pytest.raises(clfractal.DeviceError) as caught:
            clfractal.Engine(wrong)  # type: ignore[arg-type]
        assert caught.value.status == 2


def test_a_program_is_compiled_once_for_devices_of_one_kind(
    device: Device, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("CLFRACTAL_CACHE", str(tmp_path))
    monkeypatch.setenv("CLFRACTAL_LANES", "8")
    compiled = counted(monkeypatch, program, "_compile_in_child")
    scene = SCENE.replace("300, height: 200", "3000, height: 2000").replace("iterations: 8", "iterations: 9")
    with clfractal.Engine(halves_of(device)) as engine:
        for executor in engine.executor.executors:  # type: ignore[union-attr]
            executor.device.loaded.clear()
        framebuffer = engine.render(scene, samples=1)
    assert len(framebuffer.stats["devices"]) == 2
    assert len(compiled) == len({text for _, text, *_ in compiled}) > 0


def test_pictures_whose_samples_differ_are_shared(device: Device) -> None:
    """With motion blur a device makes all samples of some tiles, and leaves others to the other one."""
    tracks = {"lights.0.intensity": {"expression": "1 + frame"}}
    moving = {"frames": 4, "shutter": 0.5, "tracks": tracks}
    scene = clfractal.at_frame(clfractal.load_scene(SCENE).model_copy(update={"animation": moving}), 1)
    with clfractal.Engine(device) as one:
        alone = one.render(scene, samples=4)
    with clfractal.Engine(halves_of(device)) as both:
        both.render(scene, samples=4)
        framebuffer = both.render(scene, samples=4)
    assert len(framebuffer.stats["devices"]) == 2
    for name in alone:
        np.testing.assert_array_equal(framebuffer[name], alone[name], name)


# --- tiles are shared by measured speed ---


LAUNCH_SECONDS = 0.05


def simulated(
    tiles: int, speeds: Sequence[float], known: Sequence[float], monkeypatch: pytest.MonkeyPatch
) -> tuple[list[float], list[int]]:
    """When each device ends, seconds, and how many tiles it has done; each has two launches under way at a time."""
    clock = Clock()
    monkeypatch.setattr(sharing, "time", clock)
    shared = Shared([offer(tiles)], known)
    for device in range(len(speeds)):
        shared._workers[device].offer = shared._offers[0]  # as `items` does, which may wait
        assert not len(shared.take(device, 0))  # its programs are there
    ends, done, free = [0.0] * len(speeds), [0] * len(speeds), [0.0] * len(speeds)
    seen = np.zeros(tiles, np.int64)
    events: list[tuple[float, int, int]] = []  # time, device, the tiles that are done then; 0 to look again
    flying: list[deque[np.ndarray]] = [deque() for _ in speeds]

    def begin(device: int) -> None:
        while len(flying[device]) < 2:
            most = max(int(LAUNCH_SECONDS / 2 * speeds[device]), 1)
            taken = shared.take(device, most)
            if not len(taken):
                if not flying[device] and not shared.finished:
                    heapq.heappush(events, (clock.now + 0.02, device, 0))
                return
            seen[taken] += 1
            flying[device].append(taken)
            free[device] = max(free[device], clock.now) + len(taken) / speeds[device]
            heapq.heappush(events, (free[device], device, len(taken)))

    for device in range(len(speeds)):
        begin(device)
    while events:
        clock.now, device, count = heapq.heappop(events)
        if count:
            shared.done(device, flying[device].popleft())
            ends[device], done[device] = clock.now, done[device] + count
        begin(device)
    assert (seen == 1).all()
    assert shared.finished
    return ends, done


@settings(max_examples=40)
@given(
    st.integers(1, 1000),
    st.lists(st.floats(30, 1e5), min_size=2, max_size=4),
)
def test_devices_end_together(tiles: int, speeds: list[float]) -> None:
    """At the end at most some launches are waited for, however different the devices are."""
    with pytest.MonkeyPatch.context() as patch:
        ends, _ = simulated(tiles, speeds, speeds, patch)
    ideal = tiles / sum(speeds)
    # What the fastest needs for a tile more, and the last launches.
    assert max(ends) <= 1.02 * ideal + 2.5 * LAUNCH_SECONDS + 2 / max(speeds)


def test_speeds_that_are_not_known_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    ends, done = simulated(4000, [9000.0, 1000.0], [1.0, 1.0], monkeypatch)
    assert done[0] == pytest.approx(3600, rel=0.05)
    assert max(ends) - min(ends) <= 2 * LAUNCH_SECONDS


def test_a_slow_device_leaves_the_last_tile_to_the_fast_one(monkeypatch: pytest.MonkeyPatch) -> None:
    _, done = simulated(3, [100.0, 0.01], [100.0, 0.01], monkeypatch)
    assert done == [3, 0]
    ends, _ = simulated(50, [100.0, 1.0], [100.0, 1.0], monkeypatch)
    assert max(ends) < 1.1


def test_a_lost_device_s_tiles_are_done_by_others() -> None:
    shared = Shared([offer(10), offer(4, device=1, samples=(4, 8))], [1.0, 1.0])
    first, second = shared.items(0), shared.items(1)
    next(second)
    lost = shared.take(1, 3)
    shared.lose(1)
    found = []
    for item in first:
        while len(tiles := shared.take(0, 4)):
            found.append((item.samples, tiles.tolist()))
            shared.done(0, tiles)
    assert shared.finished
    assert list(second) == []
    assert sorted(tile for samples, tiles in found if samples == (0, 1) for tile in tiles) == list(range(10))
    # The ranges before are gone with the device, so these begin at the first sample.
    assert sorted(tile for samples, tiles in found if samples == (0, 8) for tile in tiles) == list(range(4))
    assert len(lost)
