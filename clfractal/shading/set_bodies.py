"""Of what bodies a set is made: which of its parts light goes through, and which of these are one body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from clfractal.scene.blends import is_glass
from clfractal.scene.glass_parts import has_glass_parts
from clfractal.scene.model import Scene
from clfractal.shading.maps import MappedMaterials, glass_bodies


@dataclass(frozen=True, slots=True)
class SetBodies:
    """The bodies of a set that light goes through, by numbers above those of all objects.

    Where two of them overlap the one with the higher number displaces the other, and what is opaque displaces both.

    Attributes:
        own: that of the scene's own formula; 0: it is opaque.
        parts: those of what is joined to it, by names; of what only cuts it 0.
        first_skin: of several the first that light only goes below; they come after all others.
        several: whether there are several, or opaque parts beside them: else all that is joined is one body.
    """

    own: int
    parts: Mapping[str, int]
    first_skin: int
    several: bool


def joins_smoothly(scene: Scene) -> bool:
    """Whether anything flows into the set."""
    return any(each.join == "smooth_union" for each in scene.joined.values())


def set_bodies(scene: Scene) -> SetBodies:
    """The bodies of a scene's set.

    Parts of one material are one body; bodies have numbers in the order of their last parts, but those that light only goes
    below come after all others. Where no part differs from others by being glass all of the set is one body.
    """
    first, nothing = len(scene.objects) + 1, dict.fromkeys(scene.joined, 0)
    own, *others = glass_bodies(scene)
    through = dict(zip(scene.objects, others, strict=True))
    parts = {
        name: through[name] for name, each in scene.joined.items() if each.join in ("union", "smooth_union")
    }
    if not own and not any(parts.values()):
        return SetBodies(0, nothing, 0, several=False)
    if not has_glass_parts(scene):
        return SetBodies(first, dict.fromkeys(scene.joined, first), 0, several=False)
    blends = MappedMaterials(scene).blends
    root, *roots = blends.roots
    materials = dict(zip(scene.objects, roots, strict=False))
    kinds = [root if own else None, *(materials[name] if clear else None for name, clear in parts.items())]
    last = {kind: place for place, kind in enumerate(kinds) if kind is not None}
    skins = {kind for kind in last if not is_glass(blends.materials[kind], scene.materials)}
    ranks = sorted(last, key=lambda kind: (kind in skins, last[kind]))
    bodies = [0 if kind is None else first + ranks.index(kind) for kind in kinds]
    return SetBodies(
        bodies[0],
        nothing | dict(zip(parts, bodies[1:], strict=True)),
        first + len(ranks) - len(skins),
        several=True,
    )
