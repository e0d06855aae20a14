"""What a scene that is refused is told, and where."""

from __future__ import annotations

import re
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


def cases(table: str, **names: object) -> list[tuple[str, str]]:
    """Wrong texts, and after `=>`, there or below, what is told; indented lines go on. «NAME» is a name's text."""
    for name, text in names.items():
        table = table.replace(f"«{name}»", str(text))
    found = re.findall(r"^(?!# )(\S.*?(?:\n.+?)*?)\s*=> (.*(?:\n +.*)*)$", table, re.MULTILINE)
    return [(text, re.sub(r"\n +", " ", message)) for text, message in found]
