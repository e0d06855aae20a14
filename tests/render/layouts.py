"""Layouts of several views."""

from __future__ import annotations

from typing import Any

from clfractal.scene.model import Scene
from tests import scenes
from tests.render.shots import BALL

# A surface, a cut plane and a volume, as the thesis's figure 9 has them.
VIEWS: list[dict[str, Any]] = [
    {},
    {"renderer": {"type": "cut_plane", "plane": {"width": 3, "height": 3}}, "background": "transparent"},
    {
        "renderer": {"type": "volume", "box": {"size": 2.4}, "resolution": 32, "samples": 2},
        "camera": {"projection": "orthographic", "position": [1, -3, 1], "height": 3},
        "material": {"color": [0.2, 0.6, 0.3]},
    },
]

GAP = [0.25, 0.5, 0.125]


def scene_of(views: list[dict[str, Any]], size: tuple[int, int] = (91, 50), **layout: Any) -> Scene:
    camera = {"position": [0.5, -3, 1]}
    return scenes.scene_of(BALL, camera, size, layout={"views": views, "background": GAP, **layout})
