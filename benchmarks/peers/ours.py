"""What we render of a settings file, through the same rays as the other program."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.truth.picture import see
from clfractal.camera.views import scene_view
from clfractal.engine.engine import Engine
from clfractal.exchange.mandelbulber import Imported, imported
from clfractal.exchange.placing import Placing
from clfractal.exchange.settings import Settings, read_settings
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

Floats = npt.NDArray[np.float64]


def read(path: Path) -> tuple[Imported, Settings]:
    """A file as a scene, and its settings as they stand there.

    Raises:
        FileError: it cannot be opened.
    """
    return imported(read_settings(path)), read_settings(path)


def calm_waters(found: Imported) -> list[str]:
    """The names of waters that are compared without waves, which are others in ours: those that the eye is above then."""
    eye = np.array(found.scene["camera"]["position"])

    def is_below(water: dict[str, Any]) -> bool:
        up = np.array(water.get("normal", (0, 0, 1)), float)
        return float(up @ (eye - water["position"])) > 0

    objects = found.scene.get("objects", {})
    return [name for name, each in objects.items() if each["type"] == "water" and is_below(each)]


def bare(found: Imported, side: int) -> Scene:
    """The scene of one sample to a pixel and no light, whose first `side` columns and rows have the other program's rays.

    Their rays go through the corners of pixels at the top left, ours through middles. A picture that is one pixel
    larger, at as many pixels to a degree, has a pixel where theirs has a corner.
    """
    data: dict[str, Any] = {
        key: value for key, value in found.scene.items() if key in ("version", "formula", "camera", "objects")
    }
    camera = {key: data["camera"][key] for key in ("position", "target", "up", "fov")}
    half = math.tan(math.radians(camera["fov"] / 2)) * (side + 1) / side
    camera["fov"] = math.degrees(2 * math.atan(half))
    calm = calm_waters(found)
    objects = {
        name: {key: value for key, value in each.items() if key != "material"}
        | ({"waves": {"height": 0}} if name in calm else {})
        for name, each in data.get("objects", {}).items()
    }
    data |= {
        "camera": camera,
        "image": {"width": side + 1, "height": side + 1},
        "lights": [],
        # As much finer as theirs is.
        "renderer": {
            "samples": 1,
            "detail": 0.1,
            "max_steps": 4000,
            **{key: value for key, value in found.scene["renderer"].items() if key == "bounds"},
        },
        "material": {"ambient": 0, "specular": 0},
    }
    if objects:
        data["objects"] = objects
    return load_scene(data)


def rays(scene: Scene, side: int, *, mirrored: bool, placing: Placing | None = None) -> tuple[Floats, Floats]:
    """Directions of length 1 through the other program's pixels, shape (side, side, 3), and the eye, in its own space."""
    view = scene_view(scene)
    assert view.eye is not None
    steps = np.arange(side)
    across = (steps + 0.5) / (side + 1) - 0.5
    on_plane = (
        view.center
        + (across * view.width)[None, :, None] * view.side
        - (across * view.height)[:, None, None] * view.up
    )
    directions = on_plane - view.eye
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    flip = np.array([1.0, 1.0, -1.0 if mirrored else 1.0])
    directions, eye = directions * flip, np.asarray(view.eye, float) * flip
    if placing is None:
        return directions, eye
    turn = np.array(placing.turn)
    return directions @ turn, eye @ turn + placing.position


def depths(scene: Scene, side: int, engine: Engine) -> Floats:
    """Distances along the rays to what was hit, shape (side, side); inf where nothing was.

    Raises:
        DeviceError, KernelBuildError: the device failed.
    """
    seen = see(scene, engine)
    return seen.t.reshape(side + 1, side + 1)[:side, :side]
