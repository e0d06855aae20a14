"""The films among the scenes move evenly: no jumps, no seam, no camera inside the set. Almost nothing is rendered for it.

What moves is compared as the eye sees it: scales and distances by their logarithms, a camera's way by its distance from
the target.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import clfractal
from clfractal.api import load_scene
from clfractal.formulas import reference
from clfractal.scene.animation import Animation
from clfractal.scene.checks import inside_solid
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from clfractal.scene.volume import VolumeRenderer
from tests.makers import maker, pictured
from tests.pictures import scene_paths
from tests.variants import every

FILMS = [path for path in scene_paths() if load_scene(path).animation is not None]
each_film = pytest.mark.parametrize("path", FILMS, ids=lambda path: path.stem, scope="module")

# The change of a step from one frame to the next, as a part of the largest step. A value that goes there and back as a
# sine, once in 100 frames, has 0.06; one that begins to move at once has 1.
UNEVEN = 0.15
# Parts of a film's whole way that a value may go in one frame.
STEP = 0.06
# Of the distance between camera and target: how far a camera goes in one frame, and how near it comes to walls.
CAMERA_STEP, CLEARANCE = 0.12, 0.05
SMALL = (64, 36)

Floats = npt.NDArray[np.float64]


def animation_of(scene: Scene) -> Animation:
    assert scene.animation is not None
    return scene.animation


def ways(scene: Scene, frames: npt.ArrayLike) -> Mapping[str, Floats]:
    """For each track its values at these frames, (frames, numbers); those that go by factors as logarithms."""
    found = {}
    for mover in movement_of(scene).movers:
        values = np.array([mover.at(float(frame)) for frame in np.asarray(frames)])
        found[mover.name] = np.log(values) if mover.target.kind == "scale" else values
    return found


def steps_of(values: Floats) -> Floats:
    """How long the steps between neighbours are."""
    lengths: Floats = np.linalg.norm(np.diff(values, axis=0), axis=1)
    return lengths


@each_film
def test_it_lasts_some_seconds(path: Path) -> None:
    film = animation_of(load_scene(path))
    assert 24 <= film.fps <= 30
    assert 3 <= film.count / film.fps <= 8


@each_film
def test_nothing_jumps(path: Path) -> None:
    """Nor at the seam of a film that begins again: there the frames go on beyond its end."""
    scene = load_scene(path)
    film = animation_of(scene)
    frames = np.arange(film.count + 2 if film.loop else film.count)
    for name, values in ways(scene, frames).items():
        if name.endswith(("camera.position", "camera.target")) and not film.loop:
            continue  # whose steps become small near the target: see below
        turns = np.linalg.norm(np.diff(values, n=2, axis=0), axis=1)
        assert turns.max() <= UNEVEN * steps_of(values).max(), name
        assert steps_of(values).max() <= STEP * steps_of(values).sum(), name


@each_film
def test_the_camera_goes_by_small_parts_of_what_it_sees(path: Path) -> None:
    scene = load_scene(path)
    film = animation_of(scene)
    cameras = [clfractal.at_frame(scene, frame).camera for frame in range(film.count)]
    places, targets = (np.array([getattr(each, key) for each in cameras]) for key in ("position", "target"))
    distances = np.linalg.norm(places - targets, axis=1)
    for moving in (places, targets):
        parts = np.diff(moving, axis=0) / distances[:-1, None]
        assert np.linalg.norm(parts, axis=1).max() < CAMERA_STEP
        assert np.linalg.norm(np.diff(parts, axis=0), axis=1).max() < CAMERA_STEP * UNEVEN


@each_film
def test_the_camera_is_never_inside(path: Path) -> None:
    """Not between two frames either."""
    scene = load_scene(path)
    film = animation_of(scene)
    for frame in np.arange(0, film.count - 0.5, 1.5):
        still = clfractal.at_frame(scene, float(frame))
        place = np.array(still.camera.position)
        renderer = still.renderer
        if isinstance(renderer, VolumeRenderer) and renderer.zoom:
            assert renderer.box is not None
            place = (
                np.array(renderer.zoom[-1].center) + (place - renderer.box.center) / renderer.magnification
            )
            assert not inside_solid(still, [tuple(place)])[0]
            continue
        assert not inside_solid(still, [tuple(place)])[0], frame
        clearance = reference.distance(still.chain, place[None], still.formula.iterations)[0][0]
        assert clearance > CLEARANCE * np.linalg.norm(place - still.camera.target), frame


def stays(scene: Scene, points: Floats) -> npt.NDArray[np.bool_]:
    """Which points the bailout lets be a part of the set."""
    return reference.escape(scene.chain, points, scene.formula.iterations)[1]


LOOPS = [path for path in FILMS if animation_of(load_scene(path)).loop]


@pytest.mark.parametrize("path", LOOPS, ids=lambda path: path.stem)
def test_the_last_frame_leads_into_the_first(path: Path) -> None:
    """What does not come back to its first value has gone on by a period of space, and all of it by the same."""
    scene = load_scene(path)
    count = animation_of(scene).count
    shifts = []
    for name, values in ways(scene, [0, 1, count, count + 1]).items():
        before, after = values[:2], values[2:]
        if np.allclose(before, after, atol=1e-9):
            continue
        np.testing.assert_allclose(
            after - before, np.broadcast_to(after[0] - before[0], before.shape), atol=1e-9
        )
        assert name.startswith(("camera.", "lights.", "renderer.bounds.center"))
        shifts.append(after[0] - before[0])
    if not shifts:
        return
    assert np.allclose([np.linalg.norm(shift) for shift in shifts], np.linalg.norm(shifts[0]))
    whole = next(shift for shift in shifts if len(shift) == 3)
    center, radius = clfractal.at_frame(scene, 0).bounds
    points = np.array(center) + radius / 3**0.5 * np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    iterations = scene.formula.iterations
    for judge in (lambda at: reference.distance(scene.chain, at, iterations)[0], lambda at: stays(scene, at)):
        np.testing.assert_allclose(judge(points), judge(points + whole), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("path", every(3, FILMS), ids=lambda path: path.stem, scope="module")
def test_its_frames_show_something(path: Path) -> None:
    """At its beginning, on its way and at its end, not only where the still of the scene is."""
    small = [f"image.width={SMALL[0]}", f"image.height={SMALL[1]}"]
    scene = load_scene(path)
    if isinstance(scene.renderer, VolumeRenderer):
        small.append("renderer.resolution=64")
    count = animation_of(scene).count
    numbers = [0, count // 3, 2 * count // 3, count - 1]
    found = clfractal.frames(load_scene(path, overrides=small), numbers=numbers, samples=1)
    for number, film in found:
        seen = film["A"] > 0
        assert seen.mean() > 0.06, number
        brightness = film.to_rgb8(scene.output.stops).max(axis=-1)
        assert np.median(brightness[seen]) > 30, number
        assert brightness.std() > 10, number


@pictured
@each_film
def test_its_small_film_is_shown(path: Path) -> None:
    from PIL import Image

    films = maker("make_films")
    scene = load_scene(path)
    film, file = animation_of(scene), films.film_of(path.stem)
    page = (films.DOCS / "films.md").read_text("utf-8")
    assert f"](pictures/{file.name})" in page
    assert f"](../scenes/{path.name})" in page
    assert file.stat().st_size <= films.LARGEST_FILE <= 1_500_000
    with Image.open(file) as shown:
        width, height = films.SIZE if scene.stereo is None else (2 * films.EYE_SIZE[0], films.EYE_SIZE[1])
        widths = [films.width_of(width, part) for part in films.REDUCED]
        assert shown.size in [(each, round(height * each / width)) for each in widths]
        assert shown.info["loop"] == 0
        count = shown.n_frames  # type: ignore[attr-defined]
        # (Frames that do not differ are one, which is shown longer.)
        assert 0.8 * film.count / films.STEP <= count <= len(range(0, film.count, films.STEP))
        lasts = 0
        for number in range(count):
            shown.seek(number)
            shown.load()
            lasts += shown.info["duration"]
    assert lasts == pytest.approx(1000 * film.count / film.fps, abs=2)


@each_film
def test_its_page_shows_lines_of_the_scene(path: Path) -> None:
    page = (maker("make_films").DOCS / "films.md").read_text("utf-8")
    (part,) = [part for part in page.split("\n## ") if f"](../scenes/{path.name})" in part]
    (shown,) = re.findall(r"```text\n(.*?)```", part, re.DOTALL)
    lines = {line.strip() for line in path.read_text("utf-8").splitlines()}
    assert {line.strip() for line in shown.splitlines()} <= lines


def test_there_are_eight() -> None:
    assert {path.stem for path in FILMS} >= {
        f"film_{name}" for name in ("dive", "morph", "light", "cut", "zoom", "stereo", "julia", "loop")
    }
