"""A scene that is edited at a frame of its film: what is shown, what is saved, keys, and undo."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clfractal
from clfractal.scene.load import load_scene
from clfractal.scene.parts import OrthographicCamera
from clfractal.viewer import film_place
from clfractal.viewer import timeline_edits as timeline
from clfractal.viewer.controls import Controls
from clfractal.viewer.motion import Motion
from clfractal.viewer.navigation import dolly
from clfractal.viewer.scene_operators import STEREO_MODES, SceneOperators
from clfractal.viewer.settings import Settings
from clfractal.viewer.standard_views import to_orthographic
from tests.viewer.films import MOVING, STILL, keys, studio_of
from tests.viewer.panel_harness import make_ui

# What is shown, and what is saved


@pytest.mark.parametrize("frame", [0, 7, 10, 40])
def test_a_frame_is_the_films(frame: int) -> None:
    studio = studio_of(frame=frame)
    shown, wanted = studio.shown_scene, clfractal.at_frame(load_scene(MOVING), frame)
    assert shown.model_copy(update={"image": wanted.image}) == wanted
    assert studio.value("camera.fov") == pytest.approx(30 * 2 ** min(frame / 10, 1))


def test_a_frame_has_the_films_motion_blur_until_something_has_no_key() -> None:
    blurred = MOVING.replace("frames: 41", "frames: 41\n  shutter: 180 deg")
    studio = studio_of(blurred, 20)
    shown, wanted = studio.shown_scene, clfractal.at_frame(load_scene(blurred), 20)
    assert shown.model_copy(update={"image": wanted.image}) == wanted
    assert shown.animation is not None
    assert (shown.animation.frame, shown.animation.shutter) == (20, 0.5)
    assert studio.edit({"material.ambient": 0.5})
    assert studio.shown_scene.animation == shown.animation, "what no track moves goes along"
    assert studio.edit({"camera.fov": 33})
    assert studio.shown_scene.animation is None, "how it moves is not known yet"
    assert studio.set_keys() is not None
    assert studio.shown_scene.animation is not None


def test_the_scene_as_it_stands_has_no_motion_blur() -> None:
    still = MOVING.replace("frames: 41", "frames: 41\n  shutter: 0.5\n  frame: 20")
    scene = load_scene(still, posed=False)
    studio = make_ui(scene)[0].studio
    assert studio.frame_number is None
    found = studio.shown_scene.animation
    assert found is None or found.frame is None
    assert studio.document == scene


def test_an_exposure_is_measured_in_the_films_first_frame() -> None:
    auto = MOVING + "output: {exposure: auto}\n"
    studio = studio_of(auto, 20)
    first = studio.exposed_in
    assert first == clfractal.at_frame(load_scene(auto), 0)
    studio.go_to_frame(30)
    assert studio.exposed_in is first, "it is not measured anew"
    studio.edit({"material.ambient": 0.5})
    changed = studio.exposed_in
    assert changed is not None
    assert changed.material.ambient == 0.5
    assert changed.camera == first.camera
    studio.edit({"output.exposure": 1.0})
    assert studio.exposed_in is None
    studio.go_to_frame(None)
    assert studio.exposed_in is None


def test_looking_at_frames_changes_nothing() -> None:
    studio = studio_of()
    for frame in (3, 17.5, 40, 999):
        assert studio.go_to_frame(frame, moving=True)
    assert studio.frame_number == 40
    assert not studio.unsaved
    assert studio.document == load_scene(MOVING)
    assert studio.history.depth("camera") == studio.history.depth("scene") == (0, 0)
    assert studio.go_to_frame(None)
    assert studio.scene == load_scene(MOVING)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 40), min_size=1, max_size=5))
def test_what_no_track_moves_is_edited_at_any_frame(frames: list[int]) -> None:
    studio = studio_of()
    for number, frame in enumerate(frames):
        studio.go_to_frame(frame)
        assert studio.edit({"material.ambient": 0.1 + 0.01 * number})
    assert studio.document == load_scene(MOVING, overrides=[f"material.ambient={0.1 + 0.01 * number}"])


def test_a_scene_without_a_film_has_no_frames() -> None:
    studio = studio_of(STILL, None)
    assert not studio.go_to_frame(0)
    assert studio.set_keys() is None


def test_a_frame_that_cannot_be_is_told_and_left_out() -> None:
    studio = studio_of(frame=5)
    assert studio.scene.animation is not None
    wrong = timeline.with_key(studio.scene.animation, "camera.fov", 20, 400.0)
    before = studio.scene
    assert not studio.set_animation(wrong)
    assert studio.scene is before
    assert studio.messages[-1].wrong
    assert "camera.fov" in studio.messages[-1].text


# Keys


def test_keys_are_set_for_what_changed() -> None:
    studio = studio_of(frame=20)
    studio.set_camera(dolly(studio.scene.camera, 0.5))
    studio.edit({"material.ambient": 0.5})
    assert {".".join(path) for path in studio.changed()} == {"camera.position", "material.ambient"}
    here = studio.scene.camera.position
    found: Any = studio.set_keys()
    assert set(found.keyed) == {"camera.position", "material.ambient"}
    assert keys(studio, "camera.position")[20] == here
    assert list(keys(studio, "camera.position")) == [0, 20, 40]
    # What had no track moves from what it was.
    assert keys(studio, "material.ambient") == {0: 0.1, 20: 0.5}
    assert studio.changed() == {}
    studio.go_to_frame(40)
    studio.go_to_frame(20)
    assert studio.scene.camera.position == pytest.approx(here)
    # The scene as it stands is what it was, but for the value that was set without a track.
    studio.go_to_frame(None)
    assert studio.scene.camera == load_scene(MOVING).camera


def test_setting_keys_is_one_step_of_undo() -> None:
    studio = studio_of(frame=20)
    studio.set_camera(dolly(studio.scene.camera, 0.5))
    edited = studio.scene.camera
    studio.set_keys()
    keyed = studio.scene.animation
    studio.go_to_frame(3)
    assert studio.undo("scene")
    assert (studio.frame_number, studio.document.animation) == (20, load_scene(MOVING).animation)
    assert studio.redo("scene")
    assert studio.scene.animation == keyed
    assert studio.undo("scene")
    # The move itself is a step of the camera's.
    studio.go_to_frame(3)
    assert studio.undo("camera")
    assert studio.frame_number == 20
    assert studio.redo("camera")
    assert studio.scene.camera == edited
    assert {".".join(path) for path in studio.changed()} == {"camera.position"}


def test_an_expression_takes_no_keys() -> None:
    studio = studio_of(frame=20)
    studio.edit({"formula.parameters.power": 6.0})
    found: Any = studio.set_keys()
    assert (found.keyed, found.refused) == ((), ("formula.parameters.power",))
    assert "power" not in studio.document.formula.parameters


def test_numbers_with_tracks_of_their_own_get_their_own_keys() -> None:
    studio = studio_of(
        MOVING.replace(
            "camera.position:  #", "camera.position.2: {keys: [{frame: 0, value: 1}]}\n    x: #"
        ).partition("    x:")[0],
        20,
    )
    studio.edit({"camera.position": [0.5, -3, 2]})
    found: Any = studio.set_keys()
    assert {"camera.position.0", "camera.position.2"} <= set(found.keyed)
    assert keys(studio, "camera.position.2") == {0: 1, 20: 2}


def test_keys_are_set_at_once_where_that_is_wanted() -> None:
    studio = studio_of(frame=5)
    studio.auto_keys = True
    studio.edit({"camera.fov": 33}, gesture="fov")
    studio.edit({"camera.fov": 35}, gesture="fov")
    studio.end_gesture()
    assert keys(studio, "camera.fov") == {0: 30, 5: 35, 10: 60}
    # What no track moves is an edit as ever.
    studio.edit({"material.ambient": 0.5})
    assert "material.ambient" not in studio.document.animation.tracks  # type: ignore[union-attr]
    assert studio.undo("scene")
    assert studio.undo("scene")
    assert studio.document == load_scene(MOVING)
    assert not studio.undo("scene")


# What tracks move stays

LIT = MOVING.replace(
    "    camera.fov:",
    """    stereo.screen_distance: {keys: [{frame: 0, value: 0.5}, {frame: 40, value: 0.9}]}
    lights.1.intensity: {keys: [{frame: 0, value: 2}]}
    camera.fov:""",
).replace(
    "renderer:",
    """stereo: {mode: anaglyph, screen_width: 0.5, screen_distance: 0.7}
