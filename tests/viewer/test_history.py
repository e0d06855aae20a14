"""Undo and redo: a stack for cameras, one for the rest; a drag is one step."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.scene.model import Scene
from clfractal.viewer.editing import edited
from clfractal.viewer.history import MOST_STEPS, History, kind_of
from tests.viewer.sessions import scene_of

BASE = scene_of()


class Edited:
    """A scene with its history."""

    def __init__(self) -> None:
        self.scene, self.history = BASE, History()

    def edit(self, path: str, value: Any, gesture: str | None = None) -> None:
        changed = edited(self.scene, {path: value})
        self.history.add(self.scene, changed, gesture)
        self.scene = changed

    def put(self, sections: dict[str, Any] | None) -> bool:
        if sections is not None:
            self.scene = self.scene.model_copy(update=sections)
        return sections is not None


def fov(scene: Scene) -> float:
    return scene.camera.fov  # type: ignore[union-attr]


AMBIENT = BASE.material.ambient
# What is done (a field of view, of a gesture; an ambient light; undo and redo); the steps of cameras; and what is there.
STORIES: dict[str, tuple[list[Any], tuple[int, int], tuple[float, float]]] = {
    "each kind has its own": ([30, 0.5, 40, "undo camera"], (1, 1), (30, 0.5)),
    "and goes on by itself": (
        [30, 0.5, 40, "undo camera", "undo scene", "redo camera"],
        (2, 0),
        (40, AMBIENT),
    ),
    "a drag is one step": (
        [(31, "a"), (32, "a"), "seal", (33, "a"), (34, "a"), "undo camera"],
        (1, 1),
        (32, AMBIENT),
    ),
    "whatever is between": ([(31, "a"), 0.3, (32, "a"), "undo camera"], (0, 1), (fov(BASE), 0.3)),
    "gestures are steps": ([(31, "a"), (32, "b"), 33, 34], (4, 0), (34, AMBIENT)),
    "undone is done": ([(31, "a"), "undo camera", "redo camera", (32, "a")], (2, 0), (32, AMBIENT)),
    "an edit forgets its kind": ([31, 0.3, "undo camera", "undo scene", 33, "redo scene"], (1, 0), (33, 0.3)),
    "nothing is no step": ([fov(BASE)], (0, 0), (fov(BASE), AMBIENT)),
}


@pytest.mark.parametrize("story", STORIES)
def test_steps(story: str) -> None:
    work = Edited()
    done, depth, found = STORIES[story]
    for what in done:
        if isinstance(what, str) and what != "seal":
            way, kind = what.split()
            assert work.put(getattr(work.history, way)(kind))
        elif what == "seal":
            work.history.seal()
        elif isinstance(what, float) and what < 1:
            work.edit("material.ambient", what)
        else:
            work.edit("camera.fov", *(what if isinstance(what, tuple) else (what,)))
    assert work.history.depth("camera") == depth
    assert (fov(work.scene), work.scene.material.ambient) == found


def test_memory_is_limited() -> None:
    history = History()
    other = edited(BASE, {"camera.fov": 33})
    for number in range(MOST_STEPS + 20):
        history.add(*((BASE, other) if number % 2 == 0 else (other, BASE)))
    assert history.depth("camera") == (MOST_STEPS, 0)


def test_a_camera_with_something_else_is_a_step_of_the_scene() -> None:
    assert kind_of({"camera": 1}) == "camera"
    assert kind_of({"camera": 1, "formula": 2}) == "scene"


ACTIONS = st.lists(
    st.one_of(
        st.tuples(st.just("camera.fov"), st.integers(20, 60)),
        st.tuples(st.just("material.ambient"), st.floats(0, 1)),
        st.tuples(st.just("output.exposure"), st.floats(-3, 3)),
        st.just(("undo", "camera")),
        st.just(("undo", "scene")),
        st.just(("redo", "camera")),
        st.just(("redo", "scene")),
    ),
    max_size=25,
)


@given(ACTIONS)
def test_undoing_everything_gives_the_first_scene(actions: list[tuple[str, Any]]) -> None:
    work = Edited()
    for what, value in actions:
        if what in ("undo", "redo"):
            work.put(getattr(work.history, what)(value))
        else:
            work.edit(what, value)
    last = work.scene
    while work.put(work.history.undo("camera")) or work.put(work.history.undo("scene")):
        pass
    assert work.scene == BASE
    counts = [work.history.depth(kind)[1] for kind in ("camera", "scene")]
    for kind, count in zip(("camera", "scene"), counts, strict=True):
        for _ in range(count):
            work.put(work.history.redo(kind))  # type: ignore[arg-type]
    if not any(what == "undo" for what, _ in actions):
        assert work.scene == last
