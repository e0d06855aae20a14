"""The geometry of stereo against the thesis's section 3.3.1, done step by step with NumPy, and against plain trigonometry.

Every array of points has shape (n, 3), scene units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given as given_any
from hypothesis import settings as limits
from hypothesis import strategies as st

from clfractal.camera.views import View, camera_view, eye_view, middle_view, scene_view, seen_by, shown_views
from clfractal.errors import SceneError
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera
from clfractal.scene.stereo import Eye, EyeName, Stereo
from clfractal.stereo.eyes import NEAREST, attitude, degrees, eye_views, frustum, parallax, relation
from tests.render.shots import BALL, ORTHOGRAPHIC
from tests.scenes import scene_of

Floats = npt.NDArray[np.float64]

SIDES: tuple[EyeName, EyeName] = ("left", "right")

CAMERA: dict[str, Any] = {
    "position": [1.0, -4.0, 2.0],
    "target": [0.2, 0.1, -0.3],
    "up": [0.1, 0.0, 1.0],
    "fov": 50.0,
}


def dot(a: Floats, b: Floats) -> float:
    return float((a * b).sum())


def unit(vector: Any) -> Floats:
    return np.asarray(np.array(vector, float) / np.linalg.norm(vector))


# Neither of length 1 nor perpendicular.
PLANE: dict[str, Any] = {
    "center": [0.3, -0.1, 0.2],
    "normal": [0.5, -2, 1],
    "up": [0.3, 0.1, 2],
    "width": 3.0,
}


Views = dict[EyeName, View]
coordinate = st.floats(-8, 8)
vector = st.tuples(coordinate, coordinate, coordinate)


def given(*strategies: st.SearchStrategy[Any]) -> Callable[[Any], Any]:
    """As hypothesis's own; there are many of these, and each is about smooth functions."""
    return lambda test: limits(max_examples=25)(given_any(*strategies)(test))


@dataclass
class Setting:
    """A camera, a viewer and the size of a picture."""

    camera: dict[str, Any]
    stereo: dict[str, Any]
    size: tuple[int, int]

    def section(self, **changes: Any) -> Stereo:
        return Stereo.model_validate({**self.stereo, **changes})

    def views(self, **changes: Any) -> Views:
        stereo = self.section(**changes)
        middle = middle_view(stereo, PerspectiveCamera.model_validate(self.camera), *self.size)
        return {name: eye_view(middle, stereo, Eye(name)) for name in ("left", "right", "middle")}


def apart(camera: dict[str, Any]) -> bool:
    """Whether the camera looks somewhere, and not along its `up`."""
    toward = np.subtract(camera["target"], camera["position"])
    distance = float(np.linalg.norm(toward))
    return distance > 0.1 and float(np.linalg.norm(np.cross(toward / distance, unit(camera["up"])))) > 0.1


cameras = st.fixed_dictionaries(
    {
        "position": vector,
        "target": vector,
        "up": vector.filter(lambda v: sum(x * x for x in v) > 1),
        "fov": st.floats(5, 150),
    }
).filter(apart)
viewers = st.fixed_dictionaries(
    {
        "screen_width": st.floats(0.05, 20),
        "screen_distance": st.floats(0.1, 30),
        "interpupillary_distance": st.floats(0.01, 0.2),
    }
)
settings = st.builds(Setting, cameras, viewers, st.tuples(st.integers(1, 4000), st.integers(1, 4000)))
seeds = st.integers(0, 2**32 - 1)
DESK = Setting(
    CAMERA, {"screen_width": 0.52, "screen_distance": 0.6, "interpupillary_distance": 0.063}, (96, 54)
)


def points_before(view: View, seed: int, count: int = 50) -> Floats:
    """Points that an eye sees in and around its picture, from a tenth of the plane's distance to ten times that."""
    chance = np.random.default_rng(seed)
    assert view.eye is not None
    across, rise = chance.uniform(-0.7, 0.7, (2, count))
    on_plane = view.center + np.outer(across * view.width, view.side) + np.outer(rise * view.height, view.up)
    return np.asarray(view.eye + (on_plane - view.eye) * 10.0 ** chance.uniform(-1, 1, (count, 1)))


