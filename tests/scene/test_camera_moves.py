"""Films that move the words for a camera's place: orbit, roll and shift."""

from __future__ import annotations

import math
import pickle
from typing import Any

import pytest

import clfractal
from clfractal.errors import SceneError
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from tests.scenes import scene_of


def moving(camera: dict[str, Any], tracks: dict[str, str], **others: Any) -> Scene:
    films = {"frames": 5, "tracks": {name: {"expression": text} for name, text in tracks.items()}}
    return scene_of(camera=camera, size=None, **{"animation": films, **others})


def still(camera: dict[str, Any]) -> Any:
    return scene_of(camera=camera, size=None).camera


@pytest.mark.parametrize(
    ("camera", "tracks"),
    [
        ({"position": [0, -3, 1], "roll": 10}, {"roll": "90*frame"}),
        ({"position": [0, -3, 1], "roll": 10}, {"shift.right": "frame", "shift.up": "-frame"}),
        ({"position": [0, -3, 1], "shift": {"right": 1, "forward": 0.5}}, {"shift.right": "2*frame"}),
        ({"position": [0.5, -3, 1]}, {"orbit.azimuth": "90*frame"}),
        ({"orbit": {"azimuth": 10, "elevation": 30, "distance": 4}}, {"orbit.elevation": "22.5*frame"}),
        ({"orbit": {"elevation": 90, "distance": 4}, "roll": 5}, {"orbit.azimuth": "20*frame"}),
        ({"frame": "all", "shift": {"right": 0.3}}, {"orbit.azimuth": "30*frame", "roll": "9*frame"}),
        ({"projection": "orthographic", "height": 3}, {"roll": "9*frame", "orbit.distance": "1 + frame"}),
    ],
)
def test_each_frame_is_the_still_with_the_same_words(camera: dict[str, Any], tracks: dict[str, str]) -> None:
    scene = moving(camera, {f"camera.{name}": text for name, text in tracks.items()})
    for frame in range(5):
        given = {key: dict(value) if isinstance(value, dict) else value for key, value in camera.items()}
        for name, text in tracks.items():
            *section, key = name.split(".")
            at = given.setdefault(section[0], {}) if section else given
            at[key] = float(eval(text, {"frame": frame}))
        assert clfractal.at_frame(scene, frame).camera == still(given)


def test_words_are_applied_to_the_position_that_moves_too() -> None:
    tracks = {"camera.position.1": "-3 - frame", "camera.orbit.azimuth": "90*frame", "camera.roll": "9*frame"}
    scene = moving({"position": [0, -3, 0]}, tracks)
    for frame in range(5):
        orbit = {"azimuth": 90 * frame}
        wanted = still({"position": [0, -3 - frame, 0], "orbit": orbit, "roll": 9 * frame})
        assert clfractal.at_frame(scene, frame).camera == wanted


def test_a_moved_scene_moves_from_where_the_first_one_did() -> None:
    """A frame's scene, its file and its copy in another process know the camera from before it was rolled."""
    scene = moving(
        {"position": [1, -3, 1], "roll": 10}, {"camera.roll": "90*frame", "camera.shift.up": "frame"}
    )
    wanted = [clfractal.at_frame(scene, frame).camera for frame in range(5)]
    posed = movement_of(scene).posed(3)
    others = [
        load_scene(dump_scene(scene)),
        posed,
        load_scene(dump_scene(posed)),
        pickle.loads(pickle.dumps(posed)),
    ]
    for other in others:
        assert [clfractal.at_frame(other, frame).camera for frame in range(5)] == wanted
    assert load_scene(dump_scene(scene)) == scene
    assert "roll" not in dump_scene(clfractal.at_frame(scene, 3))


def test_cameras_of_layouts_move_too() -> None:
    views = [{}, {"camera": {"position": [0, -4, 0]}}]
    scene = moving(
        {"position": [0, -3, 0]}, {"layout.views.1.camera.roll": "90*frame"}, layout={"views": views}
    )
    layout = clfractal.at_frame(scene, 1).layout
    assert layout is not None
    assert layout.views[1].camera is not None
    assert layout.views[1].camera.up == pytest.approx((1, 0, 0), abs=1e-12)
    assert load_scene(dump_scene(scene)) == scene


def test_a_distance_moves_by_factors() -> None:
    track = {"keys": [{"frame": 0, "value": 1.0}, {"frame": 4, "value": 16.0}], "interpolation": "linear"}
    films = {"frames": 5, "tracks": {"camera.orbit.distance": track}}
    scene = load_scene({"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}, "animation": films})
    distances = [math.dist(clfractal.at_frame(scene, frame).camera.position, (0, 0, 0)) for frame in range(5)]
    assert distances == pytest.approx([1, 2, 4, 8, 16])


@pytest.mark.parametrize(
    ("camera", "name", "text", "message"),
    [
        ({}, "camera.rol", "1", "unknown key of camera 'rol'; did you mean 'roll'?"),
        (
            {},
            "camera.orbit",
            "1",
            "cannot move as a whole: name one of its keys, azimuth, elevation, distance",
        ),
        ({}, "camera.frame", "1", "cannot move: it is null, and would be no number"),
        ({}, "camera.orbit.elevation", "91*u", "must be at most 90, got 91.0 at frame 4"),
        (
            {"frame": "all"},
            "camera.orbit.distance",
            "2",
            "is chosen by camera.frame; remove one of them at frame 0",
        ),
        ({"target": [0, -3, 0], "position": [0, 0, 0]}, "camera.shift.right", "9e5*u", None),
    ],
)
def test_messages(camera: dict[str, Any], name: str, text: str, message: str | None) -> None:
    if message is None:
        moving(camera, {name: text})
        return
    with pytest.raises(SceneError) as caught:
        moving(camera, {name: text})
    assert caught.value.message == message
    assert caught.value.where.path == f"animation.tracks.{name}"
