"""Pictures that must be the same, bit by bit or nearly."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device, has_float64
from clfractal.device.tune import accepted_lanes
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.render.shots import CHANNELS, shoot, stacked


def same(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Equal bits, which tells 0 from -0."""
    return a.shape == b.shape and np.array_equal(a.view(np.uint32), b.view(np.uint32))


def same_pictures(one: Framebuffer, other: Framebuffer) -> None:
    """All channels bit for bit."""
    assert one.channels == other.channels
    for name in one.channels:
        np.testing.assert_array_equal(one[name].view(np.uint32), other[name].view(np.uint32), name)


def close(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32], off: float = 0.005) -> None:
    """Colours, points, normals agree to a hundredth in nearly all pixels, and to a thousandth in the mean."""
    chosen = [CHANNELS.index(name) for name in ("R", "G", "B", "A", "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z")]
    difference = np.abs(a[..., chosen] - b[..., chosen])
    assert np.isfinite(difference).all()
    assert (difference.max(axis=-1) > 0.01).mean() < off
    assert difference.mean() < 0.001
    depth = CHANNELS.index("Z")
    assert (np.isfinite(a[..., depth]) != np.isfinite(b[..., depth])).mean() < off


def alike_by_lanes(
    scene: Scene,
    device: Device,
    names: tuple[str, ...] = ("R", "G", "B"),
    *,
    share: float = 0.98,
    mean: float = 0.01,
    apart: float = np.inf,
    **within: Any,
) -> None:
    """Packets show what single lanes show, and another number type the same light.

    Args:
        share: of the pixels that are the same `within` a tolerance. Where products are fused with sums
            rounding sends some paths another way; a mistake in one lane of 16 shows in more pixels.
        mean: by how large a part of it the whole light may differ.
        apart: by how much pixels may differ in the mean.
    """
    one = stacked(shoot(scene, device, channels=names, lanes=1), names)
    assert one.max() > 0.05
    for each in accepted_lanes(device, "float32"):
        many = stacked(shoot(scene, device, channels=names, lanes=each), names)
        assert np.isclose(one, many, **{"rtol": 1e-3, "atol": 1e-4, **within}).all(axis=-1).mean() >= share
        assert many.mean() == pytest.approx(one.mean(), rel=mean)
        assert np.abs(one - many).mean() < apart
    if has_float64(device.info):
        double = stacked(shoot(scene, device, "float64", channels=names, lanes=1), names)
        assert double.mean() == pytest.approx(one.mean(), rel=0.02)
