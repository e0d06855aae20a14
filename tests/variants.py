"""Number types, lane counts and the like, of which `make test` shows one and `make combinations` the others."""

from __future__ import annotations

from typing import Any

import pytest


def one_of(first: Any, *others: Any) -> list[Any]:
    """Parameters for `pytest.mark.parametrize`: each needs programs of its own, so all but the first are combinations."""
    return [first, *(pytest.param(each, marks=pytest.mark.combination) for each in others)]
