"""A kernel that writes beyond its buffer: `python -m tests.portability.canary` shows whether it is seen."""

from __future__ import annotations

import pyopencl as cl

from clfractal.device.program import build, math_flags
from clfractal.device.select import choose, is_simulator

_TEXT = "__kernel void k(__global int *a) { a[get_global_id(0) + 4] = 1; }\n"


def main() -> None:
    """Run the faulty kernel, on a simulator only."""
    device = choose()
    if not is_simulator(device.info):
        raise SystemExit("only a simulator survives this for certain")
    kernel = build(device, _TEXT, flags=math_flags("float32"), isolated=False).kernel("k")
    buffer = cl.Buffer(device.context, cl.mem_flags.READ_WRITE, 32)
    kernel.set_args(buffer)
    cl.enqueue_nd_range_kernel(device.queue, kernel, (8,), (1,))
    device.queue.finish()


if __name__ == "__main__":
    main()
