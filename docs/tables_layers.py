"""What materials reflect in all, by quadrature: the table of layers, laid out as `clfractal/shading/scattering.py` says.

Metals are in `tables_facets.py`, colours of wavenumbers in `tables_spectrum.py`.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from tables_facets import repeated_tables, shadow, unit_vectors, visible_facets, wide
from tables_spectrum import wave_colors

from clfractal.device.threads import in_threads
from clfractal.shading.scattering import (
    COSINES,
    DRAWN_COSINES,
    DRAWN_ROOTS,
    DRAWN_STEPS,
    DRAWN_TURNS,
    EVEN_HUNDREDTHS,
    REFLECTANCES,
    ROUGHNESSES,
    SMOOTHEST_FUZZ_PARTS,
    SMOOTHEST_PARTS,
)

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
_RADII, _ANGLES = 48, 24
_MOST_DRAWN = 32.0  # where next to nothing is lost


def found_albedos() -> Floats:
    """What `scattering.albedo_tables` reads: 0.3 s."""
    width = COSINES + 1
    fuzz = np.empty((ROUGHNESSES, width))
    dielectric = np.empty((REFLECTANCES, ROUGHNESSES, width))
    met = np.empty((3, ROUGHNESSES, width))
    cosines = table_cosines()

    def fill(k: int) -> None:
        roughness = k / (ROUGHNESSES - 1)
        alpha = max(roughness * roughness, 1 / SMOOTHEST_PARTS)
        cosine, facet, meeting = visible_normals(cosines, alpha)
        weight = mirrored(cosine, facet, meeting, alpha)
        for j in range(REFLECTANCES):
            root = j / REFLECTANCES
            dielectric[j, k, :-1] = (weight * fresnel(meeting, (1 + root) / (1 - root))).mean(axis=(1, 2))
        met[:, k, :-1] = _met(weight, meeting)
        fuzz[k, :-1] = _fuzz_albedo(cosines, roughness)

    in_threads(fill, range(ROUGHNESSES))
    for table in (fuzz, dielectric, met):
        table[..., -1] = mean_albedo(table[..., :-1])
    albedos = [np.minimum(part, 1.0).reshape(-1) for part in (fuzz, dielectric)]
    roughnesses = np.arange(ROUGHNESSES) / (ROUGHNESSES - 1)
    alphas = np.maximum(roughnesses * roughnesses, 1 / SMOOTHEST_PARTS)
    metals = repeated_tables(cosines, alphas, roughnesses)
    drawn = drawn_out(metals[:2, :, :-1])
    found = [metals.reshape(-1), *albedos, drawn.reshape(-1), met.reshape(-1), wave_colors().reshape(-1)]
    return np.concatenate(found).astype(np.float32)


def drawn_out(scales: Doubles) -> Doubles:
    """Factors for facets whose slopes are wider along a tangent than across it, beside even ones of the same roughness.

    First on the lobe of what a metal reflects more than once, in both of its directions, so that it has all light that is
    lost (Sinkhorn and Knopp 1967); then on what glass of index 1.5 reflects and refracts, from outside and from within;
    last on what dielectrics reflect, of DRAWN_ROOTS reflectances.

    Args:
        scales: of the two parts of that lobe, see `tables_facets.py`; shape (2, ROUGHNESSES, COSINES).
    """
    found = np.ones((DRAWN_ROOTS + 3, ROUGHNESSES, DRAWN_STEPS, DRAWN_TURNS, DRAWN_COSINES + 1))

    def fill(k: int) -> None:
        roughness = k / (ROUGHNESSES - 1)
        even, even_lost = _drawn_albedos(roughness, 0.0)
        lobe = _repeating_lobe(roughness, scales[:, k], even_lost)
        for step in range(1, DRAWN_STEPS):
            albedo, lost = _drawn_albedos(roughness, step / (DRAWN_STEPS - 1))
            found[1:, k, step, :, :-1] = albedo / even
            for table, one, other in zip(found[1:], albedo, even, strict=False):
                table[k, step, :, -1] = _drawn_mean(one) / _drawn_mean(other)
            wanted, factor = lost.reshape(-1), np.ones(lost.size)
            for _ in range(60):
                factor = np.sqrt(factor * wanted / np.maximum(lobe @ factor, 1e-12))
            found[0, k, step, :, :-1] = np.minimum(factor, _MOST_DRAWN).reshape(lost.shape)

    in_threads(fill, range(ROUGHNESSES))
    return found


def _drawn_widths(roughness: float, anisotropy: float) -> tuple[float, float]:
    """Along the tangent and across it, as in `elements/materials/costly/specular.h`."""
    rest, least = 1 - anisotropy, 1 / SMOOTHEST_PARTS
    along = max(roughness * roughness, least) * math.sqrt(2 / (1 + rest * rest))
    return along, max(rest * along, least)


def _drawn_directions() -> Doubles:
    """Those of the table; shape (3, DRAWN_TURNS, DRAWN_COSINES)."""
    root, turn = np.linspace(0, 1, DRAWN_COSINES), np.linspace(0, 1, DRAWN_TURNS)[:, None]
    cosine = np.maximum(root * root, 1e-4)
    sine = np.sqrt(1 - cosine * cosine)
    return np.stack(np.broadcast_arrays(sine * turn, sine * np.sqrt(1 - turn * turn), cosine))


def _drawn_albedos(roughness: float, anisotropy: float) -> tuple[Doubles, Doubles]:
    """What the tables but the first one are of, in their order, and what white facets lose; by their directions."""
    out = _drawn_directions()[..., None, None]
    widths = _drawn_widths(roughness, anisotropy)
    angle = math.pi * (np.arange(2 * _ANGLES) + 0.5) / _ANGLES
    facet, meeting = visible_facets(out, widths, (np.arange(_RADII) + 0.5)[:, None] / _RADII, angle)
    other = 2 * meeting * facet - out
    one, two = (_drawn_shadow(each, widths) for each in (out, other))
    weight = np.where(other[2] > 0, (1 + one) / (1 + one + two), 0.0)
    found = []
    for across in (1.5, 1 / 1.5):
        reflects = fresnel(meeting, across)
        cosine = np.sqrt(np.maximum(1 - (1 - meeting * meeting) / (across * across), 0.0))
        below = (meeting / across - cosine) * facet - out / across
        passes = np.where(below[2] < 0, 1 / (1 + _drawn_shadow(below, widths)), 0.0)
        found.append(reflects * weight + (1 - reflects) * passes)
    roots = 0.2 + 0.3 * np.arange(DRAWN_ROOTS)
    found += [weight * fresnel(meeting, (1 + root) / (1 - root)) for root in roots]
    return np.stack([each.mean(axis=(2, 3)) for each in found]), np.maximum(
        1 - weight.mean(axis=(2, 3)), 1e-9
    )


def _drawn_shadow(way: Doubles, widths: tuple[float, float]) -> Doubles:
    """Smith's function of GGX, Lambda, of the slopes along a direction."""
    along, across = widths
    slopes = ((along * way[0]) ** 2 + (across * way[1]) ** 2) / np.maximum(way[2] ** 2, 1e-12)
    return np.asarray((np.sqrt(1 + slopes) - 1) / 2)


