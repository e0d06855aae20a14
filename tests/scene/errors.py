"""What a scene that is refused is told, and where."""

from __future__ import annotations

from pathlib import Path

import pytest

from clfractal.errors import FileError, FormulaError, SceneError
from clfractal.scene.load import load_scene


def error_of(text: str, *overrides: str, folder: Path | None = None) -> str:
    with pytest.raises((SceneError, FormulaError, FileError)) as caught:
        load_scene(text, overrides=overrides, folder=folder)
    assert "\n" not in str(caught.value)
    assert caught.value.status == 2
    return str(caught.value)


def marked(text: str) -> tuple[str, str]:
    """The text without its mark, and the mark's place as messages show it."""
    before, _, after = text.partition("§")
    return before + after, f"scene:{before.count(chr(10)) + 1}:{len(before) - before.rfind(chr(10))}"
