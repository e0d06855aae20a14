"""Views of a scene that are kept under names; they have no influence on the picture."""

from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, Field, Tag

from clfractal.scene.deep import Deep
from clfractal.scene.parts import AnyCamera, Camera
from clfractal.schema.base import Chosen, Section, problem

MAX_BOOKMARKS = 100
MAX_NAME = 100


class DeepView(Section):
    """A camera in a place that is shown magnified."""

    tag = "placed"
    camera: Camera = Field(description="as it stands there, scene units")
    deep: Deep = Field(description="the place")


Bookmark: TypeAlias = AnyCamera | DeepView


def view_of(mark: Bookmark) -> tuple[AnyCamera, Deep | None]:
    """A bookmark's camera, and the place that it stands in; None: the formula's own space."""
    return (mark.camera, mark.deep) if isinstance(mark, DeepView) else (mark, None)


def bookmark(camera: AnyCamera, deep: Deep | None) -> Bookmark:
    """The bookmark of a view."""
    return camera if deep is None else DeepView(camera=camera, deep=deep)


def _kind(value: Any) -> str:
    keys = value if isinstance(value, dict) else ()
    return "placed" if isinstance(value, DeepView) or "camera" in keys or "deep" in keys else "alone"


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
_Kept = Annotated[
    Annotated[Camera, Tag("alone")] | Annotated[DeepView, Tag("placed")],
    Chosen(_kind),
]
Bookmarks = Annotated[dict[BookmarkName, _Kept], Field(max_length=MAX_BOOKMARKS)]