lights: [{direction: [0, 1, -1]}, {direction: [1, 1, -1], intensity: 3}, {direction: [1, 0, -1]}]
renderer:""",
)
FIRST, SECOND, THIRD = (each.model_dump(mode="json") for each in load_scene(LIT).lights)
TAKEN_AWAY: dict[str, tuple[dict[str, Any], str]] = {
    "stereo is switched off": ({"stereo": None}, "stereo.screen_distance"),
    "the light is removed": ({"lights": [FIRST]}, "lights.1.intensity"),
    "a light before it is removed": ({"lights": [SECOND, THIRD]}, "lights.1.intensity"),
    "lights are reordered": ({"lights": [SECOND, FIRST, THIRD]}, "lights.1.intensity"),
    "a light is put before it": ({"lights": [THIRD, FIRST, SECOND, THIRD]}, "lights.1.intensity"),
}


@pytest.mark.parametrize("frame", [None, 0, 20])
@pytest.mark.parametrize("case", TAKEN_AWAY)
def test_what_a_track_moves_is_not_taken_away(case: str, frame: float | None) -> None:
    studio = studio_of(LIT, frame)
    values, name = TAKEN_AWAY[case]
    if "lights" in values:  # as they are at this frame
        now = {1: studio.value("lights.1")}
        values = {"lights": [now[1] if each is SECOND else each for each in values["lights"]]}
    before, document = studio.scene, studio.document
    assert not studio.edit(values)
    assert studio.scene is before
    assert studio.document == document
    assert [message.text for message in studio.messages] == [
        f"a track of the film moves {name}"
        + (", which would be another one's" if len(values.get("lights") or [1]) > 1 else "")
        + ": remove that track in the timeline first"
    ]
    # Without the track it goes, and comes back with undo.
    assert document.animation is not None
    assert studio.set_animation(timeline.without_track(document.animation, name))
    assert studio.edit(values)
    assert studio.undo("scene")
    assert studio.undo("scene")
    assert studio.document == document


def test_what_no_track_moves_may_go_and_be_edited() -> None:
    studio = studio_of(LIT, 20)
    lights = studio.value("lights")
    assert studio.edit({"lights": lights[:2]})
    assert studio.edit({"lights.1.color": [1, 0.5, 0.2]})
    assert studio.edit({"lights": [*studio.value("lights"), lights[0]]})
    assert studio.edit({"stereo.mode": "split"})
    assert studio.messages == []


def test_a_camera_of_another_kind_is_refused_where_its_field_of_view_moves() -> None:
    studio = studio_of(frame=10)
    before = studio.scene
    studio.set_camera(to_orthographic(before.camera, before.bounds))
    assert studio.scene is before
    assert "a track of the film moves camera.fov" in studio.messages[-1].text
    assert before.animation is not None
    studio.set_animation(timeline.without_track(before.animation, "camera.fov"))
    studio.set_camera(to_orthographic(studio.scene.camera, before.bounds))
    assert isinstance(studio.scene.camera, OrthographicCamera)


def test_the_ways_of_stereo_go_round_past_off() -> None:
    studio = studio_of(LIT, 0)
    motion = Motion(studio)
    controls = Controls(studio, Settings(), motion)
    operators = SceneOperators(studio, controls, motion, lambda: None, lambda: 0.0)
    modes = set()
    for _ in STEREO_MODES:
        operators.stereo_mode(1)
        assert studio.scene.stereo is not None
        modes.add(studio.scene.stereo.mode)
    assert len(modes) >= len(STEREO_MODES) - 3
    assert sum("moves stereo.screen_distance" in message.text for message in studio.messages) == 1


# Undo of the film


# Files


ROLLED = MOVING.replace(
    "  tracks:\n", "  tracks:\n    camera.roll: {keys: [{frame: 0, value: 0}, {frame: 40, value: 80}]}\n"
)


def test_a_rolled_camera_that_is_moved_at_a_frame_is_saved_as_it_was() -> None:
    """What the roll makes of its `up` at a frame is not what the next frame is rolled from."""
    studio = studio_of(ROLLED, 20)
    shown = studio.shown_scene.camera
    assert shown == clfractal.at_frame(load_scene(ROLLED), 20).camera
    assert studio.document == load_scene(ROLLED, posed=False)
    assert studio.edit({"camera": dolly(shown, 0.5).model_dump(mode="json")})
    assert studio.shown_scene.camera != shown
    assert studio.document == load_scene(ROLLED, posed=False)
    found: Any = studio.set_keys()
    assert found.refused
    assert set(found.refused) == {"camera.roll"}
    assert "beside it" in film_place.why_no_keys(studio.scene, "camera.roll")
    assert studio.go_to_frame(40)
    assert studio.shown_scene.camera == clfractal.at_frame(load_scene(ROLLED), 40).camera
