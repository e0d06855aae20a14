"""What the two eyes see: pictures that mono cameras make too, and how far apart things are in them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.camera.views import View, scene_view, seen_by
from clfractal.device import program
from clfractal.device.select import Device
from clfractal.engine.engine import Engine
from clfractal.engine.job import StereoPair
from clfractal.engine.prepare import prepare
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators import plan, volume
from clfractal.scene.model import Scene
from clfractal.scene.stereo import EyeName
from clfractal.stereo.eyes import eye_views, parallax
from clfractal.voxels import fill as voxels
from tests.render.shots import BALL, BALL_RADIUS, CHANNELS, engine_of, points_of, shoot, stacked
from tests.scenes import scene_of

SIZE = (64, 48)
SIDES: tuple[EyeName, EyeName] = ("left", "right")
# A plane 4 wide and 3 high through the origin. The screen is 1 wide, so one of its units is 4 scene units: the eyes are
# 4 before the plane and 6 pixels of it, 0.375, apart from each other.
FOV = float(np.degrees(2 * np.arctan(1.5 / 3)))
CAMERA: dict[str, Any] = {"position": [0.0, -3.0, 0.0], "target": [0.0, 0.0, 0.0], "fov": FOV}
VIEWER: dict[str, Any] = {
    "screen_width": 1.0,
    "screen_distance": 1.0,
    "interpupillary_distance": 6 / 64,
}
DISTANCE, APART = 4.0, 0.375
# A hit lies within a twentieth of a pixel before the surface, so that places can be compared.
EXACT: dict[str, Any] = {"type": "surface", "detail": 0.05}
KINDS: dict[str, dict[str, Any]] = {
    "surface": {"renderer": EXACT},
    "planes": {
        "renderer": EXACT,
        # Four, of which one is seen: the program of test_planes_in_picture.py.
        "cut_planes": [
            {"plane": {"normal": [0.3, -1, 0.2], "width": 3, "height": 2}, "opacity": 1},
            *[{"plane": {"center": [0, 0, 9]}, "opacity": 0}] * 3,
        ],
    },
    "volume": {"renderer": {"type": "volume", "box": {"size": 2.4}, "resolution": 32, "value": "coverage"}},
}


def stereo_scene(kind: str = "surface", size: tuple[int, int] = SIZE, **stereo: Any) -> Scene:
    return scene_of(BALL, CAMERA, size, stereo={**VIEWER, **stereo}, **KINDS[kind])


def mono_scene(kind: str, camera: dict[str, Any], size: tuple[int, int] = SIZE) -> Scene:
    return scene_of(BALL, camera, size, **KINDS[kind])


def bits(framebuffer: Framebuffer) -> npt.NDArray[np.uint32]:
    return stacked(framebuffer).view(np.uint32)


@pytest.mark.parametrize("convergence", ["off_axis", "parallel", "toe_in"])
@pytest.mark.parametrize("kind", KINDS)
def test_an_eyes_picture_is_a_mono_one_through_its_view(
    device: Device, monkeypatch: pytest.MonkeyPatch, kind: str, convergence: str
) -> None:
    """Bit for bit: nothing but the View makes a stereo picture."""
    scene = stereo_scene(kind, convergence=convergence)
    framebuffers = {side: shoot(seen_by(scene, side), device) for side in SIDES}
    for side in SIDES:
        view = scene_view(*seen_by(scene, side))
        monkeypatch.setattr(plan, "scene_view", lambda *_, through=view: through)
        mono = shoot(mono_scene(kind, CAMERA), device)
        np.testing.assert_array_equal(bits(framebuffers[side]), bits(mono))
    covered = framebuffers["left"]["A"] > 0
    assert 0.2 < covered.mean() <= 1
    assert (bits(framebuffers["left"]) != bits(framebuffers["right"])).any()


@pytest.mark.parametrize("convergence", ["parallel", "toe_in"])
@pytest.mark.parametrize("kind", KINDS)
def test_eyes_that_look_straight_are_plain_cameras(device: Device, kind: str, convergence: str) -> None:
    """A scene with a camera at the eye's place, as somebody writes it, shows the same."""
    scene = stereo_scene(kind, convergence=convergence)
    for side, x in zip(SIDES, (-APART / 2, APART / 2), strict=True):
        parallel = convergence == "parallel"
        camera = {
            "position": [x, -DISTANCE, 0.0],
            "target": [x if parallel else 0.0, 0.0, 0.0],
            "fov": float(np.degrees(2 * np.arctan(1.5 / DISTANCE))),
        }
        close(shoot(seen_by(scene, side), device), shoot(mono_scene(kind, camera), device))


