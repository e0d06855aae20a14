"""Motion blur: samples spread over the time in which a shutter is open, against solids whose shadows are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clfractal
from clfractal.camera.views import View, scene_view
from clfractal.engine.engine import Engine
from clfractal.errors import ClfractalError
from clfractal.integrators import shutter as shutters
from clfractal.integrators.shutter import Shutter, shutter_of
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from tests.render.bits import same_pictures
from tests.render.shots import BALL, BALL_RADIUS, Floats
from tests.scenes import BALL_ITERATIONS
from tests.variants import combinations, one_of

ABOVE = {"projection": "orthographic", "position": [0, -3, 0], "target": [0, 0, 0], "height": 3}


def straight(*pairs: tuple[float, Any]) -> dict[str, Any]:
    return {
        "keys": [{"frame": frame, "value": value} for frame, value in pairs],
        "interpolation": "linear",
    }


# To the right by 2 scene units a frame.
PANNING = {
    "camera.position": straight((0, [-1, -3, 0]), (9, [17, -3, 0])),
    "camera.target": straight((0, [-1, 0, 0]), (9, [17, 0, 0])),
}
DIMMING = {"lights.0.intensity": straight((0, 1), (9, 19))}


def film_of(tracks: dict[str, Any], **sections: Any) -> dict[str, Any]:
    """A film of ten frames of a ball."""
    animation = {"frames": 10, "shutter": 0.5, "noise": "fixed", "tracks": tracks}
    return {
        "version": 1,
        "formula": {"inline": dict(BALL), "iterations": BALL_ITERATIONS},
        "image": {"width": 60, "height": 30},
        "camera": ABOVE,
        "lights": [{"direction": [0, 1, 0]}],
        **sections,
        "animation": {**animation, **sections.get("animation", {})},
    }


def shutter_at(scene: Scene) -> Shutter:
    found = shutter_of(scene, None, 0)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def engine() -> Engine:
    return Engine()


# -- when the shutter is open


def test_it_opens_at_the_frame_and_closes_within_the_film() -> None:
    film = load_scene(film_of(PANNING))
    times = [
        (found.opens, found.closes) for found in (shutter_at(clfractal.at_frame(film, n)) for n in range(10))
    ]
    assert times == [(n, n + 0.5) for n in range(9)] + [(8.5, 9.0)]
    ring = load_scene(film_of(PANNING, animation={"loop": True}))
    last = shutter_at(clfractal.at_frame(ring, 9))
    assert (last.opens, last.closes) == (9, 9.5)
    single = load_scene(film_of({}, animation={"frames": 1}))
    assert shutter_of(clfractal.at_frame(single, 0), None, 0) is None


@given(count=st.integers(1, 300))
def test_the_parts_of_all_samples_are_the_whole_opening(count: int) -> None:
    shutter = Shutter(load_scene(film_of(PANNING)), 2.0, 2.75, None, 0)
    parts = sorted(shutter.part(sample, count) for sample in range(count))
    assert parts[0][0] == 2.0
    assert parts[-1][1] == pytest.approx(2.75, abs=1e-12)
    for (_, end), (start, _) in pairwise(parts):
        assert end == pytest.approx(start, abs=1e-12)


@pytest.mark.parametrize("count", [8, 12, 64])
def test_early_samples_are_spread_over_the_opening(count: int) -> None:
    """Passes show pictures of the first 1, 2, 4, ... samples, so these stand for all of the time."""
    shutter = Shutter(load_scene(film_of(PANNING)), 0.0, 1.0, None, 0)
    middles = [sum(shutter.part(sample, count)) / 2 for sample in range(count)]
    for many in (2, 4):
        halves = sorted(int(many * middle) for middle in middles[:many])
        assert halves == list(range(many))


def test_a_view_is_mixed_within_a_part_of_a_pixel_whatever_way_it_goes() -> None:
    """A pan of a third of a turn within one frame, and a dive by a factor of a thousand."""
    turning = {"camera.target": {"expression": ["3*sin(t*20)", "3 - 3*cos(t*20)", "0"]}}
    eye = {"position": [0, 3, 0], "target": [0, 0, 0], "fov": 40}
    diving = {"camera.position": {"expression": ["0", "-3*exp(-7*frame)", "0.2*frame"]}}
    for tracks in (turning, diving):
        scene = clfractal.at_frame(
            film_of(tracks, camera=eye, animation={"shutter": 1.0, "fps": 10, "frames": 2}), 0
        )
        shutter = shutter_at(scene)
        poses = shutter.poses(shutter.opens, shutter.closes)
        for time in np.linspace(0, 0.999, 41):
            place = time * (len(poses) - 1)
            before, after = poses[int(place)], poses[int(place) + 1]
            true = scene_view(*shutter.seen(float(time)))
            mixed = (1 - place % 1) * corners(before) + (place % 1) * corners(after)
            off = np.linalg.norm(mixed - corners(true), axis=1).max() / (true.height / 30)
            assert off < (0.2 if len(poses) <= shutters.MOST_SPANS else 1.0)


def corners(view: View) -> Floats:
    across, up = view.side * view.width / 2, view.up * view.height / 2
    return np.stack([view.origin, *(view.center + x * across + y * up for x in (-1, 1) for y in (-1, 1))])


# -- pictures


def test_a_disk_that_crosses_the_picture_covers_its_way(engine: Engine) -> None:
    """What a moving disk covers of a pixel is the mean of what it covers at each time."""
    samples = 256
    film = engine.render(
        clfractal.at_frame(film_of(PANNING, image={"width": 120, "height": 60}), 1), samples=samples
    )
    size = 3 / 60
    # The picture's middle is at x = 1 .. 2 while the shutter is open, and the disk's at 0.
    offsets = np.linspace(-0.5, 0.5, 9)[:-1] + 1 / 16
    x = ((np.arange(120)[:, None] + 0.5 + offsets).ravel() - 60) * size
    y = ((np.arange(60)[:, None] + 0.5 + offsets).ravel() - 30) * size
    half = np.sqrt(np.maximum(BALL_RADIUS**2 - y**2, 0))[:, None]
    # x + time lies within the disk from time -half - x to half - x, of times from 1 to 2.
    share = np.clip(np.minimum(half - x, 2) - np.maximum(-half - x, 1), 0, 1)
    wanted = share.reshape(60, 8, 120, 8).mean(axis=(1, 3))
    np.testing.assert_allclose(film["A"], wanted, atol=0.06)
    assert abs(film["A"] - wanted).mean() < 0.004
    assert wanted.max() > 0.99


def test_one_sample_has_the_scene_in_the_middle_of_the_time(engine: Engine) -> None:
    blurred = engine.render(clfractal.at_frame(film_of(DIMMING), 3), samples=1)
    same_pictures(
        blurred,
        engine.render(clfractal.at_frame(film_of(DIMMING, animation={"shutter": 0}), 3.25), samples=1),
    )


def test_a_frame_in_which_nothing_moves_is_the_still(engine: Engine) -> None:
    resting = {"camera.position": straight((0, [0, -3, 0]), (5, [0, -3, 0]), (9, [3, -3, 0]))}
    job = engine.prepare(clfractal.at_frame(film_of(resting), 2))
    assert job.views[0].shutter is None
    assert engine.prepare(clfractal.at_frame(film_of(resting), 6)).views[0].plan.moving
    sharp = film_of(resting, animation={"shutter": 0})
    same_pictures(
        engine.render(clfractal.at_frame(film_of(resting), 2)), engine.render(clfractal.at_frame(sharp, 2))
    )


STEREO = {"mode": "pair", "screen_width": 0.5, "screen_distance": 0.7}
FLAT = {"type": "cut_plane", "plane": {"center": [0, 0, 0], "normal": [0, -1, 0], "width": 4, "height": 2}}
KINDS: dict[str, dict[str, Any]] = {
    "view": film_of(PANNING),
    "light": film_of(DIMMING),
    "both": film_of({**PANNING, **DIMMING}),
    "points": film_of(PANNING, renderer={"normal": "least_squares"}),
    "noise": film_of({**PANNING, **DIMMING}, renderer={"noise": 0.01, "samples": 16}),
    "lens": film_of(
        {"camera.focus_distance": straight((0, 1.5), (9, 15))},
        camera={"position": [0, -3, 0], "fov": 50, "f_number": 0.03, "focus_distance": 2},
    ),
    "mirror": film_of(PANNING, material={"reflection": 0.4}, renderer={"bounces": 2}),
    "volume": film_of({**PANNING, **DIMMING}, renderer={"type": "volume", "resolution": 24}),
    "cut_plane": film_of({"renderer.plane.center": straight((0, [0, 0, 0]), (9, [4, 2, 0]))}, renderer=FLAT),
    "planes": film_of(
        {**PANNING, "cut_planes.0.plane.center": straight((0, [0, 0, -0.5]), (9, [0, 0, 0.8]))},
        cut_planes=[{"cut": True, "plane": {"center": [0, 0, 0], "normal": [0, -1, 1]}}],
    ),
    "layout": film_of(
        {"layout.views.1.camera.position": straight((0, [3, 0, 0]), (9, [3, 18, 0]))},
        layout={"columns": 2, "views": [{}, {"camera": {"position": [3, 0, 0], "fov": 50}}]},
    ),
}

# What the others show in parts.
RARE = ("both", "noise", "lens", "mirror")


@pytest.mark.parametrize("kind", one_of(*reversed(KINDS)))
def test_passes_and_tiles_make_no_difference(kind: str, engine: Engine) -> None:
    """The bits are those of one piece, whether tiles, samples or pixels come one by one."""
    scene = clfractal.at_frame(KINDS[kind], 1)
    samples = 6 if kind != "noise" else None
    whole = engine.render(scene, samples=samples)
    *_, last = engine.refine(scene, samples=samples)
    same_pictures(whole, last)
    x, y, width, height = 37, 9, 13, 17
    part = engine.render(scene, samples=samples, region=(x, y, width, height))
    for name in part.channels:
        np.testing.assert_array_equal(part[name], whole[name][y : y + height, x : x + width], name)


@pytest.mark.parametrize("kind", [*(kind for kind in KINDS if kind not in RARE), *combinations(RARE)])
def test_every_kind_of_picture_is_blurred(kind: str, engine: Engine) -> None:
    """It is the mean of sharp pictures at times of the opening, up to noise, and none of these alone."""
    samples, times = {"lens": 4096, "layout": 1024}.get(kind, 64), 16
    scene = clfractal.at_frame(KINDS[kind], 1)
    sharp = {**KINDS[kind], "animation": {**KINDS[kind]["animation"], "shutter": 0}}
    stills = [
        engine.render(clfractal.at_frame(sharp, 1 + 0.5 * (step + 0.5) / times), samples=samples // times)[
            "R"
        ]
        for step in range(times)
    ]
    blurred, mean = engine.render(scene, samples=samples)["R"], np.mean(stills, axis=0)
    off, one = abs(blurred - mean).mean(), abs(stills[0] - mean).mean()
    assert one > 0
    assert off < 0.35 * one


def test_eyes_see_the_same_time(engine: Engine) -> None:
    """Both eyes' pixels are taken at the same times, or movement would have a depth: a pair without separation is equal."""
    scene = film_of(PANNING, stereo={**STEREO, "separation": 0})
    perspective = {**scene, "camera": {"position": [0, -3, 0], "fov": 50}}
    left, right = engine.render_pair(clfractal.at_frame(perspective, 1), samples=4)
    same_pictures(left, right)
    still = engine.render_pair(
        clfractal.at_frame({**perspective, "animation": {**scene["animation"], "shutter": 0}}, 1)
    )
    assert abs(left["R"] - still[0]["R"]).mean() > 0.01


