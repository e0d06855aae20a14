"""Light between the facets of GGX with Smith's masking, by a random walk: what rough metals reflect.

Heitz, Hanika, d'Eon and Dachsbacher 2016, Multiple-Scattering Microfacet BSDFs with the Smith Model. Facets lie at heights
of which all are equally likely; a ray meets one by how much of them it sees, or escapes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True)
class Walks:
    """Where light goes that comes from one direction, in the plane of x and z.

    Attributes:
        leaves: directions, shape (n, 3).
        facets: how many it has met.
        light: what is left of it, of each colour, shape (n, colours).
    """

    leaves: Floats
    facets: npt.NDArray[np.int64]
    light: Floats


def reflectance(cosine: Floats, straight: float, tint: float) -> Floats:
    """A metal's by Schlick, times a tint where the cosine is 1/7 (Kutz, Hasan and Edmondson 2021)."""

    def schlick(at: Any) -> Any:
        return straight + (1 - straight) * (1 - at) ** 5

    least = 1 / 7
    dip = schlick(least) * (1 - tint) / (least * (1 - least) ** 6)
    return np.asarray(np.clip(schlick(cosine) - dip * cosine * (1 - cosine) ** 6, 0, 1))


def walked(
    cosine: float, alpha: float, colors: Sequence[tuple[float, float]], *, count: int, seed: int
) -> Walks:
    """Follows rays until all have left.

    Args:
        cosine: of the direction that they come from with the normal.
        alpha: GGX's width.
        colors: reflectances straight on and tints at the edge.
    """
    random = np.random.default_rng(seed)
    leaves, facets = np.zeros((count, 3)), np.zeros(count, np.int64)
    light = np.ones((count, len(colors)))
    going = np.repeat([[-math.sqrt(1 - cosine * cosine), 0.0, -cosine]], count, axis=0)
    below = np.ones(count)  # the part of all facets that is below the ray
    rays = np.arange(count)
    while len(rays):
        sees = np.abs(lambda_of(going[:, 2], alpha))
        chance = random.random(len(rays))
        escapes = (going[:, 2] > 0) & (1 - chance < below**sees)
        leaves[rays[escapes]] = going[escapes]
        stays = ~escapes
        rays, going, below = rays[stays], going[stays], below[stays]
        passed = (1 - chance[stays]) ** (1 / sees[stays])
        below = np.clip(np.where(going[:, 2] > 0, below / passed, below * passed), 0, 1)
        facet = seen_facets(-going, alpha, random)
        meeting = np.clip(-(going * facet).sum(axis=1), 0, 1)
        for number, (straight, tint) in enumerate(colors):
            light[rays, number] *= reflectance(meeting, straight, tint)
        facets[rays] += 1
        going = going + 2 * meeting[:, None] * facet
        going /= np.linalg.norm(going, axis=1, keepdims=True)
    return Walks(leaves, facets, light)


def lambda_of(z: Floats, alpha: float) -> Floats:
    """Smith's function of GGX, of directions up or down: how many facets stand in the way."""
    square = np.maximum(z * z, 1e-20)
    slope = np.sqrt(1 + alpha * alpha * (1 - square) / square)
    return np.asarray(np.where(z > 0, (slope - 1) / 2, -(slope + 1) / 2))


def seen_facets(toward: Floats, alpha: float, random: np.random.Generator) -> Floats:
    """Normals of facets, each as likely as much of it is seen, by rejection of points on an ellipsoid's shadow.

    GGX's facets are those of an ellipsoid (Walter and others 2015): its upper half, which is seen from `toward`, has the
    visible ones as often as the shadow shows them.
    """
    found = np.zeros_like(toward)
    left = np.arange(len(toward))
    stretch = np.array([alpha, alpha, 1.0])
    while len(left):
        view = toward[left] * stretch
        view /= np.linalg.norm(view, axis=1, keepdims=True)
        # A point on the unit disc across the view, and the ball's surface above it.
        radius, angle = np.sqrt(random.random(len(left))), 2 * math.pi * random.random(len(left))
        side = np.cross(view, np.where(np.abs(view[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]))
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        across, up = radius * np.cos(angle), radius * np.sin(angle)
        ball = across[:, None] * side + up[:, None] * np.cross(view, side)
        ball += np.sqrt(1 - radius * radius)[:, None] * view
        upper = ball[:, 2] > 0
        found[left[upper]] = ball[upper] * stretch
        left = left[~upper]
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))
