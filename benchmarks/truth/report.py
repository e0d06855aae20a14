"""What was measured: lines as they come, the targets that are missed, and all of it as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from clfractal.files.atomic import atomic_writer


class Report:
    """Prints lines as they are measured, and keeps the figures."""

    def __init__(self) -> None:
        self.found: dict[str, list[dict[str, Any]]] = {}
        self.missed: list[str] = []

    def keep(self, part: str, what: Any, **more: Any) -> None:
        """Keeps a measurement (a data class that knows whether its target is met) for the file."""
        self.found.setdefault(part, []).append({**more, **asdict(what), "met": what.met})

    def say(self, line: str = "") -> None:
        """A line of the table, at once."""
        print(line, flush=True)

    def write(self, path: Path) -> None:
        """All figures as JSON; what is infinite or no number is null.

        Raises:
            FileError: it cannot be written.
        """
        with atomic_writer(path) as beside:
            text = json.dumps(_plain({**self.found, "missed": self.missed}), indent=1, allow_nan=False)
            beside.write_text(text + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
