"""Tone curves: light without limits to light that a screen can show, 0 to 1, both linear Rec. 709.

Every curve leaves black black, neutral colours neutral, and middle grey (`MIDDLE`) as it is; it never falls, and reaches
white at `WHITE`. The arithmetic is single additions and multiplications around a table, so that `tone.h` can do
the same, bit for bit.

- reinhard: E. Reinhard, M. Stark, P. Shirley, J. Ferwerda, "Photographic Tone Reproduction for Digital Images",
  SIGGRAPH 2002, Eq. 4, of the luminance. A colour keeps its proportions and so its hue; one that is still too bright for
  the screen then gets as much white as brings it there, at the same luminance.
- agx: the structure and the constants of T. Sobotka's AgX (2019, github.com/sobotka/AgX) as Blender 4 has them
  (E. Chow, AgXBaseRec2020): colours are brought a fifth nearer to grey, each component goes through one sigmoid of
  its logarithm, and the first step is undone. So bright colours become paler on their way to white, as on film.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from clfractal.files.tone_names import TONES, Tone

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]

MIDDLE = 0.18
"""Middle grey: what reflects so much of the light looks half as light as white."""
STOPS = 6.5
WHITE = MIDDLE * 2**STOPS
"""What becomes white: 6.5 stops above middle grey, some 16.3."""

# Tables are indexed by the leading bits of the float itself, 256 entries for each factor of two, and interpolated.
SHIFT = 23 - 8
LOWEST = int(np.float32(2.0**-16).view(np.int32)) >> SHIFT
ENTRIES = (int(np.float32(2.0**5).view(np.int32)) >> SHIFT) - LOWEST + 1
LIGHTEST = np.float32(1e30)
"""Larger numbers, and infinite ones, count as this."""

LUMINANCE = (np.float32(0.2126), np.float32(0.7152), np.float32(0.0722))
"""Of linear Rec. 709: Recommendation ITU-R BT.709-6, item 3.2."""
INSET = np.float32(0.2)
"""How much nearer to grey AgX brings colours before its curve."""
GREY = (np.float32(0.212), np.float32(0.392), np.float32(0.396))
"""The parts of red, green and blue in that grey."""

_STOPS_BELOW = 10.0  # what AgX takes as black: so many stops below middle grey
_SLOPE, _POWER, _CODE = 2.4, 1.5, 2.4


def reinhard(luminance: Doubles) -> Doubles:
    """The curve of Reinhard's luminance, scaled so that it leaves middle grey where it is."""
    scaled = _reinhard_scale() * np.minimum(luminance, WHITE)
    white = _reinhard_scale() * WHITE
    return scaled * (1 + scaled / white**2) / (1 + scaled)


@cache
def _reinhard_scale() -> float:
    """The k with k m (1 + k m / (k w)^2) / (1 + k m) = m, for middle grey m and white w."""
    # Written out: k m + (m / w)^2 = m + k m^2.
    return (MIDDLE - (MIDDLE / WHITE) ** 2) / (MIDDLE - MIDDLE**2)


def agx(light: Doubles) -> Doubles:
    """AgX's curve of one component: a sigmoid from the logarithm of light to a screen's code, and from this to light."""
    span = _STOPS_BELOW + STOPS
    pivot, code = _STOPS_BELOW / span, MIDDLE ** (1 / _CODE)
    with np.errstate(divide="ignore"):
        place = np.clip((np.log2(light / MIDDLE) + _STOPS_BELOW) / span, 0, 1)
    toe = _limit(pivot, code)
    shoulder = _limit(1 - pivot, 1 - code)
    bent = np.where(place < pivot, toe, shoulder)
    away = _SLOPE * (place - pivot)
    found = code + away / (1 + np.abs(away / bent) ** _POWER) ** (1 / _POWER)
    found = np.where(place > 0, np.clip(found, 0, 1), 0)
    return found**_CODE


def _limit(across: float, up: float) -> float:
    """The height at which a sigmoid would end that leaves the pivot with the slope and passes (across, up) from there."""
    rise = _SLOPE * across
    return float(rise / ((rise / up) ** _POWER - 1) ** (1 / _POWER))


@cache
def tables() -> Floats:
    """Of each curve but the linear one `ENTRIES` numbers: Reinhard's factor of the luminance, and AgX's light."""
    index = np.arange(LOWEST, LOWEST + ENTRIES, dtype=np.int32)
    light = (index << SHIFT).view(np.float32).astype(np.float64)
    return np.stack([reinhard(light) / light, agx(light)]).astype(np.float32)


def toned(red: Floats, green: Floats, blue: Floats, tone: Tone) -> tuple[Floats, Floats, Floats]:
    """Colours of any one shape through a tone curve; `linear` gives them back as they are.

    Otherwise NaN and negative numbers count as 0, and none of the result is below 0. A component may be above 1 by some
    hundredths, which a screen cuts off.
    """
    if tone == "linear":
        return red, green, blue
    limited = tuple(np.fmin(np.fmax(plane, np.float32(0)), LIGHTEST) for plane in (red, green, blue))
    return _by_luminance(*limited) if tone == "reinhard" else _by_component(*limited)


def _weighed(red: Floats, green: Floats, blue: Floats, weights: tuple[np.float32, ...]) -> Floats:
    found: Floats = weights[0] * red
    found += weights[1] * green
    found += weights[2] * blue
    return found


def _looked_up(values: Floats, tone: Tone) -> Floats:
    """The table's numbers at values of 0 or more, interpolated; outside of it those at its ends."""
    table = tables()[TONES.index(tone) - 1]
    bits = np.clip(
        np.ascontiguousarray(values).view(np.int32), LOWEST << SHIFT, (LOWEST + ENTRIES - 1) << SHIFT
    )
    index = (bits >> SHIFT) - LOWEST
    share = (bits & ((1 << SHIFT) - 1)).astype(np.float32) * np.float32(1 / (1 << SHIFT))
    low = table.take(index)
    found: Floats = low + (table.take(np.minimum(index + 1, ENTRIES - 1)) - low) * share
    return found


def _by_luminance(red: Floats, green: Floats, blue: Floats) -> tuple[Floats, Floats, Floats]:
    luminance = _weighed(red, green, blue, LUMINANCE)
    factor = _looked_up(luminance, "reinhard")
    planes = [plane * factor for plane in (red, green, blue)]
    shown = np.minimum(luminance * factor, np.float32(1))
    peak = np.maximum(np.maximum(planes[0], planes[1]), planes[2])
    outside = peak > 1
    share = np.ones_like(peak)
    np.divide(np.float32(1) - shown, peak - shown, out=share, where=outside)
    first, second, third = (np.where(outside, shown + (plane - shown) * share, plane) for plane in planes)
    return first, second, third


def _by_component(red: Floats, green: Floats, blue: Floats) -> tuple[Floats, Floats, Floats]:
    kept, back = np.float32(1) - INSET, np.float32(1) / (np.float32(1) - INSET)
    grey = INSET * _weighed(red, green, blue, GREY)
    planes = [_looked_up(kept * plane + grey, "agx") for plane in (red, green, blue)]
    grey = INSET * _weighed(planes[0], planes[1], planes[2], GREY)
    first, second, third = (np.maximum((plane - grey) * back, np.float32(0)) for plane in planes)
    return first, second, third
