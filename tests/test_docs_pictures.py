"""The pictures of docs/ that show what settings do: each row of their table has its file, and its place on a page."""

from __future__ import annotations

from typing import Any

import pytest
from PIL import Image

from tests.makers import DOCS, maker, pictured

each_picture = pytest.mark.parametrize(
    "picture", maker("make_pictures").table(), ids=lambda picture: str(picture.name)
)


@pictured
@each_picture
def test_it_is_there_and_small(picture: Any) -> None:
    assert picture.path.stat().st_size <= maker("make_gallery").LARGEST_FILE == 200_000
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
