"""Number types, lane counts, shapes and the like, of which `make test` shows one and `make combinations` the others."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def one_of(first: Any, *others: Any) -> list[Any]:
    """Parameters for `pytest.mark.parametrize`, tuples where it has several names: all but the first are combinations."""
    return [first, *combinations(others)]


def every(step: int, values: Iterable[Any], start: int = 0) -> list[Any]:
    """Parameters for `pytest.mark.parametrize`: all but each `step`-th, from the one numbered `start`, are combinations."""
    return [each if number % step == start else combinations([each])[0] for number, each in enumerate(values)]


def combinations(values: Iterable[Any]) -> list[Any]:
    """Parameters for `pytest.mark.parametrize` that `make combinations` shows."""
    several = (each if isinstance(each, tuple) else (each,) for each in values)
    return [pytest.param(*each, marks=pytest.mark.combination) for each in several]
