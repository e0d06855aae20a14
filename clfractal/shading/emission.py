"""About how bright materials shine: what things weigh among lights, and which shine the same everywhere."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clfractal.files.srgb import encode
from clfractal.scene.materials import PbrMaterial
from clfractal.scene.model import Scene
from clfractal.schema.base import Vector, unit
from clfractal.schema.mapped import ColorMap, Map, NumberMap
from clfractal.schema.shape import Ball

Floats = npt.NDArray[np.float64]
_PLACES = 256


def even_radiance(material: PbrMaterial) -> Vector | None:
    """The light of a material that is the same everywhere, linear Rec. 709; None if it is not, or if there is none."""
    luminance, color = material.emission.luminance, material.emission.color
    if material.blend is not None or isinstance(luminance, Map) or isinstance(color, Map):
        return None
    red, green, blue = color
    return (luminance * red, luminance * green, luminance * blue) if luminance * max(color) > 0 else None


def mean_radiance(scene: Scene, material: PbrMaterial, ball: Ball | None) -> Vector:
    """About the mean of a material's light, linear Rec. 709: as if what its maps follow were spread evenly.

    Args:
        ball: where the thing is, scene units, which says how far places go; None: anywhere.
    """
    red, green, blue = _mean(scene, material, ball)
    return (float(red), float(green), float(blue))


def _mean(scene: Scene, material: PbrMaterial, ball: Ball | None) -> Floats:
    if material.blend is not None:
        share = float(_mean_of(scene, material.mask, ball)[0])
        one, other = (_mean(scene, scene.materials[name], ball) for name in material.blend)
        return np.asarray((1 - share) * one + share * other)
    shine = material.emission
    return _mean_of(scene, shine.luminance, ball) * _mean_of(scene, shine.color, ball)


def _mean_of(scene: Scene, value: float | Vector | Map, ball: Ball | None) -> Floats:
    """Of a number three times the same, or of a colour."""
    if not isinstance(value, Map):
        return np.broadcast_to(np.asarray(value, np.float64), 3)
    if value.texture is not None:
        texture = scene.textures[value.texture]
        pixels = texture.pixels.reshape(-1, 3).astype(np.float64)
        if isinstance(value, ColorMap):
            return np.asarray(pixels.mean(axis=0))
        codes = encode(np.clip(pixels, 0, None)) if texture.has_codes else pixels
        quantities = codes @ np.array([0.2126, 0.7152, 0.0722])  # ITU-R BT.709-6, item 3.2
    else:
        quantities = np.linspace(*_reach(value, ball), _PLACES)
    low, high = value.used_range
    at = (quantities - low) / (high - low)
    at = at % 1.0 if value.repeat else np.clip(at, 0, 1)
    if isinstance(value, NumberMap):
        places, values = zip(*value.curve, strict=True)
        return np.full(3, np.interp(at, places, values).mean())
    assert isinstance(value, ColorMap)
    from clfractal.scene.palette import named_table

    table = np.asarray(named_table(value.palette), np.float64).reshape(-1, 3)
    return np.asarray(table[np.rint(at * (len(table) - 1)).astype(int)].mean(axis=0))


def _reach(value: Map, ball: Ball | None) -> tuple[float, float]:
    """The quantities that there may be."""
    if ball is None or value.by not in ("height", "distance"):
        return value.used_range
    center, radius = np.array(ball[0]), ball[1]
    if value.by == "height":
        middle = float(center @ np.array(unit(value.direction)))
        return middle - radius, middle + radius
    away = float(np.linalg.norm(center - np.array(value.center)))
    return max(away - radius, 0.0), away + radius
