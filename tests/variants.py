"""Number types, lane counts, shapes and the like, of which `make test` shows one and `make combinations` the others."""

from __future__ import annotations

from typing import Any

import pytest


def one_of(first: Any, *others: Any) -> list[Any]:
    """Parameters for `pytest.mark.parametrize`, tuples where it has several names: all but the first are combinations."""
    several = (each if isinstance(each, tuple) else (each,) for each in others)
    return [first, *(pytest.param(*each, marks=pytest.mark.combination) for each in several)]
