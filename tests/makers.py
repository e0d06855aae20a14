"""The programs docs/make_*.py and docs/tables_*.py, for tests. They belong to no package, and import each other by name as
when they are run."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"
PICTURES = DOCS / "pictures"
pictured = pytest.mark.skipif(not PICTURES.is_dir(), reason="an sdist comes without the pages' pictures")
"""Of tests that look at these pictures."""


def maker(name: str) -> ModuleType:
    """The program docs/NAME.py as a module, such as `make_gallery`; the same one for all who ask."""
    if str(DOCS) not in sys.path:
        sys.path.append(str(DOCS))
    return importlib.import_module(name)
