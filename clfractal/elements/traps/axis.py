"""A line as a trap."""

from typing import Any

from clfractal.schema.trap import TrapShape


class AxisTrap(TrapShape):
    """A line without an end, through a point."""

    place = 20
    keys = ("center", "direction")

    @staticmethod
    def away(offsets: Any, along: Any, axis: Any, radius: float) -> Any:
        """As of every shape."""
        arms = offsets - along[:, None] * axis
        return (arms**2).sum(axis=1) ** 0.5
