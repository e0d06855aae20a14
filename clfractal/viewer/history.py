"""Undo and redo, with a stack for the camera and one for everything else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from clfractal.scene.model import Scene

Kind = Literal["camera", "scene"]
MOST_STEPS = 500
# A camera stands in a place: what puts one back puts the other back, too.
_VIEW = ("camera", "deep")


def kind_of(sections: Mapping[str, Any]) -> Kind:
    """The stack that an edit of these sections belongs to."""
    return "camera" if set(sections) <= set(_VIEW) else "scene"


@dataclass(slots=True)
class Step:
    """Sections before and after an edit.

    Attributes:
        frame: of the film at which it was made; None: of the scene as it stands.
    """

    before: dict[str, Any]
    after: dict[str, Any]
    gesture: str | None
    frame: float | None = None


@dataclass(slots=True)
class _Stack:
    done: list[Step] = field(default_factory=list)
    undone: list[Step] = field(default_factory=list)


class History:
    """The steps of both stacks. A step keeps only the sections that it changed, so the stacks do not disturb each other."""

    def __init__(self) -> None:
        self._stacks: dict[Kind, _Stack] = {"camera": _Stack(), "scene": _Stack()}

    def add(
        self, before: Scene, after: Scene, gesture: str | None = None, frame: float | None = None
    ) -> None:
        """Remembers an edit, made at a `frame` of the film if not of the scene as it stands.

        Edits of one gesture in a row (a drag) at one frame are one step; a new edit forgets what was undone.
        """
        changed = [name for name in Scene.model_fields if getattr(before, name) != getattr(after, name)]
        if not changed:
            return
        if any(name in changed for name in _VIEW):
            changed = [name for name in Scene.model_fields if name in changed or name in _VIEW]
        old = {name: getattr(before, name) for name in changed}
        new = {name: getattr(after, name) for name in changed}
        stack = self._stacks[kind_of(new)]
        stack.undone.clear()
        last = stack.done[-1] if stack.done else None
        if gesture is not None and last is not None and (last.gesture, last.frame) == (gesture, frame):
            last.before = {**old, **last.before}
            last.after = {**last.after, **new}
            return
        stack.done.append(Step(old, new, gesture, frame))
        del stack.done[:-MOST_STEPS]

    def retell(self, before: Scene, after: Scene, frame: float | None = None) -> None:
        """A view was told by other numbers: that belongs to the step that led to it, if the last one did."""
        done = self._stacks["camera"].done
        last = done[-1] if done else None
        if last is None or last.frame != frame or last.after.get("camera") != before.camera:
            self.add(before, after, None, frame)
            return
        last.after = {**last.after, **{name: getattr(after, name) for name in _VIEW}}

    def seal(self) -> None:
        """Ends a gesture: the next edit is a step of its own, whatever it is called."""
        for stack in self._stacks.values():
            if stack.done:
                stack.done[-1].gesture = None

    def undo(self, kind: Kind) -> dict[str, Any] | None:
        """The sections to put back, or None if there is no step."""
        stack, step = self._stacks[kind], self.next_step(kind)
        if step is None:
            return None
        step.gesture = None
        stack.undone.append(stack.done.pop())
        return step.before

    def redo(self, kind: Kind) -> dict[str, Any] | None:
        """The sections of the step that was undone last, or None."""
        stack, step = self._stacks[kind], self.next_step(kind, redo=True)
        if step is None:
            return None
        stack.done.append(stack.undone.pop())
        return step.after

    def next_step(self, kind: Kind, *, redo: bool = False) -> Step | None:
        """The step that `undo` would take back next, or that `redo` would repeat."""
        stack = self._stacks[kind]
        steps = stack.undone if redo else stack.done
        return steps[-1] if steps else None

    def steps(self, kind: Kind) -> tuple[list[Step], int]:
        """The steps of a stack, the oldest first, those that were undone last; and how many are done."""
        stack = self._stacks[kind]
        return [*stack.done, *reversed(stack.undone)], len(stack.done)

    def depth(self, kind: Kind) -> tuple[int, int]:
        """How many steps can be undone and redone."""
        stack = self._stacks[kind]
        return len(stack.done), len(stack.undone)
