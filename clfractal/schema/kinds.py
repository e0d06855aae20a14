"""Kinds of one thing, each declared in a file of its own: a folder's files are the list of them."""

from collections.abc import Callable, Iterable
from functools import cache, cached_property, reduce
from importlib import import_module
from operator import or_
from pkgutil import iter_modules
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import GetCoreSchemaHandler, Tag
from pydantic_core import CoreSchema
from pydantic_core.core_schema import literal_schema

from clfractal.schema.base import ChosenBy, Section


class Kind:
    """One of several: by itself what a word chooses whose keys stand in a section that all kinds share.

    Attributes:
        tag: the word that chooses it; in `clfractal/elements` it is the name of the file.
        title: its name in the window; there that word, if it tells none.
        place: kinds follow each other by this number where users see them.
    """

    tag: ClassVar[str] = ""
    title: ClassVar[str] = ""
    place: ClassVar[int] = 0

    def __init_subclass__(cls) -> None:
        """Names the kind by its file."""
        super().__init_subclass__()
        folder, _, name = cls.__module__.rpartition(".")
        if folder.startswith("clfractal.elements."):
            cls.tag = name
            cls.title = vars(cls).get("title") or name.replace("_", " ").capitalize()


class Element(Section, Kind):
    """A section that is one of several kinds."""


K = TypeVar("K", bound=Kind)


@cache
def members(family: str) -> tuple[type[Any], ...]:
    """The kinds that the files of a folder of `clfractal/elements` declare, by `place`.

    Raises:
        ValueError: two files declare the same word, or stand at the same place.
    """
    folder = import_module(f"clfractal.elements.{family}")
    found: list[type[Kind]] = []
    for name in sorted(module.name for module in iter_modules(folder.__path__)):
        module = import_module(f"{folder.__name__}.{name}")
        classes = [
            each for each in vars(module).values() if isinstance(each, type) and issubclass(each, Kind)
        ]
        found += [each for each in classes if each.__module__ == module.__name__ and vars(each).get("tag")]
    return in_order(found)


def in_order(kinds: Iterable[type[K]]) -> tuple[type[K], ...]:
    """Kinds as users see them one after the other.

    Raises:
        ValueError: two have the same word or place.
    """
    found = sorted(kinds, key=lambda kind: kind.place)
    for name in ("tag", "place"):
        values: dict[Any, type[K]] = {}
        for each in found:
            other = values.setdefault(getattr(each, name), each)
            if other is not each:
                raise ValueError(f"{other.__module__} and {each.__module__} have the same {name}")
    return tuple(found)


def one_of(kinds: Iterable[type[Element]], key: str, default: str) -> Any:
    """The type of a value that is one of several kinds: the word under a key says which; without it, `default`."""
    options: list[Any] = [Annotated[kind, Tag(kind.tag)] for kind in in_order(kinds)]
    return Annotated[reduce(or_, options), ChosenBy(key, default)]


@cache
def by_word(family: str) -> dict[str, Any]:
    """The kinds of a family by their words, in their order."""
    return {kind.tag: kind for kind in members(family)}


class OneOf:
    """For texts: the word of a kind of a family, perhaps only of those of which something is true."""

    def __init__(self, family: str, allows: Callable[[Any], bool] = lambda kind: True) -> None:
        self.family, self.allows = family, allows

    @cached_property
    def words(self) -> tuple[str, ...]:
        """All that are possible; the kinds are loaded when they are first asked for."""
        return tuple(kind.tag for kind in members(self.family) if self.allows(kind))

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """As pydantic's for a Literal of these words."""
        return literal_schema(list(self.words))
