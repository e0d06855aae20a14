"""A camera by angles, roll, moves and `frame`: the geometry by other means, as keys, from Python, and saved again."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clfractal import camera
from clfractal.camera.views import camera_view
from clfractal.engine.variations import variations
from clfractal.engine.varied import Kind
from clfractal.errors import FileError, SceneError
from clfractal.files.volume_file import Volume, write_volume
from clfractal.scene.bookmarks import view_of
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from clfractal.scene.stance import angles, orbited
from clfractal.viewer.saving import open_source, scene_text
from tests.scene.errors import cases

HEAD = "version: 1\nformula: {name: mandelbulb}\nimage: {width: 96, height: 54}\n"
numbers = st.floats(-5, 5, allow_nan=False)
vectors = st.tuples(numbers, numbers, numbers)
ups = vectors.filter(lambda v: np.linalg.norm(v) > 0.1 and v[2] > -0.999 * np.linalg.norm(v))


def scene(keys: str, *overrides: str) -> Scene:
    return load_scene(HEAD + "camera: {" + keys + "}\n", overrides=overrides)


@given(vectors, ups, st.floats(-179, 179), st.floats(-89, 89), st.floats(0.1, 100))
def test_angles_by_a_rotation_of_the_usual_space(
    target: tuple[float, float, float],
    up: tuple[float, float, float],
    azimuth: float,
    elevation: float,
    distance: float,
) -> None:
    """With z up the camera begins in front, at -y, is raised about x and turned about z; then z goes to `up`."""
    usual = Rotation.from_euler("z", azimuth, degrees=True) * Rotation.from_euler(
        "x", -elevation, degrees=True
    )
    pole = np.array(up) / np.linalg.norm(up)
    axis = np.cross([0, 0, 1], pole)
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, pole[2])
    tilt = Rotation.from_rotvec(axis / sine * angle if sine > 0 else np.zeros(3))
    expected = np.array(target) + distance * tilt.apply(usual.apply([0.0, -1.0, 0.0]))
    position, kept = orbited(target, up, azimuth, elevation, distance)
    np.testing.assert_allclose(position, expected, atol=1e-9 * distance + 1e-12)
    assert kept == up
    np.testing.assert_allclose(angles(position, target, up), (azimuth, elevation, distance), atol=1e-5)


def test_quarter_turns_are_exact_and_the_default_is_in_front() -> None:
    assert scene("").camera.angles == (0.0, 0.0, 3.0)
    places = {0: (0, -3, 0), 90: (3, 0, 0), 180: (0, 3, 0), -90: (-3, 0, 0), 450: (3, 0, 0)}
    for azimuth, place in places.items():
        assert scene(f"orbit: {{azimuth: {azimuth}}}").camera.position == place


def test_straight_above_the_picture_has_the_top_that_it_has_nearby() -> None:
    for azimuth in (0, 30, -120):
        for elevation in (90, -90):
            there = scene(f"orbit: {{azimuth: {azimuth}, elevation: {elevation}, distance: 2}}").camera
            near = scene(
                f"orbit: {{azimuth: {azimuth}, elevation: {elevation * 0.9999}, distance: 2}}"
            ).camera
            np.testing.assert_allclose(there.position, (0, 0, 2 * np.sign(elevation)), atol=1e-12)
            one, other = camera_view(there, 96, 54), camera_view(near, 96, 54)
            np.testing.assert_allclose(one.up, other.up, atol=1e-3)
            np.testing.assert_allclose(one.side, other.side, atol=1e-3)


@given(st.floats(-400, 400))
def test_roll_turns_the_picture_about_its_middle(roll: float) -> None:
    straight = camera_view(scene("position: [1, -2, 0.5]").camera, 96, 54)
    turned = camera_view(scene(f"position: [1, -2, 0.5], roll: {roll!r}").camera, 96, 54)
    about = Rotation.from_rotvec(np.radians(roll) * straight.axis)
    np.testing.assert_allclose(turned.up, about.apply(straight.up), atol=1e-9)
    np.testing.assert_allclose(turned.side, about.apply(straight.side), atol=1e-9)
    np.testing.assert_allclose(turned.axis, straight.axis, atol=1e-12)


def test_a_roll_to_the_right_lowers_what_is_on_the_right_least() -> None:
    """Clockwise from behind: the camera's top goes to its right, which is x from the front."""
    up = camera_view(scene("roll: 10").camera, 96, 54).up
    assert up[0] > 0.1
    assert up[2] > 0.9


