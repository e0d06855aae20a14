"""A picture of each renderer that is made in passes."""

from __future__ import annotations

from typing import Any

from clfractal.scene.model import Scene
from tests.render.shots import BALL, PERSPECTIVE
from tests.scenes import scene_of

SIZE = (72, 48)


RENDERERS: dict[str, dict[str, Any]] = {
    "surface": {},
    "volume": {"type": "volume", "resolution": 32},
    "fog": {
        "type": "volume",
        "resolution": 32,
        "value": "coverage",
        "transfer": {"opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": 0.5}]},
    },
    "cut_plane": {"type": "cut_plane", "plane": {"width": 3, "height": 2}},
}


def scene_with(kind: str, size: tuple[int, int] = SIZE, **settings: object) -> Scene:
    lights = [{"direction": [-1, 1, -1], "angular_size": 4, "rays": 2}]
    renderer = {**RENDERERS[kind], "samples": 16, **settings}
    formula = {"name": "hast", "iterations": 12} if kind == "cut_plane" else BALL
    return scene_of(formula, PERSPECTIVE, size, renderer=renderer, lights=lights)
