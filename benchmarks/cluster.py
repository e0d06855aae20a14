"""What a cluster costs and gains: python -m benchmarks.cluster [--rounds 3] [--workers 200] [--frames 10000] [--side 16384]

- `speed`: a picture by one worker of one core, and by two of one core each, in turn; each worker, the scheduler and this
  process are processes of their own, on this machine.
- `tasks`: how many tasks a scheduler holds, with simulated workers that answer at once (several in each of two processes).
  All of it shares this machine's cores, so the processor time of the scheduler and of this process for each task are
  measured beside the rate: a machine with cores for all of them reaches the inverse of these.
- `memory`: what scheduler and client hold while a film of many frames, and a large picture, are made by simulated workers.
  The client is the command itself, with its journal and its files; only the pixels are none.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil

import clfractal
from clfractal.cluster.cluster import Cluster
from clfractal.engine.engine import Engine
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.run import run
from clfractal.images.tiles import TILE

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 60}
image: {width: 512, height: 384}
camera: {position: [0, -2.2, 0.4], fov: 40}
renderer: {type: surface, samples: 256, detail: 0.2}
"""
LARGE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 4096, height: 4096}
camera: {position: [0, -3, 0]}
"""
FILM = """version: 1
formula: {name: mandelbulb, iterations: 4}
image: {width: 64, height: 64}
camera: {position: [0, -3, 0]}
animation:
  frames: FRAMES
  tracks: {camera.fov: {expression: "40 + 10*u"}}
"""
SIMULATED = "--simulated-workers"
# Simulated time of a tile, seconds: one tile in a task, or the bundles of a usual picture.
_SLOW, _USUAL = 1.0, 1 / 256


@contextmanager
def process(arguments: Sequence[str], core: int | None = None) -> Iterator[psutil.Process]:
    """A Python process, on one core if that is said, which ends with the block."""
    environment = {**os.environ, "PYTHONPATH": str(Path(clfractal.__file__).parents[1])}
    pin: Any = None
    if core is not None:
        environment |= {"POCL_MAX_PTHREAD_COUNT": "1", "POCL_CPU_MAX_CU_COUNT": "1"}
        if hasattr(os, "sched_setaffinity"):
            pin = lambda: os.sched_setaffinity(0, [core])  # noqa: E731
    quiet = subprocess.DEVNULL
    started = subprocess.Popen(
        [sys.executable, *arguments], env=environment, stdout=quiet, stderr=quiet, preexec_fn=pin
    )
    try:
        yield psutil.Process(started.pid)
    finally:
        started.kill()
        started.wait()


@contextmanager
def scheduler() -> Iterator[tuple[str, psutil.Process]]:
    """A scheduler: its address and process."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    options = ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard", "--no-show"]
    with process(["-m", "distributed.cli.dask_scheduler", *options]) as running:
        for _ in range(300):
            with suppress(OSError), socket.create_connection(("127.0.0.1", port), 1):
                break
            time.sleep(0.1)
        yield f"tcp://127.0.0.1:{port}", running


def speed(rounds: int) -> None:
    """Prints the gain of a second worker, and what the tiles cost beside their kernels."""
    walls: dict[int, list[float]] = {1: [], 2: []}
    beside: dict[str, list[float]] = {"worker": [], "all": []}
    cores = os.cpu_count() or 1
    with ExitStack() as stack, tempfile.TemporaryDirectory() as folder:
        clusters = {}
        for count in walls:
            address, _ = stack.enter_context(scheduler())
            options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", folder]
            for core in range(count):
                worker = ["-m", "distributed.cli.dask_worker", address, "--name", f"w{core}", *options]
                stack.enter_context(process(worker, core % cores))
            clusters[count] = stack.enter_context(Cluster(address))
            while clusters[count].others()[0] < count:
                time.sleep(0.1)
            clfractal.render(SCENE, samples=8, executor=clusters[count])  # compiles
        for _ in range(rounds):
            for count, cluster in clusters.items():
                before = [(share.seconds, share.kernel_ms) for share in cluster.shares()]
                start = time.perf_counter()
                clfractal.render(SCENE, executor=cluster)
                wall = time.perf_counter() - start
                walls[count].append(wall)
                if count == 1:
                    (share,) = cluster.shares()
                    busy, kernel = share.seconds - before[0][0], 1e-3 * (share.kernel_ms - before[0][1])
                    beside["worker"].append(busy / kernel - 1)
                    beside["all"].append(wall / kernel - 1)
    one, two = statistics.median(walls[1]), statistics.median(walls[2])
    gains = [a / b for a, b in zip(walls[1], walls[2], strict=True)]
    print(f"one worker {one:.2f} s, two workers {two:.2f} s: {statistics.median(gains):.3f} times as fast")
    print(f"  gains of all rounds: {', '.join(f'{gain:.3f}' for gain in gains)}")
    for name, parts in beside.items():
        print(
            f"beside the kernels, {name}: {statistics.median(parts):.2%} ({', '.join(f'{p:.2%}' for p in parts)})"
        )


