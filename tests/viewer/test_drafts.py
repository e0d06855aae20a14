"""Scenes whose light goes along paths are shaded cheaply while they move, and say so; at rest they are the shell's."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest

from clfractal.device import activity
from clfractal.device.select import Device
from clfractal.elements.lights.directional import DirectionalLight
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.engine.run import run
from clfractal.scene.light_paths import DirectLighting
from clfractal.scene.parts import PerspectiveCamera
from clfractal.viewer import session
from clfractal.viewer.drafts import draft
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.panels import overlay
from tests.viewer.panel_harness import make_ui
from tests.viewer.sessions import (
    BULB,
    FOREVER,
    equal_pictures,
    framebuffers_of,
    scene_of,
    session_on,
    shell,
    turned,
    wait_for,
)
from tests.viewer.slow_compiler import Slow

PATHS = (
    "lighting={mode: path}",
    "materials={red: {base: {color: [0.8, 0.05, 0.05]}}}",
    "material={name: red}",
)
SKY = (*PATHS, "environment={name: studio}", "lights=[]", "camera.f_number=0.5", "output.exposure=1.0")


def test_a_draft_has_the_lights_and_nothing_that_takes_long() -> None:
    lamps = ("lights=[{type: sphere, position: [0, -3, 2], radius: 0.3, intensity: 5}]", "fog={density: 0.1}")
    scene = scene_of(BULB, *PATHS, *lamps)
    found = draft(scene)
    assert isinstance(found.lighting, DirectLighting)
    assert found.fog is None
    assert [(light.tag, light.shadow) for light in found.lights] == [("sphere", False)]
    assert (found.formula, found.camera) == (scene.formula, scene.camera)
    assert (found.material.color, found.coloring.by) == ((0.8, 0.05, 0.05), "solid")
    # What the eye sees by the light of a sky is lit from the eye, as bright as the exposure wants.
    found = draft(scene_of(BULB, *SKY))
    assert found.environment is not None
    assert found.environment.rays == 0
    (light,) = found.lights
    assert isinstance(light, DirectionalLight)
    ahead = np.subtract(found.camera.target, found.camera.position)
    assert np.cross(light.direction, ahead) == pytest.approx([0, 0, 0])
    assert light.intensity == pytest.approx(0.35)
    assert isinstance(found.camera, PerspectiveCamera)
    assert found.camera.lens_radius < 1e-5


def test_other_scenes_have_none() -> None:
    for options in ((), ("renderer={type: volume, resolution: 24}",)):
        scene = scene_of(BULB, *options)
        assert draft(scene) is scene


@pytest.mark.parametrize("options", [PATHS, SKY])
def test_it_is_a_draft_while_it_moves_alone(
    options: tuple[str, ...], device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of(BULB, *options)
    with session_on(device) as watch:
        watch.finished(scene)
        watch.frames.clear()
        monkeypatch.setattr(session, "SETTLE_SECONDS", FOREVER)
        for step in range(1, 6):
            number = watch.session.request(turned(scene, 0.1 * step), moving=True)
            wait_for(lambda: watch.frames and watch.frames[-1].request == number)  # noqa: B023
        assert all(each.is_draft for each in watch.frames)
        red, green = (planes_of(watch.frames[-1].canvas.read(device.transfers, 0), name) for name in "RG")
        assert red > 2 * green, "it has its colour"
        monkeypatch.undo()
        number = watch.session.request(turned(scene, 0.5), follows=True)
        frame = watch.rest()
        assert (frame.request, frame.finished, frame.is_draft) == (number, True, False)
        equal_pictures(framebuffers_of(frame).picture(), shell(turned(scene, 0.5)))


def planes_of(planes: dict[str, np.ndarray], name: str) -> float:
    """The mean of a channel where the set is."""
    return float(planes[name][np.isfinite(planes["Z"]) & (planes["Z"] > 0)].mean())


def test_where_pictures_are_never_coarse_there_are_no_drafts(device: Device) -> None:
    scene = scene_of(BULB, *PATHS)
    with session_on(device, Pacing(coarsest=1)) as watch:
        watch.finished(scene)
        watch.session.request(turned(scene, 0.2), moving=True)
        watch.rest()
        assert not any(each.is_draft for each in watch.frames)


def test_the_first_move_compiles_nothing(device: Device, slow: Slow) -> None:
    """The draft's program is compiled behind the first picture; and only once, wherever the camera goes."""
    scene = scene_of(BULB, *PATHS)
    with session_on(device) as watch:
        watch.finished(scene)
        begun = slow.begun
        slow.seconds = 10_000.0
        for step in range(1, 4):
            watch.session.request(turned(scene, 0.1 * step), moving=True)
            frame = watch.rest()
            assert not frame.is_draft
        assert slow.begun == begun
        assert any(each.is_draft for each in watch.frames)


def test_a_draft_takes_a_part_of_the_time(device: Device) -> None:
    scene = scene_of(BULB, *SKY, "image.width=480", "image.height=320")
    times = {}
    for name, shown in (("paths", scene), ("draft", draft(scene))):
        executor, job = LocalExecutor(device), prepare(shown, device, channels=("R", "G", "B", "A", "Z"))
        times[name] = min(rendered(executor, JobFramebuffers(job.coarse(2))) for _ in range(3))
    assert times["draft"] < 0.5 * times["paths"]


def rendered(executor: LocalExecutor, framebuffers: JobFramebuffers) -> float:
    """Milliseconds of the kernels."""
    return run(framebuffers.job, framebuffers.framebuffers, executor).kernel_ms


def test_it_is_told(device: Device) -> None:
    scene = scene_of(BULB, *PATHS)
    ui = make_ui(scene)[0]
    with session_on(device) as watch:
        watch.finished(scene)
        watch.session.request(turned(scene, 0.3), moving=True)
        frame = watch.rest()
        drafted = next(each for each in watch.frames if each.is_draft)
    assert [text for text, _ in overlay.state_lines(ui, drafted)] == [overlay.DRAFT]
    assert overlay.state_lines(ui, frame) == []
    ui.show.clear()  # nothing lies over a picture that is shown alone
    assert overlay.state_lines(ui, drafted) == []


@pytest.mark.parametrize(
    ("progress", "doing", "told"),
    [
        (
            "compiling rays for a device, once",
            "compiling light for a device",
            "compiling light for a device, 0 s",
        ),
        ("measuring a device, once", "writing out.png", "measuring a device, once"),
        ("measuring a device, once", None, "measuring a device, once"),
    ],
)
def test_what_a_picture_waits_for_is_told_with_its_time(progress: str, doing: str | None, told: str) -> None:
    ui = make_ui(scene_of(BULB, *PATHS))[0]
    ui.studio.session.progress = progress
    with nullcontext() if doing is None else activity.doing(doing):
        ((line, _),) = overlay.state_lines(ui, None)
    assert line.split("  ", 1)[1] == told