def _drawn_mean(albedo: Doubles) -> float:
    """Over the hemisphere, weighted by the cosine."""
    root, angle = (np.arange(64) + 0.5) / 64, (np.arange(32) + 0.5) / 64 * math.pi
    shares = _drawn_shares(np.cos(angle)[:, None], root).reshape(-1, albedo.size)
    rows = (shares @ albedo.reshape(-1)).reshape(32, 64)
    return float((rows * root**3).sum() / (32 * (root**3).sum()))


def _drawn_shares(turn: Doubles, root: Doubles) -> Doubles:
    """How much of a value between them each of the table's directions has; they are the last two axes."""
    found = [
        np.maximum(1 - np.abs(np.asarray(at)[..., None] * (count - 1) - np.arange(count)), 0.0)
        for at, count in ((turn, DRAWN_TURNS), (root, DRAWN_COSINES))
    ]
    return np.asarray(found[0][..., :, None] * found[1][..., None, :])


def _repeating_lobe(roughness: float, scales: Doubles, lost: Doubles) -> Doubles:
    """What the lobe of even facets, which lose this light, sends to all directions of the table from each of them."""
    alpha = wide(roughness)
    out = _drawn_directions().reshape(3, -1, 1)
    root, angle = (np.arange(48) + 0.5)[:, None] / 48, 2 * math.pi * (np.arange(64) + 0.5) / 64
    level = np.sqrt(1 - root**4)
    way = np.stack(np.broadcast_arrays(level * np.cos(angle), level * np.sin(angle), root * root)).reshape(
        3, 1, -1
    )
    h = unit_vectors(out + way)
    spread = h[0] ** 2 + h[1] ** 2 + alpha * alpha * h[2] ** 2
    shadows = shadow(out[2], alpha) + shadow(way[2], alpha)
    lobe = (
        alpha * alpha / (math.pi * spread * spread) / (4 * out[2] * (1 + shadows))
        + EVEN_HUNDREDTHS / 100 * way[2]
    )
    ends = [
        [np.interp(np.sqrt(a[2]), np.linspace(0, 1, COSINES), each) for a in (out, way)] for each in scales
    ]
    lobe = lobe * sum(one * two for one, two in ends) * np.repeat(root[:, 0], 64)
    lobe *= lost.reshape(-1, 1) / np.maximum(lobe.sum(axis=1, keepdims=True), 1e-30)
    turn = np.abs(np.cos(angle)) + 0 * root
    shares = _drawn_shares(turn, root + 0 * angle).reshape(-1, DRAWN_TURNS * DRAWN_COSINES)
    return np.asarray(lobe @ shares)


