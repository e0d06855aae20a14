"""The frame of a film at which its scene is shown and edited.

The scene in the window then has the values of that frame in the places of its tracks, so that all panels and pointers see
them. The scene that is saved (its document) has the values there that its file has: looking at another frame changes
nothing. What is changed at a frame stays changed until another frame is shown, or becomes a key.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any, TypeAlias

from clfractal.errors import SceneError
from clfractal.scene.animation import Animation
from clfractal.scene.camera_base import PLACE, CameraBase
from clfractal.scene.curves import same
from clfractal.scene.model import Scene
from clfractal.scene.moved_cameras import words_moved
from clfractal.scene.movement import movement_of
from clfractal.scene.tracks import target_of, value_under, with_values
from clfractal.schema.base import Section
from clfractal.viewer.timeline_edits import with_key

Path: TypeAlias = tuple[str, ...]

_NOTHING = object()
# What is no part of a picture, or is the same in all frames.
_LEFT_OUT = frozenset({"version", "image", "bookmarks", "animation"})


@dataclass(frozen=True, slots=True, eq=False)
class FilmPlace:
    """A frame that is shown.

    Attributes:
        frame: its number from 0, which may lie between two.
        rest: the document as it was when the frame was shown first; what tracks move is saved as it is here.
        posed: the scene as it is at the frame; what differs from it was changed since.
    """

    frame: float
    rest: Scene
    posed: Scene

    def document(self, scene: Scene) -> Scene:
        """The scene to be saved of one that is edited at this frame.

        Raises:
            SceneError: a track of it is wrong.
        """
        if scene is self.posed or scene.animation is None:
            return self.rest if scene is self.posed else scene
        return _rested(scene, self.rest)


def place_at(document: Scene, frame: float) -> FilmPlace:
    """A frame of a document that has an animation.

    Raises:
        ClfractalError: a value is out of its range then; at its track.
    """
    return FilmPlace(frame, document, movement_of(document).posed(frame))


def rendered(scene: Scene, frame: float, *, blurred: bool) -> Scene:
    """What is rendered of a scene that is edited at a frame: the bits of the film's frame, if nothing was edited.

    Args:
        blurred: see `Movement.rendered`.
    """
    if scene.animation is None:
        return scene
    return movement_of(scene).rendered(scene, frame, blurred=blurred)


def as_it_stands(scene: Scene) -> Scene:
    """A scene as it is rendered while none of its film's frames is shown: its own values, without the film's shutter."""
    animation = scene.animation
    if animation is None or animation.frame is None:
        return scene
    return scene.model_copy(update={"animation": animation.model_copy(update={"frame": None})})


# Keys for what changed


@dataclass(frozen=True, slots=True)
class Keyed:
    """What became of changed values.

    Attributes:
        animation: with their keys.
        keyed: the tracks that have a key now.
        refused: those that follow an expression or a table, and those of words for a camera's place that was changed:
            they take none.
    """

    animation: Animation
    keyed: tuple[str, ...]
    refused: tuple[str, ...]


def changes(before: Scene, after: Scene) -> dict[Path, tuple[Any, Any]]:
    """The values that can move and differ between two scenes: by path, (before, after)."""
    found: dict[Path, tuple[Any, Any]] = {}
    for name in Scene.model_fields:
        if name in _LEFT_OUT:
            continue
        for path, old, new in _leaves((name,), getattr(before, name), getattr(after, name)):
            if _moves(after, path) and _is_value(new):
                found[path] = (old if _is_value(old) else value_of(before, path), new)
    return found


def keyed(scene: Scene, place: FilmPlace, *, tracked_only: bool = False) -> Keyed:
    """Keys at a frame for what was changed there.

    A value that had no track gets a key at the first frame, too, with what it was: so it moves from there. A camera's
    place and target get their keys together, as flights need them.

    Args:
        scene: as it was edited at the frame; it has an animation.
        tracked_only: only for values that tracks move already.

    Raises:
        ClfractalError: a track of the scene is wrong.
    """
    assert scene.animation is not None
    animation = scene.animation
    names = {target.path: name for name, target in movement_of(scene).targets.items()}
    found = changes(place.posed, scene)
    keyed_names: list[str] = []
    refused: list[str] = []
    words = words_moved(scene, names.values())
    for path, (old, new) in _with_partners(found, names, scene).items():
        if (
            path[-1] in PLACE and path[:-1] in words
        ):  # what the words make of it at this frame is no place of its own
            refused.append(words[path[:-1]])
            continue
        for part, before, after in _parts(path, old, new, names):
            name = names.get(part)
            if name is None and tracked_only:
                continue
            if name is not None and animation.tracks[name].keys is None:
                refused.append(name)
                continue
            if name is None and place.frame > 0 and _is_value(before):
                animation = with_key(animation, ".".join(part), 0.0, before)
            name = name or ".".join(part)
            animation = with_key(animation, name, place.frame, after)
            keyed_names.append(name)
    return Keyed(animation, tuple(keyed_names), tuple(refused))


def why_no_keys(scene: Scene, name: str) -> str:
    """Why a track got none of `keyed`, in words."""
    assert scene.animation is not None
    if scene.animation.tracks[name].keys is not None:
        return "it moves this camera, whose place takes no keys beside it; set keys of this track in the timeline"
    return "it follows an expression or a table, and takes no keys"


def movable(scene: Scene) -> list[Path]:
    """The paths of all values of a scene that can move and have a number now, in the schema's order."""
    names = [name for name in Scene.model_fields if name not in _LEFT_OUT]
    paths = chain.from_iterable(_values((name,), getattr(scene, name)) for name in names)
    found = [path for path in paths if _moves(scene, path)]
    if scene.formula.chain is None:
        bound = scene.chain.links[0].bound
        own = [("formula", "parameters", parameter.name) for parameter in bound.formula.parameters]
        found += [path for path in own if path not in found and _moves(scene, path)]
    return found


