"""A point as a trap."""

from typing import Any

from clfractal.schema.trap import TrapShape


class PointTrap(TrapShape):
    """A point."""

    place = 10
    keys = ("center",)

    @staticmethod
    def away(offsets: Any, along: Any, axis: Any, radius: float) -> Any:
        """As of every shape."""
        return (offsets**2).sum(axis=1) ** 0.5