def ten_steps(setting: Setting, side: str, front: float, back: float) -> dict[str, Any]:
    """The thesis's 3.3.1 by hand: from camera and screen to one eye's frustum."""
    camera, stereo = setting.camera, setting.stereo
    position, target = np.array(camera["position"]), np.array(camera["target"])
    aspect = setting.size[0] / setting.size[1]
    # 1, 2: the view plane through the target, facing the camera, as large as that sees there.
    distance = np.linalg.norm(position - target)
    normal = (position - target) / distance
    plane_width = 2 * distance * np.tan(np.radians(camera["fov"]) / 2) * aspect
    plane_height = plane_width / aspect
    across = unit(np.cross(camera["up"], normal))
    up = np.cross(normal, across)
    # 3: how large the scene is on the real screen.
    scale = plane_width / stereo["screen_width"]
    # 4 to 6: the cyclopean eye and the two beside it.
    cyclopean = target + normal * scale * stereo["screen_distance"]
    half = across * scale * stereo["interpupillary_distance"] / 2
    eye = cyclopean - half if side == "left" else cyclopean + half
    # 7: the eye's distance from the plane; 8, 9: how near and far it sees.
    eye_distance = dot(eye - target, normal)
    near = max(eye_distance - front, NEAREST * eye_distance)
    far = eye_distance + back
    # 10: the plane's edges, seen from the foot of the perpendicular, scaled to the near plane.
    foot = eye - normal * eye_distance
    shift = np.array([dot(target - foot, across), dot(target - foot, up)])
    low, high = (
        (shift + sign * np.array([plane_width, plane_height]) / 2) * near / eye_distance for sign in (-1, 1)
    )
    return {
        "relation": scale,
        "eye": eye,
        "frame": np.stack([across, up, normal]),
        "planes": (low[0], high[0], low[1], high[1], near, far),
    }


def gl_frustum(l: float, r: float, b: float, t: float, n: float, f: float) -> Floats:  # noqa: E741
    """glFrustum's matrix as its reference page prints it."""
    return np.array(
        [
            [2 * n / (r - l), 0, (r + l) / (r - l), 0],
            [0, 2 * n / (t - b), (t + b) / (t - b), 0],
            [0, 0, -(f + n) / (f - n), -2 * f * n / (f - n)],
            [0, 0, -1, 0],
        ]
    )


def homogeneous(points: Floats) -> Floats:
    return np.concatenate([points, np.ones((len(points), 1))], axis=-1)


class TestOffAxis:
    @given(settings, st.sampled_from(SIDES), st.floats(0, 100), st.floats(0.01, 100))
    def test_the_ten_steps(self, setting: Setting, side: EyeName, front: float, back: float) -> None:
        expected = ten_steps(setting, side, front, back)
        views = setting.views()
        size = float(np.linalg.norm(expected["eye"])) + views["middle"].width
        np.testing.assert_allclose(views[side].origin, expected["eye"], atol=1e-11 * size)
        assert relation(setting.section(), views["middle"]) == pytest.approx(expected["relation"])
        frame = np.stack([views[side].side, views[side].up, -views[side].axis])
        np.testing.assert_allclose(frame, expected["frame"], atol=1e-11)
        found = frustum(views[side], front=front, back=back)
        planes = (found.left, found.right, found.bottom, found.top, found.near, found.far)
        np.testing.assert_allclose(planes, expected["planes"], rtol=1e-8, atol=1e-10 * size)
        np.testing.assert_allclose(found.matrix(), gl_frustum(*planes), rtol=1e-12)

    @given(settings, st.sampled_from(SIDES), seeds)
    def test_opengl_shows_a_point_where_the_picture_does(
        self, setting: Setting, side: EyeName, seed: int
    ) -> None:
        """Eq. 11 and glFrustum lead to the normalized device coordinates that picture files tell (whose y goes down)."""
        view = setting.views()[side]
        points = points_before(view, seed)
        lens = frustum(view, front=1e9, back=1e9)
        clip = homogeneous(points) @ (lens.matrix() @ attitude(view)).T
        from_gl = clip[:, :2] / clip[:, 3:]
        told = homogeneous(points) @ view.world_to_ndc()
        from_file = told[:, :2] / told[:, 3:]
        np.testing.assert_allclose((1 + from_gl * [1, -1]) / 2, from_file, atol=1e-7)
        assert (clip[:, 3] > 0).all()

    def test_eyes_that_see_nothing_of_the_plane(self) -> None:
        view = DESK.views()["left"]
        distance = dot(view.center - view.origin, view.axis)
        for beyond in (0.0, distance):
            place = view.center + beyond * view.axis
            behind = View(view.center, view.side, view.up, view.axis, view.width, view.height, place, place)
            for function in (lambda v: frustum(v, front=1, back=1), attitude):
                with pytest.raises(
                    SceneError, match="the eye must be in front of the view plane, got a distance"
                ):
                    function(behind)
        with pytest.raises(SceneError, match=r"camera\.projection: stereo needs an eye"):
            frustum(camera_view(scene_of(BALL, ORTHOGRAPHIC).camera, 8, 8), front=1, back=1)
        with pytest.raises(SceneError, match="back: must leave some space between near"):
            frustum(view, front=0, back=-1)


