"""In which body of the set an eye is."""

from __future__ import annotations

import math

from clfractal.device.orbit import BODY_OPAQUE
from clfractal.geometry.faces import opening_planes
from clfractal.scene.checks import parts_holding
from clfractal.scene.model import Scene
from clfractal.schema.base import Vector
from clfractal.shading.maps import has_glass_set, has_participating_media
from clfractal.shading.set_bodies import set_bodies


def eye_body(scene: Scene, eye: Vector) -> int:
    """The number of the set's body around an eye, if light goes through it; 0 in the open, and in what is opaque.

    Of media that scatter light, and of pixels with several points, it is always 0: there paths enter the body at the eye.
    """
    if not has_glass_set(scene) or has_participating_media(scene) or scene.surface.used_points.count > 1:
        return 0
    center, radius = scene.bounds
    if math.dist(eye, center) > radius or any(
        each.cuts_set and each.in_front(eye) for each in scene.cut_planes
    ):
        return 0
    bodies, found = set_bodies(scene), 0
    for name, (inside,) in parts_holding(scene, [eye]):
        for _, plane in opening_planes(scene, name):
            inside &= sum(n * (e - c) for e, c, n in zip(eye, plane.center, plane.normal, strict=True)) <= 0
        join = scene.joined[name].join if name else "union"
        if join in ("cut", "intersection"):
            found = found if inside == (join == "intersection") else 0
        elif inside:
            found = max(found, (bodies.parts[name] if name else bodies.own) or BODY_OPAQUE)
    return found if found < BODY_OPAQUE else 0
