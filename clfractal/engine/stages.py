"""What a launch renders, and the waves in which its pixels go from stage to stage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.device.select import Device
from clfractal.images.tiles import TILE
from clfractal.integrators.kernel import STAGE_NUMBERS, STATE_PADDING, WAVE_NUMBERS, Over, TileKernel
from clfractal.integrators.waves import rays_group

# Tiles of the largest launch: 1024 of them are a megapixel.
CAPACITY = 512
# A wave is the pixels of a launch that are taken from stage to stage at a time: as many as need so many bytes. On a
# processor the next stage should find them in the caches; a GPU wants many pixels at a time.
WAVE_BYTES = {"cpu": 24 << 20, "gpu": 512 << 20}
# Numbers that every kernel is given last, or before those of waves: the packets and samples of a launch, and its mode.
_SPAN_NUMBERS = 5


@dataclass(frozen=True, slots=True)
class Span:
    """What one launch renders.

    Attributes:
        tiles: indices in the view's grid of tiles.
        packets: first packet of each tile, and the one after the last.
        samples: first sample of each pixel, and the one after the last.
        mode: PASS_KEEP and PASS_ADD, as bits.
        kept_places: of each tile, its number among those that are kept for later passes.
        slot: which of the sets of buffers the results go into.
    """

    tiles: npt.NDArray[np.int32]
    packets: tuple[int, int]
    samples: tuple[int, int]
    mode: int
    kept_places: npt.NDArray[np.int32]
    slot: int


@dataclass(frozen=True, slots=True)
class Wave:
    """What is taken from stage to stage at a time.

    Attributes:
        packets: at most so many: whole tiles, or a part of one. A launch of a kernel without stages is one wave.
        turns: most rays of a pixel in the queue.
        sizes: bytes of the buffers that keep its pixels' state, their rays, and what these have met; empty without stages.
    """

    packets: int
    turns: int
    sizes: list[int]


def wave_of(kernel: TileKernel, device: Device, capacity: int) -> Wave:
    """The waves in launches of at most `capacity` tiles."""
    lanes, per_tile = kernel.plan.lanes, TILE * TILE // kernel.plan.lanes
    if not kernel.waves:
        return Wave(capacity * per_tile, 0, [])
    needs, width = kernel.wave_needs(), np.dtype(kernel.precision).itemsize
    each = width * lanes * (needs.state + (needs.ray + needs.met) * needs.turns)
    packets = max(WAVE_BYTES.get(device.info.kind, WAVE_BYTES["cpu"]) // each, 1)
    if packets >= per_tile:
        packets = min(packets // per_tile, capacity) * per_tile
    state = (packets * lanes + STATE_PADDING) * width
    queue = (packets * lanes * needs.turns + STATE_PADDING) * width
    return Wave(packets, needs.turns, [state * needs.state, queue * needs.ray, queue * needs.met])


def number_count(kernel: TileKernel) -> int:
    """How many numbers a launch sets."""
    return _SPAN_NUMBERS + (len(WAVE_NUMBERS) + len(STAGE_NUMBERS) if kernel.waves else 0)


def group_of(over: Over, lanes: int, group: int) -> tuple[int, ...]:
    """The size of a stage's work-groups, of which those over pixels have `group` work-items."""
    if over == "rays":
        return rays_group(lanes)
    if over.startswith("shares") and lanes > 1:
        group = 1
    return (group, 1) if over.endswith("pixels") else (group,)
