"""Formulas of one's own."""

from __future__ import annotations

from typing import Any

BALL_FILE = """\
title: Ball
reference: none, 2024
variables: [x, y, z]
let: {r: sqrt(x*x + y*y + z*z)}
map: [x*r, y*r, z*r]
add: none
degree: 2
bounds: {radius: 1.1}
"""


BALL: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "let": {"r": "sqrt(x*x + y*y + z*z)"},
    "map": ["x*r", "y*r", "z*r"],
    "add": "none",
    "degree": 2,
    "bounds": {"radius": 1.1},
}
