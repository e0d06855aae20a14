"""A scene as plain data without what is a default: as short as somebody would write it."""

from __future__ import annotations

from typing import Any

from clfractal.files.fragments import same
from clfractal.scene.model import Scene
from clfractal.schema.base import Section

# The kinds of camera, renderer, light and lighting that a section without its word for them has.
USUAL_KINDS = frozenset(("perspective", "surface", "directional", "direct"))


def without_defaults(scene: Scene) -> dict[str, Any]:
    """Plain data that load to an equal scene; formulas that came from files are `inline`."""
    return _section(scene)


def _section(section: Section) -> dict[str, Any]:
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
        if name in ("type", "projection"):
            # The word that says which kind it is, as everybody writes it: in front.
            found = {name: short, **found}
        else:
            found[name] = short
    return found


def _short(value: Any) -> Any:
    if isinstance(value, Section):
        return _section(value)
    if isinstance(value, dict):
        return {key: _short(child) for key, child in value.items()}
    if isinstance(value, (tuple, list)):
        return [_short(child) for child in value]
    return value
