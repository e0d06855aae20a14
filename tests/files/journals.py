"""Journals of tiles whose content is known."""

from __future__ import annotations

import numpy as np

IDENTITY = {"scene": "version: 1\n" * 20, "version": "0.1.0", "device": "PoCL cpu", "samples": 4}

CHANNELS = ("R", "Z")

COUNT = 300


def content(index: int, rows: int = 32, columns: int = 32) -> np.ndarray:
    """What a tile must hold: different in every number."""
    numbers = np.arange(2 * rows * columns, dtype=np.float32) + index * 10000
    return numbers.reshape(2, rows, columns)
