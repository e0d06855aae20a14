"""What the schema says of a scene's values, from which all widgets follow: kind, bounds, default."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache, reduce
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from clfractal.scene.model import Scene
from clfractal.schema.base import Section
from clfractal.schema.fields import Usual, known
from clfractal.schema.kinds import OneOf
from clfractal.schema.mapped import Map
from clfractal.viewer.editing import child, plain

Kind = Literal["number", "whole", "flag", "choice", "text", "vector", "color", "section", "other"]


@dataclass(frozen=True, slots=True)
class Meta:
    """One field of a section.

    Attributes:
        name: the field's.
        kind: what its values are; `other` for lists, mappings and values of several kinds.
        size: numbers in a vector or colour.
        low, high: the bounds of a number, or of each of a vector's; None: unbounded.
        open: whether the bounds themselves are not allowed: (low, high).
        choices: the words (or numbers) of a choice.
        sections: the classes that a section may be.
        optional: whether it may be null.
        default: plain; None where it has to be given, too.
        description: the schema's.
        usual: (low, high) in which it usually lies, for a slider; None: no usual range.
        log: whether a slider is divided by magnitudes.
        alternative: a word that a number's place may have, such as `auto`; empty if there is none.
    """

    name: str
    kind: Kind
    size: int
    low: float | None
    high: float | None
    open: tuple[bool, bool]
    choices: tuple[Any, ...]
    sections: tuple[type[Section], ...]
    optional: bool
    default: Any
    description: str
    usual: tuple[float, float] | None
    log: bool
    alternative: str = ""


# A range over more than this factor is divided by magnitudes.
_DECADES = 40.0
# Bounds farther apart than this are no range for a slider.
_WIDEST = 1000.0


@dataclass(frozen=True, slots=True)
class Target:
    """A value of a scene: the section (or list, or mapping) that holds it, its name there, and the value."""

    holder: Any
    name: str
    value: Any

    @property
    def meta(self) -> Meta | None:
        """What the schema says of it; None for entries of lists and mappings."""
        return meta_of(type(self.holder), self.name) if isinstance(self.holder, Section) else None


def find(scene: Scene, path: str) -> Target | None:
    """The value at a dotted path; None where a section on the way is null or missing."""
    *parts, last = path.split(".")
    holder: Any = reduce(child, parts, scene)
    return Target(holder, last, child(holder, last)) if holder is not None else None


@cache
def metas(section: type[Section]) -> dict[str, Meta]:
    """What the schema says of all fields of a section, in its order; without those that are null once a scene is read."""
    fields = section.model_fields.items()
    return {name: _meta(section, name, field) for name, field in fields if not field.exclude}


def meta_of(section: type[Section], name: str) -> Meta | None:
    """What the schema says of one field; None if there is none of that name."""
    return metas(section).get(name)


def by_magnitude(usual: tuple[float, float]) -> bool:
    """Whether a slider over this range is divided by magnitudes."""
    return usual[0] > 0 and usual[1] / usual[0] > _DECADES


def has_default(meta: Meta) -> bool:
    """Whether a value has one; those that have to be given have none."""
    return meta.default is not None or meta.optional


def differs(target: Target, meta: Meta) -> bool:
    """Whether a value is not its default; those that have to be given have none."""
    return has_default(meta) and bool(plain(target.value) != meta.default)


def first_value(meta: Meta, start: Any = None) -> Any:
    """A value for a field that was null and is now to be set: `start`, its default, or the middle of its usual range."""
    if start is not None:
        return plain(start)
    if meta.default is not None:
        return meta.default
    by_kind: dict[str, Any] = {
        "choice": next(iter(meta.choices), None),
        "vector": [0.0, 0.0, 1.0] if meta.size == 3 else [0.5] * meta.size,
        "color": [1.0, 1.0, 1.0],
        "text": "",
        "flag": True,
    }
    if meta.kind in by_kind:
        return by_kind[meta.kind]
    middle = 1.0
    if meta.usual is not None:
        low, high = meta.usual
        middle = float(f"{(low * high) ** 0.5:.2g}") if meta.log else (low + high) / 2
    return round(middle) if meta.kind == "whole" else middle


def all_sections() -> list[type[Section]]:
    """Every class of section that a scene may hold, the scene's own first."""
    found: list[type[Section]] = [Scene]
    for section in found:
        for name in section.model_fields:
            inner = _sections_in(section.model_fields[name].annotation)
            found += [each for each in dict.fromkeys(inner) if each not in found]
    return found


def sections_of(section: type[Section], name: str) -> list[type[Section]]:
    """The classes of sections that a field may hold, also as entries of a list or mapping; those of maps are left out."""
    inner = dict.fromkeys(_sections_in(section.model_fields[name].annotation))
    return [each for each in inner if not issubclass(each, Map)]


