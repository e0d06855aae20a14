"""Places on the set where its lights stand: near an orbit trap, and evenly spread."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from clfractal.elements.lights.set import SetLight
from clfractal.errors import SceneError, Where
from clfractal.formulas import catalog, reference
from clfractal.formulas.language import Chain
from clfractal.scene.model import Scene
from clfractal.schema.trap import Trap

Floats = NDArray[np.float64]

TOLERANCE = 5e-4
"""How near places are to the surface by the formula's estimate, parts of the bounds' radius."""
_DESCENTS = 24
_BATCH, _MOST_BATCHES = 20_000, 12
# So few tell in most scenes that there are places at all.
_FEW = 1_000
# Places to choose from for each that is wanted.
_CHOICE = 4
# Where the nearest place of a batch is so many thresholds away, others will not be much nearer.
_HOPELESS = 2
# Applications after which an orbit's trap is known well enough: it bounds the time.
_MOST_APPLICATIONS = 200


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where lights stand: arrays of shape (n, 3) in scene units, n at least 1; the first k are the most even k.

    Attributes:
        surface: on the set, at most TOLERANCE times the bounds' radius outside.
        normal: of length 1, out of the set.
        trap: smallest distance of each place's orbit from the trap, shape (n,).
    """

    surface: Floats
    normal: Floats
    trap: Floats


Pool = tuple[Floats, Floats, Floats]


def places_of(scene: Scene, number: int) -> Places:
    """The places of a scene's light, which is a SetLight; found once, and the same on every machine.

    Raises:
        SceneError: no place is near enough to the trap; at the light's threshold.
    """
    light = scene.lights[number]
    assert isinstance(light, SetLight)
    if isinstance(near_trap(*_searched(scene, light)), str):
        check_places(scene, number)
    return _spread_places(light.spacing or 0.0, *_searched(scene, light))


def check_places(scene: Scene, number: int) -> None:
    """Looks whether there is any place for a light, which is a SetLight; this takes a fraction of the time of `places_of`.

    Raises:
        SceneError: no place is near enough to the trap; at the light's threshold.
    """
    light = scene.lights[number]
    assert isinstance(light, SetLight)
    searched = _searched(scene, light)
    if not isinstance(near_trap(*searched, few=True), str):
        return
    found = near_trap(*searched)
    if isinstance(found, str):
        raise SceneError(found, Where(path=f"lights.{number}.threshold"))


def usual_threshold(scene: Scene, share: float = 0.5) -> float | None:
    """How near to a trap at the origin the orbits of so much of a scene's surface come; None if none of it was found."""
    searched = _searched(scene, SetLight.model_validate({"type": "set"}))
    formula, iterations, (center, radius), trap = searched[:4]
    chain = catalog.resolve(json.loads(formula), None, Where(path="formula"))
    iterations = min(iterations, _MOST_APPLICATIONS)
    start = _in_ball(np.random.default_rng(0), _FEW, center, radius)
    surface, _ = descended(chain, start, iterations, TOLERANCE * radius)
    near = trap_distances(chain, surface, iterations, Trap.model_validate_json(trap))
    return float(np.quantile(near, share)) if len(near) else None


Searched = tuple[str, int, tuple[tuple[float, float, float], float], str, float, int, str, int]


def _searched(scene: Scene, light: SetLight) -> Searched:
    """What the places near a trap follow from, as values that can be keys."""
    return (
        json.dumps(scene.formula.mapping(), sort_keys=True),
        scene.formula.iterations,
        scene.bounds,
        light.trap.model_dump_json(),
        light.threshold,
        light.count,
        light.within.model_dump_json() if light.within is not None else "",
        light.seed,
    )


@lru_cache(maxsize=16)
def _spread_places(spacing: float, *searched: *Searched) -> Places:
    found, count = near_trap(*searched), searched[5]
    assert not isinstance(found, str)
    surface, normal, near = found
    spread = spread_out(surface, count, spacing)
    return Places(surface[spread], normal[spread], near[spread])