class TestParallax:
    @given(settings, seeds, st.sampled_from(["off_axis", "parallel"]), st.floats(0, 3))
    def test_it_is_what_similar_triangles_say(
        self, setting: Setting, seed: int, convergence: str, separation: float
    ) -> None:
        """e (1 - d / z) for a point at depth z and a plane at d: none on the plane, e at infinity; e less for eyes that
        look straight on. None is vertical: both eyes' pictures show a point in one row."""
        changes = {"convergence": convergence, "separation": separation}
        views, stereo = setting.views(**changes), setting.section(**changes)
        middle = views["middle"]
        points = points_before(middle, seed)
        depth = (points - middle.origin) @ middle.axis
        distance = dot(middle.center - middle.origin, middle.axis)
        across = (
            stereo.interpupillary_distance * separation * ((convergence == "off_axis") - distance / depth)
        )
        expected = np.stack([across, 0 * across], axis=-1)
        np.testing.assert_allclose(
            parallax(stereo, views, points), expected, atol=1e-8 * max(stereo.screen_width, 1)
        )
        told = [homogeneous(points) @ views[name].world_to_ndc() for name in SIDES]
        rows = [each[:, 1] / each[:, 3] for each in told]
        np.testing.assert_allclose(rows[0], rows[1], atol=1e-8)

    @given(settings, seeds)
    def test_parallax_of_eyes_that_toe_in(self, setting: Setting, seed: int) -> None:
        """Two pinholes that look at the middle of the plane, each with a picture as wide as the middle one's angle."""
        stereo, views = setting.section(convergence="toe_in"), setting.views(convergence="toe_in")
        middle = views["middle"]
        assert middle.eye is not None
        points = points_before(middle, seed)
        distance = np.linalg.norm(middle.center - middle.eye)
        scale = distance / stereo.screen_distance
        found = {}
        for name, way in zip(SIDES, (-1, 1), strict=True):
            eye = middle.eye + way * scale * stereo.interpupillary_distance / 2 * middle.side
            forward = unit(middle.center - eye)
            right = np.cross(forward, middle.up)
            offset = points - eye
            tangents = np.stack([offset @ right, offset @ middle.up], axis=-1) / (offset @ forward)[:, None]
            found[name] = tangents * stereo.screen_distance
            assert views[name].focus_distance == pytest.approx(np.linalg.norm(middle.center - eye))
        np.testing.assert_allclose(
            parallax(stereo, views, points), found["right"] - found["left"], rtol=1e-7, atol=1e-9
        )

    @given(settings, st.floats(-5, 5))
    def test_degrees_by_the_angle_between_two_lines(self, setting: Setting, part: float) -> None:
        """The eyes' lines of sight through their places on the screen, the difference to those that meet on it."""
        stereo = setting.section()
        eyes, distance = stereo.interpupillary_distance, stereo.screen_distance
        across = part * eyes

        def turned(shift: float) -> float:
            """The angle that the lines of sight come together by; below 0 if they go apart."""
            left, right = (
                np.arctan2(sign * (shift - eyes) / 2, distance) for sign in (-1, 1)
            )  # of each eye, inwards positive
            return float(np.degrees(left - right))

        assert degrees(stereo, across) == pytest.approx(turned(0.0) - turned(across), abs=1e-9)


