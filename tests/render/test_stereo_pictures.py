"""What the two eyes see: pictures that mono cameras make too, and how far apart things are in them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.camera.views import scene_view, seen_by
from clfractal.device import program
from clfractal.device.select import Device
from clfractal.engine.engine import Engine
from clfractal.engine.job import StereoPair
from clfractal.engine.prepare import prepare
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators import plan, volume
from clfractal.scene.model import Scene
from clfractal.scene.stereo import EyeName
from clfractal.voxels import fill as voxels
from tests.render.shots import BALL, CHANNELS, engine_of, shoot, stacked
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


@pytest.mark.parametrize("convergence", ["parallel", "toe_in", "off_axis"])
@pytest.mark.parametrize("kind", KINDS)
def test_eyes_are_plain_cameras(device: Device, kind: str, convergence: str) -> None:
    """A scene with a camera at the eye's place, as somebody writes it, shows the same. Of one that looks aside it is a part
    of a wider picture: an eye three pixels of the plane beside its middle, with three more on each side."""
    scene, aside = stereo_scene(kind, convergence=convergence), convergence == "off_axis"
    for side, x in zip(SIDES, (-APART / 2, APART / 2), strict=True):
        camera = {
            "position": [x, -DISTANCE, 0.0],
            "target": [0.0 if convergence == "toe_in" else x, 0.0, 0.0],
            "fov": float(np.degrees(2 * np.arctan(1.5 / DISTANCE))),
        }
        plain = shoot(mono_scene(kind, camera, (70, 48) if aside else SIZE), device)
        first = 6 if aside and side == "left" else 0
        part = {name: plain[name][:, first : first + 64] for name in CHANNELS}
        close(shoot(seen_by(scene, side), device), part)


def close(found: Framebuffer, expected: Any) -> None:
    """The same but for the last digits of rays' directions: a few pixels at a rim may fall to either side."""
    same = found["A"] == expected["A"]
    assert same.mean() > 0.998
    for name, tolerance in (("Z", 2e-4), ("R", 4e-3), ("N.X", 4e-3), ("P.X", 2e-4)):
        with np.errstate(invalid="ignore"):
            near = np.isclose(found[name], expected[name], rtol=0, atol=tolerance)
        assert near[same].mean() > 0.995, name


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
        """(The second eye's is loaded when it is wanted, and need not be built.)"""
        texts: list[str] = []
        build = program.build

        def watched(device: Device, text: str, **named: Any) -> program.Program:
            texts.append(text)
            return build(device, text, **named)

        device.loaded.clear()
        monkeypatch.setattr(program, "build", watched)
        self.pair(stereo_scene(kind), device)
        entry = "VOLUME(volume_" if kind == "volume" else "STAGE(march_rays)"
        assert sum(entry in text for text in texts) == 1

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
