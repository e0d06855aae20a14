"""What objects and lights that are added in the window begin with, so that they are seen and give light."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clfractal.elements.lights.set import SetLight
from clfractal.formulas import catalog
from clfractal.scene.places import usual_threshold
from clfractal.schema.kinds import members
from clfractal.schema.light import LightBase
from clfractal.schema.shape import solids
from clfractal.viewer.editing import plain
from clfractal.viewer.panels import menu, right_dock, theme
from clfractal.viewer.panels.timeline_area import left_of, room_of
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.pointer import Floats
from clfractal.viewer.sight import Area, Sight, sight_of

# Radii of what is added, parts of the free part's smaller side.
_SOLID, _FORMULA = 0.11, 0.22
# The least part of the window that is taken for free.
_LEAST_FREE = 0.25
# Of lights on the set: their number; radii, and heights over the surface to light it, parts of the bounds' radius;
# and how bright they are.
_COUNT, _SMALL, _HIGH, _BRIGHT = 600, 1 / 90, 1 / 20, 12.0
_FORMULA_ADDED = {"name": "mandelbulb", "iterations": 8}
_LIT = ("color", "temperature", "intensity", "shadow")


def sight(ui: Ui) -> Sight:
    """What the window shows, and which part of it no panel covers."""
    return sight_of(ui.studio.shown_scene, ui.shown, free(ui))


def free(ui: Ui) -> Area:
    """The part of the picture that no panel covers, in parts of its width and height; all of it if hardly any is."""
    wide, high = ui.size[0], ui.size[1] - room_of(ui)
    left = left_of(ui) if "panels" in ui.show else 0.0
    right = wide - (right_dock.width_of(ui) + theme.MARGIN if right_dock.is_open(ui) else 0.0)
    top = menu.HEIGHT + 2 * theme.MARGIN if "panels" in ui.show else 0.0
    if right - left < _LEAST_FREE * wide or high - top < _LEAST_FREE * high:
        return 0.0, 0.0, 1.0, 1.0
    return left / wide, top / high, right / wide, 1.0


# Objects


def objects(ui: Ui) -> dict[str, dict[str, Any]]:
    """The first values of each kind of object."""
    found = sight(ui)
    left, top, right, bottom = found.free
    pixels = min(right - left, bottom - top)
    center, radius = found.beside(*found.middle, _SOLID * pixels)
    place = vector(center, radius)
    wide, wide_radius = found.beside(*found.middle, _FORMULA * pixels)
    level = _level(ui, found, radius)
    waves: dict[str, Any] = {"height": short(radius / 6), "length": short(2 * radius)}
    if abs(level.get("normal", [0.0])[0]) > 0.99:  # they travel along x, which would be upwards
        waves["direction"] = [0.0, 1.0, 0.0]
    added = catalog.resolve(_FORMULA_ADDED)
    scale = float(f"{wide_radius / added.radius:.3g}")
    return {
        "plane": level,
        "water": {**level, "waves": waves},
        **{kind.tag: {"position": place, **_short(kind.first(radius))} for kind in solids()},
        "formula": {
            "position": vector(wide - scale * np.array(added.center), wide_radius),
            "formula": dict(_FORMULA_ADDED),
            "scale": scale,
        },
        "volume": {"position": vector(wide, wide_radius), "size": short(2 * wide_radius / math.sqrt(3))},
    }


def _short(values: dict[str, Any]) -> dict[str, Any]:
    """Lengths, each as `short`."""
    return {
        name: [short(each) for each in value] if isinstance(value, list) else short(value)
        for name, value in values.items()
    }


def _level(ui: Ui, found: Sight, size: float) -> dict[str, Any]:
    """Where a plane is, level as the scene's first camera is: below the body's middle."""
    up = np.array(ui.studio.saved.camera.up, float)
    up /= np.linalg.norm(up)
    center = np.array(ui.studio.scene.bounds[0], float)
    place = vector(center + (found.floor(up) - float(up @ center)) * up, size)
    return {"position": place, **({} if up[2] > 1 - 1e-9 else {"normal": vector(up, 1.0)})}


# Lights


def light(ui: Ui, kind: str, before: LightBase | None = None) -> dict[str, Any]:
    """The first values of a light of a kind.

    Args:
        before: the light that becomes one of another kind: its place, colour and the brightness of what it lights stay.
    """
    found = sight(ui)
    place, point = found.light()
    values: dict[str, Any] = {"type": kind}
    if before is not None:
        values |= {name: plain(getattr(before, name)) for name in _LIT}
        place = np.array(before.stands_at, float) if before.stands_at is not None else place
    way = point - place
    away = float(np.linalg.norm(way))
    if not away > 0:
        way, away = found.view.axis, found.body.radius
    if kind == SetLight.tag:
        return values | _of_set(ui, before)
    found_kind = next(each for each in members("lights") if each.tag == kind)
    assert issubclass(found_kind, LightBase)
    keys, sizes = found_kind.model_fields, found_kind.first(away)
    if "position" in keys:
        values["position"] = vector(place, away)
    elif before is None:
        way = found.view.axis + 0.64 * found.view.side - 0.79 * found.view.up
    if "direction" in keys:
        values["direction"] = vector(way / np.linalg.norm(way), 1.0)
    if "up" in keys:
        upright = abs(way[2]) < 0.9 * away
        values["up"] = [0.0, 0.0, 1.0] if upright else [0.0, 1.0, 0.0]
    # As much light for what is so far away as the one before gives, or as 1 from far.
    given = 1.0 if before is None else before.intensity * before.given(away)
    each = found_kind.checked({**values, **sizes, "intensity": 1.0}).given(away)
    return values | _short(sizes) | {"intensity": float(f"{given / each:.3g}")}


def _of_set(ui: Ui, before: LightBase | None) -> dict[str, Any]:
    """Lights on the set stand where its orbits come nearest to the trap: how near that is differs from set to set."""
    if isinstance(before, SetLight):
        return {}
    threshold = usual_threshold(ui.studio.scene)
    radius = ui.studio.scene.bounds[1]
    found = {"count": _COUNT, "radius": short(_SMALL * radius), "height": short(_HIGH * radius)}
    found["intensity"] = _BRIGHT
    return found if threshold is None else {**found, "threshold": short(threshold)}


# Numbers that are short to write


def short(value: float) -> float:
    """A length in two digits."""
    return float(f"{value:.2g}")


def number(value: float, size: float) -> float:
    """A coordinate without digits that are below a hundredth of a size."""
    digits = 2 - math.floor(math.log10(size)) if size > 0 else 6
    return round(float(value), max(digits, 0)) + 0.0


def vector(values: Floats, size: float) -> list[float]:
    """Coordinates, each as `number`."""
    return [number(float(each), size) for each in values]