class TestScenes:
    @pytest.mark.parametrize(("size", "own"), [((64, 48), 1.2), ((48, 64), 5.0), ((64, 48), None)])
    def test_a_plane_of_its_own(self, size: tuple[int, int], own: float | None) -> None:
        """Its corners are the picture's, whatever its proportions, for both eyes; without a height pixels are square."""
        plane, height = {**PLANE, **({"height": own} if own else {})}, own or 3.0 * 48 / 64
        scene = scene_of(BALL, CAMERA, size, stereo={"plane": plane})
        normal = unit(plane["normal"])
        across = unit(np.cross(plane["up"], normal))
        up = np.cross(normal, across)
        views = eye_views(scene)
        distance = 0.6 * 3.0 / 0.52
        np.testing.assert_allclose(views["middle"].origin, np.array(plane["center"]) + distance * normal)
        for name, offset in zip(SIDES, (-1, 1), strict=True):
            view = views[name]
            expected = views["middle"].origin + offset * across * 0.063 / 2 * 3.0 / 0.52
            np.testing.assert_allclose(view.origin, expected)
            for x, y in ((-1, 1), (1, 1), (-1, -1), (1, -1)):
                corner = np.array(plane["center"]) + x * 1.5 * across + y * height / 2 * up
                told = np.append(corner, 1) @ view.world_to_ndc()
                np.testing.assert_allclose(told[:2] / told[3], [(1 + x) / 2, (1 - y) / 2], atol=1e-12)

    def test_the_camera_moves_to_where_the_viewer_is(self) -> None:
        """Nothing of a mono scene's camera stays but the direction and what it sees at its target."""
        scene = scene_of(BALL, CAMERA, (96, 54), stereo={})
        mono, middle = camera_view(scene.camera, 96, 54), scene_view(scene)
        for name in ("center", "side", "up", "axis"):
            np.testing.assert_array_equal(getattr(mono, name), getattr(middle, name))
        assert (mono.width, mono.height) == (middle.width, middle.height)
        distance = dot(middle.center - middle.origin, middle.axis)
        assert distance / middle.width == pytest.approx(0.6 / 0.52)

    @pytest.mark.parametrize("layout", [None, {"views": [{}, {}]}], ids=["alone", "in a layout"])
    @pytest.mark.parametrize("mode", ["split_half", "over_under_half"])
    def test_squeezed_eyes_see_the_whole_screen(self, mode: str, layout: dict[str, Any] | None) -> None:
        squeezed, whole = (
            scene_of(BALL, CAMERA, (96, 54), stereo={"mode": each}, layout=layout) for each in (mode, "split")
        )
        for name in SIDES:
            same_view(view_of(squeezed, name, -1), view_of(whole, name, -1))

    def test_a_view_of_a_layout_takes_up_a_part_of_the_screen(self) -> None:
        """Half of the screen's pixels are half of its width: the viewer sits twice as many of its widths before it."""
        stereo = {"screen_width": 0.5, "mode": "split"}
        views: list[dict[str, Any]] = [{}, {"camera": {**CAMERA, "fov": 20}}]
        scene = scene_of(BALL, CAMERA, (96, 54), stereo=stereo, layout={"views": views})
        for number, fov in ((0, 50), (1, 20)):
            alone = scene_of(BALL, {**CAMERA, "fov": fov}, (48, 54), stereo={**stereo, "screen_width": 0.25})
            for name in SIDES:
                same_view(view_of(scene, name, number), scene_view(*seen_by(alone, name)))

    def test_the_lens_stays_sharp_where_it_was_told_to_be(self) -> None:
        """On the screen, unless the camera says how far from the eye."""
        lens = {**CAMERA, "f_number": 2.0}
        scene = scene_of(BALL, lens, (96, 54), stereo={})
        for name in SIDES:
            view = scene_view(*seen_by(scene, name))
            assert view.focus_distance == pytest.approx(dot(view.center - view.origin, view.axis))
            assert view.lens_radius == camera_view(scene.camera, 96, 54).lens_radius != 0
        told = scene_of(BALL, {**lens, "focus_distance": 1.5}, (96, 54), stereo={})
        assert scene_view(*seen_by(told, "left")).focus_distance == 1.5


def view_of(scene: Scene, name: EyeName, number: int) -> View:
    """What an eye sees of one view of a layout."""
    shown, eye, _ = shown_views(*seen_by(scene, name))[number]
    return scene_view(shown, eye)


def same_view(found: View, expected: View) -> None:
    """To the last digits: two ways to one number may round differently."""
    for name in View.__slots__:
        np.testing.assert_allclose(
            getattr(found, name), getattr(expected, name), rtol=1e-13, atol=1e-13, err_msg=name
        )
