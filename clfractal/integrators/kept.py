"""Data that take long to make and serve many pictures: grids, packed maps, palettes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.errors import NotReady

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

    def has(self, key: str) -> bool:
        """Whether there are data for a key."""
        return key in self._things

    def adopt(self, other: Kept) -> None:
        """Takes what another keeps, as if it had been used for the last picture."""
        self._things |= other._things
        self._last_asked |= dict.fromkeys(other._things, self._picture)


class Borrowing(Kept):
    """Data of its own, and those that another keeps, which it leaves alone."""

    def __init__(self, lender: Kept) -> None:
        super().__init__()
        self._lender = lender

    def once(self, key: str, make: Callable[[], T]) -> T:
        """The other's data for this key, else its own; see `Kept`."""
        # (Another thread may drop it meanwhile.)
        lent: T | None = self._lender._things.get(key)
        return lent if lent is not None else super().once(key, make)

    def has(self, key: str) -> bool:
        """See `Kept`."""
        return key in self._lender._things or super().has(key)


@dataclass(frozen=True, slots=True)
class Resources:
    """Gives a renderer the data that its kernel reads.

    Attributes:
        device: where buffers are.
        kept: see `Kept`.
        on_compile: told a line if a program has to be compiled first.
        token: ends long work, such as the filling of a grid.
        waits: whether what takes long is made here if it is not there yet.
        counts_waits: whether kernels count how long lanes wait in orbits, which takes about a hundredth of a march.
    """

    device: Device
    kept: Kept = field(default_factory=Kept)
    on_compile: Callable[[str], None] | None = None
    token: CancelToken | None = None
    waits: bool = True
    counts_waits: bool = False

    def once(self, key: str, make: Callable[[], T], *, quick: bool = False) -> T:
        """As `Kept.once`; `quick`: made at once, whoever waits.

        Raises:
            NotReady: it is not there, takes long, and is not waited for.
        """
        if not (self.waits or quick or self.kept.has(key)):
            raise NotReady
        return self.kept.once(key, make)
