"""What our language wants to know of a formula made of a text: how fast it grows, and where its set is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

DIRECTIONS = 400
NEAREST, FARTHEST, STEP = 0.05, 120.0, 1.12
BESIDE = 24
"""Places beside each axis at each radius."""
LOOKED_AT = 12
"""Applications after which a place is taken to be inside."""
GONE = 1000.0
LEAST = 2.1
"""Of sets of powers: the needles of the Mandelbrot set are thin, and reach -2."""


def measured(
    links: Sequence[dict[str, Any]], iterations: int, reach: float, repeats: Sequence[float]
) -> dict[str, Any]:
    """The section `formula` of a scene, of members with `formula`, `count`, `start` and `stop`.

    Args:
        reach: how far from the origin anything is seen, scene units.
        repeats: after which lengths along each axis space is there once more; 0: it is not.
    """
    import numpy as np

    generator = np.random.default_rng(1)
    directions = generator.normal(size=(DIRECTIONS, 3))
    # Thin parts lie along axes, and diagonals of planes and cubes, rather than anywhere.
    straight = np.array(
        [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z]
    )
    directions = np.concatenate([straight, directions]).astype(float)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    done: dict[int, dict[str, Any]] = {}
    for link in links:
        if id(link["formula"]) not in done:
            done[id(link["formula"])] = {**link["formula"], "degree": _degree(link["formula"], directions)}
    members = [{**link, "formula": done[id(link["formula"])]} for link in links]
    shapes = any("distance" in formula for formula in done.values())
    radius = FARTHEST if shapes else _radius(members, directions, min(iterations, LOOKED_AT), repeats)
    if any(formula["degree"] >= 2 for formula in done.values()):
        radius = max(radius, LEAST)
    farthest = max(reach, 0.1)
    # Shapes are there whatever becomes of z.
    bailout = 1e9 if shapes else float(f"{max(4.0, 3 * min(radius, farthest)):.4g}")
    radius = float(f"{min(FARTHEST if any(repeats) else radius, farthest, 1e6):.4g}")
    shared = {"bounds": {"center": [0, 0, 0], "radius": radius}, "bailout": bailout}
    for formula in done.values():
        formula |= {"bounds": {"radius": radius}, "bailout": bailout}
        if shapes:
            formula |= {"degree": 1, "distance_bailout": bailout}
    if len(members) == 1 and "stop" not in members[0]:
        return {"inline": members[0]["formula"], "iterations": iterations}
    chain = [_member(each) for each in members]
    return {"inline": {"title": "Hybrid", "chain": chain, **shared}, "iterations": iterations}


def are_inside(section: dict[str, Any], points: Sequence[Sequence[float]]) -> list[bool]:
    """Whether points are in the set of a scene's section `formula`."""
    import numpy as np

    from clfractal.formulas.catalog import resolve
    from clfractal.formulas.reference import escape

    with np.errstate(all="ignore"):
        _, inside = escape(resolve(section), np.array(points, float), int(section["iterations"]))
    return [bool(each) for each in inside]


def distance_at(section: dict[str, Any], place: Sequence[float]) -> float:
    """The distance of a place from the set of a scene's section `formula`, as a march would find it."""
    import numpy as np

    from clfractal.formulas.catalog import resolve
    from clfractal.formulas.reference import distance, own_distance

    chain, count, places = resolve(section), int(section["iterations"]), np.array([place], float)
    found = (
        distance(chain, places, count)[0] if chain.rule_index is None else own_distance(chain, places, count)
    )
    return float(found[0])


def is_ball(section: dict[str, Any]) -> bool:
    """Whether the last solid of a scene's section `formula` is the ball of its bailout."""
    from clfractal.formulas.catalog import resolve

    chain = resolve(section)
    return chain.rule_index is None and chain.shape_index is None


def ball_of(section: dict[str, Any]) -> tuple[tuple[float, ...], float]:
    """The middle and the radius of the ball that holds the set of a scene's section `formula`."""
    from clfractal.formulas.catalog import resolve

    chain = resolve(section)
    return chain.center, chain.radius


POWER_BAILOUT, FOLD_BAILOUT = 10.0, 100.0
"""Beyond which their orbits end of what grows by a power, and by a factor, where a file gives nothing of its own."""


