"""Mitsuba 3's pictures of the scenes of `benchmarks.glass`, in a process of its own (`mitsuba_seeds.py`)."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from benchmarks.rivals.mitsuba_seeds import framed, write_pictures

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


def scene_of(told: dict[str, Any]) -> dict[str, Any]:
    """The scene that is told."""
    lamp, transform = told["lamp"], mi.ScalarTransform4f()
    toward = np.add(lamp["position"], lamp["direction"]).tolist()
    place = transform.look_at(origin=lamp["position"], target=toward, up=[0, 1, 0])
    sky, light = ({"type": "rgb", "value": told[name]} for name in ("sky", "light"))
    return {
        **framed(told, "path"),
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


if __name__ == "__main__":
    write_pictures(scene_of)
