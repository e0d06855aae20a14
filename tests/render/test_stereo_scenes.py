"""Scenes of pairs: the eyes of a scene file, its squeezed modes, layouts and lenses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.camera.views import View, camera_view, scene_view, seen_by, shown_views
from clfractal.scene.model import Scene
from clfractal.scene.stereo import Eye, EyeName
from clfractal.stereo.eyes import eye_views
from tests.render.shots import BALL
from tests.render.stereo_geometry import CAMERA, PLANE, SIDES, dot, unit
from tests.scenes import scene_of


class TestScenes:
    @pytest.mark.parametrize(("size", "height"), [((64, 48), 1.2), ((48, 64), 5.0), ((64, 64), 3.0)])
    def test_a_plane_of_its_own(self, size: tuple[int, int], height: float) -> None:
        """Its corners are the picture's, whatever its proportions, for both eyes."""
        plane = {**PLANE, "height": height}
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

    def test_a_plane_without_height_has_square_pixels(self) -> None:
        view = scene_view(scene_of(BALL, CAMERA, (64, 48), stereo={"plane": PLANE}))
        assert view.height == pytest.approx(3.0 * 48 / 64)

    def test_the_camera_moves_to_where_the_viewer_is(self) -> None:
        """Nothing of a mono scene's camera stays but the direction and what it sees at its target."""
        scene = scene_of(BALL, CAMERA, (96, 54), stereo={})
        mono, middle = camera_view(scene.camera, 96, 54), scene_view(scene)
        for name in ("center", "side", "up", "axis"):
            np.testing.assert_array_equal(getattr(mono, name), getattr(middle, name))
        assert (mono.width, mono.height) == (middle.width, middle.height)
        distance = dot(middle.center - middle.origin, middle.axis)
        assert distance / middle.width == pytest.approx(0.6 / 0.52)

    @pytest.mark.parametrize("mode", ["split_half", "over_under_half"])
    def test_squeezed_eyes_see_the_whole_screen(self, mode: str) -> None:
        whole = scene_of(BALL, CAMERA, (96, 54), stereo={"mode": "split"})
        squeezed = scene_of(BALL, CAMERA, (96, 54), stereo={"mode": mode})
        size = (48, 54) if mode == "split_half" else (96, 27)
        for name in SIDES:
            small, eye = seen_by(squeezed, name)
            assert (small.image.width, small.image.height) == size
            same_view(scene_view(small, eye), scene_view(*seen_by(whole, name)))

    def test_a_view_of_a_layout_takes_up_a_part_of_the_screen(self) -> None:
        """Half of the screen's pixels are half of its width: the viewer sits twice as many of its widths before it."""
        stereo = {"screen_width": 0.5, "mode": "split"}
        views: list[dict[str, Any]] = [{}, {"camera": {**CAMERA, "fov": 20}}]
        scene = scene_of(BALL, CAMERA, (96, 54), stereo=stereo, layout={"views": views})
        for number, fov in ((0, 50), (1, 20)):
            alone = scene_of(BALL, {**CAMERA, "fov": fov}, (48, 54), stereo={**stereo, "screen_width": 0.25})
            for name in SIDES:
                same_view(view_of(scene, name, number), scene_view(*seen_by(alone, name)))

    @pytest.mark.parametrize("mode", ["split_half", "over_under_half"])
    def test_squeezed_views_of_a_layout(self, mode: str) -> None:
        layout: dict[str, Any] = {"views": [{}, {}]}
        scenes = [
            scene_of(BALL, CAMERA, (96, 54), stereo={"mode": m}, layout=layout) for m in (mode, "split")
        ]
        for name in SIDES:
            found, expected = (view_of(scene, name, 1) for scene in scenes)
            same_view(found, expected)

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

    def test_copies_show_the_same_eye(self) -> None:
        scene, eye = seen_by(scene_of(BALL, CAMERA, (96, 54), stereo={}), "left")
        lit = scene.model_copy(update={"lights": scene.lights})
        same_view(scene_view(lit, eye), scene_view(scene, eye))
        assert eye == Eye("left")
        assert lit == scene


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
