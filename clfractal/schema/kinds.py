"""Kinds of one thing, each declared in a file of its own: a folder's files are the list of them."""

from collections.abc import Iterable
from functools import cache, reduce
from importlib import import_module
from operator import or_
from pkgutil import iter_modules
from typing import Annotated, Any, ClassVar

from pydantic import Tag

from clfractal.schema.base import Section, chosen_by


class Element(Section):
    """A section that is one of several kinds.

    Attributes:
        tag: the word that chooses it.
        title: its name in the window.
        place: kinds follow each other by this number where users see them.
    """

    title: ClassVar[str] = ""
    place: ClassVar[int] = 0


@cache
def members(family: str) -> tuple[type[Element], ...]:
    """The kinds that the files of a folder of `clfractal/elements` declare, by `place`.

    Raises:
        ValueError: two files declare the same word, or stand at the same place.
    """
    folder = import_module(f"clfractal.elements.{family}")
    found: list[type[Element]] = []
    for name in sorted(module.name for module in iter_modules(folder.__path__)):
        module = import_module(f"{folder.__name__}.{name}")
        classes = [
            each for each in vars(module).values() if isinstance(each, type) and issubclass(each, Element)
        ]
        found += [each for each in classes if each.__module__ == module.__name__ and vars(each).get("tag")]
    return in_order(found)


def in_order(kinds: Iterable[type[Element]]) -> tuple[type[Element], ...]:
    """Kinds as users see them one after the other.

    Raises:
        ValueError: two have the same word or place.
    """
    found = sorted(kinds, key=lambda kind: kind.place)
    for name in ("tag", "place"):
        values: dict[Any, type[Element]] = {}
        for each in found:
            other = values.setdefault(getattr(each, name), each)
            if other is not each:
                raise ValueError(f"{other.__module__} and {each.__module__} have the same {name}")
    return tuple(found)


def one_of(kinds: Iterable[type[Element]], key: str, default: str) -> Any:
    """The type of a value that is one of several kinds: the word under a key says which; without it, `default`."""
    options: list[Any] = [Annotated[kind, Tag(kind.tag)] for kind in in_order(kinds)]
    return Annotated[reduce(or_, options), chosen_by(key, default)]
