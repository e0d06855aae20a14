"""What lies at a pixel: by the ball, whose points, normals and depths are known, in every kind of picture."""

from __future__ import annotations

import json
import math
import pickle
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.engine.prepare import with_size
from clfractal.images.probe import CHANNELS, Probe
from tests.calls import failure
from tests.render.shots import BALL, BALL_RADIUS, engine_of
from tests.scenes import scene_of
from tests.shell import InProcess, works

CAMERA: dict[str, Any] = {"position": [0, -3, 0], "target": [0, 0, 0], "fov": 50}
SIZE = (96, 64)
FINE = {"type": "surface", "detail": 0.02}
STEREO = {"screen_width": 0.6, "screen_distance": 0.7}


SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 40, height: 36}
camera: {position: [0, -3, 0]}
"""


@pytest.fixture
def engine(device: Device) -> clfractal.Engine:
    return engine_of(device)


def ball(camera: dict[str, Any] | None = None, **sections: Any) -> clfractal.Scene:
    return scene_of(BALL, {**CAMERA, **(camera or {})}, SIZE, renderer=FINE, **sections)


def ray(x: float, y: float) -> Any:
    """Through a pixel's middle, 1 deep along the view axis."""
    half = math.tan(math.radians(25))
    return np.array([(x + 0.5 - 48) / 32 * half, 1.0, (32 - y - 0.5) / 32 * half])


def on_the_ball(found: Probe, x: int, y: int) -> None:
    """Where the ray through that pixel meets the sphere."""
    through = ray(x, y)
    a, b, c = through @ through, -3.0, 9 - BALL_RADIUS**2
    depth = (-b - math.sqrt(b * b - a * c)) / a
    point = np.array([0, -3, 0]) + depth * through
    assert found.hit
    assert found.depth == pytest.approx(depth, abs=2e-3)
    assert found.point == pytest.approx(tuple(point), abs=2e-3)
    assert found.normal == pytest.approx(tuple(point / np.linalg.norm(point)), abs=2e-3)
    assert found.distance == pytest.approx(depth * math.sqrt(a), abs=2e-3)
    assert found.steps > 0
    assert found.iterations is not None


@pytest.mark.parametrize("lens", [{}, {"f_number": 0.5, "focus_distance": 5}])
def test_a_point_of_the_ball(lens: dict[str, Any], engine: clfractal.Engine) -> None:
    """Through a lens, too: the ray goes through its middle."""
    for x, y in ((48, 32), (40, 21), (60, 40)):
        found = engine.probe(ball(lens), x, y)
        assert (found.x, found.y, found.view, found.eye) == (x, y, None, None)
        on_the_ball(found, x, y)


def test_beside_the_ball_is_nothing(engine: clfractal.Engine) -> None:
    found = engine.probe(ball(), 1, 1)
    assert (found.hit, found.point, found.depth, found.distance) == (False, None, None, None)
    assert json.loads(json.dumps(found.plain()))["normal"] is None


def test_films_tell_the_same(engine: clfractal.Engine) -> None:
    """From their channels, or by a ray; in a part of the picture, too, and after pickling."""
    scene = ball()
    expected = engine.probe(scene, 40, 21)
    whole = engine.render(scene, channels=CHANNELS)
    assert whole.probe(40, 21) == expected
    part = engine.render(scene, region=(30, 10, 20, 20))
    assert "N.X" not in part
    assert part.probe(40, 21) == expected
    sent = pickle.loads(pickle.dumps(part))
    assert sent.probe(40, 21) == expected
    assert sent.stats == part.stats != {}
    assert str(failure(clfractal.SceneError, part.probe, 50, 21)) == "x: must be from 30 to 49, got 50"
    with pytest.raises(clfractal.SceneError, match=r"^y: must be a whole number, got 2\.5$"):
        part.probe(40, 2.5)  # type: ignore[arg-type]
    assert part.probe(np.int64(40), np.int32(21)) == expected  # type: ignore[arg-type]
    with pytest.raises(clfractal.SceneError, match="only framebuffers that were rendered"):
        clfractal.Framebuffer().probe(0, 0)


def test_the_depth_makes_the_point_sharp(engine: clfractal.Engine) -> None:
    """A focus at that place of the picture has the number that the probe tells."""
    place = [40.5 / 96, 21.5 / 64]
    settled = engine.settled(ball({"f_number": 2, "focus_on": place}))
    depth = engine.probe(ball(), 40, 21).depth
    assert settled.camera.focus_distance == pytest.approx(depth, rel=1e-6)  # type: ignore[union-attr]


