"""Colours as people write them, "#rrggbb" or "#rgb": sRGB codes, which a scene holds as linear Rec. 709."""

import re
from collections.abc import Callable, Mapping
from typing import Any

from pydantic_core import PydanticCustomError, core_schema

_HEX = re.compile("#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})")


def is_hex(value: Any) -> bool:
    """Whether a value is a text that is meant as a colour, correct or not."""
    return isinstance(value, str) and value.startswith("#")


def linear_color(text: str) -> list[float] | None:
    """A colour's three components in linear light, 0 to 1, by the transfer function of sRGB; None if it is not one."""
    if not _HEX.fullmatch(text):
        return None
    # Here, because most scenes have no such colour, and NumPy takes long to import.
    import numpy as np

    from clfractal.files.srgb import decode

    digits = text[1:] if len(text) == 7 else "".join(2 * digit for digit in text[1:])
    codes = np.array(list(bytes.fromhex(digits)), dtype=np.float64) / 255
    return [float(component) for component in decode(codes)]


class AlsoAs:
    """For an annotation: a second, shorter way to write a value.

    Args:
        read: gives the long form of a short one, and anything else as it is.
        schema: the JSON Schema of the short form; None: that of the long form allows it.
    """

    def __init__(self, read: Callable[[Any], Any], schema: Mapping[str, Any] | None) -> None:
        self.read, self.schema = read, schema

    def __get_pydantic_core_schema__(
        self, source: Any, handler: Callable[[Any], core_schema.CoreSchema]
    ) -> core_schema.CoreSchema:
        """As the long form, after a short one was turned into it."""
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Callable[[Any], dict[str, Any]]) -> Any:
        """Either form."""
        longer = handler(schema)
        if self.schema is None:
            return longer
        if "const" in self.schema:  # so that mistakes in the long form are marked at their own places
            return {"if": {"type": "string"}, "then": dict(self.schema), "else": longer}
        return {"anyOf": [longer, dict(self.schema)]}


def listed(value: Any) -> Any:
    """A colour's text as a list of three numbers; a list as it is.

    Raises:
        PydanticCustomError: neither of the two.
    """
    found = linear_color(value) if isinstance(value, str) else value
    if not isinstance(found, (list, tuple)):
        raise PydanticCustomError("color", "must be a colour")
    return found


TEXT_SCHEMA = {"type": "string", "pattern": f"^{_HEX.pattern}$"}
AS_TEXT = AlsoAs(listed, TEXT_SCHEMA)
"""A list of three numbers may also be written as "#rrggbb" or "#rgb"."""
COLOR_SCHEMA = {
    "anyOf": [
        {"type": "array", "items": {"type": "number", "minimum": 0}, "minItems": 3, "maxItems": 3},
        TEXT_SCHEMA,
    ]
}
"""JSON Schema of a colour, in the place of something longer."""
