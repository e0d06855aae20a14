"""A scene for each kind of data that a job carries."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from clfractal.scene.model import Scene
from tests import scenes
from tests.environment_maps import write_map
from tests.render.layouts import VIEWS
from tests.render.shots import BALL, PERSPECTIVE
from tests.render.volumes import keep, middles

SIZE = (48, 40)


def scene_of(folder: Path, **sections: Any) -> Scene:
    usual: dict[str, Any] = {"formula": BALL, "camera": PERSPECTIVE, "size": SIZE}
    return scenes.scene_of(folder=folder, **{**usual, **sections})


def lit_by_a_file(folder: Path) -> Scene:
    write_map(folder / "sky.exr", np.random.default_rng(3).random((16, 32, 3), dtype=np.float32))
    return scene_of(
        folder,
        environment={"file": "sky.exr", "rays": 2},
        renderer={"samples": 4, "noise": 0.05, "min_samples": 4},
    )


def of_a_file(folder: Path) -> Scene:
    places = middles((24, 24, 24), [-1.2] * 3, [0.1] * 3)
    ball = np.clip(1.5 - np.linalg.norm(places, axis=-1), 0, 1).astype(np.float32)
    keep(folder / "ball.nrrd", ball, [-1.2] * 3, [0.1] * 3)
    fog = {"opacity": [{"at": 0.3, "opacity": 0}, {"at": 1, "opacity": 0.6}]}
    return scene_of(folder, renderer={"type": "volume", "file": "ball.nrrd", "transfer": fog})


def with_a_texture(folder: Path) -> Scene:
    codes = np.random.default_rng(5).integers(0, 256, (5, 8, 3), dtype=np.uint8)
    Image.fromarray(codes).save(folder / "tile.png")
    oak = {"base": {"color": {"texture": "tile.png"}, "weight": {"by": "trap"}}}
    both = {"blend": ["oak", "clay"], "mask": {"by": "normal"}}
    return scene_of(
        folder,
        lighting={"mode": "path", "bounces": 1},
        materials={"oak": oak, "clay": {}, "both": both},
        material={"name": "both"},
    )


SCENES: dict[str, Callable[[Path], Scene]] = {
    "surface": lambda folder: scene_of(folder, cut_planes=[{"plane": {"width": 3}, "opacity": 0.5}]),
    "environment": lit_by_a_file,
    "texture": with_a_texture,
    "volume": of_a_file,
    "cut plane": lambda folder: scene_of(folder, renderer={"type": "cut_plane"}),
    "chain": lambda folder: scene_of(folder, formula={"name": "hast", "iterations": 8}),
    "layout": lambda folder: scene_of(folder, layout={"views": VIEWS, "gap": 2}),
    "stereo": lambda folder: scene_of(folder, stereo={"mode": "anaglyph", "fit": "auto"}),
    "layout for two eyes": lambda folder: scene_of(
        folder, layout={"views": VIEWS[:2]}, stereo={"mode": "over_under"}
    ),
}
