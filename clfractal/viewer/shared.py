"""Values that a scene's text has once and uses at several places (YAML anchors): edits leave them one."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

from clfractal.errors import ClfractalError, SceneError
from clfractal.files.document import read_document
from clfractal.files.fragments import same
from clfractal.files.marks import Node, dotted
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from clfractal.viewer.editing import plain_section, replaced

Path: TypeAlias = tuple[str, ...]
Group: TypeAlias = tuple[Path, ...]
"""The places of one value, of which there are at least two."""

_NONE = object()


def groups_of(text: str) -> tuple[Group, ...]:
    """The values of a text that stand at several places; what is within such a value is not listed again."""
    try:
        root = read_document(text).root
    except SceneError:
        return ()
    found: dict[int, list[Path]] = {}
    _look(root, (), found)
    return tuple(tuple(places) for places in found.values() if len(places) > 1)


def _look(node: Node, path: Path, found: dict[int, list[Path]]) -> None:
    places = found.setdefault(id(node), [])
    places.append(path)
    if len(places) == 1:
        for name, child in _children(node.value):
            _look(child, (*path, name), found)


class Shared:
    """The shared values of the scene that is edited.

    Places are one thing as long as they have equal values, as in its text: an alias that was given another value is written
    as a value of its own. So each change of one of them, whatever made it, is made at the others too.
    """

    def __init__(self) -> None:
        self._given: tuple[Group, ...] = ()
        self._groups: list[list[Path]] = []

    def tied(self, before: Scene, after: Scene, groups: tuple[Group, ...]) -> Scene:
        """The scene after an edit, with the same change at all places of what it changed.

        Args:
            groups: of the scene's text, see `groups_of`.

        Raises:
            SceneError: the value is not possible at another of its places.
        """
        self._know(before, groups)
        old, new = self._sections(before, after)
        if not old:
            return after
        wanted: dict[Path, Any] = {}
        for group in self._groups:
            _tie(group, old, new, wanted)
        for path, value in wanted.items():
            _put(new, path, value)
        try:
            found = replaced(after, {path[0]: new[path[0]] for path in wanted}) if wanted else after
        except ClfractalError as error:
            places = ", ".join(map(dotted, wanted))
            raise SceneError(f"the file has the same value at {places}: {error}") from error
        self._follow(old, new)
        return found

    def follow(self, before: Scene, after: Scene, groups: tuple[Group, ...]) -> None:
        """A step was taken back, or repeated: it has all places of what it changed, which may have other numbers now."""
        self._know(before, groups)
        self._follow(*self._sections(before, after))

    def _know(self, scene: Scene, groups: tuple[Group, ...]) -> None:
        if groups is not self._given:
            self._given = groups
            tracks = (
                [] if scene.animation is None else [each.path for each in movement_of(scene).targets.values()]
            )
            plain = {
                path[0]: plain_section(scene, path[0]) for group in groups for path in group if _is_key(path)
            }
            self._groups = [part for group in groups for part in _parts(group, plain, tracks)]

    def _sections(self, before: Scene, after: Scene) -> tuple[dict[str, Any], dict[str, Any]]:
        """The sections with shared values as plain data; none if none of them was changed."""
        names = {path[0] for group in self._groups for path in group}
        if all(getattr(before, name) is getattr(after, name) for name in names):
            return {}, {}
        old, new = ({name: plain_section(scene, name) for name in names} for scene in (before, after))
        return old, new

    def _follow(self, old: dict[str, Any], new: dict[str, Any]) -> None:
        """Entries of lists have other numbers where some came or went: the places go with them."""
        for group in self._groups:
            values = [_get(old, path) for path in group]
            for number, path in enumerate(group):
                # What is no longer the same thing stays where it was: undo brings it back there.
                others = [*values[:number], *values[number + 1 :]]
                if values[number] is not _NONE and any(same(values[number], each) for each in others):
                    group[number] = _moved(old, new, path)


def _is_key(path: Path) -> bool:
    return bool(path) and path[0] in Scene.model_fields


def _parts(group: Sequence[Path], plain: dict[str, Any], tracks: Sequence[Path]) -> Iterator[list[Path]]:
    """A group, or where it is no whole the groups of its parts: sections of two kinds have other defaults, and tracks
    move a part of one of them."""
    places = [path for path in group if _is_key(path) and _get(plain, path) is not _NONE]
    if len(places) < 2:
        return
    values = [_get(plain, path) for path in places]
    moved = any(track[: len(path)] == path for track in tracks for path in places)
    if not moved and all(same(values[0], value) for value in values):
        yield places
        return
    for name, _ in _children(values[0]):
        yield from _parts([(*path, name) for path in places], plain, tracks)


def _tie(group: Sequence[Path], old: dict[str, Any], new: dict[str, Any], wanted: dict[Path, Any]) -> None:
    """Finds which places of a group have to change, too: those that were equal to a changed one, and have not changed."""
    there = [path for path in group if _get(new, path) is not _NONE and _shifted(old, new, path) is None]
    before = {path: _get(old, path) for path in there}
    changed = [
        path for path in there if before[path] is not _NONE and not same(before[path], _get(new, path))
    ]
    for path in there:
        like = next((each for each in changed if same(before[each], before[path])), None)
        if like is not None and path not in changed:
            wanted[path] = copy.deepcopy(_get(new, like))


def _shifted(old: dict[str, Any], new: dict[str, Any], path: Path) -> int | None:
    """Where on the way a list has another length than before: its entries may be others; None: nowhere."""
    for end in range(1, len(path)):
        one, other = _get(old, path[:end]), _get(new, path[:end])
        if isinstance(one, list) and isinstance(other, list) and len(one) != len(other):
            return end
    return None


def _moved(old: dict[str, Any], new: dict[str, Any], path: Path) -> Path:
    """Where an entry of a list that has become longer or shorter is now; the same place if it is gone."""
    end = _shifted(old, new, path)
    if end is None:
        return path
    entry, there = _get(old, path[: end + 1]), _get(new, path[:end])
    place = next((n for n, each in enumerate(there) if same(each, entry)), None)
    return path if place is None else (*path[:end], str(place), *path[end + 1 :])


def _get(value: Any, path: Path) -> Any:
    for name in path:
        value = next((child for key, child in _children(value) if key == name), _NONE)
    return value


def _put(value: Any, path: Path, new: Any) -> None:
    *way, last = path
    for name in way:
        value = value[int(name)] if isinstance(value, list) else value[name]
    if isinstance(value, list):
        value[int(last)] = new
    else:
        value[last] = new


def _children(value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        yield from value.items()
    elif isinstance(value, list):
        yield from ((str(number), each) for number, each in enumerate(value))