def value_of(scene: Scene, path: Path) -> Any:
    """The value at a path that can move: a number, or a tuple of them; None if it has none at present."""
    found = _at(scene, path)
    if found is _NOTHING and path[-2:-1] == ("parameters",):  # one that has its default
        link = int(path[2]) if path[1] == "chain" else 0
        found = scene.chain.links[link].bound.values.get(path[-1])
    return found if _is_value(found) else None


def _parts(path: Path, old: Any, new: Any, names: Mapping[Path, str]) -> Iterator[tuple[Path, Any, Any]]:
    """A changed value, or the changed numbers of one whose numbers have tracks of their own."""
    if path in names or all(other[:-1] != path for other in names):
        yield path, old, new
        return
    for number, after in enumerate(new):
        before = old[number] if isinstance(old, tuple) and number < len(old) else None
        if before != after:
            yield (*path, str(number)), before, after


def _with_partners(
    found: dict[Path, tuple[Any, Any]], names: Mapping[Path, str], scene: Scene
) -> dict[Path, tuple[Any, Any]]:
    """With the target of a camera whose place has changed, or the other way round: where it moves, or both begin to."""
    all_of_them = dict(found)
    partners = {"position": "target", "target": "position"}
    for path in filter(lambda path: path[-1] in partners, found):
        other = (*path[:-1], partners[path[-1]])
        value = _at(scene, other)
        if other not in found and _is_value(value) and (other in names or path not in names):
            all_of_them[other] = (value, value)
    return all_of_them


# Within scenes


def _rested(scene: Scene, rest: Scene) -> Scene:
    """The scene with the values of another one in the places of its tracks, where that has them."""
    values: dict[Path, Any] = {}
    parameters: dict[Path, dict[str, Any]] = {}
    for path in words_moved(scene, scene.animation.tracks if scene.animation is not None else ()):
        camera = _at(rest, path)
        if isinstance(camera, CameraBase):
            values |= {(*path, key): value for key, value in camera.said.items()}
    for target in movement_of(scene).targets.values():
        *owner, key = target.path
        found = _at(rest, target.path)
        if owner[-1] == "parameters":
            group = parameters.setdefault(tuple(owner), dict(_at(scene, tuple(owner))))
            group.pop(key, None)
            if found is not _NOTHING:
                group[key] = found
        elif found is not _NOTHING and not any(path == target.path[: len(path)] for path in values):
            values[target.path] = found
    return with_values(scene, {**values, **parameters})


def _leaves(path: Path, old: Any, new: Any) -> Iterator[tuple[Path, Any, Any]]:
    """The values that differ, numbers in a list as one; what has another shape is left out."""
    if old is new or old == new or (_is_value(old) and _is_value(new) and _same(old, new)):
        return
    if isinstance(old, Section) and isinstance(new, Section):
        if type(old) is type(new):
            for name in type(new).model_fields:
                yield from _leaves((*path, name), getattr(old, name), getattr(new, name))
    elif isinstance(new, Mapping):
        for name, value in new.items():
            yield from _leaves((*path, name), old.get(name) if isinstance(old, Mapping) else None, value)
    elif isinstance(new, tuple) and not _is_value(new):
        if isinstance(old, tuple) and len(old) == len(new):
            for number, (one, other) in enumerate(zip(old, new, strict=True)):
                yield from _leaves((*path, str(number)), one, other)
    else:
        yield path, old, new


def _values(path: Path, value: Any) -> Iterator[Path]:
    if _is_value(value):
        yield path
        return
    for name, each in _entries(value).items():
        yield from _values((*path, name), each)


def _entries(value: Any) -> Mapping[str, Any]:
    """What a section, a mapping or a list has, by names and numbers."""
    if isinstance(value, Section):
        return {name: value_under(value, name) for name in type(value).model_fields}
    if isinstance(value, tuple):
        return {str(number): each for number, each in enumerate(value)}
    return value if isinstance(value, Mapping) else {}


def _is_value(value: Any) -> bool:
    if isinstance(value, tuple):
        return 2 <= len(value) <= 16 and (all(type(each) is float for each in value) or _is_exact(value))
    return type(value) in (int, float)


def _is_exact(value: Any) -> bool:
    """Whether it may be a place that is told by text."""
    return isinstance(value, tuple) and len(value) == 3 and all(type(each) is str for each in value)


def _same(one: Any, other: Any) -> bool:
    """Whether two values are equal but for rounding, as on the way through a track."""
    if _is_exact(one) or _is_exact(other):
        return bool(one == other)
    first, second = ((each if isinstance(each, tuple) else (each,)) for each in (one, other))
    return len(first) == len(second) and same(first, second)


def _moves(scene: Scene, path: Path) -> bool:
    try:
        target_of(scene, ".".join(path))
    except SceneError:
        return False
    return True


def _at(value: Any, path: Path) -> Any:
    for part in path:
        if isinstance(value, Section):
            value = value_under(value, part) if part in type(value).model_fields else _NOTHING
        else:
            value = _entries(value).get(part, _NOTHING)
    return value
