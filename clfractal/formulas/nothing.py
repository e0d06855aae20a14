"""The formula `none`, whose set is empty: for scenes of objects alone.

Nothing asks it, but it is read, sent and kept as any other.
"""

from collections.abc import Mapping
from typing import Any

NONE = "none"
# A place has left the set as soon as it is looked at; a ball of radius 1 stands where bounds of a formula are wanted.
EMPTY: Mapping[str, Any] = {
    "title": "None",
    "description": "An empty set, for scenes of objects alone.",
    "variables": ["x", "y", "z"],
    "map": ["2*x", "2*y", "2*z"],
    "add": "none",
    "degree": 1,
    "bounds": {"center": [0, 0, 0], "radius": 1},
    "bailout": 1e-6,
}
