"""Pictures that must be the same, bit by bit or nearly."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clfractal.images.framebuffer import Framebuffer
from tests.render.shots import CHANNELS


def same(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Equal bits, which tells 0 from -0."""
    return a.shape == b.shape and np.array_equal(a.view(np.uint32), b.view(np.uint32))


def close(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> None:
    """Colours, points and normals agree to a hundredth in all but 0.5 % of the pixels, and to a thousandth in the mean."""
    chosen = [CHANNELS.index(name) for name in ("R", "G", "B", "A", "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z")]
    difference = np.abs(a[..., chosen] - b[..., chosen])
    assert np.isfinite(difference).all()
    assert (difference.max(axis=-1) > 0.01).mean() < 0.005
    assert difference.mean() < 0.001
    depth = CHANNELS.index("Z")
    assert (np.isfinite(a[..., depth]) != np.isfinite(b[..., depth])).mean() < 0.005


def same_pictures(one: Framebuffer, other: Framebuffer) -> None:
    """All channels bit for bit."""
    assert one.channels == other.channels
    for name in one.channels:
        np.testing.assert_array_equal(one[name].view(np.uint32), other[name].view(np.uint32), name)
