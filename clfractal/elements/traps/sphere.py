"""A sphere as a trap."""

from typing import Any

from clfractal.schema.trap import TrapShape


class SphereTrap(TrapShape):
    """The surface of a ball around a point."""

    place = 40
    keys = ("center", "radius")

    @staticmethod
    def away(offsets: Any, along: Any, axis: Any, radius: float) -> Any:
        """As of every shape."""
        return abs((offsets**2).sum(axis=1) ** 0.5 - radius)
