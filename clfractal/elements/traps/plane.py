"""A plane as a trap."""

from typing import Any

from clfractal.schema.trap import TrapShape


class PlaneTrap(TrapShape):
    """A plane through a point."""

    place = 30
    keys = ("center", "direction")

    @staticmethod
    def away(offsets: Any, along: Any, axis: Any, radius: float) -> Any:
        """As of every shape."""
        return abs(along)
