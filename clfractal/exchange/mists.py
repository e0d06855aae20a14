"""Fog around the set of a settings file, by distances and by iterations, as a scene's mist.

Each step of theirs replaces a part of what is behind it by a colour, and both are numbers of a screen; ours are amounts of
light. So where fog is darker than what is behind it ours has to be denser, where it is brighter thinner, by about as much
as it takes on a way straight down to an even surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from clfractal.exchange.measure import counts_apart
from clfractal.exchange.settings import Section

_DENSE = 0.3
"""Of theirs, times the distance factor: optical thickness of a unit at the set, as pictures of it are."""
_SCREEN = 2.2
_LIT, _SHADED = 1.0, 0.6
"""The part of the main light that fog by iterations shines with: without shadows in it, and with them."""
_LAMPS = 0.5
"""What lamps bring to it, about, as a part of a main light of intensity 1."""
_LARGEST = 1e6
Color = Sequence[float]


def mist_of(
    main: Section, shown: Callable[[Color], list[float]], behind: Color, remarks: list[str]
) -> dict[str, Any] | None:
    """The section `mist`; escape counts are those of theirs.

    Args:
        shown: a colour of theirs as linear light.
        behind: about what is behind the fog, linear.
    """
    near, counted = _near(main, shown), _counted(main, shown, remarks)
    if near is not None and counted is not None:
        remarks.append("iteration_fog_enable: there is fog by distances already")
    found = near or counted
    if found is not None:
        colors = found["colors"]
        usual = colors[len(colors) // 2]["color"]
        thickness = math.pi / 2 * found["density"] * found["width"] if near is not None else math.log(2)
        found["density"] = _rounded(min(found["density"] * denser(usual, behind, thickness), _LARGEST))
    return found


def denser(fog: Color, behind: Color, thickness: float) -> float:
    """By how much fog of amounts of light has to be denser than one of a screen's numbers, so that it looks alike.

    Args:
        thickness: the optical thickness of theirs for which it does.
    """
    thickness = min(max(thickness, 0.05), 5.0)
    through = math.exp(-thickness)
    found, weights = 0.0, 1e-9
    for own, other in zip(fog, behind, strict=True):
        weight = abs(own - other)
        if weight < 1e-3:
            continue
        mixed = (own ** (1 / _SCREEN) * (1 - through) + other ** (1 / _SCREEN) * through) ** _SCREEN
        found -= weight * math.log((mixed - own) / (other - own)) / thickness
        weights += weight
    return found / weights if found else 1.0


def move_counts(scene: dict[str, Any]) -> None:
    """Makes escape counts of theirs, which are whole and end at their bailout, ours, of the scene's formula."""
    mist = scene.get("mist")
    if mist is None or mist.get("by") != "iterations":
        return
    if scene["formula"] == "none":
        del scene["mist"]
        return
    shift = counts_apart(scene["formula"])
    mist["start"], mist["end"] = (
        _rounded(max(mist[key] + shift, least)) for key, least in (("start", 0), ("end", 1))
    )
    for stop in mist["colors"]:
        stop["at"] = _rounded(max(stop["at"] + shift, 0.0))


def _near(main: Section, shown: Callable[[Color], list[float]]) -> dict[str, Any] | None:
    enabled = main.flag("volumetric_fog_enabled", False)
    if not enabled:
        main.without((*main.beginning("volumetric_fog_"), "fog_color_1", "fog_color_2", "fog_color_3"))
        return None
    density = main.number("volumetric_fog_density", 0.5)
    width = main.number("volumetric_fog_distance_factor", 1.0)
    away = main.number("volumetric_fog_distance_from_surface", 0.0)
    first, second = (main.number(f"volumetric_fog_colour_{each}_distance", float(each)) for each in (1, 2))
    grey, blue, white = (0x7530, 0x7530, 0x7530), (0x0000, 0x7530, 0xFFFF), (0xFFFF, 0xFFFF, 0xFFFF)
    colors = [main.color(f"fog_color_{n}", each) for n, each in ((1, grey), (2, blue), (3, white))]
    if density <= 0 or width <= 0:
        return None
    width = min(max(width, 1e-9), _LARGEST)
    found: dict[str, Any] = {
        "density": min(_DENSE * density / width, _LARGEST),
        "width": _rounded(width),
        "colors": _by_distance(colors, max(first, 1e-9), max(second, 1e-9), shown),
    }
    if away > 1e-6 * width:
        found["distance"] = _rounded(min(away, _LARGEST))
    return found


def _by_distance(
    colors: Sequence[Color], first: float, second: float, shown: Callable[[Color], list[float]]
) -> list[dict[str, Any]]:
    """Theirs goes to the second colour as d / first, and to the third as that, 1 at most, times d / second."""
    last = second if second > first else math.sqrt(first * second)
    places = sorted({0.0, min(first, last) / 2, min(first, last), last})

    def at(distance: float) -> list[float]:
        to_second = min(distance / first, 1.0)
        to_third = min(to_second * distance / second, 1.0)
        return shown(_mixed(_mixed(colors[0], colors[1], to_second), colors[2], to_third))

    return [{"at": _rounded(min(each, _LARGEST)), "color": at(each)} for each in places]


def _counted(
    main: Section, shown: Callable[[Color], list[float]], remarks: list[str]
) -> dict[str, Any] | None:
    enabled = main.flag("iteration_fog_enable", False)
    if not enabled:
        main.without(main.beginning("iteration_fog_"))
        return None
    most = min(max(main.number("N", 250.0), 1.0), _LARGEST)
    opacity = main.number("iteration_fog_opacity", 1000.0)
    start = main.number("iteration_fog_opacity_trim", 4.0)
    if main.number("iteration_fog_opacity_trim_high", 250.0) < most:
        remarks.append("iteration_fog_opacity_trim_high: fog goes on at higher counts")
    first, second = (
        main.number(f"iteration_fog_color_{number}_maxiter", default)
        for number, default in ((1, 8.0), (2, 12.0))
    )
    colors = [main.color(f"iteration_fog_color_{number}", (0xFFFF, 0xFFFF, 0xFFFF)) for number in (1, 2, 3)]
    lit = main.number("main_light_intensity", 1.0) * main.flag("main_light_enable", True)
    if any(main.flag(f"aux_light_enabled_{number}", False) for number in range(1, 5)):
        lit += _LAMPS
    bright = max(lit, 0.0) * (_SHADED if main.flag("iteration_fog_shadows", True) else _LIT)
    if opacity <= 0 or start >= most:
        return None
    start = max(start, 0.0)
    places = [start, min(max(first, start), _LARGEST), min(max(second, first, start), _LARGEST)]
    if colors[0] == colors[1] == colors[2]:
        del colors[1:], places[1:]
    return {
        "by": "iterations",
        "density": min(opacity * ((most - start) / most) ** 2, _LARGEST),
        "start": places[0],
        "end": most,
        "colors": [
            {"at": at, "color": shown([min(part * bright, 1.0) for part in color])}
            for at, color in zip(places, colors, strict=True)
        ],
    }


def _mixed(a: Color, b: Color, part: float) -> list[float]:
    return [one + (other - one) * part for one, other in zip(a, b, strict=True)]


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")
