"""`camera.frame: seen`: how far what is seen reaches, against bodies whose corners and outlines are known."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal
from clfractal.camera import frame
from clfractal.camera.views import camera_view
from clfractal.errors import SceneError
from clfractal.formulas import reference
from clfractal.scene.bookmarks import view_of
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from clfractal.scene.parts import OrthographicCamera, PerspectiveCamera
from clfractal.scene.stance import Extent, axes, framing
from clfractal.schema.shape import Solid
from tests.elements.solids import check_away

SCENES = Path(__file__).resolve().parents[2] / "scenes"
Floats = npt.NDArray[np.float64]

BALL = {"type": "sphere", "radius": 0.7, "position": [0.3, -0.2, 0.5]}
# A set that is a ball: z stays where it is, and has escaped beyond the bailout.
UNIT = {
    "inline": {
        "title": "a ball",
        "variables": ["x", "y", "z"],
        "map": ["2*x", "2*y", "2*z"],
        "add": "none",
        "degree": 1,
        "bounds": {"radius": 3},
        "bailout": 16,
    },
    "iterations": 4,
}


def scene(camera: dict[str, Any], size: tuple[int, int] = (96, 54), **sections: Any) -> Scene:
    return load_scene(
        {
            "version": 1,
            "formula": "none",
            "image": {"width": size[0], "height": size[1]},
            **sections,
            "camera": {"frame": "seen", **camera},
        }
    )


def places(found: Scene, points: Floats) -> Floats:
    """Where points are in the picture: -1 to 1 from side to side, in front of the camera."""
    view = camera_view(found.camera, found.image.width, found.image.height)
    seen = np.column_stack([points, np.ones(len(points))]) @ view.world_to_ndc()
    assert (seen[:, 3] > 0).all()
    return np.asarray(2 * seen[:, :2] / seen[:, 3:] - 1)


def check_fills(found: Scene, points: Floats, error: float = 0.01) -> None:
    """All within 90 % of the picture, which they fill from side to side in one direction."""
    at = places(found, points)
    low, high = at.min(axis=0), at.max(axis=0)
    filled = int(np.argmax(high - low))
    assert low[filled] == pytest.approx(-0.9, abs=error)
    assert high[filled] == pytest.approx(0.9, abs=error)
    assert np.abs(at).max() < 0.9 + error


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("size", [(96, 54), (54, 96)])
def test_a_ball_fills_the_smaller_side(projection: str, size: tuple[int, int]) -> None:
    """As bounds of its size do."""
    camera = {"projection": projection, "position": [3, -1, 7], "roll": 20}
    found = scene(camera, size, objects={"ball": BALL}).camera
    extent = Extent((0.3, -0.2, 0.5), 0.7)
    fov = found.fov if isinstance(found, PerspectiveCamera) else None
    along = axes(found.position, found.target, found.up)
    position, target, height = framing(along, extent, size[0] / size[1], fov)
    np.testing.assert_allclose(found.target, target, atol=0.01)
    if isinstance(found, PerspectiveCamera):
        np.testing.assert_allclose(found.position, position, atol=0.01 * math.dist(position, target))
    else:
        assert found.height == pytest.approx(height, rel=0.01)


@pytest.mark.parametrize("seed", range(12))
def test_corners_of_a_box_fill_the_picture_from_any_side(seed: int) -> None:
    random = np.random.default_rng(seed)
    sides, middle = random.uniform(0.1, 2, 3), random.uniform(-1, 1, 3)
    box = {
        "type": "box",
        "size": sides.tolist(),
        "position": middle.tolist(),
        "rotation": random.uniform(0, 90, 3).tolist(),
    }
    camera = {"position": random.normal(size=3).tolist(), "fov": float(random.uniform(5, 100))}
    size = (int(random.integers(20, 100)), int(random.integers(20, 100)))
    found = scene(camera, size, objects={"box": box})
    it = found.objects["box"]
    assert isinstance(it, Solid)
    corners = it.position + np.array(list(product((-1, 1), repeat=3))) @ np.array(it.axes)
    check_fills(found, corners)
    away = np.subtract(found.camera.position, found.camera.target)
    np.testing.assert_allclose(
        away / np.linalg.norm(away), camera["position"] / np.linalg.norm(camera["position"]), atol=1e-9
    )


@pytest.mark.parametrize("seed", range(4))
def test_points_of_a_set_fill_the_picture_from_any_side(seed: int) -> None:
    random = np.random.default_rng(seed)
    formula = {"name": "quaternion_julia", "iterations": 9}
    found = scene({"position": random.normal(size=3).tolist()}, formula=formula)
    chain = found.chain
    points = random.uniform(-1.5, 1.5, (200_000, 3))
    inside = points[reference.escape(chain, points, 9)[1]]
    assert len(inside) > 1000
    # (Points that were drawn do not reach quite as far as the set.)
    check_fills(found, inside, 0.06)


def test_a_picture_is_filled() -> None:
    """Of a set that fills a third of its bounds."""
    found = load_scene(
        SCENES / "turned_chain.yaml",
        overrides=["camera.frame=seen", "image={width: 160, height: 90}", "objects={}"],
    )
    with clfractal.Engine() as engine:
        picture = engine.render(found, samples=1, channels=("A",))
    rows, columns = np.nonzero(picture["A"] > 0.5)
    filled = ((np.ptp(columns) + 1) / 160, (np.ptp(rows) + 1) / 90)
    assert max(filled) == pytest.approx(0.9, abs=0.02)


BALL_SET = {"formula": UNIT}


@pytest.mark.parametrize(
    ("sections", "reach"),
    [
        ({}, (-1, 1)),
        # What planes, bounds and other solids leave of it.
        ({"cut_planes": [{"plane": {"normal": [0, 0, 1]}, "cut": True}]}, (-1, 0)),
        ({"cut_planes": [{"plane": {"normal": [0, 0, 1]}, "cut": True, "set": False}]}, (-1, 1)),
        ({"renderer": {"bounds": {"center": [0, 0, 1], "radius": 0.5}}}, (0.5, 1)),
        ({"objects": {"lid": {"type": "plane", "position": [0, 0, 0.25], "join": "cut"}}}, (0.25, 1)),
        ({"objects": {"lid": {"type": "plane", "position": [0, 0, 0.25], "join": "intersection"}}}, (-1, 0.25)),
        ({"objects": {"more": {"type": "box", "position": [0, 0, 1.5], "join": "smooth_union"}}}, (-1, 2)),
        ({"objects": {"more": {"type": "cylinder", "position": [0, 0, 1.5]}}}, (-1, 2)),
        ({"objects": {"twin": {"type": "formula", "formula": UNIT, "position": [0, 0, 2], "scale": 0.5}}}, (-1, 2.5)),
        # A floor has no end, and hides what is below it.
        ({"objects": {"floor": {"type": "plane", "position": [0, 0, -1]}}}, (-1, 1)),
        ({"objects": {"floor": {"type": "plane", "position": [0, 0, -0.5]}}}, (-0.5, 1)),
        ({"objects": {"sea": {"type": "water", "position": [0, 0, -0.5]}}}, (-0.5, 1)),
        (
            {
                "objects": {"sea": {"type": "water", "position": [0, 0, -0.5], "material": "clear"}},
                "materials": {"clear": {"transmission": {"weight": 1}}},
            },
            (-1, 1),
        ),
    ],
)  # fmt: skip
def test_what_is_left_is_seen(sections: dict[str, Any], reach: tuple[float, float]) -> None:
    """From the side, by parallel rays: how far it reaches upwards."""
    camera = {"projection": "orthographic"}
    found = scene(camera, (90, 30), **{**BALL_SET, **sections}).camera
    middle, height = sum(reach) / 2, (reach[1] - reach[0]) / 0.9
    assert found.target[2] == pytest.approx(middle, abs=0.02)
    assert isinstance(found, OrthographicCamera)
    assert found.height == pytest.approx(height, abs=0.03)


def test_a_volume_is_seen_as_far_as_its_box() -> None:
    renderer = {"type": "volume", "box": {"center": [0, 0, 0], "size": [4, 4, 1]}}
    camera = {"projection": "orthographic"}
    found = scene(camera, (90, 30), formula=UNIT, renderer=renderer).camera
    assert isinstance(found, OrthographicCamera)
    assert found.height == pytest.approx(1 / 0.9, abs=0.03)


@pytest.mark.parametrize(
    ("kind", "half"), [("sphere", 30.0), ("cylinder", 30.0), ("cone", 30.0), ("torus", 30 * 1.3)]
)
def test_long_solids_are_seen_as_long_as_they_are(kind: str, half: float) -> None:
    """From above, thirty times as long as they are wide."""
    more = {"torus": {"radius": 1, "tube": 0.3}}.get(kind, {"radius": 1})
    objects = {"it": {"type": kind, "scale": [1, 30, 1], **more}}
    camera = {"projection": "orthographic"}
    found = scene({**camera, "orbit": {"elevation": 90}}, (30, 90), objects=objects).camera
    assert isinstance(found, OrthographicCamera)
    assert found.height == pytest.approx(2 * half / 0.9, rel=0.01)
    assert found.target[1] == pytest.approx(0, abs=0.01 * half)


def test_on_which_side_of_a_floor_one_is_the_framed_camera_says() -> None:
    """Angles alone say where it stands: above a floor that is above the origin, about which they turn before."""
    objects = {
        "floor": {"type": "plane", "position": [0, 0, 5]},
        "ball": {"type": "sphere", "radius": 0.5, "position": [0, 0, 8]},
    }
    orbit = {"azimuth": 20, "elevation": 20}
    found = load_scene(
        {"version": 1, "formula": "none", "camera": {"frame": "seen", "orbit": orbit}, "objects": objects}
    ).camera
    alone = load_scene(
        {
            "version": 1,
            "formula": "none",
            "camera": {"frame": "seen", "orbit": orbit},
            "objects": {"ball": objects["ball"]},
        }
    ).camera
    np.testing.assert_allclose(found.position, alone.position, atol=0.01)
    np.testing.assert_allclose(found.target, alone.target, atol=0.01)


@pytest.mark.parametrize("extra", [{}, {"renderer": {"type": "cut_plane"}}])
def test_where_nothing_is_seen_the_bounds_are(extra: dict[str, Any]) -> None:
    """Or where a picture shows no more of them than a plane."""
    gone: dict[str, Any] = (
        {"cut_planes": [{"plane": {"center": [0, 0, -2]}, "cut": True}]} if not extra else {}
    )
    seen, whole = (
        scene({"frame": word, "position": [1, 2, 3]}, formula=UNIT, **gone, **extra)
        for word in ("seen", "all")
    )
    np.testing.assert_allclose(seen.camera.position, whole.camera.position, atol=1e-12)
    np.testing.assert_allclose(seen.camera.target, whole.camera.target, atol=1e-12)


def test_views_bookmarks_and_films_see_too() -> None:
    found = scene(
        {},
        formula=UNIT,
        layout={"columns": 2, "views": [{"camera": {"frame": "seen"}}, {}]},
        bookmarks={"above": {"frame": "seen", "orbit": {"elevation": 30}}},
    )
    assert found.layout is not None
    own = found.layout.views[0].camera
    assert own is not None
    sphere = 1 / math.sin(math.atan(0.9 * math.tan(math.radians(22.5))))
    assert found.camera.angles[2] == pytest.approx(sphere, rel=0.01)
    assert own.angles[2] > found.camera.angles[2]
    assert view_of(found.bookmarks["above"])[0].angles[1:] == pytest.approx((30, sphere), rel=0.01)
    assert load_scene(dump_scene(found)) == found
    film = {"frames": 3, "fps": 1, "tracks": {"camera.orbit.azimuth": {"expression": "40*frame"}}}
    moving = scene({}, formula=UNIT, animation=film)
    for number in range(3):
        angles = clfractal.at_frame(moving, number).camera.angles
        assert angles == pytest.approx((40 * number, 0, sphere), abs=0.02)


def test_it_is_the_same_each_time_and_from_python() -> None:
    camera = {"position": [1, -2, 0.5]}
    first, second = (scene(camera, formula={"name": "mandelbox"}).camera for _ in range(2))
    assert first == second
    whole = scene({**camera, "frame": "all"}, formula={"name": "mandelbox"})
    assert frame(whole, "seen").camera.position == pytest.approx(first.position, rel=1e-9)
    with pytest.raises(SceneError, match=r"what: must be all or seen, got 'sen'"):
        frame(whole, "sen")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "values",
    [
        {"type": "box", "size": [1, 0.2, 0.6], "scale": [1, 2, 0.5]},
        {"type": "cylinder", "radius": 0.3, "height": 0.5, "scale": [1, 1.5, 1]},
    ],
)
def test_how_far_simple_solids_are_away(values: dict[str, Any]) -> None:
    turned = {**values, "rotation": [20, -35, 50], "position": [0.1, 0.2, -0.1]}
    (it,) = scene({}, objects={"it": turned}).objects.values()
    assert isinstance(it, Solid)
    points = np.random.default_rng(5).uniform(-1, 1, (9000, 3))
    held = np.array([it.holds(tuple(point)) for point in points.tolist()])
    assert held.sum() > 50
    assert ((it.away(points) < 0) == held).all()
    near = points[held]
    outside = points[~held][:400]
    # (From the nearest of those that were drawn inside, which are as near as a tenth.)
    far = np.linalg.norm(outside[:, None] - near, axis=-1).min(axis=1)
    check_away(it, outside, far - 0.1)
