"""Tables of what materials reflect and refract in all, which travel with the program and which kernels read.

`bsdf.h` keeps the energy of a material's layers with them: light that one layer does not reflect reaches the
next one (Kulla and Conty 2017, Revisiting Physically Based Shading at Imageworks). `docs/make_tables.py` finds them by
quadrature, since the first picture along paths would wait for them.

Axes: the cosine of the direction with the normal is (i / (COSINES - 1))^2, the roughness k / (ROUGHNESSES - 1), the square
root of the reflectance at normal incidence j / REFLECTANCES. The buffer has, one after the other,

    of metals                    [4][ROUGHNESSES][COSINES + 1]
    fuzz                         [ROUGHNESSES][COSINES + 1]
    GGX of a dielectric          [REFLECTANCES][ROUGHNESSES][COSINES + 1]
    highlights drawn out         [6][ROUGHNESSES][DRAWN_STEPS][DRAWN_TURNS][DRAWN_COSINES + 1]
    facets that are met          [3][ROUGHNESSES][COSINES + 1]
    colours of wavenumbers       [WAVES][3]

where the last number of a row is the mean over the hemisphere, weighted by the cosine, of what lies between the others; but
for those of metals, see `docs/tables_facets.py`. Facets that are met are told by what they would reflect if each
reflected all, and by the mean and the spread of the cosine at which they are met, so that a reflectance at a few angles
stands for that at all. Behind these, in pictures with glass, are

    glass seen from outside      [REFLECTANCES][ROUGHNESSES][COSINES + 1]
    glass seen from inside       [REFLECTANCES][ROUGHNESSES][COSINES + 1]
    wavelengths                  [WAVELENGTHS + 1][4]

of which `docs/tables_glass.py` says more.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from clfractal.files.resources import folder

COSINES, ROUGHNESSES, REFLECTANCES = 32, 16, 16
DRAWN_COSINES, DRAWN_TURNS, DRAWN_STEPS = 16, 6, 7
DRAWN_ROOTS = 3
"""Reflectances of dielectrics for which there are such tables, their roots from 0.2 in steps of 0.3."""
SMOOTHEST_PARTS = 512
"""One over the least width of a highlight (GGX's alpha): float32 can still tell its directions apart."""
SMOOTHEST_FUZZ_PARTS = 4
"""One over the least roughness of fuzz: below it would reflect more than it receives at grazing angles."""
EVEN_HUNDREDTHS = 5
"""The part that knows no direction, hundredths of 1/sr beside GGX, of the lobe of light that a rough metal's facets reflect
more than once."""
NARROWEST_TENTHS = 1
"""The least width of that lobe, tenths: narrower ones have next to no light."""
AGAIN_TENTHS = 8
"""Of light that has met three facets the part that meets a fourth, in parts of that which met a third of two, tenths."""
WAVES = 48
"""Wavenumbers at which the light that a film reflects is known, from the longest wave to the shortest."""
WAVELENGTHS = 64

Floats = npt.NDArray[np.float32]


@cache
def albedo_tables() -> Floats:
    """The buffer, float32, one-dimensional."""
    return _table("layers")


@cache
def glass_tables() -> Floats:
    """What follows in it where there is glass; float32, one-dimensional."""
    return _table("glass")


def _table(name: str) -> Floats:
    found: Floats = np.load(folder("tables") / f"{name}.npy", allow_pickle=False)
    found.flags.writeable = False
    return found
