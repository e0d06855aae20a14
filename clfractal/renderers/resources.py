"""Data that take long to make and serve many pictures: grids, packed maps, palettes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device

T = TypeVar("T")

# Pictures without a use after which data are dropped; an animation may change back and forth.
_IDLE_PICTURES = 2


class Kept:
    """Data under keys that contain everything they depend on. Data that the last pictures did not use are dropped."""

    def __init__(self) -> None:
        self._things: dict[str, Any] = {}
        self._last_asked: dict[str, int] = {}
        self._picture = 0

    def begin_picture(self) -> None:
        """Counts the pictures, and drops data that were not used lately."""
        self._picture += 1
        for key, asked in list(self._last_asked.items()):
            if asked < self._picture - _IDLE_PICTURES:
                del self._things[key], self._last_asked[key]

    def once(self, key: str, make: Callable[[], T]) -> T:
        """The data made earlier for this key; they are made now if there are none."""
        if key not in self._things:
            self._things[key] = make()
        self._last_asked[key] = self._picture
        found: T = self._things[key]
        return found


class Borrowing(Kept):
    """Data of its own, and those that another keeps, which it leaves alone."""

    def __init__(self, lender: Kept) -> None:
        super().__init__()
        self._lender = lender

    def once(self, key: str, make: Callable[[], T]) -> T:
        """The other's data for this key, else its own; see `Kept`."""
        if key in self._lender._things:
            lent: T = self._lender._things[key]
            return lent
        return super().once(key, make)


@dataclass(frozen=True, slots=True)
class Resources:
    """Gives a renderer the data that its kernel reads.

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
