"""Mitsuba 3's pictures of the scenes of `benchmarks.glass`, in a process of its own.

Reads what is told as JSON, and writes pictures, shape (seeds, height, width, 3), and the seconds of all cores that each
took.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import mitsuba as mi
import numpy as np

_CORNERS = 256


def bodies(scene: str) -> dict[str, Any]:
    """What stands on the plane."""
    if scene == "ball":
        return {"ball": {"type": "sphere", "center": [0, 0, 0.8], "radius": 0.8, "bsdf": _boundary(1.5)}}
    # A tumbler full of water that stands a little higher than the rim: each boundary for itself.
    low, bottom, rim, top, outer, inner = 0.002, 0.08, 1.3, 1.31, 0.6, 0.54
    glass, water, between = _boundary(1.5), _boundary(1.33), _boundary(1.33, 1.5)
    return {
        "side": _side(outer, low, rim, glass),
        "foot": _disk(outer, low, glass, down=True),
        "rim": _ring(inner, outer, rim, glass),
        "wet side": _side(inner, bottom, rim, between),
        "wet foot": _disk(inner, bottom, between, down=True),
        "edge": _side(inner, rim, top, water),
        "top": _disk(inner, top, water),
    }


def _boundary(inside: float, outside: float = 1.0) -> dict[str, Any]:
    return {"type": "dielectric", "int_ior": inside, "ext_ior": outside}


def _side(radius: float, low: float, high: float, bsdf: dict[str, Any]) -> dict[str, Any]:
    return {"type": "cylinder", "p0": [0, 0, low], "p1": [0, 0, high], "radius": radius, "bsdf": bsdf}


def _disk(radius: float, height: float, bsdf: dict[str, Any], *, down: bool = False) -> dict[str, Any]:
    place = mi.ScalarTransform4f().translate([0, 0, height]).scale([radius, radius, 1])
    return {"type": "disk", "to_world": place.rotate([1, 0, 0], 180 if down else 0), "bsdf": bsdf}


def _ring(inner: float, outer: float, height: float, bsdf: dict[str, Any]) -> Any:
    """A flat ring of triangles that faces up."""
    angle = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corners = np.concatenate([inner * circle, outer * circle])
    first = np.arange(_CORNERS)
    second = np.roll(first, -1)
    faces = np.concatenate(
        [
            np.stack([first, _CORNERS + first, _CORNERS + second], axis=1),
            np.stack([first, _CORNERS + second, second], axis=1),
        ]
    )
    given = mi.Properties()
    given["bsdf"] = mi.load_dict(bsdf)
    mesh = mi.Mesh("rim", len(corners), len(faces), props=given)
    values = mi.traverse(mesh)
    values["vertex_positions"] = (
        np.column_stack([corners, np.full(len(corners), height)]).astype(np.float32).ravel()
    )
    values["faces"] = faces.astype(np.uint32).ravel()
    values.update()
    return mesh


def pictures(told: dict[str, Any]) -> tuple[np.ndarray[Any, Any], list[float]]:
    """Those that are asked for, and the seconds of all cores that each took."""
    lamp, transform = told["lamp"], mi.ScalarTransform4f()
    toward = np.add(lamp["position"], lamp["direction"]).tolist()
    place = transform.look_at(origin=lamp["position"], target=toward, up=[0, 1, 0])
    sky, light = ({"type": "rgb", "value": told[name]} for name in ("sky", "light"))
    found = mi.load_dict(
        {
            "type": "scene",
            "integrator": {
                "type": "path",
                "max_depth": told["bounces"] + 2,
                "rr_depth": told["roulette"] + 1,
            },
            "sensor": {
                "type": "perspective",
                "fov": told["fov"],
                "fov_axis": "y",
                "to_world": transform.look_at(origin=told["eye"], target=told["target"], up=[0, 0, 1]),
                "film": {
                    "type": "hdrfilm",
                    "width": told["size"][0],
                    "height": told["size"][1],
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": "independent", "sample_count": told["samples"]},
            },
            "floor": {
                "type": "rectangle",
                "to_world": transform.scale([1000, 1000, 1]),
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": told["floor"]}},
            },
            "sky": {"type": "constant", "radiance": sky},
            "lamp": {
                "type": "rectangle",
                "to_world": place.scale([lamp["width"] / 2, lamp["height"] / 2, 1]),
                "emitter": {"type": "area", "radiance": light},
            },
            **bodies(told["scene"]),
        }
    )
    mi.render(found, spp=1)  # begins its threads
    shown, seconds = [], []
    for seed in told["seeds"]:
        begun = time.process_time()
        shown.append(np.array(mi.render(found, seed=1 + seed, spp=told["samples"]))[..., :3])
        seconds.append(time.process_time() - begun)
    return np.stack(shown), seconds


if __name__ == "__main__":
    mi.set_variant("scalar_rgb")
    wanted = json.load(sys.stdin)
    light, taken = pictures(wanted)
    np.savez(wanted["file"], light=light, seconds=taken)
