"""Which device made which tile, of a picture that several devices render."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

MOST = 250
"""Devices that are told apart in one picture; all further ones count as the last."""
# A longer list of tiles is not written: a header should stay small beside its picture.
_LONGEST_LIST = 1 << 20


@dataclass(frozen=True, slots=True)
class RenderDevice:
    """A device that makes tiles: its index as in `--device 0:0`, its name, and a short name of its `DeviceInfo.key`."""

    index: str
    name: str
    key: str

    @classmethod
    def of(cls, index: str, name: str, key: str) -> RenderDevice:
        """With the whole key, of which a digest is kept."""
        return cls(index, name, hashlib.sha256(key.encode()).hexdigest()[:16])

    def as_data(self) -> dict[str, str]:
        """Plain data."""
        return {"index": self.index, "name": self.name, "key": self.key}

    def __str__(self) -> str:
        return f"{self.index} {self.name}".strip()


class Provenance:
    """The devices of a picture's tiles, numbered from 1 as they come; 0 is the device of a picture that one made alone."""

    def __init__(self, tiles: int) -> None:
        self.known: list[RenderDevice] = []
        self.of_tiles = np.zeros(tiles, np.uint8)

    def number(self, device: RenderDevice) -> int:
        """The number of a device, a new one if it has none."""
        if device in self.known:
            return self.known.index(device) + 1
        if len(self.known) < MOST:
            self.known.append(device)
        return len(self.known)

    def put(self, tiles: npt.NDArray[np.int32] | int, device: RenderDevice) -> None:
        """Says who made tiles."""
        self.of_tiles[tiles] = self.number(device)

    def counts(self, done: npt.NDArray[np.bool_]) -> dict[RenderDevice, int]:
        """How many of the finished tiles each device made; of devices that made none nothing is told."""
        found = np.bincount(self.of_tiles[done], minlength=len(self.known) + 1)
        return {device: int(count) for device, count in zip(self.known, found[1:], strict=True) if count}

    def header(self, done: npt.NDArray[np.bool_]) -> dict[str, Any]:
        """Entries of a picture's header; none if one device made it alone.

        `devices` has a line for each device, and `tileDevices` the numbers of these lines, counted from 1, for all tiles
        from the top left, row by row: `2*1 14*2` are two tiles of the first and fourteen of the second.
        """
        if not self.known:
            return {}
        counts = self.counts(done)
        lines = [
            f"{number}: {device}: {_tiles(counts.get(device, 0))}"
            for number, device in enumerate(self.known, 1)
        ]
        alone = int(np.count_nonzero(done & (self.of_tiles == 0)))
        if alone:
            lines.insert(0, f"0: one device alone, in an earlier run: {_tiles(alone)}")
        runs = _runs(self.of_tiles)
        return {"devices": "\n".join(lines)} | ({"tileDevices": runs} if len(runs) <= _LONGEST_LIST else {})


def lines_of(counts: Iterable[dict[RenderDevice, int]]) -> str:
    """The same lines for a picture that is made of several; empty if one device made them alone."""
    total: dict[RenderDevice, int] = {}
    for each in counts:
        for device, tiles in each.items():
            total[device] = total.get(device, 0) + tiles
    return "\n".join(
        f"{number}: {device}: {_tiles(tiles)}" for number, (device, tiles) in enumerate(total.items(), 1)
    )


def _tiles(count: int) -> str:
    return f"{count} tile" if count == 1 else f"{count} tiles"


def _runs(numbers: npt.NDArray[np.uint8]) -> str:
    if not len(numbers):
        return ""
    starts = np.flatnonzero(np.concatenate([[True], numbers[1:] != numbers[:-1]]))
    lengths = np.diff(np.append(starts, len(numbers)))
    return " ".join(
        f"{length}*{numbers[start]}" for start, length in zip(starts.tolist(), lengths.tolist(), strict=True)
    )
