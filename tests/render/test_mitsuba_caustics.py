"""Caustics beside Mitsuba 3, which finds them by chance: of a ball of glass, and of waves on the floor of a pool."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.geometry.water import wave_set
from clfractal.scene.objects import WaterObject
from tests.render.mitsuba import Floats, assert_alike, by_mitsuba, by_us

pytestmark = pytest.mark.light

SIZE, SAMPLES, THEIR_SAMPLES, SEEDS, REGIONS = 24, 256, 1536, 5, 3
FOV, BOUNCES, ALBEDO = 36.0, 8, 0.8
BLACK = {"top": [0, 0, 0], "bottom": [0, 0, 0]}
WHITE: dict[str, Any] = {"base": {"color": [ALBEDO] * 3}, "specular": {"weight": 0}}
WAVES: dict[str, Any] = {"height": 0.16, "length": 2.0}
# Index of refraction, how deep the floor is, the lamp, the eye, and what it looks at.
SCENES: dict[str, tuple[float, float, dict[str, Any], list[float], list[float]]] = {
    "ball": (
        1.5,
        -0.9,
        {"position": [0.5, 0.4, 2.2], "radius": 0.25, "intensity": 20},
        [0.3, -1.7, 0.5],
        [-0.15, -0.1, -0.9],
    ),
    "waves": (
        1.33,
        -1.0,
        {"position": [0.6, 1.2, 1.6], "radius": 0.4, "intensity": 10},
        [0, -1.2, 1.0],
        [0, 0, -1],
    ),
}
_THEIRS = """
glass = {"type": "dielectric", "int_ior": told["index"], "ext_ior": 1.0}
white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": told["albedo"]}}
body = {"type": "sphere", "radius": 0.5, "bsdf": glass}
if told["mesh"]:
    body = {"type": "ply", "filename": told["mesh"], "bsdf": glass}
lamp = told["lamp"]
shines = {"type": "area", "radiance": {"type": "rgb", "value": lamp["intensity"]}}
found = pictures({
    "body": body,
    "floor": {"type": "rectangle", "to_world": T().translate([0, 0, told["floor"]]).scale(30), "bsdf": white},
    "lamp": {"type": "sphere", "center": lamp["position"], "radius": lamp["radius"], "emitter": shines},
})
"""


def wave_mesh(path: Path, half: float = 4.0, cells: int = 800) -> str:
    """The waves as a mesh with their own normals, for Mitsuba (PLY, little endian): the shortest one is 24 cells long."""
    waves = wave_set(WaterObject.model_validate({"type": "water", "waves": WAVES}))
    side = np.linspace(-half, half, cells + 1)
    x, y = (each.ravel() for each in np.meshgrid(side, side))
    phase = x[:, None] * waves.x + y[:, None] * waves.y + waves.phase
    height = (waves.height * (np.cos(phase) + waves.sharp * np.cos(2 * phase))).sum(axis=1)
    slope = -waves.height * (np.sin(phase) + 2 * waves.sharp * np.sin(2 * phase))
    normals = np.stack(
        [-(slope * waves.x).sum(axis=1), -(slope * waves.y).sum(axis=1), np.ones_like(x)], axis=1
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    corners = [
        np.stack([first, first + 1, first + cells + 2], axis=1),
        np.stack([first, first + cells + 2, first + cells + 1], axis=1),
    ]
    faces = np.zeros(2 * first.size, np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    faces["count"], faces["corners"] = 3, np.concatenate(corners)
    names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {x.size}\n{names}"
    head += f"element face {faces.size}\nproperty list uchar int vertex_indices\nend_header\n"
    vertices = np.column_stack([x, y, height, normals]).astype("<f4")
    path.write_bytes(head.encode() + vertices.tobytes() + faces.tobytes())
    return str(path)


@pytest.mark.parametrize("body", ["ball", "waves"])
def test_caustics_agree_with_mitsuba(body: str, tmp_path: Path) -> None:
    index, floor, lamp, eye, target = SCENES[body]
    told = {
        "eye": eye,
        "target": target,
        "fov": FOV,
        "size": [SIZE, SIZE],
        "samples": THEIR_SAMPLES,
        "seeds": SEEDS,
        "bounces": BOUNCES,
        "index": index,
        "floor": floor,
        "lamp": lamp,
        "albedo": ALBEDO,
        "mesh": wave_mesh(tmp_path / "waves.ply") if body == "waves" else None,
    }
    glass = {"specular": {"roughness": 0, "ior": index}, "transmission": {"weight": 1}}
    bodies: dict[str, dict[str, Any]] = {
        "ball": {"type": "sphere", "radius": 0.5},
        "waves": {"type": "water", "waves": WAVES},
    }
    found = by_us(
        SEEDS,
        {"samples": SAMPLES},
        formula="none",
        camera={"position": eye, "target": target, "fov": FOV},
        image={"width": SIZE, "height": SIZE},
        lighting={"mode": "path", "bounces": BOUNCES, "roulette": BOUNCES},
        background=BLACK,
        lights=[{"type": "sphere", **lamp}],
        materials={"glass": glass, "white": WHITE},
        objects={
            "body": {**bodies[body], "material": "glass"},
            "floor": {"type": "plane", "position": [0, 0, floor], "material": "white"},
        },
    )
    theirs = by_mitsuba(_THEIRS, told, tmp_path)
    assert_alike(found, theirs, REGIONS, REGIONS)
    noise, other = (
        found.var(axis=0, ddof=1).mean() * SAMPLES,
        theirs.var(axis=0, ddof=1).mean() * THEIR_SAMPLES,
    )
    assert noise < other
    # Two pictures of Mitsuba's differ by the noise of both; one of ours and one of theirs by that and by what is wrong.
    pairs = (blocks(found)[:, None] - blocks(theirs)[None]) ** 2
    own = (blocks(theirs)[:, None] - blocks(theirs)[None]) ** 2
    assert pairs.mean() < 2 * own.sum() / (own.size * (1 - 1 / SEEDS))


def blocks(pictures: Floats) -> Floats:
    """Means of blocks of 3 x 3 pixels, shape (seeds, height / 3, width / 3, 3)."""
    seeds, height, width, _ = pictures.shape
    return np.asarray(pictures.reshape(seeds, height // 3, 3, width // 3, 3, 3).mean(axis=(2, 4)))
