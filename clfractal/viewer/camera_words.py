"""A text's words for the place of a camera, such as `orbit`, which a scene that was read no longer has."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import reduce
from typing import Any, TypeAlias

from clfractal.files.fragments import same
from clfractal.scene.camera_base import CameraBase
from clfractal.viewer.editing import child

WORDS = tuple(name for name, field in CameraBase.model_fields.items() if field.exclude)

Path: TypeAlias = tuple[str | int, ...]


def written_words(text: Any) -> dict[Path, dict[str, Any]]:
    """The words of each camera in the plain data of a scene's text, by the camera's path in it."""
    found = {
        path: {name: camera[name] for name in WORDS if camera.get(name) is not None}
        for path in _cameras(text)
        if isinstance(camera := _at(text, path), Mapping)
    }
    return {path: words for path, words in found.items() if words}


def with_words(
    words: Mapping[Path, Mapping[str, Any]],
    before: Any,
    after: Any,
    sparse: Any,
    *,
    kept: Collection[Path],
) -> tuple[Any, Any, Any]:
    """Plain data of a scene, where `before` has the words of its text; the others keep those of some cameras.

    Args:
        kept: paths of cameras whose words stay if the camera is where it was.
    """
    for path, own in words.items():
        place, now = (_place(_at(data, path)) for data in (before, after))
        before = _merged(before, path, own)
        if path in kept and same(place, now):
            after, sparse = _merged(after, path, own), _merged(sparse, path, own)
    return before, after, sparse


def _cameras(data: Any) -> Iterator[Path]:
    if isinstance(data, Mapping):
        yield ("camera",)
        views = _at(data, ("layout", "views"))
        for number in range(len(views) if isinstance(views, list) else 0):
            yield ("layout", "views", number, "camera")
        for name, mark in (_at(data, ("bookmarks",)) or {}).items():
            yield ("bookmarks", name, "camera") if "camera" in mark else ("bookmarks", name)


def _place(camera: Any) -> list[Any]:
    return [camera.get(name) for name in ("position", "target", "up")] if isinstance(camera, Mapping) else []


def _at(data: Any, path: Path) -> Any:
    return reduce(child, map(str, path), data)


def _merged(data: Any, path: Path, more: Mapping[str, Any]) -> Any:
    """A copy of the data with more keys in the mapping at a path."""
    if not path:
        return {**(data or {}), **more}
    first, rest = path[0], path[1:]
    if isinstance(data, list):
        return [_merged(each, rest, more) if i == first else each for i, each in enumerate(data)]
    return {**data, first: _merged(data.get(first), rest, more)}
