"""What all parts of a scene are made of: strict frozen models, and numbers with their bounds.

The models name their types without `from __future__ import annotations`, and are built when first used: both
keep the import of the schema short.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from math import cos, fmod, radians, sin
from threading import RLock
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, TypeAlias, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError
from pydantic_core.core_schema import plain_serializer_function_ser_schema, with_info_plain_validator_function

from clfractal.errors import SceneError, Where
from clfractal.errors.arguments import plain
from clfractal.schema.fields import DIRECTION, PLACE
from clfractal.schema.hex_color import AS_TEXT

PART = "section"
"""In the metadata of a pydantic schema: the section that it stands for, whose own is made later."""
_MAKING = RLock()  # older versions of pydantic have none
S = TypeVar("S", bound="Section")
Vector: TypeAlias = tuple[float, float, float]

Coordinate = Annotated[float, Field(strict=True, ge=-1e6, le=1e6, allow_inf_nan=False)]
Fraction = Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]
Amount = Annotated[float, Field(strict=True, ge=0, le=1e6, allow_inf_nan=False)]
Angle = Annotated[float, Field(strict=True, ge=-36_000, le=36_000, allow_inf_nan=False)]
Length = Annotated[float, Field(strict=True, gt=0, le=1e6, allow_inf_nan=False)]
Number = Annotated[float, Field(strict=True, ge=-1e12, le=1e12, allow_inf_nan=False)]


def _not_zero(direction: Vector) -> Vector:
    if length(direction) < 1e-12:
        raise problem("must not be zero")
    return direction


# Strict tuples would refuse the lists of YAML and JSON; their entries stay strict.
Position = Annotated[tuple[Coordinate, Coordinate, Coordinate], Field(strict=False), PLACE]
Direction = Annotated[
    tuple[Coordinate, Coordinate, Coordinate], Field(strict=False), DIRECTION, AfterValidator(_not_zero)
]
Color = Annotated[tuple[Amount, Amount, Amount], Field(strict=False), AS_TEXT]
Reflectance = Annotated[tuple[Fraction, Fraction, Fraction], Field(strict=False), AS_TEXT]


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)  # (pydantic has no public name for it)


class _Kind(ModelMetaclass):
    """The class of sections: whoever makes one by calling it gets our own errors.

    Not `__init__`: with one of its own, pydantic would call it for each section within a section too.
    """

    if not TYPE_CHECKING:

        def __call__(self, *arguments: Any, **values: Any) -> Any:
            with own_errors(self):
                return super().__call__(*arguments, **plain(values))


@contextmanager
def own_errors(cls: Any) -> Iterator[None]:
    """Raises SceneError, with a path, where a section is refused."""
    try:
        yield
    except ValidationError as error:
        # Loaded for mistakes only.
        from clfractal.files.marks import Document, node_from_plain
        from clfractal.schema.error_texts import first_error

        raise first_error(error, Document(node_from_plain({}, None)), cls) from None


# Names of sections that are no part of the Python API.
_FOR_OURSELVES = frozenset(
    {"checked", "derived", "note_files", "once", "placed", "read_by", "tag", "title", "whole"}
)


class Section(BaseModel, metaclass=_Kind):
    """A mapping of the scene: unknown keys are errors, values are not converted, and it is immutable.

    `tag` is the word that chooses the class where several share a place.

    Raises:
        SceneError: a value is wrong, or a value of a section that exists is set; the path says which.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)
    tag: ClassVar[str] = ""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """As pydantic's; within another section, its validator is made when the first value comes.

        Making all of them takes longer than anything else about loading a scene, which has few.
        """
        if handler.field_name is None:
            return handler(source)
        return with_info_plain_validator_function(cls._as_part, metadata={PART: cls})

    @classmethod
    def _complete(cls) -> None:
        if not cls.__pydantic_complete__:
            with _MAKING:
                cls.model_rebuild()

    def __setstate__(self, state: dict[Any, Any]) -> None:
        """In a process that has made no such section yet: early versions of pydantic write none of an incomplete class."""
        self._complete()
        super().__setstate__(state)

    @classmethod
    def _as_part(cls, value: Any, info: ValidationInfo) -> Any:
        cls._complete()
        # Where this refuses, pydantic puts the path of this place before the section's own.
        return cls.__pydantic_validator__.validate_python(value, context=info.context)

    def __dir__(self) -> list[str]:
        """The keys, and what else is meant for users: not what pydantic's models bring along."""
        own = [name for cls in type(self).__mro__ if issubclass(cls, Section) for name in vars(cls)]
        public = {name for name in own if not name.startswith(("_", "model_"))} - _FOR_OURSELVES
        return sorted({*type(self).model_fields, *public, "model_copy"})

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy; values in `update` are checked, and nothing that was derived from the old values is kept.

        Raises:
            SceneError: a value of `update` is wrong; the path says which.
        """
        if not update:
            return super().model_copy(deep=deep)
        values = {name: getattr(self, name) for name in type(self).model_fields}
        return self.checked({**values, **update})

    def __hash__(self) -> int:
        """Equal sections have equal hashes; lists and mappings in them count by their values."""
        return hash((type(self), *(_hashable(getattr(self, name)) for name in type(self).model_fields)))

    @classmethod
    def checked(cls, values: Mapping[str, Any], context: Mapping[str, Any] | None = None) -> Self:
        """A section with these values; `context` as for `Scene`'s checks.

        Raises:
            SceneError: a value is wrong; the path says which.
        """
        with own_errors(cls):
            return cls.model_validate(plain(values), context=dict(context or {}))

    def __delattr__(self, name: str) -> None:
        """Nothing is deleted."""
        raise SceneError("cannot be deleted", Where(path=name))

    def __setattr__(self, name: str, value: Any) -> None:
        """Only what is derived may be set; values change in a copy."""
        if not name.startswith("_"):
            raise SceneError(
                f"cannot be set; model_copy(update={{{name!r}: ...}}) gives a copy with another value",
                Where(path=name),
            )
        super().__setattr__(name, value)

    def _settle(self, **values: Any) -> None:
        """For validators: replaces values of the section that is being made; they count as given.

        A value of None is that of a key that has done its work, and counts as not given.
        """
        for name, value in values.items():
            object.__setattr__(self, name, value)
            if value is None:
                self.__pydantic_fields_set__.discard(name)
            else:
                self.__pydantic_fields_set__.add(name)


def problem(message: str, at: str | tuple[str | int, ...] = "") -> PydanticCustomError:
    """Our own error inside a validator, at the key (or path, dotted or of parts) `at` of the model that raises it."""
    path = tuple(part for part in at.split(".") if part) if isinstance(at, str) else at
    return PydanticCustomError("clfractal", "{message}", {"message": message, "at": path})


def rule(check: Callable[[S], None]) -> Any:
    """For sections: what several of its values keep to; the method raises a `problem` otherwise, once all are made."""

    def keep(section: S) -> S:
        check(section)
        return section

    return model_validator(mode="after")(keep)


class Chosen:
    """For a union of sections: a function gives the tag of the one that a value is."""

    def __init__(self, choose: Callable[[Any], str]) -> None:
        self.choose = choose

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """As pydantic's unions of which a function chooses."""
        found = Discriminator(self.choose).__get_pydantic_core_schema__(source, handler)
        # Written as what it is: pydantic cannot look into sections made later to choose between them.
        return {**found, "serialization": plain_serializer_function_ser_schema(lambda section: section)}


