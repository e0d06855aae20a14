"""What the colours of a surface, and values of its materials, may follow."""

from typing import Annotated, Any, ClassVar, Literal, TypeAlias, cast

from pydantic import Field, GetJsonSchemaHandler
from pydantic_core import CoreSchema

from clfractal.schema.base import Section
from clfractal.schema.fields import known
from clfractal.schema.kinds import Kind, OneOf, by_word, members

Known: TypeAlias = Literal["at_hit", "with_points", "by_formula"]
"""When it is known of a place: with the ray's hit, once all of a pixel's points are, or after the formula is asked."""

CarriedName = Annotated[str, Field(strict=True, min_length=1, max_length=60)]
"""Of a number that a formula carries."""


class ColoringKind(Kind):
    """What `coloring.by`, or the `by` of a map, chooses: a quantity, or a colour by itself.

    It is a file here, and among the folders of `kernels/elements/colorings` in those that have something to ask of it.

    Attributes:
        keys: those of the coloring, or the map, that count for it, beside those of every kind.
        known: when it is known.
        of_scenes: whether `coloring` may have it.
        of_maps: whether maps may.
        of_material: whether the colour is the material's.
        of_volumes: whether it colours volumes, whose values have colours otherwise.
        of_surface: whether it follows what the surface itself is around a place, its normals and escape counts.
        counts_applications: whether it counts how often the formula is applied.
        of_objects: whether the formula has an answer on objects beside the set.
        uses_palette: whether it is a number, and the palette's colour there.
        ways: of `along`, those that it may be measured in.
        low: where a map of it begins.
        least_points: of a pixel, without which it has no value.
        hint: shown in the window in the place of a palette.
        unit: of the quantity.
        usual_scale: what `coloring.scale` suits it.
    """

    keys: ClassVar[tuple[str, ...]] = ()
    known: ClassVar[Known] = "at_hit"
    of_scenes: ClassVar[bool] = True
    of_maps: ClassVar[bool] = True
    of_material: ClassVar[bool] = False
    of_volumes: ClassVar[bool] = False
    of_surface: ClassVar[bool] = False
    counts_applications: ClassVar[bool] = False
    of_objects: ClassVar[bool] = False
    uses_palette: ClassVar[bool] = True
    ways: ClassVar[tuple[str, ...]] = ("view", "normal", "reflection")
    low: ClassVar[float] = 0.0
    least_points: ClassVar[int] = 1
    hint: ClassVar[str] = ""
    unit: ClassVar[str] = ""
    usual_scale: ClassVar[str] = ""

    @classmethod
    def needs_set(cls) -> bool:
        """Whether it is known of a formula's set only."""
        return cls.known == "by_formula" or cls.counts_applications

    @staticmethod
    def own_colors(normals: Any, plain: Any) -> Any:
        """Colours of places with these normals, shape (n, 3), where none comes from the palette.

        Args:
            plain: the material's colour.
        """
        raise NotImplementedError


def colorings() -> tuple[type[ColoringKind], ...]:
    """What `coloring.by` may be."""
    return tuple(kind for kind in members("colorings") if kind.of_scenes)


def coloring_kind(word: str) -> type[ColoringKind]:
    """The kind that a word chooses."""
    return cast(type[ColoringKind], by_word("colorings")[word])


class ByQuantity(Section):
    """A section whose `by` chooses one of them."""

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """With what each of the words means."""
        found = handler(schema)
        words = known(cls, "by", OneOf)
        each = words.words if words is not None else ()
        told = "; ".join(f"`{word}`, {coloring_kind(word).__doc__}" for word in each)
        inner = handler.resolve_ref_schema(found)
        inner["description"] = f"{inner['description']} {told}."
        return found
