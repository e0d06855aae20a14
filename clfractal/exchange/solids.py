"""Solids, planes and water of a settings file, as objects; and their materials."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from clfractal.exchange.look import decoded
from clfractal.exchange.parameters import rotation
from clfractal.exchange.placing import angles_of, reach_from
from clfractal.exchange.settings import Section
from clfractal.exchange.solid_formulas import MOST_FORMULAS, Wanted, as_formula, can_be_formula, size_of
from clfractal.exchange.textures import textures_of

MOST = 64
"""Objects of a scene."""
_FLAT = 1e-4
"""How thick what has no thickness is, as a part of its size."""
_HIGHER, _LONGER = 2.7, 6.0
"""Our waves' height and length by their amplitude and length: as high and steep as in pictures of 40 of their lengths."""
_LOW, _LONG = 1e-4, 1e6
"""Of planes that are discs: heights of the eye above them, as parts of how far rays go, and how far that may be."""
_BEGIN = "primitive_"
_GREY = (0xC350, 0xC350, 0xC350)

Vector = tuple[float, ...]


def solids_of(
    main: Section, joined: int, along_paths: bool, remarks: list[str]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The sections `objects` and `materials` of a scene.

    Args:
        joined: how many other objects are formulas.
        along_paths: whether the scene has light along paths.

    Raises:
        FileError: a value is none of its kind.
    """
    objects: dict[str, Any] = {}
    formulas = joined
    materials: dict[str, Any] = {}
    for kind, number in _enabled(main):
        key = f"{_BEGIN}{kind}_{number}_"
        make = _MAKERS.get(kind)
        # (One more may be the limits.)
        if make is None or len(objects) + joined + 1 >= MOST:
            why = "ours are fewer" if make else f"there is no {kind} among our objects"
            remarks.append(f"{key}enabled: {why}")
            continue
        found = make(main, key)
        objects[f"{kind} {number}"] = found
        name = f"material {main.whole(key + 'material_id', 1)}"
        if name != "material 1" or f"{key}color" in main.entries:
            name = name if f"{key}color" not in main.entries else f"{kind} {number}"
            if name not in materials:
                materials[name] = _material(main, key, name, along_paths, remarks)
            found["material"] = name
        wanted = _wanted(main, key, found)
        if can_be_formula(found) and not wanted.is_plain:
            if formulas < MOST_FORMULAS:
                objects[f"{kind} {number}"] = as_formula(found, wanted, reach_from(main, found["position"]))
                formulas += 1
            else:
                remarks.append(f"{key}enabled: it is plain, as no more objects can be formulas")
    return objects, materials


def _wanted(main: Section, key: str, solid: dict[str, Any]) -> Wanted:
    """What a solid has beside its size."""
    hollow = main.flag(key + "empty", False)
    rounding = main.number(key + "rounding", 0.0) if solid["type"] == "box" and not hollow else 0.0
    return Wanted(
        tuple(max(each, 0.0) for each in main.vector(key + "repeat")),
        hollow,
        solid["type"] in ("cylinder", "cone") and not main.flag(key + "caps", True),
        min(max(rounding, 0.0), 1e6),
        _is_cut(main, solid),
    )


def _is_cut(main: Section, solid: dict[str, Any]) -> bool:
    """Whether it reaches out of the limits, to which all is cut."""
    if not can_be_formula(solid) or not main.flag("limits_enabled", False):
        return False
    low, high = main.vector("limit_min", (-10, -10, -10)), main.vector("limit_max", (10, 10, 10))
    size = size_of(solid)
    return any(
        place - size < a or place + size > b for place, a, b in zip(solid["position"], low, high, strict=True)
    )


def _enabled(main: Section) -> Iterable[tuple[str, int]]:
    """The kinds and numbers of what is there; the keys of all others have no meaning."""
    found: set[tuple[str, int]] = set()
    for key in list(main.beginning(_BEGIN)):
        kind, _, rest = key.removeprefix(_BEGIN).partition("_")
        number, _, last = rest.partition("_")
        if not number.isdecimal() or len(number) > 4:
            continue
        if last == "enabled" and main.flag(key, False):
            found.add((kind, int(number)))
    for key in list(main.beginning(_BEGIN)):
        kind, _, rest = key.removeprefix(_BEGIN).partition("_")
        number = rest.partition("_")[0]
        if not number.isdecimal() or len(number) > 4 or (kind, int(number)) not in found:
            main.without([key])
    return sorted(found)


def _material(main: Section, key: str, name: str, along_paths: bool, remarks: list[str]) -> dict[str, Any]:
    """One of theirs by its number; in old files each solid has its own colour and reflection."""
    before = f"mat{name.rpartition(' ')[2]}_" if name.startswith("material") else ""
    color = main.color(f"{before}surface_color" if before else f"{key}color", _GREY)
    mirrors = main.number(f"{before}reflectance" if before else f"{key}reflection", 0.0)
    shown = textures_of(main, before, along_paths, remarks) if before else {}
    main.without(main.beginning(before) if before else ())
    base: dict[str, Any] = {"color": decoded(color), **shown.pop("base", {})}
    if mirrors >= 0.5:
        return {"base": {**base, "metalness": 1}, "specular": {"roughness": 0}, **shown}
    return {"base": base, "specular": {"roughness": 0.3}, **shown}


def _placed(main: Section, key: str, kind: str, along: float = 0.0, **numbers: Any) -> dict[str, Any]:
    """An object with its place and rotation; `along` is how far its middle is from theirs, on its own z axis."""
    matrix = rotation(main.vector(key + "rotation"))
    place = main.vector(key + "position")
    found: dict[str, Any] = {
        "type": kind,
        "position": [a + along * b for a, b in zip(place, matrix[2], strict=True)],
        **numbers,
    }
    angles = angles_of(matrix)
    if any(angles):
        found["rotation"] = angles
    return found


def _flat(main: Section, key: str, kind: str) -> dict[str, Any]:
    matrix = rotation(main.vector(key + "rotation"))
    found: dict[str, Any] = {"type": kind, "position": list(main.vector(key + "position"))}
    normal = [round(each, 9) + 0.0 for each in matrix[2]]
    return found if normal == [0, 0, 1] else {**found, "normal": normal}


def _sphere(main: Section, key: str) -> dict[str, Any]:
    return _placed(main, key, "sphere", radius=_size(main, key + "radius"))


def _box(main: Section, key: str) -> dict[str, Any]:
    sides = [max(each, 1e-6) for each in main.vector(key + "size", (1, 1, 1))]
    return _placed(main, key, "box", size=sides)


def _cylinder(main: Section, key: str) -> dict[str, Any]:
    return _placed(
        main, key, "cylinder", radius=_size(main, key + "radius"), height=_size(main, key + "height")
    )


def _cone(main: Section, key: str) -> dict[str, Any]:
    height = _size(main, key + "height")
    return _placed(main, key, "cone", height / 2, radius=_size(main, key + "radius"), height=height)


def _torus(main: Section, key: str) -> dict[str, Any]:
    radius, tube = _size(main, key + "radius"), _size(main, key + "tube_radius", 0.2)
    main.without([key + "radius_lpow", key + "tube_radius_lpow"])
    return _placed(main, key, "torus", radius=radius, tube=min(tube, radius))


def _circle(main: Section, key: str) -> dict[str, Any]:
    radius = _size(main, key + "radius")
    return _placed(main, key, "cylinder", radius=radius, height=_FLAT * radius)


def _rectangle(main: Section, key: str) -> dict[str, Any]:
    width, height = _size(main, key + "width"), _size(main, key + "height")
    return _placed(main, key, "box", size=[width, height, _FLAT * (width + height)])


def _plane(main: Section, key: str) -> dict[str, Any]:
    """A disc that ends where their rays do, and is seen as its horizon; a plane, where the eye is not above it."""
    up = rotation(main.vector(key + "rotation"))[2]
    eye, place = main.vector("camera", (3, -6, 2)), main.vector(key + "position")
    height = sum(n * (a - b) for n, a, b in zip(up, eye, place, strict=True))
    farthest = main.number("view_distance_max", 50.0)
    if main.flag("limits_enabled", False) or not _LOW * farthest < height < farthest < _LONG:
        return _flat(main, key, "plane")
    radius = math.sqrt(farthest * farthest - height * height)
    thickness = _FLAT * radius
    found = _placed(main, key, "cylinder", radius=radius, height=thickness)
    found["position"] = [a - (height + thickness / 2) * b for a, b in zip(eye, up, strict=True)]
    return found


def _water(main: Section, key: str) -> dict[str, Any]:
    length = _size(main, key + "length", 0.1)
    # (Old files give it in scene units.)
    usual = main.number(key + "amplitude", 0.2 * length) / length
    height = length * max(main.number(key + "relative_amplitude", usual), 0.0)
    main.without(key + name for name in ("iterations", "anim_speed", "wave_from_objects_enable"))
    waves = {"height": _rounded(_HIGHER * height), "length": _rounded(_LONGER * length)}
    return {**_flat(main, key, "water"), "waves": waves}


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")


def _size(main: Section, key: str, default: float = 1.0) -> float:
    return min(max(main.number(key, default), 1e-6), 1e6)


_MAKERS: dict[str, Callable[[Section, str], dict[str, Any]]] = {
    "sphere": _sphere,
    "box": _box,
    "cylinder": _cylinder,
    "cone": _cone,
    "torus": _torus,
    "circle": _circle,
    "rectangle": _rectangle,
    "plane": _plane,
    "water": _water,
}