def _meta(section: type[Section], name: str, field: FieldInfo) -> Meta:
    optional, options = _options(field.annotation)
    # A material's value is one that is the same everywhere, or a map, which widgets show in its place.
    options = [each for each in options if not (isinstance(each, type) and issubclass(each, Map))] or options
    bounds = _bounds(field.metadata)
    alternative = _alternative(options)
    if alternative:
        options = [option for option in options if not _words(option)]
    if len(options) == 1:
        kind, size, choices, inner = _kind(options[0])
        bounds = {**inner, **bounds}
    else:
        kind, size, choices = "other", 0, ()
    if kind == "text" and (words := known(section, name, OneOf)) is not None:
        kind, choices = "choice", words.words
    sections = tuple(each for each in options if isinstance(each, type) and issubclass(each, Section))
    if sections and len(sections) == len(options):
        kind = "section"
    low, high = bounds.get("low"), bounds.get("high")
    if kind == "vector" and size == 3 and low == 0 and "low_open" not in bounds:
        kind = "color"
    usual = _usual(section, name, kind, low, high)
    log = usual is not None and by_magnitude(usual)
    return Meta(
        name,
        kind,
        size,
        low,
        high,
        ("low_open" in bounds, "high_open" in bounds),
        choices,
        sections,
        optional,
        _default(field),
        field.description or "",
        usual,
        log,
        alternative,
    )


def _alternative(options: list[Any]) -> str:
    """The word that a type allows in the place of a number, or empty."""
    words = [word for option in options for word in _words(option)]
    others = [option for option in options if not _words(option)]
    simple = len(others) == len(words) == 1 and _kind(others[0])[0] in ("number", "whole")
    return str(words[0]) if simple else ""


def _words(option: Any) -> tuple[Any, ...]:
    bare = get_args(option)[0] if get_origin(option) is Annotated else option
    return get_args(bare) if get_origin(bare) is Literal else ()


def _usual(
    section: type[Section], name: str, kind: Kind, low: float | None, high: float | None
) -> tuple[float, float] | None:
    usual = known(section, name, Usual)
    if usual is not None:
        return usual.low, usual.high
    if kind in ("number", "whole") and low is not None and high is not None and high - low <= _WIDEST:
        return low, high
    return None


def _kind(option: Any) -> tuple[Kind, int, tuple[Any, ...], dict[str, float]]:
    """Kind, size, choices and bounds of a type without null."""
    bounds: dict[str, float] = {}
    if get_origin(option) is Annotated:
        option, *more = get_args(option)
        bounds = _bounds(more)
    if get_origin(option) is Annotated:
        kind, size, choices, inner = _kind(option)
        return kind, size, choices, {**inner, **bounds}
    if get_origin(option) is Literal:
        return "choice", 0, get_args(option), {}
    if get_origin(option) is tuple and ... not in get_args(option):
        entries = [_kind(each) for each in get_args(option)]
        if all(entry[0] == "number" for entry in entries):
            return "vector", len(entries), (), entries[0][3]
        return "other", 0, (), {}
    plain_kinds: dict[Any, Kind] = {bool: "flag", int: "whole", float: "number", str: "text"}
    return plain_kinds.get(option, "other"), 0, (), bounds


def _options(annotation: Any) -> tuple[bool, list[Any]]:
    """Whether a type may be null, and its other members, each as it is decorated."""
    if get_origin(annotation) in (Union, UnionType):
        members = [_options(each) for each in get_args(annotation)]
        return any(found[0] for found in members), [each for found in members for each in found[1]]
    if annotation is NoneType:
        return True, []
    if get_origin(annotation) is Annotated and get_origin(get_args(annotation)[0]) in (Union, UnionType):
        return _options(get_args(annotation)[0])
    if get_origin(annotation) is Annotated and isinstance(get_args(annotation)[0], type):
        inner = get_args(annotation)[0]
        return False, [inner if issubclass(inner, Section) else annotation]
    return False, [annotation]


def _bounds(decorations: Iterable[Any]) -> dict[str, float]:
    found: dict[str, float] = {}
    for each in decorations:
        if isinstance(each, FieldInfo):
            found.update(_bounds(each.metadata))
            continue
        for ours, theirs in (("low", ("ge", "gt")), ("high", ("le", "lt"))):
            for name in theirs:
                value = getattr(each, name, None)
                if isinstance(value, (int, float)):
                    found[ours] = float(value)
                    if name in ("gt", "lt"):
                        found[f"{ours}_open"] = 1.0
    return found


def _default(field: FieldInfo) -> Any:
    value = field.get_default(call_default_factory=True, validated_data={})
    return None if value is PydanticUndefined else plain(value)


def _sections_in(annotation: Any) -> Iterator[type[Section]]:
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for each in get_args(annotation):
        yield from _sections_in(each)
