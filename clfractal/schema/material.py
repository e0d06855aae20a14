"""What parts of a layered material have in common: values that maps may drive, and what kernels are given."""

from collections.abc import Iterator
from dataclasses import dataclass
from inspect import getdoc
from re import split
from types import NoneType
from typing import Annotated, Any, ClassVar, Literal, get_args, get_origin

from pydantic import Field, Tag

from clfractal.schema.fields import DIRECTION, Moves, known
from clfractal.schema.kinds import Element
from clfractal.schema.mapped import FORM, Map, Mapped, NumberMap

Ior = Annotated[float, Field(strict=True, ge=1, le=10, allow_inf_nan=False)]
IorMap = Annotated[Annotated[Ior, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
Depth = Annotated[float, Field(strict=True, ge=0, le=1e6, allow_inf_nan=False)]
DepthMap = Annotated[Annotated[Depth, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
Forward = Annotated[float, Field(strict=True, ge=-0.99, le=0.99)]
ForwardMap = Annotated[Annotated[Forward, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A value of a part as kernels have it.

    Attributes:
        name: the field's, behind the part's and an underscore.
        kind: its type there.
        optional: whether it may be null: it is the colouring's colour then.
        meaning: the field's description.
    """

    name: str
    kind: Literal["real", "color", "vec"]
    optional: bool
    meaning: str

    @property
    def count(self) -> int:
        """How many numbers it has."""
        return 1 if self.kind == "real" else 3


class Part(Mapped, Element):
    """A part of a layered material, which is a class in a file of `clfractal/elements/materials`.

    Its fields are parameters of the material in each lane, `PART_FIELD` of `pbr`. What it scatters by is told in the file
    of its name in `kernels/elements/materials`, and `bsdf.h` lays the parts over each other.
    """

    zero_if_matt: ClassVar[tuple[str, ...]] = ("weight",)
    """Its fields that are 0 in a material that is a matt body and nothing else."""
    costly: ClassVar[tuple[str, ...]] = ()
    """Its fields that ask for a stage of its own where they are above 0: `costly` in its kernel files' folder."""
    counts_by_weight: ClassVar[bool] = False
    """Whether in a blend its other fields count by `weight`, its first one: half a red coat beside none stays red."""
    at_spots: ClassVar[bool] = True
    """Whether its fields are parameters in each lane."""

    @classmethod
    def about(cls) -> str:
        """What it is, in a few words."""
        text = split("[:;.]", getdoc(cls) or "")[0]
        return text[:1].lower() + text[1:]

    @classmethod
    def parameters(cls) -> Iterator[Parameter]:
        """Its fields as kernels have them, in their order."""
        for name, field in cls.model_fields.items() if cls.at_spots else ():
            several = any(get_origin(each) is tuple for each in _types(field.annotation))
            kind: Literal["color", "vec"] = "vec" if known(cls, name, Moves) == DIRECTION else "color"
            optional = any(each is NoneType for each in _types(field.annotation))
            yield Parameter(
                f"{cls.tag}_{name}", kind if several else "real", optional, field.description or ""
            )

    def packed(self) -> dict[str, Any]:
        """Values of its fields, as kernels are given them."""
        return {name: getattr(self, name) for name in type(self).model_fields}

    def has(self, name: str) -> bool:
        """Whether a weight of it is above 0 anywhere."""
        value = getattr(self, name)
        return isinstance(value, Map) or value > 0


def _types(annotation: Any) -> Iterator[Any]:
    """An annotation, and all that it may be."""
    yield annotation
    if get_origin(annotation) is not tuple:
        for each in get_args(annotation):
            yield from _types(each)
