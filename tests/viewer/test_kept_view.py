"""Cameras apart from the rest of a scene: what counts as an edit, and what a window keeps when its file is loaded again."""

from __future__ import annotations

from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera
from clfractal.viewer.editing import edited
from clfractal.viewer.kept_view import cameras_of, differ_in_more, seen_as_before
from tests.viewer.sessions import BULB, scene_of

TWO = "layout={columns: 2, views: [{camera: {position: [0, -5, 0]}}, {}]}"


def moved(scene: Scene, **values: object) -> Scene:
    return edited(scene, {f"camera.{name}": value for name, value in values.items()})


def test_a_moved_camera_is_no_edit() -> None:
    scene = scene_of(BULB, TWO)
    assert not differ_in_more(scene, scene)
    assert not differ_in_more(moved(scene, position=[1, -3, 0]), scene)
    assert not differ_in_more(edited(scene, {"layout.views.0.camera.position": [1, -5, 0]}), scene)
    assert not differ_in_more(edited(scene, {"camera": {"projection": "orthographic", "height": 3}}), scene)
    assert differ_in_more(edited(scene, {"material.diffuse": 0.3}), scene)
    assert differ_in_more(edited(scene, {"layout.gap": 4}), scene)
    assert differ_in_more(edited(scene, {"layout": None}), scene)
    assert differ_in_more(edited(moved(scene, position=[1, -3, 0]), {"renderer.samples": 9}), scene)


def test_what_was_moved_here_stays_and_all_else_is_the_files() -> None:
    opened = scene_of(BULB, TWO)
    present = moved(opened, position=[1, -3, 0])
    loaded = edited(moved(opened, fov=70.0, position=[9, 9, 9]), {"material.diffuse": 0.3})
    found = seen_as_before(loaded, opened, present)
    assert isinstance(found.camera, PerspectiveCamera)
    assert (found.camera.position, found.camera.fov) == ((1, -3, 0), 70.0)
    assert found.material.diffuse == 0.3
    # Nothing was moved: the file's cameras.
    assert seen_as_before(loaded, opened, opened) == loaded


def test_views_of_a_layout_keep_their_cameras_too() -> None:
    opened = scene_of(BULB, TWO)
    present = edited(opened, {"layout.views.0.camera.position": [1, -5, 0]})
    found = seen_as_before(edited(opened, {"layout.views.0.camera.fov": 30.0}), opened, present)
    own = cameras_of(found)[1]
    assert isinstance(own, PerspectiveCamera)
    assert (own.position, own.fov) == ((1, -5, 0), 30.0)
    # Views that are no longer there, or have no camera any more, are the file's.
    for loaded in (edited(opened, {"layout": None}), edited(opened, {"layout.views.0": {}})):
        assert seen_as_before(loaded, opened, present) == loaded


def test_another_kind_of_camera_here_stays() -> None:
    opened = scene_of(BULB)
    present = edited(opened, {"camera": {"projection": "orthographic", "position": [0, -3, 0], "height": 3}})
    loaded = edited(opened, {"camera.fov": 30.0, "material.diffuse": 0.3})
    found = seen_as_before(loaded, opened, present)
    assert found.camera == present.camera
    assert found.material.diffuse == 0.3
