"""Which values of a scene can move, and how: the schema's fields by dotted keys."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from clfractal.elements.lights.set import SetLight
from clfractal.errors import SceneError, unknown_name
from clfractal.files.marks import split_path
from clfractal.scene.camera_base import WORDS, CameraBase, Orbit
from clfractal.scene.formula import FormulaSpec
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject
from clfractal.scene.volume import Box
from clfractal.schema.base import Section
from clfractal.schema.fields import EXACT, SCALE, WHOLE, Kind, Moves, known

# Mappings of sections, and what they hold.
_NAMED = {"objects": "object", "materials": "material"}
# Sections that say what a film is, and not what is in its pictures.
_FIXED: Mapping[str, str] = {
    "version": "is the version of the file",
    "image": "is the same for all frames of a film",
    "output": "says how files are written; only output.exposure can move",
    "bookmarks": "does not change the picture",
    "animation": "says how the others move",
}


@dataclass(frozen=True, slots=True)
class Target:
    """A value of a scene that moves.

    Attributes:
        path: the keys that lead to it.
        kind: how it goes from key to key.
        size: of how many numbers it consists; None: of one or of three.
    """

    path: tuple[str, ...]
    kind: Kind
    size: int | None


def target_of(scene: Scene, name: str) -> Target:
    """The value that a track of this name moves.

    Raises:
        SceneError: there is none, or it cannot move; without a place.
    """
    path = split_path(name)
    if not path or any(part.strip("[]") == "" for part in name.split(".")):
        raise SceneError("must name a value by its dotted keys, such as camera.position")
    if path[0] in _FIXED and path != ("output", "exposure"):
        raise SceneError(f"cannot move: it {_FIXED[path[0]]}")
    where, spec = _formula_of(scene, path)
    if spec is not None and path[len(where) :][:1] not in ((), ("chain",)) and spec.chain is not None:
        shown = ".".join(where)
        known = ", ".join(f"{shown}.chain.{number}" for number in range(len(spec.chain)))
        raise SceneError(f"cannot move: {shown} is a chain; name a value of {known}")
    _check_stands(scene, path)
    owner: Any = None
    value: Any = scene
    for depth in range(len(path)):
        owner, value = value, _below(value, path, depth)
    kind = _kind(scene, owner, path, value)
    return Target(path, kind, _size(owner, path[-1], kind, value))


def _formula_of(scene: Scene, path: tuple[str, ...]) -> tuple[tuple[str, ...], FormulaSpec | None]:
    """The formula that a value belongs to, and where it stands; None for values of others."""
    if path[0] == "formula":
        return path[:1], scene.formula
    if path[0] == "objects" and path[2:3] == ("formula",):
        each = scene.objects.get(path[1])
        if isinstance(each, FormulaObject):
            return path[:3], each.formula
    return (), None


def _check_stands(scene: Scene, path: Sequence[str]) -> None:
    """Lights on the set would jump from place to place if the set, or what chooses their places, moved."""
    standing = {str(number) for number, light in enumerate(scene.lights) if isinstance(light, SetLight)}
    chooses = path[0] == "lights" and path[1:2] != () and path[1] in standing and path[2:3] != ()
    if standing and (
        path[0] == "formula"
        or list(path[:2]) == ["renderer", "bounds"]
        or (chooses and path[2] in ("trap", "threshold", "spacing", "within"))
    ):
        raise SceneError(
            f"cannot move: the lights on the set, lights.{min(standing)}, would stand at other places in each frame"
        )


def _below(value: Any, path: Sequence[str], depth: int) -> Any:
    """What is under a key of a value."""
    part, shown = path[depth], ".".join(path[:depth])
    if isinstance(value, Section):
        if part not in _keys_of(value):
            what = f"key of {shown}" if shown else "key"
            raise SceneError(unknown_name(what, part, _keys_of(value)))
        return value_under(value, part)
    if isinstance(value, Mapping):
        if shown in _NAMED and part not in value:
            raise SceneError(unknown_name(_NAMED[shown], part, tuple(value)))
        return value.get(part)  # whether there is such a parameter the formula tells
    if isinstance(value, tuple):
        if not (part.isdecimal() and part == str(int(part)) and int(part) < len(value)):
            entries = f"entries 0 to {len(value) - 1}" if value else "no entries"
            raise SceneError(f"cannot move: {shown} has {entries}")
        return value[int(part)]
    if value is None:
        raise SceneError(f"cannot move: {shown} is null; give it a value, or leave this track out")
    raise SceneError(f"cannot move: {shown} is a single value, so it has no key {part!r}")


def value_under(section: Section, key: str) -> Any:
    """What a section has under a key; of a camera, under a word for its place, what the word says."""
    return section.word(key) if isinstance(section, CameraBase) and key in WORDS else getattr(section, key)


def _keys_of(section: Section) -> list[str]:
    """The keys of a section, in the schema's order."""
    return list(type(section).model_fields)


