"""The panel of places, places as text, bookmarks of places, and keys of a film that zooms into one."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import yaml

from clfractal.device.select import Device
from clfractal.errors import SceneError
from clfractal.scene.model import Scene
from clfractal.viewer.film_place import keyed
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.place_text import place_text, with_place
from clfractal.viewer.studio import Studio
from tests.viewer.sessions import scene_of

CENTER = ["0.12345678901234567890123456789012345", "-1", "1e-40"]


@pytest.fixture
def studio(device: Device) -> Iterator[Studio]:
    made = Studio(scene_of(), device, Pacing(), lambda: None)
    made.resize(48, 32)
    yield made
    made.close()


def test_a_place_goes_as_text_from_scene_to_scene() -> None:
    scene = scene_of().model_copy(update={"camera": {"position": [0.1, -3, 0.2], "fov": 30}})
    there = with_place(scene, place_text(scene_with_place()))
    assert there.deep == scene_with_place().deep
    assert there.camera == scene_with_place().camera
    assert there.formula == scene.formula
    # Of a scene's own text nothing else counts; without a place it is the space itself.
    plain = yaml.safe_load(place_text(scene))
    assert plain["deep"] is None
    back = with_place(there, yaml.safe_dump({**plain, "formula": {"name": "nothing"}}))
    assert (back.deep, back.camera) == (None, scene.camera)


def scene_with_place() -> Scene:
    return scene_of().model_copy(update={"deep": {"center": CENTER, "magnification": 1e30}})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("some words", "holds no place"),
        ("", "clipboard:1:1: is empty"),
        ("deep: {magnification: 0}", "deep.magnification: must be at least 1"),
        ("camera: [", "clipboard"),
        ("camera: {position: [0, 0, 0]}", "camera"),
    ],
)
def test_other_texts_are_refused(text: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        with_place(scene_of(), text)


def test_another_place_is_a_step_of_the_camera(studio: Studio) -> None:
    place = scene_with_place()
    studio.set_view(place.camera, place.deep)
    assert studio.scene.deep == place.deep
    assert studio.history.depth("camera") == (1, 0)
    assert studio.edit({"material.ambient": 0.3})
    assert studio.undo("camera")
    assert (studio.scene.deep, studio.scene.material.ambient) == (None, 0.3)
    # A step of the camera alone brings back its place, whatever was changed since.
    studio.set_camera(place.camera.model_copy(update={"position": (0.0, -2.0, 0.0)}))
    studio.set_view(place.camera, place.deep)
    assert studio.undo("camera")
    assert studio.undo("camera")
    assert (studio.scene.deep, studio.scene.camera) == (None, studio.saved.camera)


def test_keys_at_a_frame_zoom_into_the_place_there(studio: Studio) -> None:
    assert studio.edit({"deep": {"magnification": 1}, "animation": {"frames": 20}})
    assert studio.go_to_frame(19)
    assert studio.edit({"deep": {"center": CENTER, "magnification": 1e30}})
    assert studio.place is not None
    found = keyed(studio.scene, studio.place)
    assert set(found.keyed) == {"deep.center", "deep.magnification"}
    assert studio.set_keys() is not None
    assert studio.go_to_frame(0)
    assert studio.scene.deep is not None
    assert (studio.scene.deep.center, studio.scene.deep.magnification) == (("0", "0", "0"), 1)
    assert studio.go_to_frame(19)
    assert list(studio.scene.deep.center) == CENTER
    assert studio.go_to_frame(10)
    assert 1e15 < studio.scene.deep.magnification < 1e17
