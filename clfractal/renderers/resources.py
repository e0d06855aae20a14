"""What takes long to make and serves many pictures: grids, packed maps, palettes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device

T = TypeVar("T")

# Pictures that did not ask for a thing before it is dropped: an animation may change back and forth.
_IDLE_PICTURES = 2


class Kept:
    """Things by a key that says all they follow from. What the last pictures did not ask for is dropped."""

    def __init__(self) -> None:
        self._things: dict[str, Any] = {}
        self._last_asked: dict[str, int] = {}
        self._picture = 0

    def begin_picture(self) -> None:
        """Counts the pictures, and drops what nobody asked for lately."""
        self._picture += 1
        for key, asked in list(self._last_asked.items()):
            if asked < self._picture - _IDLE_PICTURES:
                del self._things[key], self._last_asked[key]

    def once(self, key: str, make: Callable[[], T]) -> T:
        """What was made for this key, or is made now."""
        if key not in self._things:
            self._things[key] = make()
        self._last_asked[key] = self._picture
        found: T = self._things[key]
        return found


@dataclass(frozen=True, slots=True)
class Resources:
    """Where a renderer gets what its kernel reads.

    Attributes:
        device: where buffers are.
        kept: see `Kept`.
        on_compile: told a line if a program has to be compiled first.
        token: ends long work, such as the filling of a grid.
    """

    device: Device
    kept: Kept = field(default_factory=Kept)
    on_compile: Callable[[str], None] | None = None
    token: CancelToken | None = None
