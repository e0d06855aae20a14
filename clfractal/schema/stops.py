"""Palettes as scenes name them, or tell their stops."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Annotated, Any

from pydantic import AfterValidator, Field, Tag

from clfractal.schema.base import Color, Fraction, Section, chosen_by_word, problem
from clfractal.schema.hex_color import COLOR_SCHEMA, AlsoAs, linear_color


class Stop(Section):
    """A colour at a position in a palette; between two stops colours are mixed in linear light."""

    at: Fraction = Field(description="place in the palette, 0 to 1")
    color: Color = Field(description="linear Rec. 709")


def in_order(
    place: Callable[[Any], float], key: str = "at", shown: str = "the value at the stop before"
) -> AfterValidator:
    """For a list: the places of its entries, which stand under `key`, must not fall."""

    def check(entries: Sequence[Any]) -> Sequence[Any]:
        for index, (before, at) in enumerate(pairwise(map(place, entries)), start=1):
            if at < before:
                raise problem(f"must be at least {before:g}, {shown}, got {at:g}", f"{index}.{key}")
        return entries

    return AfterValidator(check)


IN_ORDER = in_order(lambda stop: stop.at)
"""For stops in order of `at`."""


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
        IN_ORDER,
        AlsoAs(_placed_stops, None),
        Tag("stops"),
    ],
    Field(
        discriminator=chosen_by_word("name", "stops"),
        description="a palette's name; or stops in order of `at`; or colours alone, at equal distances",
    ),
]
