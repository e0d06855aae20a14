"""The ball that holds all that makes up a set."""

from collections.abc import Mapping
from functools import reduce
from typing import TYPE_CHECKING

from clfractal.scene.objects import FormulaObject, VolumeObject, ball_of_both
from clfractal.schema.shape import Ball, Joined, Solid

if TYPE_CHECKING:
    from clfractal.formulas.language import Chain
    from clfractal.scene.given import GivenGrid


def ball_of_set(
    own: Ball, joined: Mapping[str, Joined], chains: "Mapping[str, Chain]", *, alone: bool
) -> Ball:
    """Centre and radius, scene units.

    Args:
        own: the ball of the scene's own formula.
        joined: what is joined to it, by names, and the formulas among it.
        alone: whether the scene's own formula has no set.
    """
    balls = [] if alone else [own]
    for name, part in joined.items():
        if isinstance(part, FormulaObject) and part.join in ("union", "smooth_union"):
            balls.append(part.ball(chains[name].center, chains[name].radius))
        elif isinstance(part, Solid) and part.join in ("union", "smooth_union"):
            balls.append(part.ball)
    return reduce(ball_of_both, balls or [own])


def ball_of_grid(each: VolumeObject, grid: "GivenGrid") -> Ball:
    """That of a volume among the objects."""
    from clfractal.scene.object_grids import placed

    extent = placed(each, grid).place.extent
    return extent.center, extent.radius
