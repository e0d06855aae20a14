"""How many tiles go into a bundle: about a second of work, by measured speed, and less towards the end."""

from __future__ import annotations

import math

SECONDS = 1.0
"""Work of a bundle: long beside what a task costs, short beside what is lost with a worker."""
# Less is not worth a task, seconds.
_LEAST_SECONDS = 0.1
# A bundle's result, bytes.
_LARGEST = 1 << 25
# Tiles of the first bundles, whose speed is not known.
_FIRST = 8
# How much of what is believed of the speed a second of measured work replaces.
_WEIGHT = 0.5


class Pace:
    """The measured speed of workers, in seconds for a sample of all pixels of a tile."""

    def __init__(self) -> None:
        self._seconds: float | None = None

    def learn(self, tiles: int, samples: int, seconds: float) -> None:
        """Adds a measurement: what one worker took for some tiles, without compiling."""
        found = seconds / max(tiles * samples, 1)
        if self._seconds is None:
            self._seconds = found
        else:
            weight = 1 - (1 - _WEIGHT) ** min(seconds / SECONDS, 4.0)
            self._seconds += weight * (found - self._seconds)

    def bundle(self, samples: int, left: int, workers: int, tile_bytes: int) -> int:
        """Tiles of the next bundle, at least 1.

        Args:
            samples: of each pixel.
            left: tiles that are not given out yet, at least 1; the last ones are shared out, so that all end together.
            workers: how many there are.
            tile_bytes: what a tile's result takes.
        """
        share = math.ceil(left / max(2 * workers, 1))
        most = max(_LARGEST // max(tile_bytes, 1), 1)
        if self._seconds is None:
            return max(min(share, _FIRST, most), 1)
        each = max(self._seconds * samples, 1e-9)
        wanted = min(max(share, math.ceil(_LEAST_SECONDS / each)), math.floor(SECONDS / each))
        return max(min(wanted, most, left), 1)
