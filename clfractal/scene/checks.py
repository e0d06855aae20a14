"""What the parts of a scene demand of each other, once the formula and its bounds are known."""

from collections.abc import Sequence
from math import dist

from clfractal.errors import SceneError, Where
from clfractal.scene.base import Vector
from clfractal.scene.lighting import PointLight
from clfractal.scene.model import Scene

MAX_STEPS_THROUGH = 1_000_000
# A point that has not escaped after so many applications is inside for every practical purpose: it bounds the time
# that a light deep in a set of a million iterations takes.
_MOST_APPLICATIONS = 2_000


def check_parts(scene: Scene) -> None:
    """Raises SceneError, at its dotted path, for what is wrong only together."""
    radius = used_bounds(scene)[1]
    _check_step(scene.renderer.step, radius, "renderer.step")
    _check_step(scene.coloring.step, radius, "coloring.step")
    _check_residual(scene)
    _check_lights(scene)


def used_bounds(scene: Scene) -> tuple[Vector, float]:
    """Centre and radius of the ball that is looked in, scene units: the renderer's, or the formula's own."""
    bounds = scene.renderer.bounds
    return (bounds.center, bounds.radius) if bounds else (scene.chain.center, scene.chain.radius)


def _check_step(step: float | None, radius: float, path: str) -> None:
    """A step goes neither past the whole object at once nor takes forever."""
    if step is None:
        return
    diameter = 2 * radius
    if step > diameter:
        raise SceneError(
            f"must be at most the diameter of the bounds, {diameter:.4g}, got {step:g}", Where(path=path)
        )
    if step * MAX_STEPS_THROUGH < diameter:
        raise SceneError(
            f"must be at least {diameter / MAX_STEPS_THROUGH:.4g}, {MAX_STEPS_THROUGH:,} steps through the bounds,"
            f" got {step:g}",
            Where(path=path),
        )


def _check_residual(scene: Scene) -> None:
    """Through fewer points than four a plane fits exactly."""
    count = scene.renderer.used_points.count
    if scene.coloring.by == "residual" and count < 4:
        raise SceneError(
            f"residual needs at least 4 points of a pixel (renderer.points), got {count}",
            Where(path="coloring.by"),
        )


def _check_lights(scene: Scene) -> None:
    center, radius = used_bounds(scene)
    candidates = [
        (index, light.position)
        for index, light in enumerate(scene.lights)
        if isinstance(light, PointLight) and dist(light.position, center) <= radius
    ]
    if not candidates:
        return
    found = _inside(scene, [position for _, position in candidates])
    for (index, position), inside in zip(candidates, found, strict=True):
        if inside:
            shown = ", ".join(f"{x:g}" for x in position)
            raise SceneError(
                f"must be outside the object, where its light reaches something, got [{shown}]",
                Where(path=f"lights.{index}.position"),
            )


def _inside(scene: Scene, points: Sequence[Vector]) -> Sequence[bool]:
    """Which points belong to the solid that is drawn."""
    import numpy as np

    from clfractal.formulas import reference

    chain = scene.chain
    iterations = min(scene.formula.iterations, _MOST_APPLICATIONS)
    array = np.array(points, dtype=float)
    inside = reference.escape(chain, array, iterations)[1]
    if chain.degree <= 1 and chain.links[-1].bound.formula.shape is not None:
        # The last solid is the shape, which is smaller than the ball of the bailout.
        inside &= reference.distance(chain, array, iterations)[0] == 0
    return [bool(each) for each in inside]
