"""What a variation is made of: steps of named values, and how large they are."""

from __future__ import annotations

import copy
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from random import Random
from typing import Any, Literal, TypeAlias

from clfractal.scene.model import Scene

Strength: TypeAlias = Literal["slight", "medium", "heavy"]
Kind: TypeAlias = Literal["formula", "camera", "colors"]

AMOUNT: Mapping[str, float] = {"slight": 0.13, "medium": 0.35, "heavy": 1.0}
"""Length of a step, as a part of the boldest one."""


@dataclass(slots=True)
class Step:
    """New values of a scene.

    Attributes:
        changes: dotted path to plain value.
        sizes: the signed length of the step along each quantity, about -1 to 1; tells two variations apart.
        remarks: what changes, in a few words each.
    """

    changes: dict[str, Any] = field(default_factory=dict)
    sizes: dict[str, float] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)

    def add(self, other: Step) -> None:
        """Takes over another step; where both change a value, the other's is kept."""
        self.changes |= other.changes
        self.sizes |= other.sizes
        self.remarks += other.remarks


def signed(rng: Random, amount: float) -> float:
    """A step to either side, never so short that nothing would be seen: `amount` times 0.35 to 1."""
    return rng.choice((-1.0, 1.0)) * rng.uniform(0.35, 1.0) * amount


def rounded(value: float, step: float) -> float:
    """The value without digits that are fine against the length of a step (below a hundredth of it)."""
    if step == 0 or not math.isfinite(step):
        return value
    return round(value, 2 - math.floor(math.log10(abs(step)))) + 0.0


def is_locked(path: str, locked: Collection[str]) -> bool:
    """Whether a path is locked: by its own name, as a part of a locked section, or because a part of it is."""
    return any(path == name or path.startswith(f"{name}.") or name.startswith(f"{path}.") for name in locked)


def changed(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """The scene with new values at dotted paths; only the keys that were given before, and these, count as given.

    Raises:
        SceneError: the schema refuses a value.
    """
    sections: dict[str, Any] = {}
    for path, value in changes.items():
        name, *rest = path.split(".")
        if name not in sections:
            sections[name] = _plain(scene, name)
        if rest:
            _put(sections[name], rest, value)
        else:
            sections[name] = value
    return scene.model_copy(update=sections)


def _plain(scene: Scene, name: str) -> Any:
    """A section as plain data of its own, with the given keys only."""
    if name == "formula":
        return copy.deepcopy(scene.formula.mapping())
    return scene.model_dump(mode="json", include={name}, exclude_unset=True).get(name) or {}


def _put(data: Any, path: list[str], value: Any) -> None:
    for index, part in enumerate(path):
        key: Any = int(part) if isinstance(data, list) else part
        if index == len(path) - 1:
            data[key] = value
        elif isinstance(data, dict) and data.get(key) is None:
            data[key] = {}
        data = data[key]
