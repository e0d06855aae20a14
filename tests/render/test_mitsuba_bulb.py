"""A rough set along paths beside its own mesh, as Mitsuba 3 sees it: light between bumps finer than a pixel counts too."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal

pytestmark = pytest.mark.light

Floats = npt.NDArray[np.float64]

SIDE, ALBEDO, BOUNCES = 128, 0.8, 6
EYE, TARGET, FOV = [1.25, -2.05, 0.85], [0, 0, -0.02], 56
FORMULA = {"name": "mandelbulb", "iterations": 5}
_THEIRS = """
import json, sys
import mitsuba as mi
import numpy as np
mi.set_variant("scalar_rgb")
told = json.load(sys.stdin)
white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": told["albedo"]}}
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path", "max_depth": told["bounces"] + 2, "rr_depth": 1000},
    "sensor": {
        "type": "perspective", "fov": told["fov"], "fov_axis": "y",
        "to_world": mi.ScalarTransform4f().look_at(origin=told["eye"], target=told["target"], up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": told["side"], "height": told["side"], "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": 16},
    },
    "set": {"type": "ply", "filename": told["mesh"], "face_normals": True, "bsdf": {"type": "twosided", "sided": white}},
    "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1}},
})
np.save(told["to"], np.array(mi.render(scene, seed=1))[..., 1])
"""


def drawn(side: int, samples: int, detail: float | None = None) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Our light, as means over the pixels of a picture of SIDE pixels, and which of these show the set alone."""
    given: dict[str, Any] = {} if detail is None else {"detail": detail}
    scene = clfractal.Scene(
        version=1,
        formula=FORMULA,
        image={"width": side, "height": side},
        renderer={"samples": samples},
        lighting={"mode": "path", "bounces": BOUNCES, "roulette": BOUNCES, **given},
        camera={"position": EYE, "target": TARGET, "fov": FOV},
        background={"top": [1, 1, 1], "bottom": [1, 1, 1]},
        lights=[],
        materials={"white": {"base": {"color": [ALBEDO] * 3}, "specular": {"weight": 0}}},
        material={"name": "white"},
    )
    film = clfractal.render(scene, channels=("R", "G", "B", "A"))
    shape = (SIDE, side // SIDE, SIDE, side // SIDE)
    light, covered = (film[name].astype(np.float64).reshape(shape).mean(axis=(1, 3)) for name in "GA")
    return light, covered == 1


def theirs(folder: Path) -> Floats:
    """Mitsuba's picture of the mesh, of 4.5 million triangles."""
    scene = folder / "bulb.yaml"
    scene.write_text(
        f"version: 1\nformula: {json.dumps(FORMULA)}\ncamera: {{position: {EYE}}}\nrenderer: {{type: volume}}\n"
    )
    mesh, picture = folder / "bulb.ply", folder / "theirs.npy"
    command = [sys.executable, "-m", "clfractal", "mesh", str(scene), "-o", str(mesh), "--resolution", "512"]
    subprocess.run(command, check=True, timeout=300)
    told = {
        "albedo": ALBEDO,
        "bounces": BOUNCES,
        "fov": FOV,
        "eye": EYE,
        "target": TARGET,
        "side": SIDE,
        "mesh": str(mesh),
        "to": str(picture),
    }
    subprocess.run(
        [sys.executable, "-c", _THEIRS], input=json.dumps(told), text=True, check=True, timeout=300
    )
    return np.asarray(np.load(picture), np.float64)


@pytest.fixture(scope="module")
def beside(tmp_path_factory: pytest.TempPathFactory) -> Floats:
    return theirs(tmp_path_factory.mktemp("bulb"))


@pytest.mark.parametrize(("side", "samples"), [(128, 64), (512, 4)])
def test_the_bulb_is_as_bright_as_its_mesh(side: int, samples: int, beside: Floats) -> None:
    light, covered = drawn(side, samples)
    assert covered.mean() > 0.4
    assert light[covered].mean() == pytest.approx(beside[covered].mean(), rel=0.03)


def test_its_old_look_was_not(beside: Floats) -> None:
    """Rays that leave the surface three pixels above it never see what is between its bumps."""
    light, covered = drawn(128, 16, detail=1)
    assert light[covered].mean() > 1.1 * beside[covered].mean()