def counts_apart(section: dict[str, Any]) -> float:
    """By how much our smooth escape counts of a scene's section `formula` are larger than their whole ones, in the mean.

    Theirs end at a smaller radius. Applications from the one to the other are counted from places around the set.
    """
    import numpy as np

    from clfractal.formulas.catalog import resolve
    from clfractal.formulas.reference import escape

    chain, limit = resolve(section), int(section["iterations"])
    far, near = chain.distance_bailout, POWER_BAILOUT if chain.degree > 1 else FOLD_BAILOUT
    places = np.random.default_rng(1).uniform(-1, 1, (2000, 3)) * min(chain.radius, 1e6) + chain.center
    with np.errstate(all="ignore"):
        (ours, inside), (theirs, _) = (
            escape(resolve({**section, "bailout": radius, "distance_bailout": radius}), places, limit)
            for radius in (far, near)
        )
    known = ~inside & (theirs > 0) & (ours < limit)
    apart = float((ours - theirs)[known].mean()) if known.any() else 0.0
    return apart - 0.5


def _member(link: dict[str, Any]) -> dict[str, Any]:
    return {
        "inline": link["formula"],
        **{key: link[key] for key in ("count", "start", "stop") if key in link},
    }


def _degree(formula: dict[str, Any], directions: Any) -> float:
    """The power by which |z| grows far outside, in the middle of many directions."""
    import numpy as np

    from clfractal.formulas.backends import NumpyBackend
    from clfractal.formulas.catalog import resolve
    from clfractal.formulas.reference import apply

    bound = resolve({"inline": formula}).links[0].bound
    lengths = []
    for size in (1e5, 1e6):
        axes = len(formula["variables"])
        z = [*(size * directions.T), *([np.zeros(len(directions))] if axes == 4 else [])]
        carried = [np.ones(len(directions)) for _ in formula.get("state", ())]
        with np.errstate(all="ignore"):
            found = apply(bound, [*z, *carried], [0.0 * part for part in z], NumpyBackend())[:axes]
            lengths.append(np.sqrt(sum(np.broadcast_to(part, len(directions)) ** 2 for part in found)))
    with np.errstate(all="ignore"):
        slopes = np.log10(lengths[1] / lengths[0])
    slopes = slopes[np.isfinite(slopes)]
    middle = float(np.median(slopes)) if len(slopes) else 1.0
    whole = round(middle)
    near = float(whole) if abs(middle - whole) < 0.1 else round(middle, 2)
    return min(max(near, 1.0), 64.0)


def _radius(
    members: Sequence[dict[str, Any]], directions: Any, applications: int, repeats: Sequence[float]
) -> float:
    """The radius of a ball around the origin with all places of the middle cell that are near after some applications."""
    import numpy as np

    from clfractal.formulas.catalog import resolve
    from clfractal.formulas.reference import escape

    last = max((link.get("stop", 0) for link in members), default=0)
    chain = resolve({"inline": {"chain": [_member(each) for each in members], "bailout": GONE}})
    count = round(np.log(FARTHEST / NEAREST) / np.log(STEP))
    radii = NEAREST * STEP ** np.arange(count)
    points = (radii[:, None, None] * directions[None, :70]).reshape(-1, 3)
    applications = min(max(applications, last + 2), 40)
    with np.errstate(all="ignore"):
        _, inside = escape(chain, points, applications)
    halves = np.array([length / 2 if length > 0 else np.inf for length in repeats])
    inside &= np.all(abs(points) <= halves, axis=1)
    kept = inside.reshape(count, -1).any(axis=1) | _along_axes(chain, radii, applications, halves)
    if not kept.any():
        return 4.0
    largest = float(radii[np.nonzero(kept)[0].max()])
    return max(1.4 * largest, 0.5)


def _along_axes(chain: Any, radii: Any, applications: int, halves: Any) -> Any:
    """Of each radius, whether what is near an axis there stays: rows that a transform repeats go on without an end."""
    import numpy as np

    from clfractal.formulas.reference import escape

    generator = np.random.default_rng(2)
    found = np.zeros(len(radii), bool)
    for axis in range(3):
        points = generator.uniform(-1, 1, (len(radii), BESIDE, 3))
        # Repeats have lengths; which part of one a radius meets is anywhere.
        points[..., axis] = radii[:, None] * generator.uniform(1 / STEP, 1, (len(radii), BESIDE))
        points[:, ::2, axis] *= -1
        with np.errstate(all="ignore"):
            _, inside = escape(chain, points.reshape(-1, 3), applications)
        found |= (inside.reshape(points.shape[:2]) & np.all(abs(points) <= halves, axis=2)).any(axis=1)
    return found