@given(numbers, numbers, numbers)
def test_moves_go_along_the_camera_and_not_along_space(right: float, up: float, forward: float) -> None:
    keys = "position: [2, -1, 1], roll: 30"
    start, moved = scene(keys), scene(f"{keys}, shift: {{right: {right}, up: {up}, forward: {forward}}}")
    view = camera_view(start.camera, 96, 54)
    step = right * view.side + up * view.up + forward * view.axis
    np.testing.assert_allclose(moved.camera.position, view.origin + step, atol=1e-9)
    np.testing.assert_allclose(
        np.subtract(moved.camera.target, moved.camera.position), -np.array([2.0, -1.0, 1.0]), atol=1e-9
    )


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("size", [(96, 54), (54, 96)])
def test_frame_shows_the_bounds_in_nine_tenths_of_the_smaller_side(
    projection: str, size: tuple[int, int]
) -> None:
    text = (
        f"version: 1\nformula: {{name: mandelbulb}}\nimage: {{width: {size[0]}, height: {size[1]}}}\n"
        f"camera: {{projection: {projection}, frame: all, position: [3, -1, 7], roll: 20}}\n"
    )
    found = load_scene(text)
    center, radius = found.bounds
    view = camera_view(found.camera, *size)
    distance = np.linalg.norm(np.subtract(found.camera.position, center))
    # Where rays touch the ball, in the direction of the smaller side.
    cosine = radius / distance if view.eye is not None else 0.0
    side = view.side if size[0] < size[1] else view.up
    touched = np.array(center) + radius * (np.sqrt(1 - cosine**2) * side - cosine * view.axis)
    ndc = np.append(touched, 1.0) @ view.world_to_ndc()
    place = ndc[:2] / ndc[3]
    assert max(abs(place - 0.5)) == pytest.approx(0.45, rel=1e-9)
    assert found.camera.target == center
    direction = np.subtract(found.camera.target, found.camera.position) / distance
    np.testing.assert_allclose(direction, -np.array([3, -1, 7]) / np.sqrt(59), atol=1e-12)


BOX = {"center": [0.5, -0.25, 1.0], "size": [3.0, 1.0, 0.5]}


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("size", [(96, 54), (40, 90)])
def test_frame_shows_the_corners_of_a_volumes_own_box(projection: str, size: tuple[int, int]) -> None:
    """All eight within 90 % of the picture, and one at its rim. Zooms are shown where the box is."""
    plain = {
        "version": 1,
        "formula": {"name": "mandelbulb"},
        "image": {"width": size[0], "height": size[1]},
        "camera": {"projection": projection, "frame": "all", "position": [3, -1, 7], "roll": 20},
        "renderer": {"type": "volume", "box": BOX, "zoom": [{"center": [0.6, -0.3, 1.0], "scale": 9.0}]},
    }
    found = load_scene(plain)
    assert found.camera.target == (0.5, -0.25, 1.0)
    assert _reach(found, np.array([0.5, -0.25, 1.0]), np.array([3.0, 1.0, 0.5])) == pytest.approx(0.9)
    # Without a box of its own a volume shows the bounds.
    bare = load_scene({**plain, "renderer": {"type": "volume"}})
    assert bare.camera == load_scene({**plain, "renderer": {"type": "surface"}}).camera


def test_frame_shows_a_grid_of_a_file(tmp_path: Path) -> None:
    """Wherever the file says that it lies; the file is looked for beside the scene, also for copies."""
    place = np.array([10.0, 20.0, 30.0])
    write_volume(
        tmp_path / "scan.nrrd", Volume(np.ones((4, 3, 2), np.uint8), place, np.diag([1.0, 2.0, 3.0]))
    )
    plain = {
        "version": 1,
        "formula": {"name": "mandelbulb"},
        "image": {"width": 96, "height": 54},
        "camera": {"frame": "all", "position": [3, -1, 7]},
        "renderer": {"type": "volume", "file": "scan.nrrd"},
    }
    found = load_scene(plain, folder=tmp_path)
    sides = np.array([2.0, 6.0, 12.0])
    middle = place - np.array([0.5, 1.0, 1.5]) + sides / 2
    assert _reach(found, middle, sides) == pytest.approx(0.9)
    turned = camera.frame(camera.orbit(found, azimuth=100.0))
    assert _reach(turned, middle, sides) == pytest.approx(0.9)
    assert camera.frame(found).camera.position == pytest.approx(found.camera.position, rel=1e-12)
    with pytest.raises(FileError, match=r"renderer\.file: .*scan\.nrrd"):
        load_scene(plain, folder=tmp_path / "elsewhere")


def _reach(scene: Scene, middle: npt.NDArray[np.float64], sides: npt.NDArray[np.float64]) -> float:
    """How far from the picture's middle the farthest corner of a box is seen, as a part of half of a side."""
    view = camera_view(scene.camera, scene.image.width, scene.image.height)
    corners = middle + sides / 2 * np.array(list(product((-1, 1), repeat=3)))
    seen = np.column_stack([corners, np.ones(8)]) @ view.world_to_ndc()
    return float(np.abs(2 * seen[:, :2] / seen[:, 3:] - 1).max())


def test_a_scene_that_was_read_has_a_position_and_no_other_words() -> None:
    found = scene("orbit: {azimuth: 30, elevation: 20}, frame: all, roll: 5, shift: {right: 0.1}")
    for name in ("orbit", "frame", "roll", "shift"):
        assert getattr(found.camera, name) is None
        assert name not in found.resolved()["camera"]
        assert f"{name}:" not in dump_scene(found)
    assert load_scene(dump_scene(found)) == found
    assert found.camera.model_fields_set >= {"position", "target", "up"}
    # All of them have had their effect, in this order.
    plain = scene("orbit: {azimuth: 30, elevation: 20}")
    after = camera.shift(camera.roll(camera.frame(plain), 5), right=0.1)
    np.testing.assert_allclose(found.camera.position, after.camera.position, atol=1e-12)
    np.testing.assert_allclose(found.camera.up, after.camera.up, atol=1e-12)


