"""A ball in fog around it, before a wall of one colour, and what is seen of them by sums along the rays."""

from __future__ import annotations

from typing import Any

import numpy as np

from clfractal.formulas import reference
from clfractal.scene.model import Scene
from tests.render.shots import PERSPECTIVE, SOLID_RADIUS, SOLID_SPHERE, Floats, rays, to_sphere
from tests.scenes import scene_of

SIDE = 32
BEHIND, SURFACE = np.array([0.6, 0.5, 0.4]), np.array([0.2, 0.7, 0.3])


def misty(samples: int, formula: dict[str, Any] = SOLID_SPHERE, **sections: Any) -> Scene:
    """A ball that shines evenly, in fog around it."""
    paths = sections.get("lighting", {}).get("mode") == "path"
    black = {"color": [0, 0, 0], "ambient": 0, "diffuse": 0, "specular": 0}
    even = {**black, "color": SURFACE.tolist(), "ambient": 1}
    shining = {
        "base": {"weight": 0},
        "specular": {"weight": 0},
        "emission": {"luminance": 1, "color": SURFACE.tolist()},
    }
    given: dict[str, Any] = {
        "camera": PERSPECTIVE,
        "lights": [] if paths else [{"direction": [1, 0, 0], "shadow": False}],
        "material": {"name": "even"} if paths else even,
        "materials": {"even": shining} if paths else {},
        "background": {"top": BEHIND.tolist(), "bottom": BEHIND.tolist()},
        **sections,
    }
    camera, renderer = given.pop("camera"), given.pop("renderer", {})
    return scene_of(formula, camera, (SIDE, SIDE), renderer={"samples": samples, **renderer}, **given)


def expected(scene: Scene, parts: int = 8000, way: float = 40.0) -> Floats:
    """Of each pixel's middle ray, from the middles of many parts: short ones around the ball, where the fog changes."""
    mist: Any = scene.mist
    radius = ball_radius(scene)
    origin, direction, _ = rays(scene)
    origin = np.broadcast_to(origin, direction.shape)
    hit, nearest = to_sphere(origin, direction, [0, 0, 0], radius)
    found = np.zeros(direction.shape)
    for place in np.ndindex(hit.shape):
        meets = nearest[place] < radius
        far = hit[place] if meets else way
        middle = float(np.clip(-(origin[place] @ direction[place]), 0, far))
        reach = np.geomspace(1e-4, way, parts // 2)
        edges = np.unique(
            np.clip(np.concatenate([[0.0], middle - reach, [middle], middle + reach, [far]]), 0, far)
        )
        t, step = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
        away = np.linalg.norm(origin[place] + t[:, None] * direction[place], axis=1)
        quantity, density = _fog(scene, away, radius)
        haze = np.zeros(len(t)) if scene.fog is None else np.full(len(t), scene.fog.density)
        if scene.fog is not None and not meets and not scene.fog.background:
            raise ValueError("fog that covers no background has an end of its own")
        through = np.exp(-np.cumsum((density + haze) * step))
        before = np.concatenate([[1.0], through[:-1]])
        # Of what a part takes away each fog replaces its share.
        taken = (before - through)[:, None] / np.maximum(density + haze, 1e-30)[:, None]
        stops = np.array([stop.at for stop in mist.colors])
        colors = np.array([stop.color for stop in mist.colors])
        own = np.stack([np.interp(quantity, stops, colors[:, i]) for i in range(3)], axis=1)
        light = taken * density[:, None] * own
        if scene.fog is not None:
            light += taken * haze[:, None] * np.array(scene.fog.color)
        behind = SURFACE if meets else BEHIND if scene.fog is None else np.array(scene.fog.color)
        found[place] = light.sum(axis=0) + through[-1] * behind
    return found


def _fog(scene: Scene, away: Floats, radius: float) -> tuple[Floats, Floats]:
    """What chooses the fog's colour at distances from the middle, and how dense it is there."""
    mist: Any = scene.mist
    dense = mist.used_density(scene.bounds[1])
    if mist.by == "closeness":
        distance = np.maximum(away - radius, 0)
        if scene.chain.shape_index is None:
            # The formula's estimate; within one radius of the bounds the distance from these takes over.
            bounds = scene.bounds[1]
            points = np.stack([away, 0 * away, 0 * away], axis=1)
            estimate = reference.distance(scene.chain, points, scene.formula.iterations)[0]
            part = np.clip((away - bounds) / bounds, 0, 1)
            distance = estimate + part * np.maximum(away - bounds - estimate, 0)
        return distance, dense / (1 + ((distance - mist.distance) / mist.used_width(scene.bounds[1])) ** 2)
    count = np.log2(np.log(scene.chain.distance_bailout) / np.log(away))
    end = mist.used_end(scene.formula.iterations)
    return count, dense * np.clip((count - mist.start) / (end - mist.start), 0, 1) ** 2


def ball_radius(scene: Scene) -> float:
    """Of the solid, by its formula."""
    return SOLID_RADIUS if scene.chain.shape_index is not None else 4.0 ** (2.0**-scene.formula.iterations)


def sure(scene: Scene) -> Any:
    """Pixels without the ball's rim."""
    origin, way, _ = rays(scene)
    radius = ball_radius(scene)
    _, nearest = to_sphere(np.broadcast_to(origin, way.shape), way, [0, 0, 0], radius)
    return (nearest < 0.92 * radius) | (nearest > 1.08 * radius)
