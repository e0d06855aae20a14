"""What the tracks of a film move must stay while the scene is edited, and stay the same."""

from __future__ import annotations

from typing import Any

from clfractal.errors import SceneError, Where
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from clfractal.scene.tracks import target_of
from clfractal.schema.base import Section


class TrackedError(SceneError):
    """An edit would take away what a track of the film moves."""


def check_tracked(before: Scene, after: Scene) -> None:
    """Makes sure that an edit leaves everything that tracks move.

    Raises:
        TrackedError: a value that a track moves is gone (stereo was switched off, for example), or its place in a list is
            another entry's (a light before it was removed).
    """
    if before.animation is None or after.animation is None:
        return
    for name, target in movement_of(before).targets.items():
        if name not in after.animation.tracks:
            continue
        try:
            target_of(after, name)
        except SceneError as error:
            raise _refused(name, "") from error
        if _is_another(before, after, target.path):
            raise _refused(name, ", which would be another one's")


def _refused(name: str, why: str) -> TrackedError:
    return TrackedError(
        f"a track of the film moves {name}{why}: remove that track in the timeline first",
        Where(path=f"animation.tracks.{name}"),
    )


def _is_another(before: Any, after: Any, path: tuple[str, ...]) -> bool:
    """Whether a path leads through another entry of a list than before: entries were taken out, put in or reordered."""
    for part in path:
        if isinstance(before, tuple):
            if _is_moved(before, after, int(part)):
                return True
            before, after = before[int(part)], after[int(part)]
        elif isinstance(before, Section) and isinstance(after, Section):
            before, after = getattr(before, part, None), getattr(after, part, None)
        else:
            return False
    return False


def _is_moved(before: tuple[Any, ...], after: tuple[Any, ...], index: int) -> bool:
    entry = before[index]
    if not isinstance(entry, Section) or after[index] == entry:
        return False
    # An entry that was edited where it is has no equal: only one that went elsewhere, or out of a list of the others, has.
    return entry in after or (len(after) < len(before) and after[index] in before)