def test_options_move_a_camera_that_has_a_position() -> None:
    found = scene("position: [0, -2, 2]", "camera.orbit.azimuth=90").camera
    np.testing.assert_allclose(found.position, (2, 0, 2), atol=1e-12)


def test_views_and_bookmarks_have_their_own_frames() -> None:
    text = HEAD + (
        "camera: {frame: all}\n"
        "layout: {columns: 2, views: [{camera: {frame: all}}, {}]}\n"
        "bookmarks: {all: {frame: all, orbit: {elevation: 30}}}\n"
    )
    found = load_scene(text)
    assert found.layout is not None
    own = found.layout.views[0].camera
    assert own is not None
    # Half of the picture is higher than wide, so its camera stands farther away.
    assert found.camera.angles[2] < own.angles[2]
    assert found.views[0][0].camera == own
    assert view_of(found.bookmarks["all"])[0].angles[1:] == pytest.approx((30, found.camera.angles[2]))
    assert load_scene(dump_scene(found)) == found


@pytest.mark.parametrize(
    ("keys", "message"),
    cases(
        """
frame: all, orbit: {distance: 3} => camera.orbit.distance: is chosen by camera.frame; remove one of them
orbit: {elevation: 91} => camera.orbit.elevation: must be at most 90, got 91
orbit: {azimut: 9} => camera.orbit: unknown key 'azimut'; did you mean 'azimuth'?
frame: some => camera.frame: must be all or seen, got 'some'
roll: x => camera.roll: must be a number, got 'x'
position: [0, 1000000, 0], shift: {forward: -9} => camera.shift: must leave the camera's coordinates below 1,000,000
target: [1000000, 0, 0], orbit: {azimuth: 90, elevation: 0, distance: 1}
=> camera.orbit.distance: must leave the camera's coordinates below 1,000,000
position: [0, 0, 0], orbit: {distance: 3} => camera.target: must differ from camera.position
"""
    ),
)
def test_mistakes(keys: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene(keys)
    assert str(caught.value).endswith(message)
    assert str(caught.value).startswith("scene:4:")


def test_an_orbit_that_says_all_needs_no_position() -> None:
    assert scene("position: [0, 0, 0], orbit: {azimuth: 0, elevation: 0, distance: 2}").camera.position == (
        0,
        -2,
        0,
    )


def test_from_python() -> None:
    start = scene("position: [0, -2, 2]")
    assert camera.angles(start) == pytest.approx((0, 45, 8**0.5))
    above = camera.turn(start, elevation=60)
    assert above.camera.position == pytest.approx((0, 0, 8**0.5))
    turned = camera.turn(start, azimuth=30, elevation=-15)
    assert camera.angles(turned) == pytest.approx((30, 30, 8**0.5))
    assert camera.orbit(turned, azimuth=0, elevation=45).camera.position == pytest.approx((0, -2, 2))
    assert start.camera.position == (0, -2, 2)
    with pytest.raises(SceneError, match=r"^camera\.orbit\.elevation: must be at most 90, got 95$"):
        camera.orbit(start, elevation=95)
    with pytest.raises(SceneError, match=r"^camera\.roll: must be a finite number, got \.?nan$"):
        camera.roll(start, float("nan"))


def test_variations_of_a_camera_by_angles() -> None:
    start = scene("orbit: {azimuth: 30, elevation: 20}")
    kinds: tuple[Kind, ...] = ("camera",)
    for variation in variations(start, count=3, kinds=kinds):
        assert load_scene(dump_scene(variation.scene)) == variation.scene
        assert variation.scene.camera.position != start.camera.position


WRITTEN = """\
# mine
version: 1
formula: {name: mandelbulb}
camera:
  orbit: {azimuth: 30, elevation: 20}  # from the right
  roll: 5
  fov: 40
image: {width: 64, height: 36}
bookmarks:
  near: {frame: all}  # all of it
"""


def test_saving_keeps_the_words_until_the_camera_moves(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(WRITTEN)
    source = open_source(file)
    before = source.loaded
    assert before is not None
    assert scene_text(source, before) == WRITTEN
    wide = before.model_copy(update={"camera": before.camera.model_copy(update={"fov": 60.0})})
    assert scene_text(source, wide) == WRITTEN.replace("fov: 40", "fov: 60")
    moved = before.model_copy(update={"camera": before.camera.model_copy(update={"position": (0, -2, 0)})})
    text = scene_text(source, moved)
    assert "orbit" not in text
    assert "roll" not in text
    assert "near: {frame: all}  # all of it" in text
    assert load_scene(text) == moved
    # What `frame` does follows from the size of the picture, too.
    high = before.model_copy(update={"image": {"width": 36, "height": 64}})
    text = scene_text(source, high)
    assert "orbit: {azimuth: 30, elevation: 20}  # from the right" in text
    assert "frame" not in text
    assert load_scene(text) == high
