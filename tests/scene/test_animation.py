"""Movement in a scene file: what can move and how, what is refused and where, and the scene of each frame."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import clfractal
from clfractal.errors import ClfractalError, SceneError
from clfractal.formulas.opencl import write_formula
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.movement import movement_of
from tests.scene.movements import HEAD, moving, values


def keys(*pairs: tuple[float, Any], **others: Any) -> dict[str, Any]:
    return {"keys": [{"frame": frame, "value": value} for frame, value in pairs], **others}


def test_times_in_seconds_and_frames() -> None:
    track = {"keys": [{"frame": 0, "value": 1}, {"time": 1.0, "value": 3}], "interpolation": "linear"}
    found = values(moving({"lights.0.intensity": track}), "lights.0.intensity")
    assert found[5] == 2
    assert found[10:] == [3] * 11
    assert moving({}, frames=None, duration="1.5 min", fps=2).animation.count == 180  # type: ignore[union-attr]
    assert moving({}, frames=None, duration=0.26).animation.count == 3  # type: ignore[union-attr]


def test_each_interpolation_meets_the_keys() -> None:
    for word in ("hold", "linear", "smooth", "ease", "ease_in", "ease_out"):
        found = values(
            moving({"material.ambient": keys((0, 0.1), (10, 0.5), (20, 0.3), interpolation=word)}),
            "material.ambient",
        )
        assert (found[0], found[10], found[20]) == (0.1, 0.5, 0.3), word
        assert all(0.1 <= value <= 0.5 for value in found)
        assert (found[5] == 0.1) == (word == "hold")


def test_a_key_may_have_a_way_of_its_own() -> None:
    track = keys((0, 0.0), (10, 1.0), (20, 0.0), interpolation="hold")
    track["keys"][1] |= {"interpolation": "bezier", "handles": [0.5, 0, 0.5, 1]}
    found = values(moving({"material.ambient": track}), "material.ambient")
    assert set(found[:10]) == {0.0}
    assert found[15] == pytest.approx(0.5)
    assert found[12] > 0.85  # slow at first


def test_scales_go_by_factors() -> None:
    found = values(moving({"camera.fov": keys((0, 90.0), (20, 0.009))}), "camera.fov")
    np.testing.assert_allclose(np.divide(found[1:], found[:-1]), 1e-4 ** (1 / 20), rtol=1e-9)
    linear = values(
        moving({"camera.fov": keys((0, 90.0), (20, 0.009), interpolation="linear")}), "camera.fov"
    )
    np.testing.assert_allclose(linear, found, rtol=1e-9)


def test_angles_are_never_wrapped() -> None:
    base = {"environment": {"name": "studio"}}
    found = values(
        moving({"environment.rotation": keys((0, -300.0), (20, 300.0))}, base=base), "environment.rotation"
    )
    np.testing.assert_allclose(found, np.linspace(-300, 300, 21))


def test_directions_go_on_the_sphere() -> None:
    found = values(
        moving({"lights.0.direction": keys((0, [5, 0, 0]), (20, [0, 0, -1]))}), "lights.0.direction"
    )
    for frame, direction in enumerate(found):
        angle = math.pi / 2 * frame / 20
        np.testing.assert_allclose(direction, [math.cos(angle), 0, -math.sin(angle)], atol=1e-12)


def test_whole_numbers_are_rounded() -> None:
    found = values(moving({"formula.iterations": keys((0, 2), (20, 12))}), "formula.iterations")
    assert [type(each) for each in found] == [int] * 21
    assert found == [round(2 + frame / 2) for frame in range(21)]


def test_one_component_of_a_place_moves_alone() -> None:
    scene = moving({"camera.position.2": keys((0, 0.0), (20, 2.0))})
    assert clfractal.at_frame(scene, 10).camera.position == (0, -3, 1)


def test_what_is_null_may_move() -> None:
    scene = moving(
        {"formula.julia": keys((0, [0.0, 0, 0]), (20, [0.4, 0, 0])), "camera.focus_distance": keys((0, 2.0))}
    )
    found = clfractal.at_frame(scene, 10)
    assert found.formula.julia == pytest.approx((0.2, 0, 0))
    assert found.animation is None


@pytest.mark.parametrize("frame", [0, 1, 7.5, 20])
def test_expressions_know_frame_time_and_part(frame: float) -> None:
    track = {"expression": ["frame", "2*t", "where(u < 0.5, u, 1 - u)"]}
    u = frame / 20
    expected = (frame, 2 * frame / 10, u if u < 0.5 else 1 - u)
    found = movement_of(moving({"camera.target": track})).values(frame)["camera.target"]
    assert found == pytest.approx(expected)


def test_in_a_loop_the_part_does_not_reach_one() -> None:
    scene = moving({"coloring.offset": {"expression": "u"}}, loop=True, frames=20)
    np.testing.assert_allclose(values(scene, "coloring.offset"), np.arange(20) / 20)


def test_a_loop_has_no_seam() -> None:
    scene = moving({"coloring.offset": keys((0, 0.0), (7, 1.0), (13, 0.2))}, loop=True, frames=20)
    at = [movement_of(scene).values(frame)["coloring.offset"] for frame in (19.999, 19.9999, 0.0, 0.0001)]
    assert at[1] == pytest.approx(0, abs=1e-4)
    before, after = (at[1] - at[0]) / 0.0009, (at[3] - at[2]) / 0.0001
    assert before == pytest.approx(after, abs=1e-3)
    # A first key that is not at the film's first frame, too.
    later = moving({"coloring.offset": keys((5, 0.0), (10, 1.0))}, loop=True, frames=20)
    found = values(later, "coloring.offset")
    assert found[5] == 0
    assert found[10] == 1
    # From the key at frame 10 to the first one, at frame 25, frame 20 is two thirds of the way; both are extremes.
    assert found[0] == pytest.approx(1 - (3 * (2 / 3) ** 2 - 2 * (2 / 3) ** 3))


def test_tracks_that_repeat() -> None:
    there = keys((2, 0.0), (6, 1.0), interpolation="linear")
    looped = values(moving({"coloring.offset": {**there, "repeat": "loop"}}), "coloring.offset")
    assert looped[2:14] == [0, 0.25, 0.5, 0.75] * 3
    back = values(moving({"coloring.offset": {**there, "repeat": "ping_pong"}}), "coloring.offset")
    assert back[2:18] == [0, 0.25, 0.5, 0.75, 1, 0.75, 0.5, 0.25] * 2


def test_a_dive_comes_nearer_by_equal_factors() -> None:
    target = [0.2, -0.7, 0.1]
    end = [0.2, -0.7 - 3e-5, 0.1]
    base = {"camera": {"position": [0, -3, 0], "target": target}}
    scene = moving({"camera.position": keys((0, [0.2, -3.7, 0.1]), (20, end))}, base=base)
    away = [math.dist(place, target) for place in values(scene, "camera.position")]
    np.testing.assert_allclose(np.divide(away[1:], away[:-1]), 1e-5 ** (1 / 20), rtol=1e-6)
    plain = keys((0, [0.2, -3.7, 0.1]), (20, end), around_target=False)
    straight = values(moving({"camera.position": plain}, base=base), "camera.position")
    np.testing.assert_allclose(np.diff(np.array(straight)[:, 1]), (3 - 3e-5) / 20)


def test_position_and_target_fly_together() -> None:
    tracks = {
        "camera.position": keys((0, [0.0, -3, 0]), (20, [0.65, -0.753, 0.5])),
        "camera.target": keys((0, [0.0, 0, 0]), (20, [0.65, -0.75, 0.5])),
    }
    scene = moving(tracks)
    seen = [clfractal.at_frame(scene, frame).camera for frame in range(21)]
    assert seen[0].position == (0, -3, 0)
    assert seen[-1].position == (0.65, -0.753, 0.5)
    steps = [
        math.dist(a.target, b.target)
        / math.sqrt(math.dist(a.position, a.target) * math.dist(b.position, b.target))
        for a, b in pairwise(seen)
    ]
    assert max(steps) < 1.01 * min(steps)


def test_a_camera_follows_a_target_with_a_clock_of_its_own() -> None:
    """It keeps its distance of 3 from where the target is, however either of them repeats."""
    circle = [[3.0, 0, 0], [0.0, 3, 0], [-3.0, 0, 0], [0.0, -3, 0], [3.0, 0, 0]]
    there = keys(*((2 * i, row) for i, row in enumerate(circle)), repeat="loop")
    target: dict[str, Any] = {"expression": ["t", "0", "2*u"]}
    moved = {
        "camera.position": keys(*((2 * i, [x, y, z]) for i, (x, y, z) in enumerate(circle)), repeat="loop")
    }
    still = moving(moved)
    assert [math.hypot(*place) for place in values(still, "camera.position")] == pytest.approx([3.0] * 21)
    both = moving(
        {
            "camera.position": there,
            "camera.target": keys((0, [0.0, 0, 0]), (5, [0.0, 0, 1]), repeat="ping_pong"),
        }
    )
    for frame in range(21):
        camera = clfractal.at_frame(both, frame).camera
        assert 2.9 < math.dist(camera.position, camera.target) < 3.3
    assert clfractal.at_frame(moving({"camera.target": target, **moved}), 10).camera.target == (1, 0, 1)


@pytest.mark.parametrize("seconds", [8.3, 4.1, 0.7])
def test_a_loop_may_end_with_its_first_key_in_seconds(seconds: float) -> None:
    wave = ((0, 0), (seconds / 3, 1), (2 * seconds / 3, -1), (seconds, 0))
    track = {"keys": [{"time": time, "value": value} for time, value in wave]}
    scene = moving({"coloring.offset": track}, fps=30, frames=None, duration=seconds, loop=True)
    found = values(scene, "coloring.offset")
    assert found[1] > 0
    assert found[-1] == pytest.approx(-found[1], rel=1e-6)


def test_what_is_null_has_as_many_numbers_as_the_schema_says() -> None:
    base: dict[str, Any] = {"formula": {"name": "quaternion_mandelbrot"}}
    scene = moving({"formula.julia": keys((0, [0.1, 0, 0, 0]), (20, [0.3, 0, 0, 0]))}, base=base)
    assert clfractal.at_frame(scene, 10).formula.julia == pytest.approx((0.2, 0, 0, 0))
    base = {"camera": {"position": [0, -3, 0], "f_number": 2}}
    scene = moving({"camera.focus_on": keys((0, [0.0, 0.5]), (20, [1.0, 0.5]))}, base=base)
    assert clfractal.at_frame(scene, 10).camera.focus_on == pytest.approx((0.5, 0.5))  # type: ignore[union-attr]


def test_parameters_that_move_need_no_new_text() -> None:
    scene = moving({"formula.parameters.power": keys((0, 8), (20, 2.5))})
    texts = {write_formula(clfractal.at_frame(scene, frame).chain).text for frame in (0, 3, 20)}
    assert len(texts) == 1
    chain = {"formula": {"chain": [{"name": "menger_sponge"}, {"name": "mandelbulb"}]}}
    moved = moving({"formula.chain.1.parameters.power": keys((0, 6), (20, 9))}, base=chain)
    links = clfractal.at_frame(moved, 20).formula.chain
    assert links is not None
    assert links[1].parameters == {"power": 9}


def test_lights_on_the_set_stay_where_they_stand() -> None:
    light = {"type": "set", "trap": {"shape": "plane"}, "threshold": 0.5, "count": 9}
    base = {"formula": {"name": "menger_sponge", "iterations": 3}, "lights": [{}, light]}
    bright = {
        "lights.1.intensity": keys((0, 1), (20, 5)),
        "lights.1.temperature": keys((0, 2000), (20, 3000)),
    }
    assert clfractal.at_frame(moving(bright, base=base), 10).lights[1].intensity == pytest.approx(3)
    for name in (
        "formula.iterations",
        "lights.1.threshold",
        "lights.1.trap.center.0",
        "renderer.bounds.radius",
    ):
        with pytest.raises(
            SceneError, match=r"cannot move: the lights on the set, lights\.1, would stand"
        ) as caught:
            moving({name: keys((0, 1), (20, 2))}, base=base)
        assert caught.value.where.path == f"animation.tracks.{name}"


def test_noise_is_new_in_each_frame_or_fixed() -> None:
    base = {
        "renderer": {"seed": 2**32 - 2},
        "layout": {"views": [{}, {"renderer": {"type": "surface", "seed": 5}}]},
    }
    new = [clfractal.at_frame(moving({}, base=base), frame) for frame in range(3)]
    assert [scene.renderer.seed for scene in new] == [2**32 - 2, 2**32 - 1, 0]
    for number, scene in enumerate(new):
        assert scene.layout is not None
        assert scene.layout.views[0].renderer is None
        assert scene.layout.views[1].renderer is not None
        assert scene.layout.views[1].renderer.seed == 5 + number
    fixed = clfractal.at_frame(moving({}, base=base, noise="fixed"), 2)
    assert fixed.renderer.seed == 2**32 - 2


# --- what is refused ---

REFUSED = {
    "camera.fow: {expression: '1'}": "unknown key of camera 'fow'; did you mean 'fov'?",
    "camera: {expression: '1'}": "cannot move as a whole: name one of its keys, position, target, up, orbit,"
    " frame, roll, shift, projection, fov, f_number, focus_distance, focus, focus_on, sensor_height",
    "camera..fov: {expression: '1'}": "must name a value by its dotted keys, such as camera.position",
    "formula.parameters: {expression: '1'}": "cannot move as a whole: name one of its values, such as"
    " formula.parameters.NAME",
    "camera.position.02: {expression: '1'}": "cannot move: camera.position has entries 0 to 2",
    "camera.target: {expression: ['1e200*u', '0', '0']}": "must be at most 1000000",
    "formula.iterations: {expression: '8 + 1/(frame - 2)'}": "is not a finite number at frame 2",
    "image.width: {expression: '1'}": "cannot move: it is the same for all frames of a film",
    "output.quality: {expression: '1'}": "cannot move: it says how files are written; only output.exposure can move",
    "renderer.samples: {expression: '1'}": "cannot move: it is a whole number, and decides how the picture is made",
    "renderer.type: {expression: '1'}": "cannot move: it is a word, 'surface'",
    "lights.0.shadow: {expression: '1'}": "cannot move: it is true or false",
    "lights.2.intensity: {expression: '1'}": "cannot move: lights has entries 0 to 0",
    "fog.density: {expression: '1'}": "cannot move: fog is null; give it a value, or leave this track out",
    "camera.fov.x: {expression: '1'}": "cannot move: camera.fov is a single value, so it has no key 'x'",
    "formula.parameters.powr: {expression: '1'}": "unknown parameter 'powr'; did you mean 'power'?",
    "camera.fov: {}": "needs one of keys, expression and file",
    "camera.fov: {column: a, expression: '1'}": "needs file and column together",
    "camera.fov: {expression: '200*u'}": "must be at least 1e-06, got 0.0 at frame 0",
    "camera.fov: {expression: '10 + 200*u'}": "must be below 180, got 210.0 at frame 20",
    "camera.fov: {expression: '1/(frame - 7)'}": "is not a finite number at frame 7",
    "formula.parameters.power: {expression: '8*t'}": "must be at least 1.5, got 0 at frame 0",
    "camera.target: {expression: ['0', '-3', '0.5']}": "must differ from camera.position",
    "lights.0.rays: {expression: '1'}": "cannot move: it is null, and would be no number",
}


@pytest.mark.parametrize("track", REFUSED)
def test_a_track_that_cannot_be_is_refused_at_its_line(track: str) -> None:
    with pytest.raises(ClfractalError) as caught:
        load_scene(f"{HEAD}animation:\n  frames: 21\n  tracks:\n    {track}\n")
    assert REFUSED[track] in caught.value.message
    assert caught.value.where.line in (4, 5, 7)


WRONG_KEYS = {
    "[{frame: 5, value: 1}, {frame: 5, value: 2}]": (
        "keys.1",
        "must come after the key before it: frame 5 is at the same time as frame 5",
    ),
    "[{frame: 5, value: 1}, {time: 0.1, value: 2}]": (
        "keys.1",
        "must come after the key before it: frame 3 is before frame 5",
    ),
    "[{value: 1}]": ("keys.0", "needs frame or time"),
    "[{frame: 1, time: 1, value: 1}]": ("keys.0", "needs one of frame and time"),
    "[{frame: 1, value: [1, 2]}]": ("keys.0.value", "must be a number for camera.fov, got 2"),
    "[{frame: 1, value: 1}, {frame: 2, value: [1, 2]}]": (
        "keys.1.value",
        "must be a number, as that of the first key",
    ),
    "[{frame: 1, value: 1, interpolation: bezier}, {frame: 2, value: 1}]": (
        "keys.0",
        "needs handles: [x1, y1, x2, y2], as for bezier",
    ),
    "[{frame: 1, value: 1, handles: [0, 0, 2, 1]}]": ("keys.0.handles.2", "must be at most 1, got 2"),
    "[]": ("keys", "must not be empty"),
}


@pytest.mark.parametrize("listed", WRONG_KEYS)
def test_wrong_keys_are_told_at_their_place(listed: str) -> None:
    path, message = WRONG_KEYS[listed]
    with pytest.raises(ClfractalError) as caught:
        load_scene(f"{HEAD}animation:\n  frames: 21\n  tracks:\n    camera.fov: {{keys: {listed}}}\n")
    assert caught.value.message == message
    assert caught.value.where.path == f"animation.tracks.camera.fov.{path}"
    assert caught.value.where.line == 7


def test_one_value_has_one_track() -> None:
    with pytest.raises(ClfractalError, match=r"moves what 'camera\.position' moves already"):
        moving({"camera.position": keys((0, [0, -3, 0])), "camera.position.1": keys((0, -2.0))})


def test_around_target_is_for_smooth_positions() -> None:
    with pytest.raises(ClfractalError, match="applies to a camera's position"):
        moving({"camera.fov": keys((0, 40), around_target=True)})
    turn = keys((0, [0, -3, 0]), (5, [3, 0, 0]), around_target=True, interpolation="linear")
    with pytest.raises(ClfractalError, match="applies to a smooth track"):
        moving({"camera.position": turn})
    with pytest.raises(ClfractalError, match="must differ from the camera's target at frame 5"):
        moving({"camera.position": keys((0, [0, -3, 0]), (5, [0, 0, 0]), (9, [3, 0, 0]))})


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=6),
    st.sampled_from(["hold", "linear", "smooth", "ease"]),
    st.sampled_from(["none", "loop", "ping_pong"]),
    st.booleans(),
)
def test_any_keys_make_a_film(numbers: list[float], word: str, repeat: str, loop: bool) -> None:
    listed = [(3 * index, number) for index, number in enumerate(numbers)]
    scene = moving({"coloring.offset": keys(*listed, interpolation=word, repeat=repeat)}, loop=loop)
    found = values(scene, "coloring.offset")
    low, high = min(numbers), max(numbers)
    slack = 1e-9 * max(abs(low), abs(high))
    assert all(low - slack <= value <= high + slack for value in found)
    assert found[0] == numbers[0]


def test_a_cut_in_seconds_is_at_its_frame() -> None:
    """0.28 * 25 is a little more than 7 for a computer."""
    cut = {"keys": [{"time": 0, "value": 45}, {"time": 0.28, "value": 20}], "interpolation": "hold"}
    assert values(moving({"camera.fov": cut}, fps=25), "camera.fov")[6:9] == [45, 20, 20]


def test_a_flight_follows_single_numbers_of_its_target() -> None:
    """Wherever one begins: the film, or a frame that keeps its animation."""
    tracks = {
        "camera.position": keys((0, [0, -3, 0.5]), (20, [2, -2, 1])),
        "camera.target.0": {"expression": "u"},
    }
    scene = moving(tracks, shutter=0.5)
    frame = clfractal.at_frame(scene, 5)
    assert movement_of(frame).instant(5).camera.position == pytest.approx(frame.camera.position, abs=1e-12)
    away = [
        math.dist(at.camera.position, at.camera.target)
        for at in (movement_of(scene).scene(f) for f in (0, 20))
    ]
    assert away == pytest.approx([math.dist((0, -3, 0.5), (0, 0, 0)), math.dist((2, -2, 1), (1, 0, 0))])


def test_a_scene_with_a_frame_can_be_read_as_it_was_written() -> None:
    tracks = {"camera.fov": keys((0, 40), (20, 20), interpolation="linear")}
    text = dump_scene(moving(tracks, base={"camera": {"position": [0, -3, 0], "fov": 45}}))
    override = ["animation.frame=10"]
    assert load_scene(text, overrides=override).camera.fov == pytest.approx(math.sqrt(40 * 20))  # type: ignore[union-attr]
    assert load_scene(text, overrides=override, posed=False).camera.fov == 45  # type: ignore[union-attr]


def test_variations_of_a_frame_stay_as_they_were_varied() -> None:
    scene = moving({"camera.fov": keys((0, 40), (20, 20))}, frame=10)
    (found,) = clfractal.variations(scene, count=1, seed=3)
    assert load_scene(dump_scene(found.scene)) == found.scene


def test_a_looped_flight_goes_on_whatever_its_target_does() -> None:
    """The target has a seam of its own at the film's end, and nowhere else."""
    tracks = {
        "camera.position": keys((10, [0, -3, 0.5]), (60, [2, -2, 1])),
        "camera.target": {"expression": ["frame/100", "0", "0"]},
    }
    found = movement_of(moving(tracks, frames=120, loop=True))
    before, after = (found.values(frame)["camera.position"] for frame in (9.999, 10.001))
    assert before == pytest.approx(after, abs=1e-3)