def table_cosines() -> Doubles:
    """The cosines of the tables' columns; the first one stands for a grazing direction."""
    return np.asarray(np.square(np.arange(COSINES) / (COSINES - 1)))


def mean_albedo(rows: Doubles) -> Doubles:
    """2 times the integral of albedo times cosine, of what is linear between columns in the root of the cosine."""
    root = np.linspace(0.0, 1.0, COSINES)
    low, high, step = root[:-1], root[1:], root[1] - root[0]
    # The integral over mu of mu f(sqrt(mu)) with mu = x^2 is that of 2 x^3 f(x).
    whole = (high**4 - low**4) / 2
    part = (2 / 5 * (high**5 - low**5) - low * whole) / step
    return np.asarray(2 * ((whole - part) * rows[..., :-1] + part * rows[..., 1:]).sum(axis=-1))


def fresnel(cosine: Doubles, ior: float) -> Doubles:
    """The reflectance of a dielectric's smooth boundary, for unpolarised light; `ior` is below 1 from within."""
    if ior == 1:
        return np.zeros_like(cosine)
    square = ior * ior - 1 + cosine * cosine
    g = np.sqrt(np.maximum(square, 0.0))
    a = (g - cosine) / (g + cosine)
    b = (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return np.asarray(np.where(square > 0, a * a * (1 + b * b) / 2, 1.0))


def visible_normals(cosines: Doubles, alpha: float) -> tuple[Doubles, Doubles, Doubles]:
    """Cosines of the viewer's directions, of facets with the normal, and of both with each other.

    See `visible_facets`. Shapes (cosines, 1, 1), and twice (cosines, radii, angles): facets of equal probability.
    """
    cosine = np.maximum(cosines, 1e-4)[:, None, None]
    out = np.stack([np.sqrt(1 - cosine * cosine), 0.0 * cosine, cosine])
    u, angle = (np.arange(_RADII) + 0.5)[:, None] / _RADII, math.pi * (np.arange(_ANGLES) + 0.5) / _ANGLES
    facet, meeting = visible_facets(out, (alpha, alpha), u, angle)
    return cosine, facet[2], meeting


def _met(weight: Doubles, meeting: Doubles) -> Doubles:
    """Of facets with these weights their sum, and the mean and the spread of the cosine; shape (3, cosines)."""
    total = weight.mean(axis=(1, 2))
    mean = (weight * meeting).mean(axis=(1, 2)) / total
    square = (weight * (meeting - mean[:, None, None]) ** 2).mean(axis=(1, 2)) / total
    return np.stack([total, mean, np.sqrt(square)])


def mirrored(cosine: Doubles, facet: Doubles, meeting: Doubles, alpha: float) -> Doubles:
    """G2 / G1 of the directions that facets mirror to; 0 below the surface. Takes what `visible_normals` gives."""
    other = np.clip(2 * meeting * facet - cosine, None, 1.0)
    one, two = shadow(cosine, alpha), shadow(np.maximum(other, 1e-6), alpha)
    return np.asarray(np.where(other > 0, (1 + one) / (1 + one + two), 0.0))


def _fuzz_albedo(cosines: Doubles, roughness: float) -> Doubles:
    """Of the fuzz lobe, see `kernels/shading/bsdf.h`; by midpoints over the hemisphere."""
    power = min(1 / max(roughness, 1e-9), SMOOTHEST_FUZZ_PARTS)
    cosine = np.maximum(cosines, 1e-4)[:, None, None]
    sine = np.sqrt(1 - cosine * cosine)
    mu = ((np.arange(96) + 0.5) / 96)[None, :, None]
    phi = math.pi * ((np.arange(96) + 0.5) / 96)[None, None, :]
    level = np.sqrt(1 - mu * mu)
    between = cosine * mu + sine * level * np.cos(phi)
    high = (cosine + mu) / np.sqrt(np.maximum(2 + 2 * between, 1e-12))
    sine_half = np.sqrt(np.clip(1 - high * high, 0.0, 1.0))
    density = (2 + power) / (2 * math.pi) * sine_half**power
    value = density / (4 * (cosine + mu - cosine * mu)) * mu
    return np.asarray(value.mean(axis=(1, 2)) * 2 * math.pi)