def _kind(scene: Scene, owner: Any, path: tuple[str, ...], value: Any) -> Kind:
    """How the value moves; SceneError if it does not."""
    key, moves = path[-1], None
    if path[-2:-1] == ("parameters",):
        return "whole" if _is_whole(scene, path) else "number"
    if isinstance(owner, Section):
        moves = known(type(owner), key, Moves)
        if moves is not None and moves in (EXACT, SCALE, WHOLE):
            return moves.kind
        if value is None:
            annotation = str(type(owner).model_fields[key].annotation)
            if "float" not in annotation or "Literal" in annotation:
                raise SceneError("cannot move: it is null, and would be no number")
            return moves.kind if moves is not None else "place" if "tuple" in annotation else "number"
    if isinstance(value, (Section, Mapping)):
        keys = _keys_of(value) if isinstance(value, Section) else list(value)
        listing = f"keys, {', '.join(keys)}" if keys else f"values, such as {'.'.join(path)}.NAME"
        raise SceneError(f"cannot move as a whole: name one of its {listing}")
    if isinstance(value, str) and not (isinstance(owner, Section) and key == "exposure"):
        raise SceneError(f"cannot move: it is a word, {value[:40]!r}")
    if isinstance(value, bool):
        raise SceneError("cannot move: it is true or false")
    if isinstance(value, int):
        raise SceneError("cannot move: it is a whole number, and decides how the picture is made")
    if isinstance(value, tuple):
        if not value or not all(isinstance(entry, float) for entry in value):
            raise SceneError("cannot move as a whole: name one of its entries, from 0 on")
        return moves.kind if moves is not None else "color"
    return "number"


def _is_whole(scene: Scene, path: tuple[str, ...]) -> bool:
    """Whether a formula's parameter is a whole number."""
    where, _ = _formula_of(scene, path)
    chain = scene.chain if path[0] == "formula" else scene.joined_chains[path[1]]
    below = path[len(where) :]
    link = int(below[1]) if below[0] == "chain" else 0
    known = {each.name: each for each in chain.links[link].bound.formula.parameters}
    if path[-1] not in known:
        raise SceneError(unknown_name("parameter", path[-1], list(known)))
    return known[path[-1]].type == "int"


def _size(owner: Any, key: str, kind: Kind, value: Any) -> int | None:
    if isinstance(owner, Box) and key == "size":
        return None
    if isinstance(value, tuple):
        return len(value)
    if value is None and kind == "place":  # how many, the schema tells
        return None
    return 3 if value is None and kind == "direction" else 1


def with_values(scene: Scene, values: Mapping[tuple[str, ...], Any], **others: Any) -> Scene:
    """The scene with other values at some paths, all at once.

    Args:
        others: sections that are replaced, by key.

    Raises:
        SceneError: a value is wrong; the path says which.
    """
    tree: dict[str, Any] = {}
    for path, value in values.items():
        below = tree
        for part in path[:-1]:
            below = below.setdefault(part, {})
        below[path[-1]] = _Leaf(value)
    update = {key: _changed(getattr(scene, key), below, key) for key, below in tree.items()}
    return scene.model_copy(update={**update, **others})


@dataclass(frozen=True, slots=True)
class _Leaf:
    value: Any


def _changed(value: Any, tree: Any, shown: str) -> Any:
    """A value with what the tree says in the place of its parts."""
    if isinstance(tree, _Leaf):
        return tree.value
    if isinstance(value, tuple):
        return tuple(
            _changed(entry, tree[str(index)], f"{shown}.{index}") if str(index) in tree else entry
            for index, entry in enumerate(value)
        )
    if isinstance(value, Mapping):
        return {**value, **{key: _changed(value.get(key), tree[key], f"{shown}.{key}") for key in tree}}
    own = {"orbit": Orbit()} if isinstance(value, CameraBase) else {}  # what is left out there stays as it is
    update = {
        key: _changed(own.get(key, value_under(value, key)), below, f"{shown}.{key}")
        for key, below in tree.items()
    }
    try:
        return value.moved(update) if isinstance(value, CameraBase) else value.model_copy(update=update)
    except SceneError as error:
        path = ".".join(part for part in (shown, error.where.path) if part)
        raise SceneError(error.message, replace(error.where, path=path)) from error


def is_camera_place(scene: Scene, path: Sequence[str]) -> bool:
    """Whether a path leads to the place of a camera, which has a target."""
    value: Any = scene
    for depth in range(len(path) - 1):
        value = _below(value, path, depth)
    return isinstance(value, CameraBase) and path[-1] == "position"
