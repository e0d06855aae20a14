"""Which things pixels show: numbers and Cryptomatte layers, made of what the kernel notes.

Cryptomatte (Friedman and Jones 2015; its specification 1.2.0, Psyop) names things by 32 bits of MurmurHash3 (Appleby),
told as the bits of a float; each rank is a pair of this identifier and what the thing covers, the largest first.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clfractal.files.channels import (
    CRYPTOMATTE_MATERIALS,
    CRYPTOMATTE_OBJECTS,
    CRYPTOMATTE_RANKS,
    ID_CHANNELS,
)
from clfractal.schema.shape import ObjectBase

if TYPE_CHECKING:
    from clfractal.scene.cut_plane import CutPlane
    from clfractal.scene.model import Scene

Floats = npt.NDArray[np.float32]
_MASK = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class Things:
    """What pixels may show: names, and which of them each thing has that the kernel numbers.

    These are the set, then objects; and behind them, for each plane, also one that does not cut, the same as they are seen
    on its faces.

    Attributes:
        names: in the order of their numbers, from 1.
        numbers: of each thing of the kernel the number of its name, from 1.
    """

    names: tuple[str, ...]
    numbers: tuple[int, ...]

    def identifiers(self) -> Floats:
        """Each name's, as Cryptomatte tells it."""
        return np.array([identifier(name) for name in self.names], np.float32)


def objects_of(scene: Scene) -> Things:
    """The set and the objects, by their names; the set is `set` unless an object is called so."""
    names = (_free("set", scene.objects), *scene.objects)
    own = tuple(range(1, len(names) + 1))
    return Things(names, own * (1 + len(_planes(scene))))


def _planes(scene: Scene) -> list[CutPlane]:
    """The planes of a scene, those of a stack one by one."""
    return [plane for plane in scene.cut_planes for _ in range(plane.count)]


def materials_of(scene: Scene) -> Things:
    """The materials by their names; what has none has `material`, the section of the scene."""
    names = (*scene.materials, _free("material", scene.materials))
    own = scene.material.name

    def number(name: str | None) -> int:
        return len(names) if name is None else 1 + names.index(name)

    bodies: tuple[ObjectBase, ...] = tuple(scene.objects.values())
    numbers = (number(own), *(number(each.material or own) for each in bodies))
    faces = [
        numbers if plane.material is None else (number(plane.material),) * len(numbers)
        for plane in _planes(scene)
    ]
    return Things(names, sum(faces, numbers))


def told(framebuffer: Floats, channels: Sequence[str], scene: Scene) -> Floats:
    """A framebuffer of the kernel, shape (tiles, channels, rows, columns), with what its channels of things tell in the
    end.
    """
    if set(ID_CHANNELS).isdisjoint(channels):
        return framebuffer
    made = framebuffer.copy()
    for number, layer, things in (
        ("object", CRYPTOMATTE_OBJECTS, objects_of(scene)),
        ("material", CRYPTOMATTE_MATERIALS, materials_of(scene)),
    ):
        numbers = np.array([0, *things.numbers])
        if number in channels:
            at = channels.index(number)
            made[:, at] = numbers[framebuffer[:, at].astype(int)]
        if not set(layer).isdisjoint(channels):
            places = [channels.index(name) for name in layer]
            made[:, places] = ranked(framebuffer[:, places], numbers, things.identifiers())
    return made


def ranked(pairs: Floats, numbers: npt.NDArray[np.int64], identifiers: Floats) -> Floats:
    """Pairs of a thing and its coverage, shape (tiles, 2 CRYPTOMATTE_RANKS, ...), as pairs of names, the largest
    coverage first.

    Args:
        numbers: of each of the kernel's things, from 0 for none, the number of its name, 0 for none.
        identifiers: of the names from 1.
    """
    name = numbers[pairs[:, ::2].astype(int)]
    covers = np.where(name > 0, pairs[:, 1::2], 0)
    # What has the same name is one: its first rank takes all.
    for later in range(1, CRYPTOMATTE_RANKS):
        for rank in range(later):
            same = (name[:, rank] == name[:, later]) & (name[:, later] > 0)
            covers[:, rank] += np.where(same, covers[:, later], 0)
            covers[:, later] = np.where(same, 0, covers[:, later])
            name[:, later] = np.where(same, 0, name[:, later])
    order = np.argsort(-covers, axis=1, kind="stable")
    name, covers = np.take_along_axis(name, order, 1), np.take_along_axis(covers, order, 1)
    made = np.empty_like(pairs)
    made[:, ::2] = np.concatenate([np.zeros(1, np.float32), identifiers])[name]
    made[:, 1::2] = covers
    return made


def attributes(scene: Scene, channels: Sequence[str]) -> dict[str, str | list[str]]:
    """What a file's header tells of things: their names, and of Cryptomatte layers which identifier each name has."""
    found: dict[str, str | list[str]] = {}
    if "object" in channels:
        found["objects"] = list(objects_of(scene).names)
    if "material" in channels:
        found["materials"] = list(materials_of(scene).names)
    for name, layer, things in (
        ("CryptoObject", CRYPTOMATTE_OBJECTS, objects_of(scene)),
        ("CryptoMaterial", CRYPTOMATTE_MATERIALS, materials_of(scene)),
    ):
        if set(layer).isdisjoint(channels):
            continue
        manifest = {each: f"{bits_of(each):08x}" for each in things.names}
        key = f"cryptomatte/{murmur3(name.encode()):08x}"[: len("cryptomatte/") + 7]
        found |= {
            f"{key}/name": name,
            f"{key}/hash": "MurmurHash3_32",
            f"{key}/conversion": "uint32_to_float32",
            f"{key}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
        }
    return found


def identifier(name: str) -> float:
    """The float that stands for a name."""
    return float(np.array(bits_of(name), np.uint32).view(np.float32))


def bits_of(name: str) -> int:
    """Its bits: the hash, of which one bit is turned where it would be no normal number."""
    found = murmur3(name.encode())
    return found ^ (1 << 23) if (found >> 23) & 255 in (0, 255) else found


def murmur3(data: bytes) -> int:
    """MurmurHash3 of 32 bits for x86, with the seed 0 (Appleby 2011)."""

    def rotated(value: int, by: int) -> int:
        return (value << by | value >> 32 - by) & _MASK

    def mixed(word: int) -> int:
        return rotated(word * 0xCC9E2D51 & _MASK, 15) * 0x1B873593 & _MASK

    state, whole = 0, len(data) - len(data) % 4
    for at in range(0, whole, 4):
        state = rotated(state ^ mixed(int.from_bytes(data[at : at + 4], "little")), 13)
        state = (state * 5 + 0xE6546B64) & _MASK
    state ^= mixed(int.from_bytes(data[whole:], "little")) if whole < len(data) else 0
    state ^= len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        state = (state ^ state >> shift) * factor & _MASK
    return state ^ state >> 16


def _free(name: str, taken: Mapping[str, object]) -> str:
    while name in taken:
        name = f"the {name}"
    return name
