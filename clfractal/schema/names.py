"""Names that users give to what they make: materials and objects."""

from collections.abc import Callable
from typing import Annotated

from pydantic import AfterValidator, Field

from clfractal.schema.base import problem

MAX_NAME = 100


def _fitting(what: str) -> Callable[[str], str]:
    def checked(name: str) -> str:
        if not name.isprintable() or name.isspace() or "." in name:
            raise problem(f"{what} name must be printable text on one line, without a dot")
        return name

    return checked


MaterialName = Annotated[
    str, Field(strict=True, min_length=1, max_length=MAX_NAME), AfterValidator(_fitting("a material's"))
]
ObjectName = Annotated[
    str, Field(strict=True, min_length=1, max_length=MAX_NAME), AfterValidator(_fitting("an object's"))
]
