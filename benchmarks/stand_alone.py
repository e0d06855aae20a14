"""Times a hand-written kernel from a file: what a device can do without an engine around it.

The file holds `march(out, width, height, limit, fov, detail, counts)` over packets of W rays (macro, 1, 8
or 16); a packet covers 1 x 1, 4 x 2 or 4 x 4 pixels. Rays end `detail` widths of a pixel before the set. Each lane
count runs in a child process: a compiler may abort.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from pathlib import Path

from benchmarks.ours import REPOSITORY
from benchmarks.rivals.base import MissingError, Sample, run
from benchmarks.runtimes import Runtime

PIXELS, LAUNCHES = 1000, 5
PACKET = {1: (1, 1), 8: (4, 2), 16: (4, 4)}
ITERATIONS = {"mandelbulb8-shadow": 250}  # every other row: 40
CAMERA = ("-DCAMX=-0.8f", "-DCAMY=2.2f", "-DCAMZ=3.0f")


class StandAloneKernel:
    """One kernel file on one runtime, at its fastest lane count."""

    def __init__(self, row: str, file: Path, flags: str, runtime: Runtime, *, detail: float = 1.0) -> None:
        self._row, self._file, self._flags, self._runtime = row, file, flags, runtime
        self._detail, self._lanes = detail, 1
        self.name = self._named("")

    def _named(self, how: str) -> str:
        return f"{self._file.name} alone, detail {self._detail:g}{how} ({self._runtime.name})"

    def prepare(self) -> None:
        times: dict[int, float] = {}
        reason = MissingError("no lane count works")
        for lanes in PACKET:
            try:
                times[lanes] = self._milliseconds(lanes)
            except MissingError as error:
                reason = error
        if not times:
            raise reason
        self._lanes = min(times, key=times.__getitem__)
        self.name = self._named(f", lanes={self._lanes}")

    def measure(self) -> list[Sample]:
        milliseconds = self._milliseconds(self._lanes)
        return [Sample(self._row, milliseconds, rays_per_second=1e3 * PIXELS**2 / milliseconds)]

    def _milliseconds(self, lanes: int) -> float:
        limit = ITERATIONS.get(self._row, 40)
        command: list[str | Path] = [
            sys.executable,
            "-m",
            "benchmarks.stand_alone",
            self._file,
            str(lanes),
            str(limit),
            self._flags,
            str(self._detail),
        ]
        return float(
            json.loads(run(command, environment=self._runtime.environment(), timeout_s=120, cwd=REPOSITORY))
        )


def main() -> None:
    """Child process: FILE LANES LIMIT FLAGS DETAIL; prints the median of the launches in milliseconds."""
    import numpy as np
    import pyopencl as cl

    file, lanes, limit, flags = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4].split()
    detail = float(sys.argv[5])
    device = cl.get_platforms()[0].get_devices()[0]
    context = cl.Context([device])
    queue = cl.CommandQueue(context)
    kernel = cl.Program(context, file.read_text()).build([f"-DW={lanes}", *CAMERA, *flags]).march
    picture, counts = (cl.Buffer(context, cl.mem_flags.READ_WRITE, PIXELS * PIXELS * 4) for _ in range(2))
    size = np.int32(PIXELS)
    kernel.set_args(picture, size, size, np.int32(limit), np.float32(1), np.float32(detail), counts)
    grid = tuple(-(-PIXELS // side) for side in PACKET[lanes])
    times = []
    for _ in range(1 + LAUNCHES):
        start = time.perf_counter()
        cl.enqueue_nd_range_kernel(queue, kernel, grid, None)
        queue.finish()
        times.append(1e3 * (time.perf_counter() - start))
    print(json.dumps(statistics.median(times[1:])))  # the first launch specialises the kernel


if __name__ == "__main__":
    main()
