"""How much the eyes turn: measured against geometry, and fitted to a budget."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clfractal
from clfractal.camera.views import scene_view, seen_by
from clfractal.device.select import Device, choose
from clfractal.engine import comfort
from clfractal.engine import preview as preview_module
from clfractal.engine.comfort import Comfort, comfort_of, comfort_of_depth, fitted, measured
from clfractal.engine.job import Job
from clfractal.engine.preview import Preview, points_of_depth
from clfractal.engine.run import run
from clfractal.scene.stereo import EyeName, Stereo
from clfractal.stereo.eyes import degrees, eye_distance
from tests.render.shots import BALL, BALL_RADIUS, SOLIDS, engine_of, points_of, shoot
from tests.scenes import scene_of
from tests.shell import SCENE

CAMERA: dict[str, Any] = {"position": [0.0, -3.0, 0.0], "fov": 50.0}
VIEWER: dict[str, Any] = {"screen_width": 0.6, "screen_distance": 0.7, "interpupillary_distance": 0.065}
SIZE = (96, 80)
SIDES: tuple[EyeName, EyeName] = ("left", "right")
# Renderers of other solids, each of whose programs other tests have too.
SOLIDS_SEEN: dict[str, dict[str, Any]] = {
    "ball": {},
    "solids": {"camera": {"position": [1.5, -2.5, 1.6], "target": [0, 0, 0.3]}},
    "mandelbulb": {},
    "volume": {"renderer": {"type": "volume", "box": {"size": 2.4}, "resolution": 32}},
    "near": {"camera": {"position": [0.2, -1.1, 0.1], "target": [0.1, 0, 0], "fov": 100}},
}


@pytest.fixture(scope="module")
def device() -> Device:
    return choose()


@pytest.fixture(scope="module")
def preview(device: Device) -> Preview:
    """The preview of an engine, which keeps what its previews have in common."""
    return engine_of(device).preview


def seen(kind: str, size: tuple[int, int] = SIZE, **stereo: Any) -> clfractal.Scene:
    """A stereo scene of one of the solids."""
    sections = {"camera": CAMERA, **SOLIDS_SEEN[kind], "stereo": {**VIEWER, **stereo}}
    if kind == "mandelbulb":
        plain = clfractal.load_scene(SCENE).resolved()
        return clfractal.load_scene({**plain, **sections, "image": {"width": size[0], "height": size[1]}})
    camera = sections.pop("camera")
    return scene_of(SOLIDS if kind == "solids" else BALL, camera, size, **sections)


class TestMeasured:
    def test_a_ball(self, preview: Preview) -> None:
        """Seen from depth d - r to the circle where lines from an eye touch it. That lies r^2 / l before its middle, on the
        way to an eye at a distance l, and has the radius r sqrt(1 - r^2 / l^2); an eye that is beside the middle by a sees
        a / l of that radius deeper on its own side. The plane is at d, so the parallax at depth z is e (1 - d / z)."""
        scene = seen("ball", (160, 160))
        high, r = 6 * np.tan(np.radians(25)), BALL_RADIUS
        scale, eyes = high / VIEWER["screen_width"], VIEWER["interpupillary_distance"]
        d, a = VIEWER["screen_distance"] * scale, eyes * scale / 2
        distance = np.hypot(d, a)
        near = d - r
        far = d - d * (r / distance) ** 2 + r * np.sqrt(1 - (r / distance) ** 2) * a / distance
        found = measured(scene, preview)
        assert found is not None
        # A hit may lie a pixel or two before the surface, and no pixel's middle is exactly on the nearest point or the rim.
        pixel = high / 160
        assert eyes * (1 - d / (near - 2 * pixel)) < found.nearest < eyes * (1 - d / (near + pixel / 4))
        assert found.farthest == pytest.approx(eyes * (1 - d / far), abs=0.05 * abs(found.nearest))
        assert found.farthest < 0
        ends = degrees(Stereo.model_validate({**VIEWER}), [found.nearest, found.farthest])
        np.testing.assert_allclose([found.nearest_degrees, found.farthest_degrees], ends)

    def test_a_preview_is_quick(self, preview: Preview, monkeypatch: pytest.MonkeyPatch) -> None:
        """However large the picture and how many its samples: 320 pixels on the longer side, one ray each."""
        previews: list[tuple[int, int, int, tuple[str, ...]]] = []

        def watched(job: Job, *arguments: Any, **named: Any) -> Any:
            (view,) = job.views
            previews.append((*view.size, view.plan.samples, view.plan.channels))
            return run(job, *arguments, **named)

        monkeypatch.setattr(preview_module, "run", watched)
        large = seen("ball", (16000, 4000))
        large = large.model_copy(update={"renderer": large.renderer.model_copy(update={"samples": 64})})
        same = large.model_copy(update={"image": large.image.resized(320, 80)})
        found, small = measured(large, preview), measured(same, preview)
        assert previews == [(320, 80, 1, ("R", "G", "B", "A", "Z"))] * 4  # of either eye
        assert found == small

    def test_all_views_of_a_layout(self, preview: Preview) -> None:
        """The nearest and the farthest of any; a plane by itself has none, and nothing seen is nothing."""
        away = {"camera": {"position": [0, -3, 0], "target": [0, -9, 0]}}
        plane = {"renderer": {"type": "cut_plane"}}

        def of(*views: dict[str, Any]) -> Comfort | None:
            layout = {"views": list(views)}
            return measured(scene_of(BALL, CAMERA, SIZE, stereo=VIEWER, layout=layout), preview)

        near = of({}, {})
        assert near is not None
        assert of({}, away) == near
        assert of(away, away) is None
        assert of(plane, plane) == Comfort(0, 0, 0, 0)
        both = of({}, plane)
        assert both is not None
        assert (both.nearest, both.farthest) == (near.nearest, max(near.farthest, 0))

    def test_points_are_where_the_picture_says(self, device: Device) -> None:
        """From depth alone, what the channel P tells; of a part of the picture too."""
        scene, eye = seen_by(seen("solids"), "right")
        film = shoot((scene, eye), device)
        hit = np.isfinite(film["Z"])
        found = points_of_depth(scene_view(scene, eye), film["Z"], SIZE)
        np.testing.assert_allclose(found, points_of(film)[hit], atol=1e-5)
        part = film["Z"][30:60, 20:90]
        found = points_of_depth(scene_view(scene, eye), part, SIZE, (20, 30))
        np.testing.assert_allclose(found, points_of(film)[30:60, 20:90][np.isfinite(part)], atol=1e-5)

    @pytest.mark.parametrize("convergence", ["off_axis", "parallel", "toe_in"])
    def test_a_pictures_depth_tells_what_its_points_do(self, device: Device, convergence: str) -> None:
        """The range over all pixels, and over all of a part of them; of none there is no range."""
        scene, eye = seen_by(seen("solids", convergence=convergence), "left")
        view = scene_view(scene, eye)
        depth = shoot((scene, eye), device, channels=("Z",))["Z"]
        for y, x, part in ((0, 0, depth), (30, 20, depth[30:60, 20:90])):
            found = comfort_of_depth(scene, eye, part, SIZE, (x, y))
            assert found is not None
            expected = comfort_of(scene, points_of_depth(view, part, SIZE, (x, y)), eye)
            for name in Comfort.__slots__:
                assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=1e-5)
        for nothing in (np.inf, 0.0):
            assert comfort_of_depth(scene, eye, np.full((2, 3), nothing, np.float32), SIZE) is None


class TestFitted:
    @pytest.mark.parametrize("budget", [0.3, 1.0])
    @pytest.mark.parametrize("kind", SOLIDS_SEEN)
    def test_all_of_the_depth_is_within_the_budget(
        self, device: Device, preview: Preview, kind: str, budget: float
    ) -> None:
        """Of the picture's own pixels, of both eyes, which are finer than those of the preview."""
        scene = seen(kind, (400, 330), fit="auto", budget=budget)
        found = fitted(scene, preview)
        assert found.stereo is not None
        assert found.stereo.fit is None
        assert 0 < found.stereo.separation <= 1
        told = measured(found, preview)
        assert told is not None
        assert told.nearest < 0 < told.farthest
        assert told.nearest_degrees == pytest.approx(-told.farthest_degrees, rel=0.06)
        for side in SIDES:
            film = shoot(seen_by(found, side), device, channels=("Z",))
            points = points_of_depth(scene_view(*seen_by(found, side)), film["Z"], (400, 330))
            assert comfort_of(found, points).worst_degrees <= budget
        # And it is used: either the eyes are as far apart as they may be, or the depth takes up nearly all of it.
        assert found.stereo.separation == 1 or told.worst_degrees > 0.9 * budget

    @pytest.mark.parametrize("kind", ["ball", "near"])
    def test_the_eye_between_stays(self, preview: Preview, kind: str) -> None:
        """What it sees is as without a fit: only the screen moves, through the picture."""
        before = scene_view(seen(kind))
        scene = fitted(seen(kind, fit="auto"), preview)
        after = scene_view(scene)
        np.testing.assert_allclose(after.origin, before.origin, atol=1e-12)
        np.testing.assert_allclose(after.axis, before.axis, atol=1e-12)
        assert after.width / eye_distance(after) == pytest.approx(before.width / eye_distance(before))
        assert after.height / after.width == pytest.approx(before.height / before.width)
        assert eye_distance(after) < eye_distance(before)  # nearer than the target in the middle of the ball

    def test_its_own_plane_stays(self, preview: Preview) -> None:
        plane = {"center": [0, -0.3, 0], "normal": [0.1, -1, 0.2], "width": 3.0}
        scene = seen("ball", fit="auto", plane=plane, budget=0.5)
        found = fitted(scene, preview)
        assert found.stereo is not None
        assert scene.stereo is not None
        assert found.stereo == scene.stereo.model_copy(
            update={"fit": None, "separation": found.stereo.separation}
        )
        told = measured(found, preview)
        assert told is not None
        assert told.worst_degrees == pytest.approx(0.95 * 0.5, rel=1e-3)

    def test_what_fits_already_keeps_its_separation(self, preview: Preview) -> None:
        for separation in (0.05, 0.0):
            found = fitted(seen("ball", fit="auto", separation=separation), preview)
            assert found.stereo is not None
            assert found.stereo.separation == separation

    def test_a_scene_without_fit_stays_itself(self, preview: Preview) -> None:
        for scene in (seen("ball"), scene_of(BALL, CAMERA)):
            assert fitted(scene, preview) is scene

    @given(
        st.tuples(st.floats(1e-3, 1e3), st.floats(1.0, 1e4)),
        st.floats(0.01, 10),
        st.floats(0.01, 10),
        st.floats(0.05, 20),
        st.floats(0.1, 30),
        st.floats(0.01, 0.2),
    )
    @settings(max_examples=200)
    def test_any_depth_fits(
        self,
        depth: tuple[float, float],
        budget: float,
        separation: float,
        width: float,
        distance: float,
        eyes: float,
    ) -> None:
        """Depths from near to near times far / near, any viewer: within the budget, the same on both sides."""
        stereo = Stereo.model_validate(
            {
                "screen_width": width,
                "screen_distance": distance,
                "interpupillary_distance": eyes,
                "budget": budget,
                "separation": separation,
            }
        )
        near, far = depth[0], depth[0] * depth[1]
        screen = comfort._balanced(stereo, (near, far))
        assert near <= screen <= far
        found = comfort._separation(stereo, (near, far), screen)
        assert 0 <= found <= separation
        # Similar triangles, from eyes that are `found` times as far apart.
        ends = degrees(stereo, [found * eyes * (1 - screen / z) for z in (near, far)])
        assert np.abs(ends).max() <= 0.95 * budget * (1 + 1e-6)
        assert -ends[0] == pytest.approx(ends[1], rel=1e-4, abs=1e-7)


class TestTold:
    def test_joined(self) -> None:
        parts = [Comfort(-2, 1, -0.2, 0.1), Comfort(-1, 3, -0.1, 0.3)]
        assert Comfort.joined(parts) == Comfort(-2, 3, -0.2, 0.3)
        assert Comfort.joined([]) is None

    def test_a_sentence_and_a_warning(self) -> None:
        found = Comfort(-0.01, 0.005, -0.9999, 0.5)
        assert found.sentence() == ("parallax -0.01 to +0.005 in the screen's unit, -1.00 to +0.50 degrees")
        assert found.worst_degrees == 0.9999
        assert found.warning() == ""
        assert (
            Comfort(-0.01, 0.005, -0.5, 1.25)
            .warning()
            .startswith("parallax reaches 1.25 degrees, but eyes tire beyond 1; ")
        )
        assert (
            Comfort(-0.1, 0.005, -2.5, 1.25)
            .warning()
            .startswith("parallax reaches 2.50 degrees, but eyes tire beyond 1; ")
        )
