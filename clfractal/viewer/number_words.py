"""Numbers in lines for the user."""

from __future__ import annotations


def counted(number: int, word: str) -> str:
    """So many of something: `1 key`, `3 keys`."""
    return f"{number} {word}" if number == 1 else f"{number} {word}s"
