"""Exposure is how light a screen shows a picture: what an EXR holds does not depend on it, bright sparks limited or not."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

import clfractal
from clfractal.files.exr import read_exr
from clfractal.scene.surface import SurfaceRenderer
from tests.shell import Ended, InProcess

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 40, height: 36}
camera: {position: [0, -3, 0]}
environment: {name: studio, rays: 8, intensity: 3}
material: {reflection: 0.6}
renderer: {type: surface, bounces: 2, samples: 2, firefly_limit: 0.4}
output: {precision: {R: float, G: float, B: float}}
"""


def colors(clf: InProcess, name: str, *settings: str) -> npt.NDArray[np.float32]:
    """R, G and B of an EXR, which is rendered beside a PNG."""
    options = [word for setting in settings for word in ("--set", setting)]
    outputs = ("-o", f"{name}.exr", "-o", f"{name}.png", "--quiet")
    assert clf("render", "scene.yaml", *outputs, *options) == Ended(0, "", "")
    planes = read_exr(f"{name}.exr")[0]
    return np.stack([planes[channel] for channel in "RGB"])


def test_files_of_the_shell(clf: InProcess) -> None:
    plain = colors(clf, "plain")
    free = colors(clf, "free", "renderer.firefly_limit=null")
    assert (free > plain).mean() > 0.05  # the limit is one
    mean = []
    for number, stops in enumerate((-3, 0, 1.5, 4)):
        found = colors(clf, f"a{number}", f"output.exposure={stops}")
        np.testing.assert_array_equal(found.view(np.uint32), plain.view(np.uint32))
        with Image.open(f"a{number}.png") as picture:
            mean.append(float(np.asarray(picture).mean()))
    assert mean == sorted(set(mean))


def test_the_limit_is_that_of_the_scenes_own_light() -> None:
    """What a mirror or the environment brings is never lighter, whatever the exposure."""
    black = "material.diffuse=0", "material.ambient=0", "material.specular=0", "material.reflection=1"
    for limit, stops in ((0.25, -2), (0.25, 2), (1.0, 3)):
        changes = [*black, f"renderer.firefly_limit={limit}", f"output.exposure={stops}"]
        scene = clfractal.load_scene(SCENE, overrides=changes)
        assert isinstance(scene.renderer, SurfaceRenderer)
        film = clfractal.render(scene)
        hit = film["A"] == 1
        brightest = max(float(film[name][hit & np.isfinite(film["Z"])].max()) for name in "RGB")
        assert brightest == pytest.approx(limit, rel=0.05)
