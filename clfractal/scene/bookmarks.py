"""Cameras of a scene that are kept under names; they have no influence on the picture."""

from typing import Annotated

from pydantic import AfterValidator, Field

from clfractal.scene.parts import Camera
from clfractal.schema.base import problem

MAX_BOOKMARKS = 100
MAX_NAME = 100


def _fitting(name: str) -> str:
    if not 1 <= len(name) <= MAX_NAME:
        raise problem(f"a bookmark's name must be 1 to {MAX_NAME} characters long, got {len(name)}")
    if not name.isprintable() or name.isspace():
        raise problem("a bookmark's name must be printable text on one line")
    return name


BookmarkName = Annotated[
    str,
    Field(strict=True, json_schema_extra={"minLength": 1, "maxLength": MAX_NAME}),
    AfterValidator(_fitting),
]
Bookmarks = Annotated[dict[BookmarkName, Camera], Field(max_length=MAX_BOOKMARKS)]
