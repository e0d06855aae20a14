"""Balls in space: the bounds of what is searched, and where lights on the set stand."""

from typing import Annotated

from pydantic import Field

from clfractal.schema.base import Length, Position, Section
from clfractal.schema.fields import SCALE


class Ball(Section):
    """A ball in space that contains everything visible."""

    center: Position = Field((0.0, 0.0, 0.0), description="scene units")
    radius: Annotated[Length, SCALE] = Field(description="scene units")
