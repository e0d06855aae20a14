"""The formulas that the importer makes of an installed text, with its parameters' defaults or with random ones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Any

from clfractal.exchange.defaults import CHOICES, default_of
from clfractal.exchange.ends import BAILOUT, DISCS, PLANES, distance_to_disc, distance_to_planes
from clfractal.exchange.installed import ADD_NOTHING, ADD_SWAPPED, ADD_THEMSELVES, Installed, statements_of
from clfractal.exchange.settings import Entry, Section
from clfractal.exchange.translate import Space
from clfractal.exchange.translated import Addition, Following, Text, followed_as_needed
from clfractal.formulas.catalog import resolve
from clfractal.formulas.definition import BoundFormula

APPLICATIONS = (0, 1, 2, 5, 9)
"""Those that are looked at; they may be of different formulas."""
_PASSES = 4
"""With other parameters a text reads others, too."""
_TRANSFORMS, _SHAPES = 1000, range(600, 800)
_COUNTS = ("int", "iterations", "number", "divisions", "order_of", "sides", "repeats")
"""What is in the keys of whole numbers."""

Numbered = tuple[int, BoundFormula]


def formulas_of(
    path: Path, number: int | None, installed: Installed, chance: Random | None
) -> list[Numbered]:
    """The formulas of a text, each with the number of an application that is such a one.

    Args:
        number: of the text, if it has one.
        chance: gives values to all parameters that the text reads, and to what is added; None: they have their defaults.

    Raises:
        FileError: the text is not understood, or not with these parameters.
    """
    section = Section(path.name, "fractal_1")
    swapped = number in ADD_SWAPPED
    found = _formulas(path, number, installed, section, Addition((1.0, 1.0, 1.0), swapped=swapped))
    for _ in range(_PASSES if chance is not None else 0):
        assert chance is not None
        new = sorted(section.seen - section.entries.keys())
        if not new:
            break
        section.entries |= {key: Entry(_any_value(key, chance), 1) for key in new}
        numbers = tuple(chance.uniform(-1.5, 1.5) for _ in range(3))
        added = Addition(numbers) if chance.random() < 0.5 else Addition(constant=numbers)
        found = _formulas(path, number, installed, section, Addition(added.factors, added.constant, swapped))
    return found


def _any_value(key: str, chance: Random) -> str:
    """A value of a parameter, as it stands in a file."""
    usual = default_of(key)
    if isinstance(usual, tuple):
        return " ".join(f"{_near(each, chance):.6g}" for each in usual)
    if "enabled" in key or key.endswith(("_false", "_true", "_mode")):
        return chance.choice(("true", "false"))
    if any(word in key for word in CHOICES):
        return str(chance.randrange(3))
    if "start_iterations" in key:
        return str(chance.randrange(3))
    if "stop_iterations" in key:
        return str(chance.choice((4, 250)))
    if any(word in key for word in _COUNTS):
        return str(max(round(usual) + chance.randrange(-1, 2), 0))
    return f"{_near(usual, chance):.6g}"


def _near(usual: float, chance: Random) -> float:
    """A number of the same kind: far enough from the usual one that nothing cancels."""
    return usual * chance.uniform(0.6, 1.4) + chance.uniform(-0.3, 0.3)


def _formulas(
    path: Path, number: int | None, installed: Installed, section: Section, addition: Addition
) -> list[Numbered]:
    text = Text(number or 0, statements_of(path), path, section, installed.choices)
    adds_not = (*ADD_NOTHING, *ADD_THEMSELVES, *_SHAPES)
    if number is None or number >= _TRANSFORMS or number in adds_not:
        addition = Addition()
    last = None
    if number in (*DISCS, *PLANES):
        last = (distance_to_disc if number in DISCS else distance_to_planes)(text.parameters)
    bailout = BAILOUT if number in DISCS else None

    def begin(four: bool, carried: tuple[str, ...]) -> Following:
        return Following(Space(four), text.parameters, carried, last=last, bailout=bailout)

    def follow(following: Following) -> list[dict[str, Any]]:
        every = [following.applied(text, each, addition) for each in range(APPLICATIONS[-1] + 1)]
        return [every[each] for each in APPLICATIONS]

    done, _ = followed_as_needed(begin, follow, carried=("DE",) if last is not None else ())
    return _bound(done)


def _bound(done: Sequence[dict[str, Any]]) -> list[Numbered]:
    """Each formula once."""
    found: dict[int, Numbered] = {}
    for application, formula in zip(APPLICATIONS, done, strict=True):
        if id(formula) not in found:
            found[id(formula)] = (application, resolve({"inline": formula}).links[0].bound)
    return list(found.values())
