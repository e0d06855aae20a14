"""What is known of a field beside its type and bounds: where its values usually lie, and how they move."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel

Kind: TypeAlias = Literal["number", "whole", "scale", "place", "direction", "color", "exact"]
"""How a value goes from key to key.

`number`: as it is, angles too, which are never wrapped; `whole`: the same, then rounded; `scale`: in the logarithm;
`place`: on a path in space; `direction`: on the sphere; `color`: each component as a number; `exact`: a place
told by text of many digits, as evenly as what is magnified there allows.
"""
Known = TypeVar("Known")


@dataclass(frozen=True, slots=True)
class Usual:
    """Where values usually lie whose bounds are too wide for a slider."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Moves:
    """How a value moves that its type does not tell."""

    kind: Kind


SCALE = Moves("scale")
"""What is a factor to the eye, so that equal factors in equal times look even."""
WHOLE = Moves("whole")
"""A whole number between which a picture's subject changes, and not how it is made."""
PLACE, DIRECTION, EXACT = Moves("place"), Moves("direction"), Moves("exact")


def known(section: type[BaseModel], name: str, of: type[Known]) -> Known | None:
    """What the declaration of a field says of one sort, such as `Usual`; None if nothing."""
    field = section.model_fields[name]
    found = [*field.metadata, *_marks(field.annotation)]
    return next((each for each in found if isinstance(each, of)), None)


def _marks(annotation: Any) -> Iterator[Any]:
    """What decorates a type, or one of several that it may be."""
    if get_origin(annotation) is Annotated:
        inner, *marks = get_args(annotation)
        yield from marks
        yield from _marks(inner)
    elif get_origin(annotation) in (Union, UnionType):
        for each in get_args(annotation):
            yield from _marks(each)
