"""Cameras apart from the rest of a scene, so that the window's view stays when a file is loaded."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from clfractal.scene.model import Scene
from clfractal.scene.parts import AnyCamera

Cameras = Sequence[AnyCamera | None]


def cameras_of(scene: Scene) -> list[AnyCamera | None]:
    """The scene's camera, then each view's own; None for a view without one."""
    views = scene.layout.views if scene.layout is not None else ()
    return [scene.camera, *(view.camera for view in views)]


def with_cameras(scene: Scene, cameras: Cameras) -> Scene:
    """The scene with other cameras; a None leaves what is there, and so does a view without a camera of its own."""
    first, *others = cameras
    update: dict[str, object] = {} if first is None or first == scene.camera else {"camera": first}
    layout = scene.layout
    if layout is not None:
        views = tuple(
            view.model_copy(update={"camera": camera})
            if view is not None and camera is not None and view.camera is not None and camera != view.camera
            else view
            for view, camera in zip_longest(layout.views, others[: len(layout.views)])
        )
        if views != layout.views:
            update["layout"] = layout.model_copy(update={"views": views})
    return scene.model_copy(update=update) if update else scene


def differ_in_more(one: Scene, other: Scene) -> bool:
    """Whether two scenes differ in anything but their cameras."""
    return one is not other and with_cameras(other, cameras_of(one)) != one


def seen_as_before(loaded: Scene, opened: Scene, present: Scene) -> Scene:
    """A scene that was loaded again, with what the window has changed of its cameras since it was opened.

    What was not moved here is as the file has it now: so an angle of view that was changed in the file counts, although the
    camera has been turned meanwhile.
    """
    found: list[AnyCamera | None] = []
    for now, before, mine in zip_longest(cameras_of(loaded), cameras_of(opened), cameras_of(present)):
        if now is None or before is None or mine is None or mine == before:
            found.append(None)
        elif type(now) is type(before) is type(mine):
            moved = {
                name: getattr(mine, name)
                for name in type(mine).model_fields
                if getattr(mine, name) != getattr(before, name)
            }
            found.append(now.model_copy(update=moved))
        else:
            found.append(mine)
    return with_cameras(loaded, found[: len(cameras_of(loaded))])
