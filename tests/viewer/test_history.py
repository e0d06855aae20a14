"""Undo and redo: a stack for cameras, one for the rest; a drag is one step."""

from __future__ import annotations

from typing import Any

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


def test_each_kind_has_its_own_stack() -> None:
    work = Edited()
    work.edit("camera.fov", 30)
    work.edit("material.ambient", 0.5)
    work.edit("camera.fov", 40)
    assert work.history.depth("camera") == (2, 0)
    assert work.history.depth("scene") == (1, 0)
    work.put(work.history.undo("camera"))
    assert (fov(work.scene), work.scene.material.ambient) == (30, 0.5)
    work.put(work.history.undo("scene"))
    assert (fov(work.scene), work.scene.material.ambient) == (30, BASE.material.ambient)
    work.put(work.history.redo("camera"))
    assert (fov(work.scene), work.scene.material.ambient) == (40, BASE.material.ambient)
    assert work.history.undo("scene") is None


def test_a_drag_is_one_step() -> None:
    work = Edited()
    for value in (31, 32, 33):
        work.edit("camera.fov", value, "drag")
    work.history.seal()
    for value in (34, 35):
        work.edit("camera.fov", value, "drag")
    work.put(work.history.undo("camera"))
    assert fov(work.scene) == 33
    work.put(work.history.undo("camera"))
    assert work.scene == BASE
    work.put(work.history.redo("camera"))
    work.put(work.history.redo("camera"))
    assert fov(work.scene) == 35


def test_a_drag_goes_on_after_an_edit_of_the_other_stack() -> None:
    work = Edited()
    work.edit("camera.fov", 31, "orbit")
    work.edit("material.ambient", 0.3)
    work.edit("camera.fov", 32, "orbit")
    assert work.history.depth("camera") == (1, 0)
    work.put(work.history.undo("camera"))
    assert (fov(work.scene), work.scene.material.ambient) == (fov(BASE), 0.3)


def test_different_gestures_are_different_steps() -> None:
    work = Edited()
    work.edit("camera.fov", 31, "orbit")
    work.edit("camera.fov", 32, "pan")
    work.edit("camera.fov", 33)
    work.edit("camera.fov", 34)
    assert work.history.depth("camera") == (4, 0)


def test_a_drag_does_not_join_a_step_that_was_undone_and_repeated() -> None:
    work = Edited()
    work.edit("camera.fov", 31, "drag")
    work.put(work.history.undo("camera"))
    work.put(work.history.redo("camera"))
    work.edit("camera.fov", 32, "drag")
    assert work.history.depth("camera") == (2, 0)


def test_an_edit_forgets_what_was_undone_of_its_kind() -> None:
    work = Edited()
    work.edit("camera.fov", 31)
    work.edit("material.ambient", 0.3)
    work.put(work.history.undo("camera"))
    work.put(work.history.undo("scene"))
    work.edit("camera.fov", 33)
    assert work.history.redo("camera") is None
    assert work.put(work.history.redo("scene"))
    assert work.scene.material.ambient == 0.3


def test_an_edit_that_changes_nothing_is_no_step() -> None:
    work = Edited()
    work.edit("camera.fov", fov(BASE))
    assert work.history.depth("camera") == (0, 0)


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
