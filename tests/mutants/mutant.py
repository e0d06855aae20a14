"""A file of the program with one small mistake in it."""

from __future__ import annotations

import difflib
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Mutant:
    """One mistake: the whole text of a file with it, and that text without it."""

    path: str
    """Of the file, from the checkout's root, with forward slashes."""
    what: str
    """The kind of mistake."""
    before: str
    after: str

    def diff(self) -> str:
        """The change as a unified diff with two lines around it."""
        lines = difflib.unified_diff(
            self.before.splitlines(), self.after.splitlines(), self.path, self.path, self.what, "", 2, ""
        )
        return "\n".join(lines)
