"""Checks of what Python programs pass: errors of one line that name the argument.

NumPy's numbers are taken wherever Python's are.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from clfractal.errors import ClfractalError, SceneError, Where, nearest

Kind = type[ClfractalError]

_BUILT_IN = frozenset({str, int, float, bool, type(None)})


def plain(value: Any) -> Any:
    """The value with Python's numbers and lists in the place of NumPy's, in mappings, lists and tuples too."""
    if type(value) in _BUILT_IN:
        return value
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list):
        return [plain(each) for each in value]
    if type(value) is tuple:
        return tuple(plain(each) for each in value)
    # Arrays and single numbers of NumPy both have it; NumPy is not loaded for asking.
    return value.tolist() if hasattr(type(value), "tolist") else value


def refuse(name: str, allowed: str, value: Any, error: Kind = SceneError) -> NoReturn:
    """Raises the error of an argument: `samples: must be a whole number, got 2.7`."""
    raise error(f"{allowed}, got {shown(value)}", Where(path=name))


def shown(value: Any) -> str:
    """A value as errors show it: short, on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if value is None:
        return "nothing"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    if isinstance(value, Mapping):
        return "a mapping"
    text = repr(value) if isinstance(value, (int, float, str)) else type(value).__name__
    return text if len(text) <= 60 else text[:57] + "..."


def whole(name: str, value: Any, least: int, most: int, error: Kind = SceneError) -> int:
    """A whole number from `least` to `most`."""
    found = plain(value)
    if isinstance(found, bool) or not isinstance(found, int):
        refuse(name, "must be a whole number", found, error)
    if not least <= found <= most:
        refuse(name, f"must be from {least} to {most}", found, error)
    return found


def number(
    name: str,
    value: Any,
    least: float = -math.inf,
    most: float = math.inf,
    *,
    above: float | None = None,
    error: Kind = SceneError,
) -> float:
    """A finite number from `least` to `most`, and larger than `above`."""
    found = plain(value)
    if isinstance(found, bool) or not isinstance(found, (int, float)):
        refuse(name, "must be a number", found, error)
    if not math.isfinite(found):
        refuse(name, "must be a finite number", found, error)
    if found < least:
        refuse(name, f"must be at least {least:g}", found, error)
    if found > most:
        refuse(name, f"must be at most {most:g}", found, error)
    if above is not None and found <= above:
        refuse(name, f"must be above {above:g}", found, error)
    return float(found)


def flag(name: str, value: Any) -> bool:
    """True or false."""
    found = plain(value)
    if not isinstance(found, bool):
        refuse(name, "must be true or false", found)
    return found


def word(name: str, value: Any, known: Sequence[str], error: Kind = SceneError) -> str:
    """One of some words."""
    if not isinstance(value, str) or value not in known:
        guess = nearest(value, known) if isinstance(value, str) else None
        allowed = f"must be {', '.join(known[:-1])} or {known[-1]}"
        raise error(
            f"{allowed}, got {shown(value)}" + (f"; did you mean {guess!r}?" if guess else ""),
            Where(path=name),
        )
    return value


def numbers(name: str, value: Any, count: int, form: str) -> tuple[int, ...]:
    """Some whole numbers; `form` says which, for the message."""
    found = plain(value)
    is_list = isinstance(found, (list, tuple)) and len(found) == count
    if not is_list or not all(isinstance(each, int) and not isinstance(each, bool) for each in found):
        given = f"{found!r}"[:60] if isinstance(found, (list, tuple)) else shown(found)
        raise SceneError(f"must be {count} whole numbers, {form}; got {given}", Where(path=name))
    return tuple(found)


def words(name: str, value: Any) -> tuple[str, ...]:
    """A list of texts, which a single text is not."""
    if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Iterable):
        refuse(name, "must be a list of texts", plain(value))
    found = tuple(value)
    for each in found:
        if not isinstance(each, str):
            refuse(name, "must be a list of texts", plain(each))
    return found


def function(name: str, value: Any) -> None:
    """A function, or None."""
    if value is not None and not callable(value):
        refuse(name, "must be a function", plain(value))


def path_of(name: str, value: Any, error: Kind = SceneError) -> Path:
    """A path: text or a Path, not empty."""
    if not isinstance(value, (str, Path)):
        refuse(name, "must be a path", plain(value), error)
    if str(value) == "":
        raise error("must not be empty", Where(path=name))
    return Path(value)
