"""Maps of surroundings in files, for scenes that name one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clfractal.files.exr import write_exr


def write_map(path: Path, value: float = 0.5, size: tuple[int, int] = (8, 4)) -> Path:
    path.parent.mkdir(exist_ok=True)
    plane = np.full(size[::-1], value, np.float32)
    bands = [dict.fromkeys("RGB", plane)]
    write_exr(path, bands, display=size, region=(0, 0, *size), channels="RGB", half="")
    return path
