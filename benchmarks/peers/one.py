"""One file: its record, in a process of its own, which may be ended when it takes too long."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.peers import causes, ours, theirs
from benchmarks.peers.compare import likeness
from clfractal.engine.engine import Engine
from clfractal.errors import ClfractalError
from clfractal.exchange.placing import placing_of
from clfractal.exchange.view import is_mirrored


def record(path: Path, side: int, seconds: float, keep: Path | None = None) -> dict[str, Any]:
    """What is known of a file.

    Args:
        side: of the picture, pixels.
        seconds: what the other program may take.
        keep: a folder that depths are written to, `NAME.npz` with `theirs` and `ours`; None: they are not.
    """
    found: dict[str, Any] = {"stage": "open", "error": None, "dropped": [], "habits": []}
    try:
        scene, settings = ours.read(path)
        calm = ours.calm_waters(scene)
        found |= {"dropped": causes.dropped(scene), "habits": causes.habits(settings), "calm": bool(calm)}
        bare = ours.bare(scene, side)
        found["stage"] = "theirs"
        rays, eye = ours.rays(bare, side, mirrored=is_mirrored(settings), placing=placing_of(settings))
        start = time.perf_counter()
        numbers = [int(name.rpartition(" ")[2]) for name in calm]
        seen = theirs.depths(path, settings.main, side, rays, eye, seconds, numbers)
        found["theirs_s"] = round(time.perf_counter() - start, 2)
        found["stage"] = "ours"
        start = time.perf_counter()
        own = ours.depths(bare, side, Engine())
        found["ours_s"] = round(time.perf_counter() - start, 2)
    except (ClfractalError, theirs.TheirsError) as error:
        return found | {"error": str(error)}
    if keep is not None:
        import numpy as np

        keep.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(keep / f"{path.stem}.npz", theirs=seen.t, ours=own)
    measured = likeness(seen.t, own)
    return found | {
        "stage": "done",
        "covered": measured.covered,
        "union": measured.union,
        "middle": _finite(measured.middle),
        "ninth": _finite(measured.ninth),
        "spread": _finite(seen.spread),
    }


def _finite(value: float) -> float | None:
    return value if value == value else None


def main() -> None:
    path, side, seconds, keep = sys.argv[1:]
    print(json.dumps(record(Path(path), int(side), float(seconds), Path(keep) if keep else None)))


if __name__ == "__main__":
    main()