def test_views_of_a_layout(engine: clfractal.Engine) -> None:
    """Two views, side by side: the second sees the ball from the other side. Between them is nothing to ask."""
    behind = {**CAMERA, "position": [0, 3, 0]}
    scene = ball(layout={"views": [{}, {"camera": behind}], "gap": 4})
    left, right = engine.probe(scene, 22, 32), engine.probe(scene, 96 - 23, 32)
    assert (left.view, right.view) == (0, 1)
    assert left.point is not None
    assert right.point is not None
    assert left.point[1] < -0.9
    assert right.point[1] > 0.9
    with pytest.raises(clfractal.SceneError, match="between the views"):
        engine.probe(scene, 47, 32)


@pytest.mark.parametrize(
    ("mode", "pixel", "eye", "seen"),
    [
        ("split", (48, 32), "left", (48, 32)),
        ("split", (96 + 48, 32), "right", (48, 32)),
        ("over_under_half", (48, 48), "right", (48, 16)),
        ("rows", (48, 33), "right", (48, 33)),
        ("columns", (47, 33), "right", (47, 33)),
        ("checkerboard", (47, 33), "left", (47, 33)),
        ("anaglyph", (48, 32), "left", (48, 32)),
        ("pair", (48, 32), "left", (48, 32)),
        ("right", (48, 32), "right", (48, 32)),
    ],
)
def test_pictures_of_two_eyes(
    mode: str, pixel: tuple[int, int], eye: str, seen: tuple[int, int], engine: clfractal.Engine
) -> None:
    """Each pixel is one eye's; the point is on the ball, in the direction in which that eye's view shows the pixel."""
    job = engine.prepare(ball(stereo={**STEREO, "mode": mode}))
    found = engine.probe(job.scene, *pixel)
    assert (found.eye, found.view) == (eye, None)
    assert found.point is not None
    assert float(np.linalg.norm(found.point)) == pytest.approx(BALL_RADIUS, abs=3e-3)
    (view,) = [view for view, side in zip(job.views, job.sides, strict=True) if side == eye]
    camera = view.camera
    where = camera.points_at([seen[0] + 0.5], [seen[1] + 0.5], view.size, [found.depth or 0])[0]
    assert found.point == pytest.approx(tuple(where), abs=3e-3)
    assert found.distance == pytest.approx(float(np.linalg.norm(where - camera.origin)), abs=3e-3)


def test_films_of_two_eyes(engine: clfractal.Engine) -> None:
    left, right = engine.render_pair(ball(stereo=STEREO), channels=CHANNELS)
    assert left.probe(48, 32).eye == "left"
    assert right.probe(48, 32).eye == "right"
    assert left.probe(48, 32).point != right.probe(48, 32).point


def test_the_shell(clf: InProcess) -> None:
    ended = works(clf("probe", "scene.yaml", "48,32", "--size", "96x64", "--json"))
    told = json.loads(ended.out)
    assert told == clfractal.probe(
        with_size(clfractal.load_scene("scene.yaml"), (96, 64)), 48, 32
    ).plain() | {name: list(told[name]) for name in ("point", "normal")}
    text = clf("probe", "scene.yaml", "20,18").out.splitlines()
    assert text[0] == "pixel 20,18"
    assert [line.split()[0] for line in text[1:]] == [
        "point",
        "normal",
        "depth",
        "distance",
        "iterations",
        "steps",
    ]
    assert clf("probe", "scene.yaml", "0,0").out == "pixel 0,0: nothing is there\n"


@pytest.mark.parametrize(
    ("pixel", "message"),
    [
        ("40,0", "X,Y: must lie inside the picture of 40 x 36 pixels, got 40,0"),
        ("1", "X,Y: must be X,Y, such as 640,360; got '1'"),
        ("a,b", "X,Y: must be X,Y, such as 640,360; got 'a,b'"),
    ],
)
def test_pixels_that_are_not_there(pixel: str, message: str, clf: InProcess) -> None:
    assert clf("probe", "scene.yaml", pixel).is_one_line(2, message)
    layout = "layout={columns: 2, gap: 4, views: [{}, {}]}"
    between = "scene.yaml: the pixel 20,18 lies between the views of the layout"
    assert clf("probe", "scene.yaml", "20,18", "--set", layout).is_one_line(2, between)
