"""The page about the window says what the program does: its keys, gestures and settings."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from clfractal.viewer.keys import KeyMap
from clfractal.viewer.settings import Settings
from tests.document import DOCS, table


def test_the_table_of_keys() -> None:
    told = [tuple(row) for row in table("window.md", "Keys")]
    assert told == KeyMap.defaults().help_rows()


def shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def test_the_table_of_settings() -> None:
    expected = []
    for field in fields(Settings):
        rules = field.metadata
        if field.name == "keys":
            expected.append([f"`{field.name}`", "`{}`", "actions and keys", rules["told"]])
            continue
        bounds = f"{rules['least']:g} to {rules['most']:g}" if "least" in rules else ""
        words = bounds or " or ".join(rules.get("words") or ()) or "true or false"
        expected.append([f"`{field.name}`", f"`{shown(field.default)}`", words, rules["told"]])
    assert table("window.md", "Settings") == expected


def test_every_gesture_of_the_help_is_told() -> None:
    pytest.importorskip("imgui_bundle")
    from clfractal.viewer.panels.help import POINTER_ROWS

    page = (DOCS / "window.md").read_text(encoding="utf-8").lower()
    for gesture, _ in POINTER_ROWS:
        first = gesture.split(":")[0].split("+")[0].split()[-1].lower()
        assert first in page, gesture
