"""Faces that planes cut: their numbers, and the planes that open a part of the set alone."""

from __future__ import annotations

from collections.abc import Iterator

from clfractal.scene.model import Scene
from clfractal.scene.rectangle import Placed, moved

FACES = 128
"""What separates the numbers of faces: there are fewer objects, of which each has a number from 1."""


def face_number(plane: int, thing: int) -> int:
    """The number of the face where a plane, from 0, cuts an object, from 1, or the set, 0."""
    return (plane + 1) * FACES + thing


def opening_planes(scene: Scene, name: str) -> Iterator[tuple[int, Placed]]:
    """The planes that cut one part of the set alone, by their numbers: of a stack the one that takes most away."""
    first = 0
    for plane in scene.cut_planes:
        if name in scene.joined and name in plane.cut_objects and not plane.set:
            number = plane.count - 1 if plane.spacing < 0 else 0
            yield first + number, moved(plane.plane.placed, normal=number * plane.spacing)
        first += plane.count
