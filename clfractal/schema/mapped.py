"""Values of a material that differ from place to place: a quantity through a curve, or a picture."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, get_args

from pydantic import Discriminator, Field, Tag
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from clfractal.schema.base import (
    Amount,
    Coordinate,
    Direction,
    Fraction,
    Length,
    Number,
    Position,
    Reflectance,
    Section,
    check_one_of,
    problem,
    rule,
)
from clfractal.schema.fields import Usual
from clfractal.schema.kinds import OneOf
from clfractal.schema.quantity import ByQuantity, CarriedName, ColoringKind, coloring_kind
from clfractal.schema.stops import Palette, in_order
from clfractal.schema.trap import Trap

TextureName = Annotated[str, Field(strict=True, min_length=1, max_length=1000)]


class Map(ByQuantity):
    """What a value follows from place to place: `by` a quantity, or a picture, the `texture`.

    What `coloring` measures along a way is measured along the normal here.
    """

    tag = "map"
    by: Annotated[str, OneOf("colorings", lambda kind: kind.of_maps)] | None = Field(
        None, description="the quantity; null: a `texture`"
    )
    texture: TextureName | None = Field(
        None, description="a picture in the scene's folder or below, shown from three sides"
    )
    range: Annotated[tuple[Coordinate, Coordinate], Field(strict=False)] | None = Field(
        None, description="quantities at its beginning and end; null: [-1, 1] of a normal, else [0, 1]"
    )
    repeat: bool = Field(False, description="true: it repeats; false: beyond the range its ends continue")
    direction: Direction = Field(
        (0.0, 0.0, 1.0), description="for `normal` and `height`; its length is of no account"
    )
    center: Position = Field((0.0, 0.0, 0.0), description="for `distance`, scene units")
    layer: Annotated[int, Usual(1, 64)] = Field(
        1, ge=1, le=1_000_000, description="iterations of the other layer of `layer_distance`"
    )
    step: Length | None = Field(
        None,
        description="for `curvature`, `thickness`, `layer_distance`, scene units; null: 1/100 of the bounds' radius",
    )
    number: CarriedName | None = Field(
        None, description="the name of the number for `by: carried`; null: the formula's first one"
    )
    trap: Trap = Field(default_factory=dict, validate_default=True, description="the shape for `by: trap`")
    scale: Annotated[Length, Usual(0.01, 10)] = Field(1.0, description="width of the texture, scene units")
    sharpness: Annotated[float, Field(strict=True, ge=1, le=64)] = Field(
        4.0, description="how narrow the seams between the texture's three sides are"
    )

    @rule
    def _one_source(self) -> None:
        check_one_of(self, "by", "texture")
        low, high = self.used_range
        if low == high:
            raise problem(f"must be two different numbers, got {low:g} twice", "range")

    @property
    def used_range(self) -> tuple[float, float]:
        """Quantities at its beginning and end."""
        return (
            self.range if self.range is not None else (self.kind.low if self.kind is not None else 0.0, 1.0)
        )

    @property
    def kind(self) -> type[ColoringKind] | None:
        """What it follows; None if it is a texture."""
        return coloring_kind(self.by) if self.by is not None else None

    @property
    def is_asked(self) -> bool:
        """Whether the formula is asked for it."""
        return self.kind is not None and self.kind.known == "by_formula"

    @property
    def own_keys(self) -> tuple[str, ...]:
        """The keys that count for its quantity alone."""
        return tuple(
            key for key in type(self).model_fields if self.kind is not None and key in self.kind.keys
        )

    @property
    def told(self) -> str:
        """What it follows, in words."""
        return self.texture or f"by {str(self.by).replace('_', ' ')}"

    @property
    def used_keys(self) -> tuple[str, ...]:
        """The keys that count for what it follows, and are numbers or words."""
        if self.texture is not None:
            return ("texture", "scale", "sharpness")
        own = [key for key in self.own_keys if not isinstance(getattr(self, key), Section)]
        return ("by", "range", "repeat", *own)

    def check(self, high: float, low: float) -> None:
        """Raises a problem if a value of the map may be out of these bounds."""


class NumberMap(Map):
    """A number that differs from place to place: a curve of a quantity, or of a picture's grey."""

    curve: Annotated[
        tuple[Annotated[tuple[Fraction, Number], Field(strict=False)], ...],
        Field(strict=False, min_length=2, max_length=256),
        in_order(lambda point: point[0], "0", "the place of the point before"),
    ] = Field(
        ((0.0, 0.0), (1.0, 1.0)),
        description="[place in the range, 0 to 1; value there], joined by straight lines",
    )

    @property
    def is_flat(self) -> bool:
        """Whether it is the same everywhere."""
        return len({value for _, value in self.curve}) == 1

    def check(self, high: float, low: float) -> None:
        """Of the curve's values."""
        for index, (_, value) in enumerate(self.curve):
            _check(value, high, low, f"curve.{index}.1")


class ColorMap(Map):
    """A colour that differs from place to place: a palette along a quantity, or a picture's colours."""

    palette: Palette = "viridis"

    def check(self, high: float, low: float) -> None:
        """Of the palette's colours."""
        if not isinstance(self.palette, str):
            for index, stop in enumerate(self.palette):
                for part in stop.color:
                    _check(part, high, low, f"palette.{index}.color")


def _check(value: float, high: float, low: float, at: str) -> None:
    if value > high:
        raise problem(f"must be at most {high:g}, got {value:g}", at)
    if value < low:
        raise problem(f"must be at least {low:g}, got {value:g}", at)


FORM = Discriminator(lambda value: "map" if isinstance(value, (Mapping, Section)) else "given")
"""Tells a map from a number or colour that is the same everywhere."""

FractionMap = Annotated[Annotated[Fraction, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
AmountMap = Annotated[Annotated[Amount, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
ReflectanceMap = Annotated[Annotated[Reflectance, Tag("given")] | Annotated[ColorMap, Tag("map")], FORM]


class Mapped(Section):
    """A section whose values may be maps: these keep to the bounds of the values."""

    # Not named by the schema; sections that are no part of a material have none.
    maps: ClassVar[bool] = True

    @rule
    def _maps_in_bounds(self) -> None:
        for name, field in type(self).model_fields.items():
            found = getattr(self, name)
            if isinstance(found, Map):
                try:
                    found.check(*_limits(field.annotation))
                except PydanticCustomError as error:
                    told: Any = error.context
                    raise problem(told["message"], (name, *told["at"])) from None


def _limits(annotation: Any) -> tuple[float, float]:
    """The largest and the smallest number that an annotation allows."""
    high, low = 1e12, -1e12
    for each in _decorations(annotation):
        high, low = min(getattr(each, "le", high), high), max(getattr(each, "ge", low), low)
    return high, low


def _decorations(annotation: Any) -> Iterator[Any]:
    for each in get_args(annotation):
        if isinstance(each, FieldInfo):
            yield from each.metadata
        yield from _decorations(each)


def maps_of(section: Section) -> Iterator[tuple[str, Map]]:
    """The maps in a material, with their paths."""
    for name in type(section).model_fields:
        found = getattr(section, name)
        if isinstance(found, Map):
            yield name, found
        elif isinstance(found, Mapped):
            for inner, each in maps_of(found):
                yield f"{name}.{inner}", each
