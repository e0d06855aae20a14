"""What materials reflect in all: tables of directional albedos, found by quadrature, which the kernels read.

`bsdf.h` keeps the energy of a material's layers with them: light that one layer does not reflect reaches the
next one (Kulla and Conty 2017, Revisiting Physically Based Shading at Imageworks).

Axes: the cosine of the direction with the normal is (i / (COSINES - 1))^2, the roughness k / (ROUGHNESSES - 1), the square
root of the reflectance at normal incidence j / REFLECTANCES. The buffer has, one after the other,

    of metals, see `facets.py`   [4][ROUGHNESSES][COSINES + 1]
    fuzz                         [ROUGHNESSES][COSINES + 1]
    GGX of a dielectric          [REFLECTANCES][ROUGHNESSES][COSINES + 1]

where the last number of a row is the mean over the hemisphere, weighted by the cosine, of what lies between the others; but
for those of metals.

They travel with the program, since the first picture along paths would wait for them: `docs/make_tables.py` writes them.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from clfractal.device.threads import in_threads
from clfractal.files.resources import folder
from clfractal.shading.facets import repeated_tables

COSINES, ROUGHNESSES, REFLECTANCES = 32, 16, 16
SMOOTHEST_PARTS = 512
"""One over the least width of a highlight (GGX's alpha): float32 can still tell its directions apart."""
SMOOTHEST_FUZZ_PARTS = 4
"""One over the least roughness of fuzz: below it would reflect more than it receives at grazing angles."""

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
_RADII, _ANGLES = 48, 24


@cache
def albedo_tables() -> Floats:
    """The buffer, float32, one-dimensional."""
    return read_table("layers")


def read_table(name: str) -> Floats:
    """A table that travels with the program."""
    found: Floats = np.load(folder("tables") / f"{name}.npy", allow_pickle=False)
    found.flags.writeable = False
    return found


def found_albedos() -> Floats:
    """What `albedo_tables` reads, by quadrature: 0.3 s."""
    width = COSINES + 1
    fuzz = np.empty((ROUGHNESSES, width))
    dielectric = np.empty((REFLECTANCES, ROUGHNESSES, width))
    cosines = table_cosines()

    def fill(k: int) -> None:
        roughness = k / (ROUGHNESSES - 1)
        alpha = max(roughness * roughness, 1 / SMOOTHEST_PARTS)
        cosine, facet, meeting = visible_normals(cosines, alpha)
        weight = mirrored(cosine, facet, meeting, alpha)
        for j in range(REFLECTANCES):
            root = j / REFLECTANCES
            dielectric[j, k, :-1] = (weight * fresnel(meeting, (1 + root) / (1 - root))).mean(axis=(1, 2))
        fuzz[k, :-1] = _fuzz_albedo(cosines, roughness)

    in_threads(fill, range(ROUGHNESSES))
    for table in (fuzz, dielectric):
        table[..., -1] = mean_albedo(table[..., :-1])
    albedos = [np.minimum(part, 1.0).reshape(-1) for part in (fuzz, dielectric)]
    roughnesses = np.arange(ROUGHNESSES) / (ROUGHNESSES - 1)
    alphas = np.maximum(roughnesses * roughnesses, 1 / SMOOTHEST_PARTS)
    metals = repeated_tables(cosines, alphas, roughnesses)
    return np.concatenate([metals.reshape(-1), *albedos]).astype(np.float32)


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
    """The reflectance of a dielectric's smooth boundary from outside, for unpolarised light."""
    if ior == 1:
        return np.zeros_like(cosine)
    g = np.sqrt(ior * ior - 1 + cosine * cosine)
    a = (g - cosine) / (g + cosine)
    b = (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return np.asarray(a * a * (1 + b * b) / 2)


def visible_normals(cosines: Doubles, alpha: float) -> tuple[Doubles, Doubles, Doubles]:
    """Cosines of the viewer's directions, of facets with the normal, and of both with each other.

    Dupuy and Benyoub 2023, Sampling Visible GGX Normals with Spherical Caps. Shapes (cosines, 1, 1), and twice (cosines,
    radii, angles): facets of equal probability.
    """
    cosine = np.maximum(cosines, 1e-4)[:, None, None]
    sine = np.sqrt(1 - cosine * cosine)
    u = ((np.arange(_RADII) + 0.5) / _RADII)[None, :, None]
    phi = math.pi * ((np.arange(_ANGLES) + 0.5) / _ANGLES)[None, None, :]
    stretched = np.sqrt(alpha * alpha * sine * sine + cosine * cosine)
    x, z = alpha * sine / stretched, cosine / stretched
    height = 1 - u * (1 + z)
    level = np.sqrt(np.maximum(1 - height * height, 0.0))
    h = np.stack(
        np.broadcast_arrays(alpha * (level * np.cos(phi) + x), alpha * level * np.sin(phi), height + z)
    )
    h = h / np.sqrt((h * h).sum(axis=0))
    meeting = np.clip(h[0] * sine + h[2] * cosine, 0.0, 1.0)
    return cosine, h[2], meeting


def shadow(cosine: Doubles, alpha: float) -> Doubles:
    """Smith's function of GGX, Lambda, of directions with these cosines to the normal."""
    tangent = (1 - cosine * cosine) / np.maximum(cosine * cosine, 1e-20)
    return np.asarray((np.sqrt(1 + alpha * alpha * tangent) - 1) / 2)


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
