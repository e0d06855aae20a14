"""Numbers in lines for the user."""

from __future__ import annotations

from clfractal.viewer.number_words import counted


def test_one_has_no_plural() -> None:
    assert [counted(number, "key") for number in (0, 1, 2)] == ["0 keys", "1 key", "2 keys"]
