"""Blends of materials: what is made of what, in an order in which shares can be passed on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from clfractal.errors import SceneError, Where, unknown_name
from clfractal.scene.materials import PARTS, PbrMaterial
from clfractal.schema.material import BLACK


@dataclass(frozen=True, slots=True)
class Blends:
    """Materials and all that they are blended of.

    Attributes:
        materials: each one once, blends before those that they are made of.
        parts: of each the numbers of the two that it blends, or None.
        roots: the numbers of those that were asked for, in their order.
    """

    materials: tuple[PbrMaterial, ...]
    parts: tuple[tuple[int, int] | None, ...]
    roots: tuple[int, ...]


def blends_of(roots: Sequence[PbrMaterial], named: Mapping[str, PbrMaterial]) -> Blends:
    """All that `roots` are made of; their references have been checked."""
    ended: list[PbrMaterial] = []
    known: set[int] = set()

    def visit(material: PbrMaterial) -> None:
        if id(material) in known:
            return
        known.add(id(material))
        for name in reversed(material.blend or ()):
            visit(named[name])
        ended.append(material)

    for root in reversed(roots):
        visit(root)
    order = ended[::-1]
    numbers = {id(material): number for number, material in enumerate(order)}
    parts = tuple(
        None if m.blend is None else (numbers[id(named[m.blend[0]])], numbers[id(named[m.blend[1]])])
        for m in order
    )
    return Blends(tuple(order), parts, tuple(numbers[id(root)] for root in roots))


def made_of(material: PbrMaterial, named: Mapping[str, PbrMaterial]) -> Iterator[PbrMaterial]:
    """A material, or those with layers that it is blended of; references have been checked."""
    if material.blend is None:
        yield material
    for name in material.blend or ():
        yield from made_of(named[name], named)


def is_glass(material: PbrMaterial, named: Mapping[str, PbrMaterial]) -> bool:
    """Whether light may go through a material, or through a part of what it is blended of; likewise."""
    return any(each.transmission.has("weight") for each in made_of(material, named))


def is_subsurface(material: PbrMaterial, named: Mapping[str, PbrMaterial]) -> bool:
    """Whether light may go below a material's boundary, or that of a part of what it is blended of; likewise."""
    return any(each.subsurface.has("weight") for each in made_of(material, named))


def is_costly(material: PbrMaterial, named: Mapping[str, PbrMaterial]) -> bool:
    """Whether a material, or a part of what it is blended of, has what most have not and pay nothing for; likewise."""
    return any(
        getattr(each, part.tag).has(name)
        for each in made_of(material, named)
        for part in PARTS
        for name in part.costly
    )


def is_participating(material: PbrMaterial, named: Mapping[str, PbrMaterial]) -> bool:
    """Whether a material, or a part of what it is blended of, scatters light on its way through; likewise."""
    return any(
        each.transmission.has("weight") and each.transmission.scatter != BLACK
        for each in made_of(material, named)
    )


def check_blends(named: Mapping[str, PbrMaterial]) -> None:
    """Raises SceneError, at materials.NAME.blend, for a name that no material has, and for what is made of itself."""
    for name, material in named.items():
        for index, part in enumerate(material.blend or ()):
            if part not in named:
                where = Where(path=f"materials.{name}.blend.{index}")
                raise SceneError(unknown_name("material", part, tuple(named)), where)
    done: set[str] = set()

    def visit(name: str, above: tuple[str, ...]) -> None:
        if name in above:
            ring = " -> ".join((*above[above.index(name) :], name))
            raise SceneError(f"is made of itself: {ring[:200]}", Where(path=f"materials.{name}.blend"))
        if name in done:
            return
        for part in named[name].blend or ():
            visit(part, (*above, name))
        done.add(name)

    for name in named:
        visit(name, ())
