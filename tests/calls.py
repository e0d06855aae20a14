"""Functions whose calls are noted."""

from __future__ import annotations

from collections.abc import Callable

import pytest


def counted(monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> list[object]:
    """Notes the calls of a function."""
    calls: list[object] = []
    before: Callable[..., object] = getattr(owner, name)

    def noted(*arguments: object, **settings: object) -> object:
        calls.append(arguments)
        return before(*arguments, **settings)

    monkeypatch.setattr(owner, name, noted)
    return calls
