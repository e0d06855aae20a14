"""The tutorial's pictures: each is there, small, and one that a command of the page makes."""

from __future__ import annotations

import re

import pytest
from PIL import Image

from tests.makers import DOCS, pictured

PAGE = (DOCS / "tutorial.md").read_text("utf-8")
NAMES = re.findall(r"\]\(pictures/tutorial_(\w+)\.webp\)", PAGE)


def test_it_has_pictures() -> None:
    assert len(NAMES) >= 10
    assert len(set(NAMES)) == len(NAMES)


@pictured
@pytest.mark.parametrize("name", NAMES)
def test_a_picture(name: str) -> None:
    assert f"-o {name}.png" in PAGE
    file = DOCS / "pictures" / f"tutorial_{name}.webp"
    assert file.stat().st_size <= 200_000
    with Image.open(file) as shown:
        assert shown.width <= 1280


@pictured
def test_no_picture_is_left_over() -> None:
    assert {file.stem for file in (DOCS / "pictures").glob("tutorial_*")} == {
        f"tutorial_{name}" for name in NAMES
    }
