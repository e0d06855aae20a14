"""Cameras whose orbit, roll or shift a film moves: as plain data they are what the scene gave."""

from collections.abc import Iterable, Mapping
from typing import Any

from clfractal.files.marks import split_path
from clfractal.scene.camera_base import WORDS, CameraBase
from clfractal.schema.base import Section


def with_words(plain: dict[str, Any], sections: Section, tracks: Iterable[str]) -> None:
    """Puts what cameras were given into plain data, where tracks move their words.

    A camera that was read has its roll in `up`. A track of the roll needs the `up` from before it: else the next frame
    would roll what is rolled already.

    Args:
        plain: of a scene, changed in place.
        sections: the scene.
        tracks: the names of its tracks.
    """
    for path in words_moved(sections, tracks):
        at: Any = plain
        for key in path:
            at = at[int(key)] if isinstance(at, list) else at[key]
        camera = _under(sections, path)
        at.update({key: _plain(value) for key, value in camera.said.items() if value is not None})


def words_moved(sections: Section, tracks: Iterable[str]) -> dict[tuple[str, ...], str]:
    """The cameras whose words are moved: their paths, each with one of the tracks that do it."""
    found: dict[tuple[str, ...], str] = {}
    for name in tracks:
        path = split_path(name)
        for depth, part in enumerate(path):
            if part in WORDS and isinstance(_under(sections, path[:depth]), CameraBase):
                found.setdefault(path[:depth], name)
    return found


def _under(value: Any, path: tuple[str, ...]) -> Any:
    for part in path:
        if isinstance(value, Section):
            value = getattr(value, part, None)
        elif isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(value, tuple) and part.isdecimal() and int(part) < len(value):
            value = value[int(part)]
        else:
            return None
    return value


def _plain(value: Any) -> Any:
    if isinstance(value, Section):
        return value.model_dump(mode="json")
    return list(value) if isinstance(value, tuple) else value