# -- what goes along with a picture


def test_a_picture_holds_what_it_takes_to_make_it_again(tmp_path: Path, engine: Engine) -> None:
    film = engine.render(clfractal.at_frame(KINDS["both"], 4), samples=4)
    film.save(tmp_path / "frame.exr")
    found = load_scene(tmp_path / "frame.exr")
    assert found.animation is not None
    assert found.animation.frame == 4
    same_pictures(film, engine.render(found))
    assert load_scene(dump_scene(found)) == found


def test_a_scene_may_say_which_frame_its_still_shows(engine: Engine) -> None:
    film = film_of(PANNING, animation={"shutter": 0})
    still = load_scene(film, overrides=["animation.frame=4"])
    assert still.camera.position == (7, -3, 0)
    same_pictures(engine.render(still), engine.render(clfractal.at_frame(film, 4)))


def test_unfinished_work_of_another_movement_is_another_picture(engine: Engine) -> None:
    slower = {**PANNING, "camera.target": straight((0, [-1, 0, 0]), (9, [16, 0, 0]))}
    changes: dict[str, Callable[[], Scene]] = {
        "no shutter": lambda: clfractal.at_frame(film_of(PANNING, animation={"shutter": 0}), 0),
        "shutter": lambda: clfractal.at_frame(film_of(PANNING, animation={"shutter": 0.25}), 0),
        "track": lambda: clfractal.at_frame(film_of(slower), 0),
    }
    first, again = (engine.prepare(clfractal.at_frame(film_of(PANNING), 0)).identity(0) for _ in range(2))
    assert first == again
    for name, scene in changes.items():
        assert engine.prepare(scene()).identity(0) != first, name


