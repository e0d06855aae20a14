"""Turns errors of the schema into one line: what is allowed, what was given, and where."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeAlias, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from clfractal.errors import SceneError, Where, nearest, unknown_name
from clfractal.errors.arguments import shown
from clfractal.files.marks import Document, dotted

# Words for the checks that compare with one number or a few words, filled with the check's own context.
_ALLOWED: Mapping[str, str] = {
    "less_than": "must be below {lt}",
    "less_than_equal": "must be at most {le}",
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be at least {ge}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "string_too_short": "must not be empty",
    "string_too_long": "must be at most {max_length} characters long",
    "dict_type": "must be a mapping",
    "model_type": "must be a mapping",
    "model_attributes_type": "must be a mapping",
    "too_short": "must have at least {min_length} entries",
    "too_long": "must have at most {max_length} entries",
}


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong with plain data.

    `path` leads to the value; with `key` set the problem is the key itself, of the mapping at `path`.
    A `late` problem is found at the end of the value (something is missing in it).
    `shown` is the path in the message, where it is not `path`.
    """

    path: tuple[str | int, ...]
    message: str
    key: str | None = None
    late: bool = False
    shown: tuple[str | int, ...] | None = None

    def error(self, document: Document) -> SceneError:
        """The error, at its place in the document."""
        where = document.where(self.path, key=self.key)
        if self.shown is not None:
            where = Where(where.file, where.line, where.column, dotted(self.shown))
        return SceneError(self.message, where)

    def order(self, document: Document) -> tuple[int, int, int]:
        """Sorts problems by their place in the text; problems in options come last."""
        place = document.where(self.path, key=self.key)
        if place.line is None or place.column is None:
            return (1, 0, 0)
        if self.late:
            line, column = document.end(self.path)
            return (0, line, column)
        return (0, place.line, place.column)


Root = type[BaseModel]
"""The model that refused plain data: its errors' locations begin there."""


def first_error(error: ValidationError, document: Document, root: Root) -> SceneError:
    """The first problem in the text, as an error of ours. `root` is the model that was to be made of the document."""
    problems = [
        p for details in error.errors(include_url=False) if (p := _problem(details, root)) is not None
    ]
    if not problems:
        return SceneError("is not a scene", document.where(()))
    return min(problems, key=lambda p: p.order(document)).error(document)


@dataclass(slots=True)
class _Place:
    """Where an error's location leads: the path in the data, and the types that are allowed there."""

    path: list[str | int]
    types: list[Any]

    @property
    def models(self) -> list[Root]:
        return [t for t in self.types if isinstance(t, type) and issubclass(t, BaseModel)]

    def keys(self) -> list[str]:
        return [name for model in self.models for name in model.model_fields]


def _tag(model: Root) -> str:
    """The word that chooses the model, see `Section`."""
    return str(getattr(model, "tag", ""))


def _options(annotation: Any) -> list[Any]:
    """The types of an annotation, without what decorates them."""
    if get_origin(annotation) is Annotated:
        return _options(get_args(annotation)[0])
    if get_origin(annotation) in (tuple, dict, Literal) or not get_args(annotation):
        return [annotation]
    return [option for argument in get_args(annotation) for option in _options(argument)]


def _place(root: Root, location: Sequence[str | int]) -> _Place:
    """Follows a location through the schema; words in it that choose a class are not keys."""
    place = _Place([], [root])
    for part in location:
        model = next((m for m in place.models if part in m.model_fields), None)
        chosen = [m for m in place.models if _tag(m) == part] if len(place.models) > 1 else []
        if chosen:  # before a key of the same name
            place.types = list(chosen)
        elif isinstance(part, int):
            items = [a for t in place.types if get_origin(t) is tuple for a in get_args(t) if a is not ...]
            place.types = [option for item in items for option in _options(item)]
            place.path.append(part)
        elif model is not None:
            place.types = _options(model.model_fields[part].annotation)
            place.path.append(part)
        elif any(get_origin(t) is dict for t in place.types):
            values = [get_args(t)[1] for t in place.types if get_origin(t) is dict]
            place.types = [option for value in values for option in _options(value)]
            place.path.append(part)
    return place


def _problem(details: ErrorDetails, root: Root) -> Problem | None:
    place = _place(root, details["loc"])
    special: _Special | None = _SPECIAL.get(details["type"])
    if special is not None:
        return special(details, place, root)
    if details["type"] not in _ALLOWED:
        return Problem(tuple(place.path), details["msg"][:1].lower() + details["msg"][1:])
    allowed = _allowed(details)
    return Problem(tuple(place.path), f"{allowed}, got {shown(details['input'])}")


