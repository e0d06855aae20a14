"""Sets of glass that are joined: one body, whose boundary is where the joined set's is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.render.glass_scenes import BODIES, FAR_OFF, Floats, colors_of, glass, scene
from tests.render.path_scenes import BALL, GREY, path, scene_of
from tests.variants import one_of

pytestmark = pytest.mark.light

HOLES: dict[str, Any] = {
    "hole": {"type": "sphere", "radius": 0.5, "position": [0.2, -0.9, 0.3], "join": "cut"},
    "hollow": {
        "type": "formula",
        "formula": BALL,
        "scale": 0.4,
        "position": [-0.5, -0.7, 0.2],
        "join": "cut",
    },
    "drop": {"type": "sphere", "radius": 0.4, "position": [0.9, -0.5, -0.4], "join": "smooth_union"},
}


def joined(objects: dict[str, Any], material: dict[str, Any], **sections: Any) -> Any:
    return scene_of(
        objects=objects,
        materials={"glass": material},
        material={"name": "glass"},
        lighting=path(64),
        image={"width": 96, "height": 96},
        **{"background": GREY, **sections},
    )


@pytest.mark.parametrize("roughness", one_of(0, 0.4))
def test_glass_before_white_is_not_seen(roughness: float) -> None:
    """Also where something is cut out of it, and flows into it."""
    camera = {"position": [0.6, -4, 1], "fov": 36}
    colors = colors_of(joined(HOLES, glass(roughness), camera=camera), 32)
    assert abs(colors.mean() - 1) < 0.01
    assert np.percentile(colors, 2) > 0.8


@pytest.mark.combination
def test_what_is_left_of_a_set_is_as_an_object_of_that_shape() -> None:
    """A ball of which only a box is left is a box of glass: the same light comes through it, dimmed by the same ways."""
    clear = glass(0, 1.4, color=[0.7, 0.4, 0.2], depth=0.5)
    box = {**BODIES["box"], "size": [1, 0.8, 0.6]}
    camera = {"position": [0, -4, 0], "target": [0, 0, 0], "fov": 24}
    left = colors_of(joined({"box": {**box, "join": "intersection"}}, clear, camera=camera), 24)
    beside = scene(
        {"box": {**box, "material": "glass"}},
        {"glass": clear},
        camera={"position": [0, 40, 0], "target": [0, 44, 0], "fov": 24},
        bounces=64,
    ).model_copy(update={"image": joined({}, clear).image})
    whole: Floats = colors_of(beside, 24)
    assert FAR_OFF["position"] == [0, 40, 0]
    np.testing.assert_allclose(left.mean(axis=(0, 1)), whole.mean(axis=(0, 1)), rtol=0.01)
    # The edges of a set are a footprint wide: at a quarter of this size of picture it is 8 %, at twice it 2 %.
    middle = (slice(34, 62), slice(34, 62))
    np.testing.assert_allclose(left[middle].mean(axis=(0, 1)), whole[middle].mean(axis=(0, 1)), rtol=0.05)