# -- bad input


def test_degrees_of_a_turning_shutter() -> None:
    found = load_scene(film_of(PANNING, animation={"shutter": "180 deg"}))
    assert found.animation is not None
    assert found.animation.shutter == 0.5


def test_a_value_that_leaves_its_range_between_two_frames_is_told() -> None:
    """At each frame the ambient light is 0.1; between two it is negative."""
    track = {"material.ambient": {"expression": "0.1*cos(2*pi*frame)"}}
    load_scene(film_of(track, animation={"shutter": 0}))
    with pytest.raises(ClfractalError) as caught:
        load_scene(film_of(track))
    assert "material.ambient" in str(caught.value)
    assert "frame 0.5" in str(caught.value)


def test_a_volume_that_is_filled_for_each_sample_is_told(engine: Engine, tmp_path: Path) -> None:
    renderer = {"type": "volume", "resolution": 16, "samples": 4}
    growing = {"formula.parameters.power": straight((0, 6), (9, 9))}
    bulb = {"formula": {"name": "mandelbulb", "iterations": 4}, "renderer": renderer}
    film = engine.render(clfractal.at_frame(film_of(growing, **bulb), 2))
    assert any("motion blur fills 4 grids for each picture" in remark for remark in film.remarks)
    film = engine.render(clfractal.at_frame(film_of(PANNING, **bulb), 2))
    assert not any("motion blur" in remark for remark in film.remarks)


@settings(max_examples=25, deadline=None)
@given(shutter=st.floats(0.01, 1), frame=st.floats(0, 9))
def test_times_lie_in_the_film(shutter: float, frame: float) -> None:
    scene = clfractal.at_frame(film_of(PANNING, animation={"shutter": shutter}), frame)
    found = shutter_at(scene)
    assert 0 <= found.opens < found.closes <= 9
    assert found.closes - found.opens == pytest.approx(shutter, abs=1e-9)
    assert math.isclose(found.opens, frame) or found.closes == 9