def _allowed(details: ErrorDetails) -> str:
    context = {
        key: int(value) if isinstance(value, float) and value.is_integer() and abs(value) < 1e16 else value
        for key, value in details.get("ctx", {}).items()
    }
    return _ALLOWED[details["type"]].format(**context)


def _own(details: ErrorDetails, _: _Place, root: Root) -> Problem:
    location = details["loc"]
    key = None
    if location and location[-1] == "[key]":
        key, location = str(location[-2]), location[:-2]
    path = tuple(_place(root, location).path)
    context = details["ctx"]
    return Problem((*path, *context["at"]), context["message"], key)


def _unknown_key(details: ErrorDetails, _: _Place, root: Root) -> Problem:
    place = _place(root, details["loc"][:-1])
    key = str(details["loc"][-1])
    return Problem(tuple(place.path), unknown_name("key", key, place.keys()), key)


def _missing(details: ErrorDetails, _: _Place, root: Root) -> Problem:
    place = _place(root, details["loc"][:-1])
    part = details["loc"][-1]
    if isinstance(part, int):
        return _tuple(details, place, root)
    return Problem(tuple(place.path), "is missing", late=True, shown=(*place.path, part))


def _tuple(details: ErrorDetails, place: _Place, _: Root) -> Problem:
    fixed = next((t for t in place.types if get_origin(t) is tuple and ... not in get_args(t)), None)
    entries = [option for item in get_args(fixed) for option in _options(item)]
    of = "lists" if any(get_origin(entry) is tuple for entry in entries) else "numbers"
    what = f"a list of {len(get_args(fixed))} {of}" if fixed else "a list"
    if str in place.types:
        what = f"text or {what}"
    return Problem(tuple(place.path), f"must be {what}, got {shown(details['input'])}")


def _length(details: ErrorDetails, place: _Place, root: Root) -> Problem | None:
    if any(get_origin(t) is tuple and ... not in get_args(t) for t in place.types):
        return _tuple(details, place, root)
    # The check does not count an entry that is itself wrong; that entry has its own error.
    if details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]:
        return None
    if not details["input"]:
        return Problem(tuple(place.path), "must not be empty")
    allowed = _allowed(details)
    return Problem(tuple(place.path), f"{allowed}, got {len(details['input'])}")


def _kind(details: ErrorDetails, place: _Place, _: Root) -> Problem:
    """The message for a word that should choose a class but is unknown."""
    key = "projection" if any("projection" in m.model_fields for m in place.models) else "type"
    given = details["input"].get(key)
    tags = [_tag(model) for model in place.models if key in model.model_fields]
    path = (*place.path, key)
    if not isinstance(given, str):
        return Problem(path, f"must be {' or '.join(tags)}, got {shown(given)}")
    return Problem(path, unknown_name(key, given, tags))


def _word(details: ErrorDetails, place: _Place, _: Root) -> Problem:
    allowed = details["ctx"]["expected"].replace("'", "")
    if place.models:
        allowed += f", a colour, or a mapping with {' and '.join(place.keys())}"
    elif float in place.types:
        allowed = f"a number or {allowed}"
    guess = _nearest_word(details["input"], allowed)
    return Problem(tuple(place.path), f"must be {allowed}, got {shown(details['input'])}{guess}")


def _nearest_word(given: Any, allowed: str) -> str:
    """A suggestion of a similar word, if there are many choices."""
    words = allowed.replace(" or ", ", ").split(", ")
    guess = nearest(given, words) if isinstance(given, str) and len(words) > 3 else None
    return f"; did you mean {guess!r}?" if guess else ""


def _color(details: ErrorDetails, place: _Place, _: Root) -> Problem:
    """The message for what is no colour. Without quotes a `#` begins a comment, and the value is nothing."""
    given = details["input"]
    quoted = "; a # needs quotes" if given is None else ""
    return Problem(
        tuple(place.path),
        f"must be a list of 3 numbers, or a colour as '#ff8800' or '#f80', got {shown(given)}{quoted}",
    )


_Special: TypeAlias = Callable[[ErrorDetails, _Place, Root], Problem | None]
_SPECIAL: Mapping[str, _Special] = {
    "clfractal": _own,
    "color": _color,
    "extra_forbidden": _unknown_key,
    "missing": _missing,
    "tuple_type": _tuple,
    "too_short": _length,
    "too_long": _length,
    "union_tag_invalid": _kind,
    "literal_error": _word,
}
