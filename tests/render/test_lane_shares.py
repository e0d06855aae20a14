"""Lanes that are gathered from several packets: the same bits as without, whatever their paths meet."""

from __future__ import annotations

from typing import Any

import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.engine import drawing
from clfractal.integrators import surface
from clfractal.integrators.kernel import LANE_SHARE
from clfractal.scene.model import Scene
from tests.render.bits import same_pictures
from tests.render.media import keep_media
from tests.render.shots import shoot
from tests.scenes import scene_of
from tests.variants import one_of

LANES = 16
ROUGH = {"roughness": {"by": "normal", "range": [-1, 1], "curve": [[0, 0.1], [1, 0.6]]}}
MATERIALS: dict[str, Any] = {
    "relief": {
        "specular": ROUGH,
        "bump": {"height": {"by": "trap", "trap": {"shape": "plane"}, "curve": [[0, 0], [1, 0.03]]}},
        "thin_film": {"weight": 1, "thickness": 0.4},
    },
    "prism": {"transmission": {"weight": 1, "dispersion_scale": 1}, "specular": {"roughness": 0.1}},
    "wax": {"subsurface": {"weight": 1, "radius": 0.1}},
    "tiles": {"specular": ROUGH, "coat": {"weight": 0.5}},
}
OBJECTS: dict[str, Any] = {
    "floor": {"type": "plane", "position": [0, 0, -1.2], "material": "tiles"},
    "ball": {"type": "sphere", "position": [-1.3, -0.8, -0.7], "radius": 0.5, "material": "prism"},
    "candle": {"type": "cylinder", "position": [1.3, -0.6, -0.6], "radius": 0.3, "material": "wax"},
    "cloud": {
        "type": "volume",
        "file": "ball.nrrd",
        "position": [0.3, -1.2, 0.5],
        "transfer": {
            "opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": 0.3}],
            "color": [{"at": 0, "color": [0.9, 0.9, 0.9]}],
        },
    },
}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return scene_of(
        {"name": "mandelbulb", "iterations": 5},
        {"position": [0.4, -4.2, 0.6], "fov": 40},
        (70, 45),
        folder=keep_media(tmp_path_factory.mktemp("media")),
        lighting={"mode": "path", "bounces": 8},
        renderer={"samples": 2},
        lights=[{"type": "point", "position": [2, -3, 3], "falloff": "inverse_square", "intensity": 8}],
        background={"top": [0.3, 0.4, 0.6], "bottom": [0.2, 0.2, 0.2]},
        materials=MATERIALS,
        material={"name": "relief"},
        objects=OBJECTS,
    )


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_pictures_do_not_depend_on_how_many_are_gathered(
    device: Device, scene: Scene, precision: Precision, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A share of one packet has no other lanes to gather."""
    assert LANE_SHARE > LANES
    gathered = shoot(scene, device, precision, lanes=LANES)
    for module in (drawing, surface):
        monkeypatch.setattr(module, "LANE_SHARE", LANES)
    same_pictures(gathered, shoot(scene, device, precision, lanes=LANES))
    assert gathered["R"].max() > 0.1
