"""Where their distances make other surfaces than the set has: views from within, sets of few applications.

Theirs find surfaces where their estimate of a distance ends, whether or not orbits escape. Elsewhere that is where the set
is, which our distances, of the map's own derivative, lead to.
"""

from __future__ import annotations

import math
from typing import Any

from clfractal.exchange.installed import Installed
from clfractal.exchange.measure import are_inside, distance_at
from clfractal.exchange.sequence import formula_of
from clfractal.exchange.settings import Settings

_SOLID = ("iteration_threshold_mode", "interior_mode")
"""Keys with which what does not escape is a solid."""
_FEW = 300.0
"""By how much a power is raised in all where what has not left is not yet the set: its edge is that of their distance."""
_AT_ONCE = 1e-3
"""A distance from the eye, as a part of that to the target and of theirs, that is none: the eye is in a surface of ours."""


def take_their_distance(scene: dict[str, Any], settings: Settings, installed: Installed | None) -> None:
    """Gives a scene's formula the distance of its text, where surfaces are where that ends."""
    section = scene["formula"]
    if section == "none" or "inline" not in section or any(settings.main.flag(key, False) for key in _SOLID):
        return
    members = [each["inline"] for each in section["inline"].get("chain", [section])]
    known = any("distance" in each for each in members)
    degree = max(each["degree"] for each in members)
    powers = degree >= 2
    # (Within limits, what does not escape of powers is cut: a distance of theirs is 0 there.)
    if known or (powers and settings.main.flag("limits_enabled", False)):
        return
    eye = scene["camera"]["position"]
    few = powers and degree ** min(section["iterations"], 99) <= _FEW
    sure = few or are_inside(section, [eye])[0]
    near = 0.0 if sure else distance_at(section, eye)
    if near > _AT_ONCE * math.dist(eye, scene["camera"]["target"]):
        return
    theirs = formula_of(settings, installed, [], hollow=powers)
    # (Texts that were read again are told once.)
    settings.origins[:] = dict.fromkeys(settings.origins)
    if isinstance(theirs, dict) and (sure or near < _AT_ONCE * distance_at(theirs, eye)):
        scene["formula"] = theirs
