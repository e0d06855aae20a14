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
from tests.render.mitsuba import Floats, by_mitsuba

pytestmark = pytest.mark.light

Way = list[float] | None

SIDE, ALBEDO, BOUNCES = 128, 0.8, 6
EYE, TARGET, FOV = [1.25, -2.05, 0.85], [0, 0, -0.02], 56
SUN: Way = [0.3, 0.5, -0.8]
FORMULA = {"name": "mandelbulb", "iterations": 5}


def drawn(
    side: int, samples: int, sun: Way = None, detail: float | None = None
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Our light of a sun or a white sky, as means over a picture of SIDE pixels, and which of these show the set alone."""
    given: dict[str, Any] = {} if detail is None else {"detail": detail}
    sky = [1, 1, 1] if sun is None else [0, 0, 0]
    lamps = [] if sun is None else [{"type": "directional", "direction": sun, "intensity": 1}]
    scene = clfractal.Scene(
        version=1,
        formula=FORMULA,
        image={"width": side, "height": side},
        renderer={"samples": samples},
        lighting={"mode": "path", "bounces": BOUNCES, "roulette": BOUNCES, **given},
        camera={"position": EYE, "target": TARGET, "fov": FOV},
        background={"top": sky, "bottom": sky},
        lights=lamps,
        materials={"white": {"base": {"color": [ALBEDO] * 3}, "specular": {"weight": 0}}},
        material={"name": "white"},
    )
    film = clfractal.render(scene, channels=("R", "G", "B", "A"))
    shape = (SIDE, side // SIDE, SIDE, side // SIDE)
    light, covered = (film[name].astype(np.float64).reshape(shape).mean(axis=(1, 3)) for name in "GA")
    return light, covered == 1


def meshed(folder: Path) -> Path:
    """The bulb's mesh, of 4.5 million triangles."""
    scene, mesh = folder / "bulb.yaml", folder / "bulb.ply"
    scene.write_text(
        f"version: 1\nformula: {json.dumps(FORMULA)}\ncamera: {{position: {EYE}}}\nrenderer: {{type: volume}}\n"
    )
    command = [sys.executable, "-m", "clfractal", "mesh", str(scene), "-o", str(mesh), "--resolution", "512"]
    subprocess.run(command, check=True, timeout=300)
    return mesh


_THEIRS = """
white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": told["albedo"]}}
light = {"type": "constant", "radiance": {"type": "rgb", "value": 1}}
if told["sun"] is not None:
    # A white surface that faces our light is as bright as the light is intense: that takes pi times the irradiance.
    light = {"type": "directional", "direction": told["sun"], "irradiance": {"type": "rgb", "value": np.pi}}
body = {"type": "ply", "filename": told["mesh"], "face_normals": True, "bsdf": {"type": "twosided", "sided": white}}
found = pictures({"set": body, "light": light})[0, ..., 1]
"""


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Floats]:
    """Mitsuba's pictures of the mesh, under a white sky and in the sun."""
    folder = tmp_path_factory.mktemp("bulb")
    view = {"eye": EYE, "target": TARGET, "fov": FOV, "size": [SIDE, SIDE], "samples": 16}
    told = {**view, "albedo": ALBEDO, "bounces": BOUNCES, "mesh": str(meshed(folder))}
    return {
        name: by_mitsuba(_THEIRS, {**told, "sun": sun}, folder) for name, sun in (("sky", None), ("sun", SUN))
    }


@pytest.mark.parametrize(("side", "samples"), [(128, 64), (512, 4)])
@pytest.mark.parametrize(("light", "sun"), [("sky", None), ("sun", SUN)])
def test_the_bulb_is_as_bright_as_its_mesh(
    light: str, sun: Way, side: int, samples: int, theirs: dict[str, Floats]
) -> None:
    found, covered = drawn(side, samples, sun)
    assert covered.mean() > 0.4
    assert found[covered].mean() == pytest.approx(theirs[light][covered].mean(), rel=0.03)


@pytest.mark.parametrize(
    ("sun", "expected"),
    [(None, 0.6449), (SUN, 0.2547), ([1.0, 0.1, -0.15], 0.0203)],
    ids=["sky", "sun", "side"],
)
def test_the_bulb_is_as_bright_as_its_equation(sun: Way, expected: float) -> None:
    """Beside paths that another program traced in float64: steps of a quarter of the distance by the potential's Jacobian,
    hits halved down to 1e-10, rays begun a millionth above them. Meshes are up to 1.5 % off that, to both sides."""
    light, covered = drawn(128, 64, sun)
    assert light[covered].mean() == pytest.approx(expected, rel=0.03)


def test_its_old_look_was_not(theirs: dict[str, Floats]) -> None:
    """Rays that leave the surface three pixels above it never see what is between its bumps."""
    light, covered = drawn(128, 16, detail=1)
    assert light[covered].mean() > 1.1 * theirs["sky"][covered].mean()


@pytest.mark.parametrize("sun", [[0, 1, 0], [1, -0.5, 0.2]], ids=["before", "behind"])
def test_a_ball_has_no_shadow_on_its_lit_side(sun: list[float]) -> None:
    """Where a ball is lit its light is the cosine, up to where the lamp grazes it."""
    side, fine, height = 256, 16, 2.4
    scene = clfractal.Scene(
        version=1,
        formula={"name": "quaternion_julia", "iterations": 6, "julia": [0, 0, 0, 0]},
        image={"width": side, "height": side},
        renderer={"samples": 16},
        lighting={"mode": "path", "bounces": 0},
        camera={
            "projection": "orthographic",
            "position": [0, -3, 0],
            "target": [0, 0, 0],
            "up": [0, 0, 1],
            "height": height,
        },
        background={"top": [0, 0, 0], "bottom": [0, 0, 0]},
        lights=[{"type": "directional", "direction": sun, "intensity": 1}],
        materials={"white": {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}},
        material={"name": "white"},
    )
    film = clfractal.render(scene, channels=("R", "G", "B", "A"))
    radius = 4 ** (1 / 2**6)  # |z| = 4 after six squarings
    across = ((np.arange(side * fine) + 0.5) / (side * fine) - 0.5) * height
    x, z = np.meshgrid(across, -across)
    square = radius**2 - x**2 - z**2
    toward = -np.array(sun) / np.linalg.norm(sun)
    cosine = (x * toward[0] - np.sqrt(np.maximum(square, 0)) * toward[1] + z * toward[2]) / radius
    lit = np.where(square > 0, np.maximum(cosine, 0), 0).reshape(side, fine, side, fine).mean(axis=(1, 3))
    whole = film["A"] == 1
    assert film["G"][whole].sum() == pytest.approx(lit[whole].sum(), rel=1e-3)
    seen = whole & (lit > 0.02)
    assert np.quantile(film["G"][seen] / lit[seen], 0.01) > 0.99
