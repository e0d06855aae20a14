"""Edits of a scene by dotted paths, as `--set` has them, on the checked scene instead of its text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from clfractal.errors import SceneError, Where
from clfractal.scene.load import check_scene
from clfractal.scene.model import Scene
from clfractal.schema.base import Section
from clfractal.viewer.tracked import check_tracked


def plain_section(scene: Scene, key: str) -> Any:
    """A section (or another top-level value) of a scene as plain data."""
    value = getattr(scene, key)
    if key == "formula":
        return value.mapping()
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    return _plain(value)


def _plain(value: Any) -> Any:
    return value.model_dump(mode="json") if hasattr(value, "model_dump") else value


def value_at(scene: Scene, path: str) -> Any:
    """The plain value at a dotted path, such as `lights.0.intensity`; None if there is none."""
    first, *parts = path.split(".")
    if first not in Scene.model_fields:
        return None
    value = plain_section(scene, first)
    for part in parts:
        if isinstance(value, list) and part.isdecimal() and int(part) < len(value):
            value = value[int(part)]
        elif isinstance(value, dict):
            value = value.get(part)
        else:
            return None
    return value


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


@cache
def _defaults() -> dict[str, Any]:
    least = {"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}}
    return Scene.model_validate(least).model_dump(mode="json")


def differing(scene: Scene, *, keys: tuple[str, ...] | None = None) -> dict[str, tuple[Any, Any]]:
    """What differs from the defaults: dotted path -> (value, default).

    Args:
        keys: the sections to look at; None: all but the version and bookmarks.
    """
    defaults = _defaults()
    found: dict[str, tuple[Any, Any]] = {}
    for key in keys if keys is not None else tuple(Scene.model_fields):
        if key in ("version", "bookmarks"):
            continue
        before = {"iterations": 30} if key == "formula" else defaults[key]
        _differences(key, plain_section(scene, key), before, found)
    return found


def _differences(path: str, now: Any, before: Any, found: dict[str, tuple[Any, Any]]) -> None:
    if isinstance(now, dict) and isinstance(before, dict):
        for name, value in now.items():
            _differences(f"{path}.{name}", value, before.get(name), found)
    elif isinstance(now, list) and isinstance(before, list) and len(now) == len(before):
        if all(not isinstance(each, (dict, list)) for each in now):
            if now != before:
                found[path] = (now, before)
            return
        for number, (value, other) in enumerate(zip(now, before, strict=True)):
            _differences(f"{path}.{number}", value, other, found)
    elif now != before:
        found[path] = (now, before)
