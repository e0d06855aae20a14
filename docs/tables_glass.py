"""What rough glass reflects and refracts in all, and wavelengths, laid out as `clfractal/shading/scattering.py` says.

`elements/materials/transmission.h` and `glass_paths.h` of the kernels read them.

The first two are albedos, without the light that is lost between facets; the root of the reflectance at normal incidence is
(j / REFLECTANCES)^2, since light from inside changes most near an index of 1.

A row of the third is a place in the spectrum, of
which all are equally likely: how much more than the index of refraction at 587.6 nm the index is there, in parts of the
difference between 486.1 nm and 656.3 nm; and the weights of linear Rec. 709, whose mean over all places is 1.
"""

from __future__ import annotations

import numpy as np
from tables_facets import shadow
from tables_layers import Doubles, Floats, mean_albedo, mirrored, table_cosines, visible_normals
from tables_spectrum import SEEN, seen_colors

from clfractal.device.threads import in_threads
from clfractal.shading.scattering import COSINES, REFLECTANCES, ROUGHNESSES, SMOOTHEST_PARTS, WAVELENGTHS

LEAST_INDEX = 1.005
"""The index of refraction of glass, at the least: float32 cannot tell where light is bent to below it."""
# Fraunhofer's lines d, F and C, by which Abbe numbers are told, in nanometres.
_LINE_D, _LINE_F, _LINE_C = 587.6, 486.1, 656.3


def found_glass() -> Floats:
    """What `scattering.glass_tables` reads: 0.3 s."""
    return np.concatenate([glass_albedos().reshape(-1), wavelengths().reshape(-1)]).astype(np.float32)


def glass_albedos() -> Doubles:
    """What is reflected and refracted at once, shape (2, REFLECTANCES, ROUGHNESSES, COSINES + 1): outside, inside."""
    table = np.empty((2, REFLECTANCES, ROUGHNESSES, COSINES + 1))

    def fill(k: int) -> None:
        alpha = max((k / (ROUGHNESSES - 1)) ** 2, 1 / SMOOTHEST_PARTS)
        cosine, facet, meeting = visible_normals(table_cosines(), alpha)
        reflected = mirrored(cosine, facet, meeting, alpha)
        for j in range(REFLECTANCES):
            root = (j / REFLECTANCES) ** 2
            index = max((1 + root) / (1 - root), LEAST_INDEX)
            for side, across in enumerate((index, 1 / index)):
                share = fresnel_across(meeting, across)
                passed = _refracted(cosine, facet, meeting, across, alpha)
                table[side, j, k, :-1] = (share * reflected + (1 - share) * passed).mean(axis=(1, 2))

    in_threads(fill, range(ROUGHNESSES))
    table[..., -1] = mean_albedo(table[..., :-1])
    return np.minimum(table, 1.0)


def fresnel_across(cosine: Doubles, across: float) -> Doubles:
    """The reflectance of a smooth boundary for unpolarised light, 1 where it reflects all.

    `across` is the index of refraction beyond it over the one before it.
    """
    square = across * across - 1 + cosine * cosine
    g = np.sqrt(np.maximum(square, 0.0))
    a = (g - cosine) / np.maximum(g + cosine, 1e-12)
    b = (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return np.asarray(np.where(square > 0, np.minimum(a * a * (1 + b * b) / 2, 1.0), 1.0))


def _refracted(cosine: Doubles, facet: Doubles, meeting: Doubles, across: float, alpha: float) -> Doubles:
    """Smith's G1 of the directions that facets refract to; 0 for those that are not below the surface."""
    other = np.sqrt(np.maximum(1 - (1 - meeting * meeting) / (across * across), 0.0))
    below = cosine / across - (meeting / across - other) * facet
    return np.asarray(np.where(below > 0, 1 / (1 + shadow(np.clip(below, 1e-6, 1.0), alpha)), 0.0))


def wavelengths() -> Doubles:
    """The table of wavelengths, shape (WAVELENGTHS + 1, 4)."""
    nanometres = np.linspace(*SEEN, 2001)
    colors = seen_colors(nanometres)
    total = np.concatenate([[0.0], np.cumsum((colors[1:] + colors[:-1]).sum(axis=1))])
    places = np.interp(np.linspace(0, 1, WAVELENGTHS + 1), total / total[-1], nanometres)
    # The ends, where nothing is seen, are as what is beside them.
    places[0], places[-1] = np.interp([0.002, 0.998], total / total[-1], nanometres)
    weights = seen_colors(places)
    weights /= weights.sum(axis=1, keepdims=True)
    weights /= np.trapezoid(weights, dx=1 / WAVELENGTHS, axis=0)
    bend = (places**-2 - _LINE_D**-2) / (_LINE_F**-2 - _LINE_C**-2)
    return np.concatenate([bend[:, None], weights], axis=1)
