"""The portraits of the library's formulas: each has one, they are small, and their page shows them all."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PIL import Image

from clfractal.formulas import catalog
from tests.makers import DOCS, maker, pictured

MOST = 600_000  # bytes of all


@pytest.fixture(scope="module")
def portraits() -> Any:
    """docs/make_portraits.py"""
    return maker("make_portraits")


def test_every_formula_with_something_to_show_has_one(portraits: Any) -> None:
    assert set(portraits.names()) == set(catalog.names())
    assert set(portraits.table()) <= set(portraits.names())
    for name in portraits.names():
        scene = portraits.portrait(name, portraits.table().get(name, {}))
        assert scene.formula.name == name
        assert (scene.image.width, scene.image.height) == portraits.SIZE


def test_the_page_is_made_of_the_library(portraits: Any) -> None:
    assert (DOCS / "portraits.md").read_text("utf-8") == portraits.page()


@pictured
def test_the_pictures_are_there_and_small(portraits: Any) -> None:
    files = {file.stem: file for file in portraits.PICTURES.glob("*.webp")}
    assert set(files) == set(portraits.names())
    assert sum(file.stat().st_size for file in files.values()) <= MOST
    for name, file in files.items():
        assert file.stat().st_size <= portraits.LARGEST_FILE
        with Image.open(file) as picture:
            assert picture.size == portraits.SIZE
            shown = np.asarray(picture.convert("RGB"), float)
        # More than the sky: the set takes a good part of the picture, lit and shaded.
        sky = np.linspace(shown[:2].mean(axis=(0, 1)), shown[-2:].mean(axis=(0, 1)), len(shown))[:, None]
        assert (np.abs(shown - sky).max(axis=2) > 25).mean() > 0.08, name
        assert shown.std() > 12, name
