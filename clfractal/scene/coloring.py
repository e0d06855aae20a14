"""Where the surface's colour comes from: a quantity and a palette."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Tag, model_validator

from clfractal.schema.base import (
    Color,
    Coordinate,
    Direction,
    Fraction,
    Length,
    Position,
    Section,
    chosen_by_word,
    length,
    problem,
)
from clfractal.schema.fields import Usual
from clfractal.schema.hex_color import COLOR_SCHEMA, AlsoAs, linear_color


class Stop(Section):
    """A colour at a position in a palette; between two stops colours are mixed in linear light."""

    at: Fraction = Field(description="place in the palette, 0 to 1")
    color: Color = Field(description="linear Rec. 709")


def _placed_stops(value: Any) -> Any:
    """Colours alone become stops at equal distances from 0 to 1: entry i of n lies at i / (n - 1)."""
    if not isinstance(value, (list, tuple)):
        return value
    last = max(len(value) - 1, 1)
    found = []
    for index, entry in enumerate(value):
        if isinstance(entry, (str, list, tuple)):
            color = linear_color(entry) if isinstance(entry, str) else entry
            if color is None:
                raise problem(
                    f"must be a stop, or a colour as '#ff8800' or '#f80', got {entry[:40]!r}", str(index)
                )
            entry = {"at": index / last, "color": color}
        found.append(entry)
    return found


Palette = Annotated[
    Annotated[str, Field(min_length=1, max_length=200), Tag("name")]
    | Annotated[
        tuple[Annotated[Stop, AlsoAs(lambda entry: entry, COLOR_SCHEMA)], ...],
        Field(strict=False, min_length=2, max_length=256),
        AlsoAs(_placed_stops, None),
        Tag("stops"),
    ],
    Field(
        discriminator=chosen_by_word("name", "stops"),
        description="a palette's name; or stops in order of `at`; or colours alone, at equal distances",
    ),
]


def check_order(palette: str | Sequence[Stop]) -> None:
    """For validators of sections with a `palette`: its stops must be in order."""
    if isinstance(palette, str):
        return
    for index in range(1, len(palette)):
        at, before = palette[index].at, palette[index - 1].at
        if at < before:
            raise problem(
                f"must be at least {before:g}, the value at the stop before, got {at:g}",
                f"palette.{index}.at",
            )


class Trap(Section):
    """A shape in the formula's space; the colour follows the smallest distance of the orbit from it."""

    shape: Literal["point", "axis", "plane", "sphere"] = Field(
        "point", description="the shape to which the orbit's distance is measured"
    )
    center: Position = Field(
        (0.0, 0.0, 0.0), description="the point, a point of the axis or plane, or the sphere's centre"
    )
    direction: Direction = Field((0.0, 0.0, 1.0), description="the axis's direction, or the plane's normal")
    radius: Length = Field(1.0, description="the sphere's radius")

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Self:
        if length(self.direction) < 1e-12:
            raise problem("must not be zero", "direction")
        return self


class Coloring(Section):
    """Where the material's colour comes from: the palette at scale * quantity + offset, or a fixed colour.

    `solid`: material.color. `normal`: the normal's x, y, z as red, green, blue, from -1..1 to 0..1.
    The quantities: `iterations`, the smooth escape count; `residual`, how far the pixel's points are from the
    plane fitted to them, in footprints; `thickness`, from where `along` enters the set to where it leaves it, scene units;
    `layer_distance`, from the surface to the surface after `layer` iterations, scene units; `trap`, the smallest
    distance of the orbit from a shape.
    """

    by: Literal["solid", "normal", "iterations", "residual", "thickness", "layer_distance", "trap"] = Field(
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
    trap: Trap = Field(default_factory=dict, validate_default=True, description="the shape for `by: trap`")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        check_order(self.palette)
        return self

    @property
    def uses_palette(self) -> bool:
        """Whether the palette chooses the colour."""
        return self.by not in ("solid", "normal")

    @model_validator(mode="after")
    def _has_a_way(self) -> Self:
        if self.by == "thickness" and self.along == "reflection":
            raise problem("must be view or normal for thickness, got reflection", "along")
        return self