@lru_cache(maxsize=16)
def near_trap(
    formula: str,
    iterations: int,
    bounds: tuple[tuple[float, float, float], float],
    trap_text: str,
    threshold: float,
    count: int,
    within: str,
    seed: int,
    *,
    few: bool = False,
) -> Pool | str:
    """Places near the trap: surface, normal, trap; or what is wrong.

    Several for each of `count` if they are found; with `few` only those from a few starts.
    """
    chain = catalog.resolve(json.loads(formula), None, Where(path="formula"))
    trap = Trap.model_validate_json(trap_text)
    iterations = min(iterations, _MOST_APPLICATIONS)
    center, radius = bounds
    if within:
        ball = json.loads(within)
        center, radius = tuple(ball["center"]), ball["radius"]
    random = np.random.default_rng(seed)
    pool: list[Pool] = []
    nearest, enough, reached = np.inf, 0, False
    for _ in range(1 if few else _MOST_BATCHES):
        start = _in_ball(random, _FEW if few else _BATCH, center, radius)
        surface, normal = descended(chain, start, iterations, TOLERANCE * bounds[1])
        kept = np.linalg.norm(surface - center, axis=1) <= radius
        surface, normal = surface[kept], normal[kept]
        reached |= len(surface) > 0
        near = trap_distances(chain, surface, iterations, trap)
        nearest = min(nearest, float(near.min(initial=np.inf)))
        chosen = near < threshold
        pool.append((surface[chosen], normal[chosen], near[chosen]))
        enough += int(chosen.sum())
        if enough >= _CHOICE * count or (enough == 0 and _HOPELESS * threshold < nearest < np.inf):
            break
    if not reached:
        return "no place of the surface was found; give a larger ball in within, or remove it"
    if enough == 0:
        return f"no place of the set is that near to the trap: the nearest is {nearest:.3g} away, got {threshold:g}"
    surface, normal, near = (np.concatenate(parts) for parts in zip(*pool, strict=True))
    return surface, normal, near


def descended(chain: Chain, points: Floats, iterations: int, tolerance: float) -> tuple[Floats, Floats]:
    """Points led down to the surface along the distance's gradient, as many as arrive: points and normals, shape (n, 3).

    Those that arrive are outside the solid, and at most `tolerance` away by the estimate.
    """
    found: list[tuple[Floats, Floats]] = []
    points = np.array(points)
    for _ in range(_DESCENTS):
        if not len(points):
            break
        away, gradient = reference.distance(chain, points, iterations)
        with np.errstate(all="ignore"):
            normal = gradient / np.linalg.norm(gradient, axis=1)[:, None]
        usable = (away > 0) & np.isfinite(away) & np.isfinite(normal).all(axis=1)
        arrived = usable & (away <= tolerance)
        found.append((points[arrived], normal[arrived]))
        onward = usable & ~arrived
        points = points[onward] - (away[onward] - tolerance / 2)[:, None] * normal[onward]
    if not found:
        return points, points
    return np.concatenate([each for each, _ in found]), np.concatenate([each for _, each in found])


def trap_distances(chain: Chain, points: Floats, iterations: int, trap: Trap) -> Floats:
    """Smallest distance of z_1, z_2, ... from the trap, of points of shape (n, 3); as in `coloring.h`."""
    backend = reference.NumpyBackend()
    result = np.full(len(points), np.inf)
    with np.errstate(all="ignore"):
        state, place = reference.start(chain, points, backend)
        alive = np.arange(len(points))
        first = trap.away(np.stack(place[:3], axis=1))
        for application in range(iterations):
            inside = np.sqrt(sum(part * part for part in state[: chain.size])) <= chain.bailout
            alive, state = alive[inside], [part[inside] for part in state]
            if not len(alive):
                break
            bound = chain.link_at(application).bound
            constant = reference.constant_of(bound, [part[alive] for part in place])
            moved = reference.apply(
                bound, state, constant, backend, number=application, carried=chain.carried
            )
            state = [np.array(np.broadcast_to(part, alive.shape), float) for part in moved]
            result[alive] = np.fmin(result[alive], trap.away(np.stack(state[:3], axis=1)))
    return np.where(np.isfinite(result), result, first)


def spread_out(points: Floats, count: int, spacing: float) -> NDArray[np.int64]:
    """Numbers of at most `count` points: each is the farthest from all before (Gonzalez 1985), over `spacing` away."""
    chosen = [0]
    axes = [np.ascontiguousarray(axis) for axis in points.T]
    away = np.full(len(points), np.inf)
    # Written to in each step: whole arrays of it would take most of the time.
    square, part = np.empty(len(points)), np.empty(len(points))
    while len(chosen) < min(count, len(points)):
        square[:] = 0
        for axis in axes:
            np.subtract(axis, axis[chosen[-1]], out=part)
            np.multiply(part, part, out=part)
            np.add(square, part, out=square)
        np.minimum(away, square, out=away)
        farthest = int(away.argmax())
        if away[farthest] <= spacing**2:
            break
        chosen.append(farthest)
    return np.array(chosen)


def _in_ball(random: np.random.Generator, count: int, center: tuple[float, ...], radius: float) -> Floats:
    way = random.normal(size=(count, 3))
    way *= (radius * random.uniform(size=count) ** (1 / 3) / np.linalg.norm(way, axis=1))[:, None]
    return np.asarray(way + np.array(center))
