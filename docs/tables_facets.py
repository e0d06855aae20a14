"""Light that a rough metal's facets reflect more than once, in tables that `kernels/shading/bsdf.h` reads.

Of GGX's facets with Smith's masking it is known what light meets, facet after facet (Heitz, Hanika, d'Eon and Dachsbacher
2016, Multiple-Scattering Microfacet BSDFs with the Smith Model). The heights at which it meets the first two can be
integrated exactly; the facets' directions are a sum over a lattice. What the metal sends back after two facets, and what
after more, are two lobes

    scale(o) scale(i) (GGX(o, i) of the width `wide(roughness)` + an even part)

which have a direction, are the same both ways, and have all that light. Their colour is that of the first facet and of the
last one, by the directions o and i, and of those between, by the roughness. A metal reflects straight + (1 - straight) a -
dip b there, where a is the mean of (1 - cosine)^5 and b that of cosine (1 - cosine)^6 (`fresnel_metal` of
`kernels/elements/materials/base.h`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.shading.scattering import EVEN_HUNDREDTHS, NARROWEST_TENTHS

Doubles = npt.NDArray[np.float64]

# Of generators of lattices of so many points one whose sums are the nearest to those of 65536.
_FACETS, _GENERATOR = 1021, 776
_MIDDLES, _ANGLES = 64, 32


def repeated_tables(cosines: Doubles, alphas: Doubles, roughnesses: Doubles) -> Doubles:
    """Shape (4, roughnesses, cosines + 1): the scales of both lobes, and a and b at the first facet.

    The last number of a row is that of all facets between the first and the last one; of scales it is 0.
    """
    found = np.zeros((4, len(alphas), len(cosines) + 1))
    points = _lattice()
    for k, (alpha, roughness) in enumerate(zip(alphas, roughnesses, strict=True)):
        met = _met(cosines, float(alpha), points)
        found[:2, k, :-1] = [_scale(part, cosines, wide(float(roughness))) for part in (met.twice, met.more)]
        found[2:, k] = met.facets
    return found


def wide(roughness: float) -> float:
    """GGX's width of the lobe."""
    return max(roughness, NARROWEST_TENTHS / 10)


def _lattice() -> Doubles:
    """Points of the unit cube of four dimensions, evenly spread; shape (4, 1, _FACETS) (Korobov 1959)."""
    steps = [pow(_GENERATOR, power, _FACETS) for power in range(4)]
    return np.asarray(np.outer(steps, np.arange(_FACETS) + 0.5)[:, None, :] / _FACETS % 1)


@dataclass(frozen=True, slots=True)
class _Met:
    """What light from some directions meets.

    Attributes:
        twice, more: the part of it that leaves after two facets, and after more than two.
        facets: a and b; shape (2, directions + 1).
    """

    twice: Doubles
    more: Doubles
    facets: Doubles


def _met(cosines: Doubles, alpha: float, points: Doubles) -> _Met:
    """For directions with these cosines."""
    cosine = np.maximum(cosines, 1e-4)[:, None]
    out = np.stack(np.broadcast_arrays(np.sqrt(1 - cosine * cosine), 0.0 * cosine, cosine))
    one, meets_one = _mirrored(out, alpha, points[0], points[1])
    two, meets_two = _mirrored(-one, alpha, points[2], points[3])
    before, middle, after = (shadow(np.abs(z), alpha) for z in (cosine, one[2], two[2]))
    up = one[2] > 0
    # Heights that are met have the density (1 + before) s^before in parts s of the facets below, and light escapes upwards
    # from there with the probability s^lambda: integrals of powers.
    goes_on = np.where(up, middle / (1 + before + middle), 1.0)
    down_after = (1 + before) * (1 + middle) / ((1 + middle + after) * (1 + before + after))
    up_after = (1 + before) * middle / ((1 + before + middle) * (1 + before + after))
    leaves = np.where(two[2] > 0, np.where(up, up_after, down_after), 0.0)
    again = goes_on - leaves
    twice, more = leaves.mean(axis=1), np.maximum(again.mean(axis=1), 0.0)
    facets = np.empty((2, len(cosines) + 1))
    facets[:, :-1] = (goes_on * _powers(meets_one)).mean(axis=2) / np.maximum(twice + more, 1e-30)
    weight = cosine * again
    facets[:, -1] = (weight * _powers(meets_two)).sum(axis=(1, 2)) / max(float(weight.sum()), 1e-30)
    return _Met(twice, more, facets)