@pytest.mark.parametrize("kind", KINDS)
def test_an_eye_beside_the_middle_sees_a_part_of_a_wider_picture(device: Device, kind: str) -> None:
    """An eye three pixels of the plane beside its middle, with three more on each side: the plane is a part of that."""
    scene = stereo_scene(kind)
    for side, x in zip(SIDES, (-APART / 2, APART / 2), strict=True):
        camera = {
            "position": [x, -DISTANCE, 0.0],
            "target": [x, 0.0, 0.0],
            "fov": float(np.degrees(2 * np.arctan(1.5 / DISTANCE))),
        }
        wider = shoot(mono_scene(kind, camera, (70, 48)), device)
        first = 6 if side == "left" else 0
        part = {name: wider[name][:, first : first + 64] for name in CHANNELS}
        close(shoot(seen_by(scene, side), device), part)


def close(found: Framebuffer, expected: Any) -> None:
    """The same but for the last digits of rays' directions: a few pixels at a rim may fall to either side."""
    same = found["A"] == expected["A"]
    assert same.mean() > 0.998
    for name, tolerance in (("Z", 2e-4), ("R", 4e-3), ("N.X", 4e-3), ("P.X", 2e-4)):
        with np.errstate(invalid="ignore"):
            near = np.isclose(found[name], expected[name], rtol=0, atol=tolerance)
        assert near[same].mean() > 0.995, name


@pytest.mark.parametrize("kind", KINDS)
def test_disparity_in_the_pictures(device: Device, kind: str) -> None:
    """What the left eye shows in a pixel the right eye shows in the same row, as far beside it as the parallax says."""
    scene = stereo_scene(kind)
    left, right = (shoot(seen_by(scene, side), device) for side in SIDES)
    points = points_of(left)
    assert scene.stereo is not None
    across = parallax(scene.stereo, eye_views(scene), points.reshape(-1, 3))[:, 0].reshape(SIZE[::-1])
    errors: list[float] = []
    for row in range(SIZE[1]):
        columns = np.nonzero(left["A"][row] == 1)[0]
        places = columns + across[row, columns] * SIZE[0] / VIEWER["screen_width"]
        others = np.nonzero(right["A"][row] == 1)[0]
        if len(others) < 8:
            continue
        inner = (places > others[0] + 2) & (places < others[-1] - 2)
        found = np.stack(
            [np.interp(places, np.arange(SIZE[0]), points_of(right)[row, :, i]) for i in range(3)]
        )
        errors.extend(np.linalg.norm(found.T - points[row, columns], axis=-1)[inner])
    assert len(errors) > 400
    # A pixel is a 16th wide. At rims, where depth jumps, there is nothing to interpolate between.
    assert np.quantile(errors, 0.8) < (0.2 if kind == "volume" else 0.1) / 16
    seen = across[left["A"] == 1]
    assert seen.min() < -0.01  # before the screen
    assert np.ptp(seen) * SIZE[0] > 1  # and not all of it alike, by more than a pixel


def test_the_middle_of_a_ball_before_and_behind_the_screen(device: Device) -> None:
    """The outline of a ball of radius r, at depth z and a to the side, reaches from tan(t - s) to tan(t + s), where
    tan t = a / z and sin s = r / sqrt(a^2 + z^2)."""
    size = (256, 192)
    columns = np.arange(size[0]) + 0.5
    for depth in (3.0, 4.0, 7.0):
        plane = {"center": [0, DISTANCE - depth, 0], "normal": [0, -1, 0], "width": 4.0}
        scene = stereo_scene(size=size, plane=plane)
        middles = []
        for side in SIDES:
            disc = shoot(seen_by(scene, side), device)["A"] > 0
            middles.append(float((disc.sum(axis=0) * columns).sum() / disc.sum()))
        to_side = np.arctan2(APART / 2, depth)
        half = np.arcsin(BALL_RADIUS / np.hypot(APART / 2, depth))
        seen = (np.tan(to_side + half) + np.tan(to_side - half)) / 2 * DISTANCE  # from the left eye's foot
        expected = 2 * (APART / 2 - seen) * size[0] / 4
        assert middles[1] - middles[0] == pytest.approx(expected, abs=0.25)
        assert np.sign(expected) == (1 if depth > 5 else -1)


