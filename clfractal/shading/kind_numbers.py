"""Numbers that stand for words of a scene in records and in kernels: every program gets the same ones."""

from __future__ import annotations

from collections.abc import Mapping

from clfractal.device.source import kinds

TRAPS = kinds("elements/traps")
COLORINGS = kinds("elements/colorings")
KNOWN = {"at_hit": 0, "with_points": 1, "by_formula": 2}
ALONG = {"view": 0, "normal": 1, "reflection": 2}
NORMALS = {
    "gradient": 0,
    "one_triangle": 1,
    "eight_triangles_shading": 2,
    "eight_triangles_normal": 3,
    "least_squares": 4,
}
# What a scene has beside what other fields tell, as bits.
FEATURES = {
    "fog": 1,
    "bump": 2,
    "paths": 4,
    "shining_clouds": 8,
    "emitters": 16,
    "glass": 32,
    "glass_set": 64,
    "subsurface": 128,
    "clouds": 256,
    "sought": 512,
}

_FAMILIES: Mapping[str, Mapping[str, int]] = {
    "KNOWN": KNOWN,
    "ALONG": ALONG,
    "NORMAL": NORMALS,
    "FEATURE": FEATURES,
}


def kind_text() -> str:
    """The numbers as constants in C, such as `ALONG_VIEW`."""
    return "".join(
        f"#define {family}_{word.upper()} {number}\n"
        for family, numbers in _FAMILIES.items()
        for word, number in numbers.items()
    )
