"""Layouts of several views."""

from __future__ import annotations

from typing import Any

from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from tests.render.shots import BALL
from tests.scenes import BALL_ITERATIONS

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
    return load_scene(
        {
            "version": 1,
            "formula": {"inline": BALL, "iterations": BALL_ITERATIONS},
            "image": {"width": size[0], "height": size[1]},
            "camera": {"position": [0.5, -3, 1]},
            "layout": {"views": views, "background": GAP, **layout},
        }
    )
