"""Edits of a scene by dotted paths, as `--set` has them, on the checked scene instead of its text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

from clfractal.errors import SceneError, Where
from clfractal.scene.load import check_scene
from clfractal.scene.model import Scene
from clfractal.schema.base import Section
from clfractal.viewer.tracked import check_tracked


def plain_section(scene: Scene, key: str) -> Any:
    """A section (or another top-level value) of a scene as plain data."""
    return scene.formula.mapping() if key == "formula" else plain(getattr(scene, key))


def plain(value: Any) -> Any:
    """A value of a scene as plain data: lists, mappings, numbers, words."""
    if isinstance(value, Section):
        return value.model_dump(mode="json")
    if isinstance(value, (tuple, list)):
        return [plain(each) for each in value]
    return {name: plain(each) for name, each in value.items()} if isinstance(value, dict) else value


def value_at(scene: Scene, path: str) -> Any:
    """The plain value at a dotted path, such as `lights.0.intensity`; None if there is none."""
    first, *parts = path.split(".")
    if first not in Scene.model_fields:
        return None
    return reduce(child, parts, plain_section(scene, first))


def child(holder: Any, name: str) -> Any:
    """What a section, a mapping or a list has under a name or number; None if there is nothing."""
    if isinstance(holder, Section):
        return getattr(holder, name, None)
    if isinstance(holder, (tuple, list)):
        return holder[int(name)] if name.isdecimal() and int(name) < len(holder) else None
    return holder.get(name) if isinstance(holder, Mapping) else None


def edited(scene: Scene, values: Mapping[str, Any]) -> Scene:
    """A scene with other values, checked as a scene file is; what was read of files is kept where it still applies.

    Args:
        values: dotted path -> plain value. A path of one part replaces a section; an index just behind a list's end
            appends to it.

    Raises:
        SceneError, FormulaError, FileError: a value is wrong; `where.path` says which.
    """
    sections: dict[str, Any] = {}
    for path, value in values.items():
        first, *parts = path.split(".")
        if first not in Scene.model_fields:
            raise SceneError("there is no such key", Where(path=path))
        present = sections[first] if first in sections else getattr(scene, first)
        sections[first] = _changed({} if parts and present is None else present, parts, value, path)
    return replaced(scene, sections)


def replaced(scene: Scene, sections: Mapping[str, Any]) -> Scene:
    """A scene with other sections, plain or checked ones, as a whole checked as a scene file is.

    Raises:
        SceneError, FormulaError, FileError: they are wrong, or do not fit the others.
    """
    result = scene.model_copy(update=sections)
    if "animation" not in sections:
        check_tracked(scene, result)
    check_scene(result)
    return result


def _changed(value: Any, parts: Sequence[str], new: Any, path: str) -> Any:
    """A value with another one at a path: what is on the way is opened, to be checked again, and all else stays."""
    if not parts:
        return new
    part, *rest = parts
    if isinstance(value, (list, tuple)):
        if not part.isdecimal() or int(part) > len(value) - bool(rest):
            raise SceneError("there is no such entry", Where(path=path))
        index = int(part)
        entry = _changed(value[index] if rest else None, rest, new, path)
        return [*value[:index], entry, *value[index + 1 :]]
    opened = _keys(value) if isinstance(value, Section) else value
    if not isinstance(opened, dict):
        raise SceneError("there is no such key", Where(path=path))
    made: Any = [] if rest and rest[0].isdecimal() else {}
    below = opened.get(part)
    return {**opened, part: _changed(made if below is None else below, rest, new, path)}


def _keys(section: Section) -> dict[str, Any]:
    """The values of a section, but those that others replace."""
    return {
        name: getattr(section, name)
        for name, field in type(section).model_fields.items()
        if not field.exclude
    }