def _powers(cosine: Doubles) -> Doubles:
    """Of which a and b are the means."""
    rest = 1 - cosine
    return np.stack([rest**5, cosine * rest**6])


def _mirrored(out: Doubles, alpha: float, u: Doubles, v: Doubles) -> tuple[Doubles, Doubles]:
    """Where facets that are seen from `out` mirror it to, and the cosine there."""
    facet, meeting = visible_facets(out, (alpha, alpha), u, 2 * math.pi * v)
    return 2 * meeting * facet - out, meeting


def visible_facets(
    out: Doubles, widths: tuple[float, float], u: Doubles, angle: Doubles
) -> tuple[Doubles, Doubles]:
    """Normals of facets that are seen from directions, all of equal probability, and the cosine of both.

    Dupuy and Benyoub 2023, Sampling Visible GGX Normals with Spherical Caps.

    Args:
        out: shape (3, ...); it may look from below, too.
        widths: of the facets' slopes along x and y.
        u, angle: places of 0 to 1, and 0 to 2 pi or a half of it, spread evenly.
    """
    stretch = np.array([*widths, 1.0]).reshape(3, *[1] * (out.ndim - 1))
    stretched = unit_vectors(stretch * out)
    height = 1 - u * (1 + stretched[2])
    level = np.sqrt(np.maximum(1 - height * height, 0.0))
    cap = np.stack(np.broadcast_arrays(level * np.cos(angle), level * np.sin(angle), height)) + stretched
    facet = unit_vectors(stretch * cap)
    return facet, np.clip((out * facet).sum(axis=0), 0.0, 1.0)


def unit_vectors(a: Doubles) -> Doubles:
    """Vectors of length 1 in the same directions, shape (3, ...)."""
    return np.asarray(a / np.sqrt((a * a).sum(axis=0)))


def shadow(cosine: Doubles, alpha: float) -> Doubles:
    """Smith's function of GGX, Lambda, of directions with these cosines to the normal."""
    tangent = (1 - cosine * cosine) / np.maximum(cosine * cosine, 1e-20)
    return np.asarray((np.sqrt(1 + alpha * alpha * tangent) - 1) / 2)


def _scale(wanted: Doubles, cosines: Doubles, alpha: float) -> Doubles:
    """The factors with which the lobe sends the wanted part of light from each direction back (Sinkhorn and Knopp 1967)."""
    root = (np.arange(_MIDDLES) + 0.5) / _MIDDLES
    other = root * root
    rows = _around(np.maximum(cosines, 1e-4)[:, None], other[None, :], alpha) * (other * 2 * root / _MIDDLES)
    # Factors are linear between columns in the root of the cosine.
    place = root * (len(cosines) - 1)
    low = np.minimum(place.astype(int), len(cosines) - 2)
    columns = np.zeros((_MIDDLES, len(cosines)))
    columns[np.arange(_MIDDLES), low] = 1 - (place - low)
    columns[np.arange(_MIDDLES), low + 1] = place - low
    lobe = rows @ columns
    scale = np.sqrt(wanted)
    for _ in range(40):
        scale = np.sqrt(scale * wanted / np.maximum(lobe @ scale, 1e-30))
    return scale


def _around(o: Doubles, i: Doubles, alpha: float) -> Doubles:
    """The lobe without its scale, summed over all angles between directions with these cosines."""
    # Most of it goes straight on, and the nearer to the horizon the narrower.
    place = ((np.arange(_ANGLES) + 0.5) / _ANGLES)[:, None, None]
    angle = math.pi * (1 - place**3)
    product = np.sqrt((1 - o * o) * (1 - i * i))
    between = o * i + product * np.cos(angle)
    high2 = (o + i) ** 2 / np.maximum(2 + 2 * between, 1e-12)
    spread = 1 - high2 + alpha * alpha * high2
    normals = alpha * alpha / (math.pi * spread * spread)
    facets = (3 * place * place * normals).mean(axis=0) / (
        4 * o * i * (1 + shadow(o, alpha) + shadow(i, alpha))
    )
    return np.asarray(2 * math.pi * (facets + EVEN_HUNDREDTHS / 100))
