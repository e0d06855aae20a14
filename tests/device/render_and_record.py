"""Renders a small picture of each kind; leaves each program's text and what is kept of it, for test_library_calls."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import clfractal
from clfractal.device import cache, program

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
    build = program.build

    def recording(device: Any, text: str, **options: Any) -> program.Program:
        built = build(device, text, **options)
        name = program._key(
            device, *program._as_compiled(device, text, options["flags"]), options.get("warm", ())
        )
        (folder / f"{name}.cl").write_text(text, encoding="utf-8")
        (folder / f"{name}.kept").write_bytes(cache.load_blob(name) or b"")
        return built

    program.build = recording
    for scene in SCENES:
        clfractal.render(clfractal.load_scene(scene))


if __name__ == "__main__":
    main()