def tasks(workers: int, rounds: int) -> None:
    """Prints how many tasks pass in a second, and the processor time of scheduler and client for each."""
    with ExitStack() as stack:
        address, running = stack.enter_context(scheduler())
        for count in (workers // 2, workers - workers // 2):
            own = ["-m", "benchmarks.cluster", SIMULATED, f"{count},{_SLOW},{address}"]
            stack.enter_context(process(own))
        cluster = stack.enter_context(Cluster(address))
        begun = time.perf_counter()
        while cluster.others()[0] < workers:
            time.sleep(0.1)
        print(f"{workers} workers take part after {time.perf_counter() - begun:.1f} s")
        with Engine() as engine:
            job = engine.prepare(LARGE)
        for _ in range(rounds):
            framebuffers = JobFramebuffers(job)
            own_before, before = psutil.Process().cpu_times(), running.cpu_times()
            start = time.perf_counter()
            run(job, framebuffers.framebuffers, cluster)
            wall = time.perf_counter() - start
            after, own_after = running.cpu_times(), psutil.Process().cpu_times()
            made = job.tiles
            there = (after.user + after.system - before.user - before.system) / made
            here = (own_after.user + own_after.system - own_before.user - own_before.system) / made
            print(
                f"{made} tasks in {wall:.1f} s: {made / wall:.0f} a second here; processor time of a task: scheduler"
                f" {1e3 * there:.2f} ms ({1 / there:.0f} a second), client {1e3 * here:.2f} ms ({1 / here:.0f} a second);"
                f" scheduler's memory {running.memory_info().rss / 2**20:.0f} MiB"
            )


def memory(frames: int, side: int) -> None:
    """Prints what scheduler and client hold at each quarter of a film of many frames, and of a large picture."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        address, running = stack.enter_context(scheduler())
        own = ["-m", "benchmarks.cluster", SIMULATED, f"8,{_USUAL},{address}"]
        stack.enter_context(process(own))
        (folder / "film.yaml").write_text(FILM.replace("FRAMES", str(frames)))
        (folder / "large.yaml").write_text(LARGE)
        order = ["animate", str(folder / "film.yaml"), "-o", str(folder / "f_#####.png")]
        watched(f"film of {frames} frames", [*order, "--cluster", address], running)
        print(f"  {len(list(folder.glob('f_*.png')))} frames are there")
        for each in (side // 4, side):
            order = ["render", str(folder / "large.yaml"), "--size", f"{each}x{each}", "--samples", "1"]
            order += ["-o", str(folder / f"{each}.exr"), "--cluster", address]
            watched(f"picture of {each} x {each}", order, running)
            print(f"  {(folder / f'{each}.exr').stat().st_size / 2**20:.0f} MiB are there")


def watched(what: str, order: Sequence[str], running: psutil.Process) -> None:
    """Prints the memory of a command and of the scheduler, at its highest, for each quarter of the command's time.

    A process's own memory is told without pages of files, which the system takes back when it needs them.
    """
    found: list[tuple[float, int, int]] = []
    start = time.perf_counter()
    with process(["-m", "clfractal", *order, "--quiet"]) as client:
        while client.status() != psutil.STATUS_ZOMBIE:
            with suppress(psutil.NoSuchProcess, psutil.ZombieProcess):
                found.append((time.perf_counter() - start, own_bytes(client), own_bytes(running)))
            time.sleep(0.2)
        status = client.wait()
        assert status == 0, f"{what}: exit status {status}"
    seconds = found[-1][0]
    for name, place in (("client", 1), ("scheduler", 2)):
        parts = [[each[place] for each in found if q <= 4 * each[0] / seconds <= q + 1] for q in range(4)]
        quarters = ", ".join(f"{max(part, default=0) / 2**20:.0f}" for part in parts)
        print(f"{what}, {seconds:.0f} s: {name} {quarters} MiB in the quarters", flush=True)


def own_bytes(process: psutil.Process) -> int:
    """Memory that is a process's own, bytes; where the system does not tell which, all of it."""
    told = process.memory_info()
    return int(told.rss - getattr(told, "shared", 0))


async def simulate(count: int, seconds: float, address: str) -> None:
    """Workers that answer at once with tiles of zeros, and say that each tile took some seconds."""
    import numpy as np
    from distributed import Worker, get_worker

    from clfractal.cluster import tasks as real
    from clfractal.cluster.fingerprint import fingerprint
    from clfractal.device.select import choose
    from clfractal.engine.run import Counters

    info = choose(None).info

    def enlist(*_: Any) -> dict[str, Any]:
        return {"version": "", "fingerprint": fingerprint(), "pid": os.getpid(), "device": info}

    def tiles(_seat: Any, data: Any, arrays: Any, item: Any) -> real.Answer:
        with real._one_at_a_time:
            channels = len(real._unpacked(data, arrays).channels)
        framebuffer = np.zeros((len(item.tiles), channels, TILE, TILE), np.float32)
        own, counters, took = get_worker(), Counters(rays=1), seconds * len(item.tiles)
        return real.Answer(
            item.view,
            item.tiles,
            framebuffer,
            counters,
            took,
            own.address,
            str(own.name),
            real.render_device_of(info),
        )

    for function in (enlist, tiles):
        setattr(real, function.__name__, function)
    offers = {real.RESOURCE: 1, real.FLOAT64: 1}
    workers = [
        Worker(address, nthreads=1, resources=offers, name=f"{os.getpid()}-{number}", dashboard=False)
        for number in range(count)
    ]
    await asyncio.gather(*workers)
    await asyncio.gather(*(worker.finished() for worker in workers))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--workers", type=int, default=200)
    parser.add_argument("--only", choices=("speed", "tasks", "memory"))
    parser.add_argument("--frames", type=int, default=10_000, help="of the film whose memory is measured")
    parser.add_argument("--side", type=int, default=16384, help="of the picture whose memory is measured")
    parser.add_argument(SIMULATED, help=argparse.SUPPRESS)
    wanted = parser.parse_args()
    if wanted.simulated_workers:
        count, seconds, address = wanted.simulated_workers.split(",")
        asyncio.run(simulate(int(count), float(seconds), address))
        return
    if wanted.only in (None, "speed"):
        speed(wanted.rounds)
    if wanted.only in (None, "tasks"):
        tasks(wanted.workers, wanted.rounds)
    if wanted.only in (None, "memory"):
        memory(wanted.frames, wanted.side)


if __name__ == "__main__":
    main()
