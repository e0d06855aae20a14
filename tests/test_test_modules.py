"""No test module is imported by another: what several need lies in a file of its own, named after what it is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
_OF_A_MODULE = re.compile(r"\b(?:from|import)\s+(?:tests(?:\.\w+)*|\.+(?:\w+\.)*)\.?test_\w+")
_OF_A_FOLDER = re.compile(
    r"\bfrom\s+(?:tests(?:\.\w+)*|\.[.\w]*)\s+import\s+(?:\([^)]*?|[^\n(]*?)\b(test_\w+)"
)


def imported_tests(text: str) -> list[str]:
    """What a file imports of test modules; also in the texts of programs that it starts."""
    found = [match[0] for pattern in (_OF_A_MODULE, _OF_A_FOLDER) for match in pattern.finditer(text)]
    return [" ".join(each.split()) for each in found]


def test_no_file_imports_a_test_module() -> None:
    files = sorted(TESTS.rglob("*.py"))
    assert len(files) > 400
    wrong = {
        str(path.relative_to(TESTS)): found
        for path in files
        if path != Path(__file__) and (found := imported_tests(path.read_text(encoding="utf-8")))
    }
    assert wrong == {}


@pytest.mark.parametrize(
    "text",
    [
        "from tests.files.test_png import head",
        "from tests.test_api import BULB",
        "import tests.render.test_paths as paths",
        "from tests.render import shots, test_paths",
        "from tests.render import (\n    shots,\n    test_paths,\n)",
        "from .test_paths import path",
        "from . import test_paths",
        'CHILD = """\nfrom tests.files.test_journal import content\n"""',
    ],
)
def test_imports_of_every_form_are_seen(text: str) -> None:
    assert len(imported_tests(text)) == 1


@pytest.mark.parametrize(
    "text",
    [
        "from tests.render.paths import seen\n\n\ndef test_it() -> None: ...",
        "from tests.render import (\n    shots,\n)\nx = (test_y,)",
        "import tests\ntest_x = 1",
    ],
)
def test_other_imports_are_not(text: str) -> None:
    assert imported_tests(text) == []
