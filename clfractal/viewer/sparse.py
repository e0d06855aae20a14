"""A scene as plain data without what is a default: as short as somebody would write it."""

from __future__ import annotations

from typing import Any

from clfractal.files.fragments import same
from clfractal.schema.base import Section

# The kinds of camera, renderer, light and lighting that a section without its word for them has.
USUAL_KINDS = frozenset(("perspective", "surface", "directional", "direct"))


def without_defaults(section: Section) -> dict[str, Any]:
    """Plain data that load to an equal scene, or section; formulas that came from files are `inline`."""
    found: dict[str, Any] = {}
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        short = _short(value)
        if not field.is_required():
            if isinstance(value, str) and value == section.tag:
                if value in USUAL_KINDS:
                    continue
            elif same(short, _short(field.get_default(call_default_factory=True))):
                continue
        # The word that says which kind it is stands in front, as everybody writes it.
        found = {name: short, **found} if name in ("type", "projection") else {**found, name: short}
    return found


def _short(value: Any) -> Any:
    if isinstance(value, Section):
        return without_defaults(value)
    if isinstance(value, dict):
        return {key: _short(child) for key, child in value.items()}
    if isinstance(value, (tuple, list)):
        return [_short(child) for child in value]
    return value
