"""Solids, planes and water of a settings file, as objects; and their materials."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from clfractal.exchange.look import decoded
from clfractal.exchange.parameters import rotation
from clfractal.exchange.placing import angles_of
from clfractal.exchange.settings import Section

MOST = 64
_BEGIN = "primitive_"
_GREY = (0xC350, 0xC350, 0xC350)

Vector = tuple[float, ...]


def solids_of(main: Section, remarks: list[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The sections `objects` and `materials` of a scene.

    Raises:
        FileError: a value is none of its kind.
    """
    objects: dict[str, Any] = {}
    materials: dict[str, Any] = {}
    for kind, number in _enabled(main):
        key = f"{_BEGIN}{kind}_{number}_"
        make = _MAKERS.get(kind)
        if make is None or len(objects) >= MOST:
            why = "ours are fewer" if make else f"there is no {kind} among our objects"
            remarks.append(f"{key}enabled: {why}")
            continue
        found = make(main, key)
        objects[f"{kind} {number}"] = found
        for part in ("repeat", "empty"):
            if part == "empty" and main.flag(key + part, False):
                remarks.append(f"{key}{part}: it is a solid, not a shell")
            if part == "repeat" and any(main.vector(key + part)):
                remarks.append(f"{key}{part}: it is there once")
        name = f"material {main.whole(key + 'material_id', 1)}"
        if name != "material 1" or f"{key}color" in main.entries:
            name = name if f"{key}color" not in main.entries else f"{kind} {number}"
            materials[name] = _material(main, key, name)
            found["material"] = name
    return objects, materials


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


def _material(main: Section, key: str, name: str) -> dict[str, Any]:
    """One of theirs by its number; in old files each solid has its own colour and reflection."""
    before = f"mat{name.rpartition(' ')[2]}_" if name.startswith("material") else ""
    color = main.color(f"{before}surface_color" if before else f"{key}color", _GREY)
    mirrors = main.number(f"{before}reflectance" if before else f"{key}reflection", 0.0)
    main.without(main.beginning(before) if before else ())
    base: dict[str, Any] = {"color": decoded(color)}
    if mirrors >= 0.5:
        return {"base": {**base, "metalness": 1}, "specular": {"roughness": 0}}
    return {"base": base, "specular": {"roughness": 0.3}}


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
    main.without([key + "rounding"])
    sides = [max(each, 1e-6) for each in main.vector(key + "size", (1, 1, 1))]
    return _placed(main, key, "box", size=sides)


def _cylinder(main: Section, key: str) -> dict[str, Any]:
    main.without([key + "caps"])
    return _placed(
        main, key, "cylinder", radius=_size(main, key + "radius"), height=_size(main, key + "height")
    )


def _cone(main: Section, key: str) -> dict[str, Any]:
    main.without([key + "caps"])
    height = _size(main, key + "height")
    return _placed(main, key, "cone", height / 2, radius=_size(main, key + "radius"), height=height)


def _torus(main: Section, key: str) -> dict[str, Any]:
    radius, tube = _size(main, key + "radius"), _size(main, key + "tube_radius", 0.2)
    main.without([key + "radius_lpow", key + "tube_radius_lpow"])
    return _placed(main, key, "torus", radius=radius, tube=min(tube, radius))


def _plane(main: Section, key: str) -> dict[str, Any]:
    return _flat(main, key, "plane")


def _water(main: Section, key: str) -> dict[str, Any]:
    length = _size(main, key + "length", 0.1)
    height = length * max(main.number(key + "relative_amplitude", 0.2), 0.0)
    main.without(key + name for name in ("amplitude", "iterations", "anim_speed", "wave_from_objects_enable"))
    return {**_flat(main, key, "water"), "waves": {"height": height, "length": length}}


def _size(main: Section, key: str, default: float = 1.0) -> float:
    return min(max(main.number(key, default), 1e-6), 1e6)


_MAKERS: dict[str, Callable[[Section, str], dict[str, Any]]] = {
    "sphere": _sphere,
    "box": _box,
    "cylinder": _cylinder,
    "cone": _cone,
    "torus": _torus,
    "plane": _plane,
    "water": _water,
}