class ChosenBy(Chosen):
    """For a union of sections: the word under a key chooses one of them, and without the key it is the default's."""

    def __init__(self, key: str, default: str) -> None:
        super().__init__(self._choose)
        self.key, self.default = key, default

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """One of the sections. All but the default need their word: else a mapping without it would be all of them."""
        found: dict[str, Any] = handler(schema)
        # Keys beside a reference hold too.
        found["oneOf"] = [
            section if word == self.default else {**section, "required": [self.key]}
            for word, section in zip(schema["choices"], found["oneOf"], strict=True)
        ]
        return found

    def _choose(self, value: Any) -> str:
        given = isinstance(value, Mapping)
        found = value.get(self.key, self.default) if given else getattr(value, self.key, self.default)
        return found if isinstance(found, str) else repr(found)


def chosen_by_word(word: str, other: str) -> Discriminator:
    """Chooses `word` for a string and `other` for anything else."""
    return Discriminator(lambda value: word if isinstance(value, str) else other)


def chosen_by_list(several: str, one: str) -> Discriminator:
    """Chooses `several` for a list and `one` for anything else."""
    return Discriminator(lambda value: several if isinstance(value, (list, tuple)) else one)


def minus(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a: Vector) -> float:
    """The Euclidean length of a."""
    return float((a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) ** 0.5)


def dot(a: Vector, b: Vector) -> float:
    """The scalar product of a and b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def unit(a: Vector) -> Vector:
    """The vector of length 1 in the direction of a, which is not 0."""
    # The largest component first: squares of small sides would vanish.
    largest = max(abs(a[0]), abs(a[1]), abs(a[2]))
    a = (a[0] / largest, a[1] / largest, a[2] / largest)
    size = length(a)
    return (a[0] / size, a[1] / size, a[2] / size)


def turn(vector: Vector, axis: Vector, degrees: float) -> Vector:
    """A vector, turned about an axis of length 1 (Rodrigues' formula)."""
    c, s = cos_sin(degrees)
    across, along = cross(axis, vector), dot(axis, vector) * (1 - c)
    x, y, z = (v * c + a * s + k * along for v, a, k in zip(vector, across, axis, strict=True))
    return (x, y, z)


def check_one_of(section: Section, *keys: str) -> None:
    """For rules: exactly one of some keys is given."""
    given = [key for key in keys if getattr(section, key) is not None]
    listing = ", ".join(keys[:-1]) + f" or {keys[-1]}"
    if not given:
        raise problem(f"needs one of {listing}")
    if len(given) > 1:
        raise problem(f"cannot be combined with {given[0]}: give one of {listing}", given[1])


def check_frame(normal: Vector, up: Vector) -> None:
    """For rules of rectangles: `up` must not lie along the normal."""
    if length(cross(normal, up)) <= 1e-6 * length(normal) * length(up):
        raise problem("must not be parallel to the normal", "up")


def cos_sin(degrees: float) -> tuple[float, float]:
    """Cosine and sine; exact at quarter turns, so that they cause no rounding."""
    reduced = fmod(degrees, 360.0)
    quarters = round(reduced / 90.0)
    rest = radians(reduced - 90.0 * quarters)
    c, s = cos(rest), sin(rest)
    return ((c, s), (-s, c), (-c, -s), (s, -c))[quarters % 4]


def frame_of(normal: Vector) -> tuple[Vector, Vector, Vector]:
    """Two sides of a plane and its normal, right-handed, of length 1."""
    axis = unit(normal)
    side = unit(cross((0.0, 1.0, 0.0) if abs(axis[1]) < 0.9 else (1.0, 0.0, 0.0), axis))
    return side, cross(axis, side), axis


def _hashable(value: Any) -> Any:
    """A value, with tuples and sets in the place of lists and mappings; equal values stay equal."""
    if isinstance(value, Mapping):
        return frozenset((key, _hashable(each)) for key, each in value.items())
    if isinstance(value, (list, tuple)):
        return tuple(_hashable(each) for each in value)
    return value
