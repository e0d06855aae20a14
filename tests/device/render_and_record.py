"""Renders a small picture of each kind, and leaves the texts of all programs that it takes: run by test_library_calls."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import clfractal
from clfractal.device import isolate

_HAST = {"name": "hast", "iterations": 20}
_SUN = [{"direction": [0.5, 0.6, -0.62], "shadow": True}]
_FIRST: dict[str, Any] = {
    "version": 1,
    "image": {"width": 16, "height": 16},
    "camera": {"position": [0, -3, 0]},
    "lights": _SUN,
}
SCENES: tuple[dict[str, Any], ...] = (
    # By a scalar rule, and by the Jacobian.
    {**_FIRST, "formula": {"name": "mandelbulb", "iterations": 20}},
    {**_FIRST, "formula": _HAST},
    {
        **_FIRST,
        "formula": _HAST,
        "renderer": {
            "type": "volume",
            "resolution": 32,
            "transfer": {"opacity": [{"at": 0.2, "opacity": 0}, {"at": 0.8, "opacity": 1}]},
        },
    },
    {
        "version": 1,
        "image": {"width": 16, "height": 16},
        "camera": {},
        "formula": _HAST,
        "renderer": {"type": "cut_plane", "plane": {"width": 4, "height": 4}},
    },
)


def main() -> None:
    folder = Path(sys.argv[1])
    run = isolate.run

    def recording(job: str, device: Any, arguments: Mapping[str, Any], **options: Any) -> Any:
        if "text" in arguments:
            number = len(list(folder.glob("*.cl")))
            (folder / f"{number}.cl").write_text(arguments["text"], encoding="utf-8")
        return run(job, device, arguments, **options)

    # Programs are compiled in child processes, since nothing is in the cache.
    isolate.run = recording
    for scene in SCENES:
        clfractal.render(clfractal.load_scene(scene))


if __name__ == "__main__":
    main()
