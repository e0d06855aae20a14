"""The pictures of docs/ that show what settings do: each row of their table has its file, and its place on a page."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from PIL import Image

DOCS = Path(__file__).resolve().parents[1] / "docs"


def maker() -> ModuleType:
    """docs/make_pictures.py, which belongs to no package."""
    spec = importlib.util.spec_from_file_location("make_pictures", DOCS / "make_pictures.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up there
    spec.loader.exec_module(module)
    return module


MAKER = maker()
each_picture = pytest.mark.parametrize("picture", MAKER.table(), ids=lambda picture: str(picture.name))


@each_picture
def test_it_is_there_and_small(picture: Any) -> None:
    assert picture.path.stat().st_size <= MAKER.gallery().LARGEST_FILE == 200_000
    with Image.open(picture.path) as shown:
        assert shown.size == picture.size


@each_picture
def test_its_page_shows_it(picture: Any) -> None:
    assert f"](pictures/{picture.name}.webp)" in (DOCS / picture.page).read_text("utf-8")


@each_picture
def test_its_panels_differ(picture: Any) -> None:
    assert (
        len({(str(panel.scene.resolved()), panel.show) for panel in picture.panels})
        == len(picture.panels)
        > 1
    )
