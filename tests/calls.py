"""Functions whose calls are noted, and functions that fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn, TypeVar

import pytest

import clfractal
from clfractal.errors import STATUS_BAD_INPUT

Failure = TypeVar("Failure", bound=clfractal.ClfractalError)


def failure(
    kind: type[Failure], function: Callable[..., object], *arguments: Any, **settings: Any
) -> Failure:
    """How a call fails: in one line, as is promised, and as bad input."""
    with pytest.raises(kind) as caught:
        function(*arguments, **settings)
    assert "\n" not in str(caught.value)
    assert caught.value.status == STATUS_BAD_INPUT
    return caught.value


def counted(monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> list[tuple[Any, ...]]:
    """Notes the calls of a function: the arguments that have no names."""
    calls: list[tuple[Any, ...]] = []
    before: Callable[..., object] = getattr(owner, name)

    def noted(*arguments: object, **settings: object) -> object:
        calls.append(arguments)
        return before(*arguments, **settings)

    monkeypatch.setattr(owner, name, noted)
    return calls


def raising(error: BaseException | type[BaseException]) -> Callable[..., NoReturn]:
    """A function that fails, whatever it is given."""

    def fail(*_: object, **__: object) -> NoReturn:
        raise error

    return fail
