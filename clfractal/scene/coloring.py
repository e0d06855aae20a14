"""Where the surface's colour comes from: a quantity and a palette."""

from typing import Annotated, Literal

from pydantic import Field

from clfractal.schema.base import Coordinate, Length, problem, rule
from clfractal.schema.fields import Usual
from clfractal.schema.kinds import OneOf
from clfractal.schema.quantity import ByQuantity, CarriedName, ColoringKind, coloring_kind
from clfractal.schema.stops import Palette
from clfractal.schema.trap import Trap


class Coloring(ByQuantity):
    """Where the material's colour comes from: the palette at scale * quantity + offset, or a fixed colour."""

    by: Annotated[str, OneOf("colorings", lambda kind: kind.of_scenes)] = Field(
        "solid", description="the quantity that chooses the colour"
    )
    palette: Palette = "viridis"
    scale: Annotated[Coordinate, Usual(-2, 2)] = Field(
        0.1, description="palette lengths per unit of the quantity"
    )
    offset: Annotated[Coordinate, Usual(-1, 1)] = Field(
        0.0, description="position in the palette where the quantity is 0"
    )
    repeat: bool = Field(
        True, description="true: the palette repeats; false: its first and last colour continue"
    )
    along: Literal["view", "normal", "reflection"] = Field(
        "normal",
        description="direction in which `thickness` (view or normal) or `layer_distance` is measured",
    )
    layer: Annotated[int, Usual(1, 64)] = Field(
        1, ge=1, le=1_000_000, description="iterations of the other layer of `layer_distance`"
    )
    step: Length | None = Field(
        None, description="step in that direction, scene units; null: 1/100 of the bounds' radius"
    )
    number: CarriedName | None = Field(
        None, description="the name of the number for `by: carried`; null: the formula's first one"
    )
    trap: Trap = Field(default_factory=dict, validate_default=True, description="the shape for `by: trap`")

    @property
    def uses_palette(self) -> bool:
        """Whether the palette chooses the colour."""
        return self.kind.uses_palette

    @property
    def kind(self) -> type[ColoringKind]:
        """What chooses the colour."""
        return coloring_kind(self.by)

    @rule
    def _has_a_way(self) -> None:
        if "along" in self.kind.keys and self.along not in self.kind.ways:
            raise problem(f"must be {' or '.join(self.kind.ways)} for {self.by}, got {self.along}", "along")
