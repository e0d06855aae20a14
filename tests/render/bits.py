"""Pictures that must be the same, bit by bit or nearly."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clfractal.images.framebuffer import Framebuffer


def same(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Equal bits, which tells 0 from -0."""
    return a.shape == b.shape and np.array_equal(a.view(np.uint32), b.view(np.uint32))


def same_pictures(one: Framebuffer, other: Framebuffer) -> None:
    """All channels bit for bit."""
    assert one.channels == other.channels
    for name in one.channels:
        np.testing.assert_array_equal(one[name].view(np.uint32), other[name].view(np.uint32), name)
