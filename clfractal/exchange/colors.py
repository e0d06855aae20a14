"""How settings choose colours: a palette, along which the orbit's distance from 0 or its folds lead."""

from __future__ import annotations

from typing import Any

from clfractal.errors import FileError
from clfractal.exchange.look import Screen
from clfractal.exchange.settings import Section, Settings

MOST_STOPS = 255
LENGTH = 10_000
"""Positions of a gradient go from 0 to this."""
_WHOLE = 2560
"""Of their units of colour a palette's length is so many."""
_UNITS = {10: 1000, 73: 200}
"""How many units a distance of 1 is, by the formula; 5000 for all others, 1000 for hybrids."""
_FOLD = 100
"""How many units 1 of what folds sum up is."""
_ALGORITHM = "mat1_fractal_coloring_algorithm"
_EXTRA = "mat1_fractal_coloring_extra_color_enabled_false"
_BY_FOLDS = (8, 17, 18, 43, 60, 64, 75, 76, 77)
"""Formulas whose colours follow how often a point was folded, which those of our library do not count."""
DEFAULT = (
    "0 fd6029 1000 698403 2000 fff59b 3000 f5bd22 4000 0b5e87"
    " 5000 c68876 6000 a51c64 7000 3b9fee 8000 d4ffd4 9000 aba53c"
)
"""The colours of a file that gives none."""


def follows_folds(settings: Settings) -> bool:
    """Whether colours follow nothing but how often a point was folded."""
    main = settings.main
    plain = not any(main.flag(key, False) for key in ("hybrid_fractal_enable", "boolean_operators", _EXTRA))
    shown = main.flag("mat1_use_colors_from_palette", True) and main.flag("fractal_color", True)
    standard = main.text(_ALGORITHM, "0").strip() == "0"
    return plain and shown and standard and main.whole("formula_1", 2) in _BY_FOLDS


def coloring_of(settings: Settings, remarks: list[str], folds: str | None = None) -> dict[str, Any] | None:
    """The section `coloring`; None if the surface has one colour.

    Args:
        folds: the number that the formula carries of how often a point was folded; None: it has none.

    Raises:
        FileError: a value is none of its kind.
    """
    main = settings.main
    new = "mat1_surface_color_palette" in main.entries or "mat1_surface_color_gradient" in main.entries
    before = "mat1_" if new or "surface_color_palette" not in main.entries else ""
    speed = main.number(f"{before}coloring_speed", 1.0)
    offset = main.number(f"{before}coloring_palette_offset", 0.0)
    main.without(f"{before}coloring_{name}" for name in ("random_seed", "palette_size", "saturation"))
    wanted = main.flag("mat1_use_colors_from_palette", True) and main.flag("fractal_color", True)
    if not main.flag("mat1_surface_gradient_enable", True) or not wanted:
        return None
    stops = _stops(main, before, Screen.of(main))
    hybrid = main.flag("hybrid_fractal_enable", False)
    number = main.whole("formula_1", 2)
    units = 1000 if hybrid else _UNITS.get(number, 5000)
    if (number in _BY_FOLDS and folds is None) or hybrid:
        remarks.append("colours follow the orbit's distance from 0 alone, not the folds that it went through")
    if main.whole(_ALGORITHM, 0) != 0 or main.flag(_EXTRA, False):
        remarks.append("mat1_fractal_coloring_algorithm: colours follow the orbit's distance from 0")
    main.without(main.beginning("mat1_fractal_coloring_"))
    by = {"by": "trap"} if folds is None else {"by": "carried", "number": folds}
    units = units if folds is None else _FOLD
    return {
        **by,
        "palette": stops,
        "scale": float(f"{units / _WHOLE * speed:.6g}"),
        "offset": offset % 1.0,
    }


def _stops(main: Section, before: str, screen: Screen) -> list[dict[str, Any]]:
    """The palette: colours at positions, the first one once more at the end, as the palette repeats."""
    key = f"{before}surface_color_gradient"
    if key not in main.entries and f"{before}surface_color_palette" in main.entries:
        key = f"{before}surface_color_palette"
        words = main.text(key).split()
        pairs = [(LENGTH * place / max(len(words), 1), word) for place, word in enumerate(words)]
    else:
        words = main.text(key, DEFAULT).split()
        if len(words) % 2:
            raise FileError("must be positions and colours in turn", main.where(key))
        pairs = []
        for place, word in zip(words[::2], words[1::2], strict=True):
            if not place.isdecimal() or int(place[:9]) > LENGTH:
                raise FileError(f"positions must be 0 to {LENGTH}, got {place[:20]!r}", main.where(key))
            pairs.append((float(place), word))
    if not pairs:
        raise FileError("must have a colour", main.where(key))
    pairs.sort(key=lambda pair: pair[0])
    step = -(-len(pairs) // MOST_STOPS)
    stops: list[dict[str, Any]] = [
        {"at": round(place / LENGTH, 6), "color": _shown(main.code(key, word, 0xFFFFFF), screen)}
        for place, word in pairs[::step]
    ]
    if len(stops) == 1 or stops[-1]["at"] < 1:
        stops.append({"at": 1, "color": stops[0]["color"]})
    return stops


def _shown(code: int, screen: Screen) -> str | list[float]:
    """A colour of the palette, as it comes on a screen."""
    if screen.gamma == 1:
        return f"#{code:06x}"
    return screen.color([(code >> shift & 255) / 255 for shift in (16, 8, 0)])