class TestFlat:
    """A cut plane by itself lies on the screen: both eyes see the same, and what a mono scene shows."""

    RENDERER: dict[str, Any] = {"type": "cut_plane", "plane": {"width": 3, "height": 3}}  # noqa: RUF012

    def test_as_the_renderer(self, device: Device) -> None:
        framebuffers = [
            shoot(scene_of(BALL, CAMERA, SIZE, renderer=self.RENDERER), device),
            *(
                shoot(
                    seen_by(scene_of(BALL, CAMERA, SIZE, renderer=self.RENDERER, stereo=VIEWER), side), device
                )
                for side in SIDES
            ),
        ]
        for framebuffer in framebuffers[1:]:
            np.testing.assert_array_equal(bits(framebuffer), bits(framebuffers[0]))

    def test_in_a_layout(self, device: Device) -> None:
        """A surface and a plane beside each other, each with half of the screen."""
        views: list[dict[str, Any]] = [{}, {"renderer": self.RENDERER}]
        scene = scene_of(BALL, CAMERA, SIZE, stereo=VIEWER, layout={"views": views})
        half = (SIZE[0] // 2, SIZE[1])
        both = engine_of(device).render_pair(scene, precision="float32", channels=CHANNELS)
        framebuffers = {side: stacked(framebuffer) for side, framebuffer in zip(SIDES, both, strict=True)}
        plane = stacked(shoot(scene_of(BALL, CAMERA, half, renderer=self.RENDERER), device))
        alone = scene_of(BALL, CAMERA, half, stereo={**VIEWER, "screen_width": 0.5})
        for side in SIDES:
            np.testing.assert_array_equal(framebuffers[side][:, half[0] :], plane)
            np.testing.assert_array_equal(
                framebuffers[side][:, : half[0]], stacked(shoot(seen_by(alone, side), device))
            )
        assert (framebuffers["left"] != framebuffers["right"]).any()


class TestCost:
    """What both pictures need is made once."""

    def pair(self, scene: Scene, device: Device) -> None:
        with Engine(device) as engine:
            engine.render_pair(scene, precision="float32")

    @pytest.mark.parametrize("kind", KINDS)
    def test_one_program(self, device: Device, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
        """Compiled, or loaded from the cache, once."""
        made: list[str] = []

        def counted(name: str, original: Any) -> Any:
            def call(*arguments: Any, **named: Any) -> Any:
                result = original(*arguments, **named)
                if result is not None:
                    made.append(name)
                return result

            return call

        texts: list[str] = []
        build = program.build

        def watched(device: Device, text: str, **named: Any) -> program.Program:
            texts.append(text)
            return build(device, text, **named)

        device.loaded.clear()
        # Compiling loads what the child process has made, so both are one call of this.
        monkeypatch.setattr(program, "_built", counted("built", program._built))
        monkeypatch.setattr(program, "build", watched)
        self.pair(stereo_scene(kind), device)
        entries = {"volume": "VOLUME(volume_", "cut_plane": "kernel void cut_plane("}
        entry = entries.get(kind, "STAGE(march_rays)")
        pictures = [text for text in texts if entry in text]
        # (The second eye's is loaded when it is wanted, and need not be built.)
        assert len(pictures) == 1
        assert len(made) == len(set(texts))

    def test_one_grid(self, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
        """Of a scene whose depth is looked at first, too; another solid is another grid."""
        filled: list[Scene] = []
        fill = voxels.fill_grid

        def counted(scene: Scene, *arguments: Any, **named: Any) -> Any:
            filled.append(scene)
            return fill(scene, *arguments, **named)

        monkeypatch.setattr(volume, "fill_grid", counted)
        self.pair(stereo_scene("volume", fit="auto"), device)
        assert len(filled) == 1
        layout = {"views": [{}, {"renderer": {**KINDS["volume"]["renderer"], "resolution": 24}}]}
        self.pair(scene_of(BALL, CAMERA, SIZE, stereo=VIEWER, layout=layout, **KINDS["volume"]), device)
        assert len(filled) == 3

    @pytest.mark.parametrize("mode", ["left", "right"])
    def test_one_eye_where_one_is_shown(self, device: Device, mode: str) -> None:
        job = prepare(stereo_scene(mode=mode), device)
        assert isinstance(job.composition, StereoPair)
        assert list(job.composition.eyes) == [mode]
        assert job.sides == (mode,)


def test_depth_is_measured_from_the_eye_across_the_plane(device: Device) -> None:
    """Along the view's axis, which is not where an eye beside the middle looks."""
    scene = stereo_scene()
    view: View = scene_view(*seen_by(scene, "left"))
    framebuffer = shoot(seen_by(scene, "left"), device)
    hit = framebuffer["A"] > 0
    depth = (points_of(framebuffer)[hit] - view.origin) @ view.axis
    np.testing.assert_allclose(framebuffer["Z"][hit], depth, atol=1e-5)
