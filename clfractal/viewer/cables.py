"""Monitors that windows fill, and that may be unplugged and come back, perhaps at another place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from clfractal.viewer import window
from clfractal.viewer.window import Monitor, Window

_SECONDS = 1.0


class Told(NamedTuple):
    """A line about a monitor, and whether it is bad news."""

    text: str
    wrong: bool


class Cables:
    """Looks after the monitors of windows.

    Systems move the windows of a monitor that is gone, and leave them there when it is back. So a window stays as it is
    while one of its monitors is missing, and fills them anew when all are there.

    Args:
        ask: what tells the monitors that are there.
    """

    def __init__(self, ask: Callable[[], list[Monitor]] = window.monitors) -> None:
        self._ask = ask
        self._filled: list[tuple[Window, list[Monitor]]] = []
        self._there: list[Monitor] = []
        self._looked = 0.0

    def filled(self, where: Window, wanted: Sequence[Monitor]) -> None:
        """A window fills these monitors, which are there, from now on."""
        self._filled.append((where, list(wanted)))
        self._there = self._ask()

    def clear(self) -> None:
        """No window fills any."""
        self._filled.clear()

    def look(self, now: float) -> tuple[list[Told], list[tuple[Window, list[Monitor]]]]:
        """Asks what is there, if a second has passed: what to tell, and the windows that have to fill theirs anew."""
        if not self._filled or now - self._looked < _SECONDS:
            return [], []
        self._looked = now
        told: list[Told] = []
        again: list[tuple[Window, list[Monitor]]] = []
        before, self._there = self._there, self._ask()
        for (where, wanted), old, new in zip(
            self._filled, self._found(before), self._found(self._there), strict=True
        ):
            for each, had, has in zip(wanted, old, new, strict=True):
                called = f"monitor {each.number} ({each.name})"
                if had is not None and has is None:
                    told.append(Told(f"{called} is gone; its picture waits for it", True))
                elif had is None and has is not None:
                    told.append(Told(f"{called} is back", False))
            complete = [each for each in new if each is not None]
            if len(complete) == len(wanted) and old != new:
                again.append((where, complete))
        return told, again

    def has(self, where: Window) -> bool:
        """Whether all monitors of a window are there; also if it fills none."""
        places = zip(self._filled, self._found(self._there), strict=True)
        return all(None not in theirs for (filled, _), theirs in places if filled is where)

    @property
    def complete(self) -> bool:
        """Whether all monitors are there that windows fill."""
        return all(None not in theirs for theirs in self._found(self._there))

    def _found(self, there: Sequence[Monitor]) -> list[list[Monitor | None]]:
        """The monitors of each window as they are now, by their names; of several with one name first those in place."""
        wanted = [each for _, theirs in self._filled for each in theirs]
        found: dict[int, Monitor] = {}
        left = list(there)
        for at_its_place in (True, False):
            for number, each in enumerate(wanted):
                same = [other for other in left if other.name == each.name]
                if at_its_place:
                    same = [other for other in same if (other.x, other.y) == (each.x, each.y)]
                if same and number not in found:
                    found[number] = same[0]
                    left.remove(same[0])
        numbers = iter(range(len(wanted)))
        return [[found.get(next(numbers)) for _ in theirs] for _, theirs in self._filled]
