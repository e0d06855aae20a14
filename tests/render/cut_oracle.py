"""A scene whose bodies planes have cut, each its own, and what rays meet in it by their equations in float64."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.elements.shapes.sphere import SphereObject
from clfractal.scene.model import Scene
from tests import scenes
from tests.render.objects_oracle import span
from tests.render.quads import escape_tint
from tests.render.shots import BALL, Floats, to_sphere

RADIUS = 4.0**0.125  # of the set, by three applications
# One plane opens the set alone; the other the crate alone, and the set's top and all of the egg are in front of it.
PLANES: tuple[dict[str, Any], ...] = (
    {
        "plane": {"center": [0.1, -0.35, 0.15], "normal": [0.3, -1.0, 0.4]},
        "cut": True,
        "opacity": 0,
        "iterations": 8,
        "colors": {"mode": "stepped", "palette": "magma", "inside": [0.9, 0.1, 0.3], "scale": 1.5},
    },
    {
        "plane": {"center": [0, 0, 0.2], "normal": [0.1, -0.2, 1.0]},
        "cut": True,
        "set": False,
        "objects": ["crate"],
        "opacity": 0,
        "colors": {"inside": [0.1, 0.6, 0.2]},
    },
)
WHITE: tuple[dict[str, Any], ...] = tuple(
    {**each, "colors": {"palette": ["#ffffff", "#ffffff"], "inside": [1, 1, 1]}} for each in PLANES
)
OBJECTS: dict[str, Any] = {
    "crate": {"type": "box", "position": [-2.0, -0.5, 0.1], "rotation": [0, 0, 20]},
    "egg": {"type": "sphere", "position": [1.9, -0.6, 0.6], "radius": 0.35},
    "mirror": {"type": "box", "position": [0, 0, -1.35], "size": [7, 7, 0.1], "material": "mirror"},
}
MIRROR: dict[str, Any] = {"base": {"color": [1, 1, 1], "metalness": 1}, "specular": {"roughness": 0}}
BODIES = ("set", *OBJECTS)


def scene_of(**sections: Any) -> Scene:
    """The ball of radius RADIUS, the objects, and no light, unless the sections say otherwise."""
    usual: dict[str, Any] = {
        "formula": {"inline": BALL, "iterations": 3},
        "camera": {"position": [0.6, -5.2, 2.4], "target": [0, 0, -0.1], "fov": 44},
        "size": (72, 56),
        "renderer": {"detail": 0.05},
        "material": {"ambient": 0, "diffuse": 1, "specular": 0, "color": [1, 1, 1]},
        "materials": {"mirror": MIRROR},
        "objects": OBJECTS,
        "cut_planes": PLANES,
        "lights": [],
        "background": {"top": [0, 0, 0], "bottom": [0, 0, 0]},
    }
    return scenes.scene_of(**{**usual, **sections})


def solid_of(scene: Scene, name: str) -> Any:
    """A body as a solid."""
    return (
        scene.objects[name] if name != "set" else SphereObject.checked({"type": "sphere", "radius": RADIUS})
    )


@dataclass
class Met:
    """What rays meet first; `body` by its place in BODIES, -1: nothing; `plane`: that of the face, -1: no face; `sure`:
    that rounding does not decide which of them it is."""

    t: Floats
    body: npt.NDArray[np.int64]
    plane: npt.NDArray[np.int64]
    normal: Floats
    sure: npt.NDArray[np.bool_]


def first_met(scene: Scene, origin: Floats, direction: Floats, slack: float = 5e-3) -> Met:
    """Of rays that begin outside of all bodies, shape (..., 3)."""
    shape = direction.shape[:-1]
    found = Met(
        np.full(shape, np.inf),
        np.full(shape, -1),
        np.full(shape, -1),
        np.zeros(direction.shape),
        np.ones(shape, bool),
    )
    for body, name in enumerate(BODIES):
        (entry, normal), (exit_, _) = span(solid_of(scene, name), origin, direction)
        plane = np.full(shape, -1)
        for number, each in enumerate(scene.cut_planes):
            if not (each.cuts_set if name == "set" else name in each.cut_objects):
                continue
            front = np.array(each.plane.placed.normal)
            with np.errstate(divide="ignore"):
                t = ((np.array(each.plane.placed.center) - origin) @ front) / (direction @ front)
            down = direction @ front < 0
            later = down & (t > entry)
            found.sure &= ~down | (np.abs(t - entry) > slack)
            entry, plane = np.where(later, t, entry), np.where(later, number, plane)
            normal = np.where(later[..., None], front, normal)
            exit_ = np.where(down, exit_, np.minimum(exit_, t))
        hit = (entry < exit_) & (entry > 0)
        found.sure &= np.abs(np.where(np.isfinite(entry), exit_ - entry, 1)) > slack
        if name == "set":  # a march may find what a ray only just passes
            found.sure &= np.abs(to_sphere(origin, direction, (0, 0, 0), RADIUS)[1] - RADIUS) > slack
        nearer = hit & (entry < found.t)
        found.t, found.body = np.where(nearer, entry, found.t), np.where(nearer, body, found.body)
        found.plane = np.where(nearer, plane, found.plane)
        found.normal = np.where(nearer[..., None], normal, found.normal)
    return found


def face_tint(
    scene: Scene, met: Met, points: Floats, rim: float = 1e-4
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """The colours of faces at points: a plane's by the counts of its own limit, or where it cuts an object its colour of
    insides; and where the count is certain."""
    tint, sure = np.zeros(points.shape), np.ones(met.t.shape, bool)
    for number, each in enumerate(scene.cut_planes):
        own, near = escape_tint(scene, points, each.iterations or scene.formula.iterations, each.colors)
        certain = near > rim
        of_set = ((met.plane == number) & (met.body == 0))[..., None]
        inside = ((met.plane == number) & (met.body > 0))[..., None]
        tint = np.where(of_set, own, np.where(inside, each.colors.inside, tint))
        sure &= ~of_set[..., 0] | certain
    return tint, sure
