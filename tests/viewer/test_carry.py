"""A camera that moves: most pixels come from the frame before, near what rays show, never old, and never at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.engine import carry as carrying
from clfractal.engine.canvas import CHANNELS, Canvas
from clfractal.engine.carry import OLDEST, PHASES, can_carry, places
from clfractal.engine.job import Job
from clfractal.engine.prepare import prepare
from clfractal.errors import DeviceError
from clfractal.files import srgb
from clfractal.scene.model import Scene
from clfractal.viewer import session as sessions_module
from clfractal.viewer.editing import edited
from clfractal.viewer.frame import Frame
from clfractal.viewer.pacing import Pacing
from tests.scenes import STEREO
from tests.viewer.sessions import (
    BULB,
    FOREVER,
    HALVES,
    Watch,
    equal_pictures,
    framebuffers_of,
    planes,
    scene_of,
    session_on,
    shell,
    turned,
)

DEGREE = np.pi / 180
LARGER = ("image.width=240", "image.height=160")
PATHS = ("lighting={mode: path, bounces: 2}", "renderer.samples=2")
LAMP = ("lights=[{type: sphere, position: [1, -3, 2], radius: 0.3, intensity: 15}]",)
SKY = ("environment={name: studio}", "lights=[]")
ORTHOGRAPHIC = "camera={projection: orthographic, position: [0, -2.8, 0.6], target: [0, 0, 0], height: 2.6}"


@pytest.fixture(autouse=True)
def movements_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions_module, "SETTLE_SECONDS", FOREVER)


def moved(watch: Watch, scene: Scene) -> Frame:
    """The moving frame of a scene."""
    number = watch.session.request(scene, moving=True)
    watch.shows(lambda frame: frame.request == number)
    return next(frame for frame in watch.frames if frame.request == number)


def linear_to_screen(found: dict[str, np.ndarray]) -> np.ndarray:
    return srgb.encode(np.clip(np.stack([found[name] for name in "RGB"]), 0, 1))


def by_rays(device: Device, watch: Watch, frame: Frame) -> list[dict[str, np.ndarray]]:
    """What a moving frame would show, had each of its pixels a ray."""
    job, canvas = frame.job.coarse(frame.divider), Canvas(device)
    canvas.fit(job.views)
    watch.session._painter.run(job, canvas, CancelToken())
    return [canvas.read(device.transfers, number) for number in range(len(job.views))]


@pytest.mark.parametrize(
    "more",
    [(), (STEREO, "stereo.mode=pair"), (ORTHOGRAPHIC,), ("image.width=77", "image.height=41"), (STEREO,)],
    ids=["mono", "pair", "orthographic", "odd size", "anaglyph"],
)
@pytest.mark.parametrize("coarsest", [1, 8])
def test_a_picture_at_rest_knows_nothing_of_what_moved(
    more: tuple[str, ...], coarsest: int, device: Device
) -> None:
    """Its bits are those of a session that has seen nothing else."""
    scene = scene_of(BULB, *more)
    pacing = Pacing(coarsest=coarsest, seconds_per_pixel=1e-4)
    with session_on(device, pacing) as watch:
        watch.finished(scene)
        frames = [moved(watch, turned(scene, DEGREE * step)) for step in range(1, 7)]
        assert all(frame.carried and not frame.finished for frame in frames)
        last = turned(scene, DEGREE * 6)
        frame = watch.finished(last)
        after = planes(frame)
        assert not frame.carried
    with session_on(device) as watch:
        fresh = planes(watch.finished(last))
    for one, other in zip(after, fresh, strict=True):
        for name in CHANNELS:
            np.testing.assert_array_equal(one[name].view(np.uint32), other[name].view(np.uint32), name)


def test_a_movement_that_ends_by_itself_has_the_bits_of_the_shell(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of(BULB)
    with session_on(device) as watch:
        watch.finished(scene)
        assert moved(watch, turned(scene, DEGREE)).carried
        monkeypatch.setattr(sessions_module, "SETTLE_SECONDS", 0.05)
        last = turned(scene, 2 * DEGREE)
        watch.session.request(last, moving=True)
        frame = watch.rest()
        assert (frame.finished, frame.carried) == (True, False)
        equal_pictures(framebuffers_of(frame).picture(), shell(last))


@pytest.mark.parametrize("more", [LAMP, SKY], ids=["lamp", "sky"])
@pytest.mark.parametrize("divider", [1, 2])
def test_drafts_are_carried_and_a_picture_along_paths_at_rest_knows_nothing_of_them(
    more: tuple[str, ...], divider: int, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first is rendered, as the picture at rest has other light; a light at the eye moves with it."""
    monkeypatch.setattr(Pacing, "divider", lambda *_, **__: divider)
    scene = scene_of(BULB, *LARGER, *PATHS, *more)
    with session_on(device) as watch:
        watch.finished(scene)
        frames = [moved(watch, turned(scene, DEGREE * step)) for step in range(1, 8)]
        assert all(frame.is_draft and not frame.finished for frame in frames)
        assert [frame.carried for frame in frames] == [False] + 6 * [True]
        found, wanted = planes(frames[-1])[0], by_rays(device, watch, frames[-1])[0]
        off = np.abs(linear_to_screen(found) - linear_to_screen(wanted))
        assert off.mean() < 0.02
        last = turned(scene, DEGREE * 7)
        frame = watch.finished(last)
        after = planes(frame)
        assert (frame.carried, frame.is_draft) == (False, False)
    with session_on(device) as watch:
        fresh = planes(watch.finished(last))
    for one, other in zip(after, fresh, strict=True):
        for name in CHANNELS:
            np.testing.assert_array_equal(one[name].view(np.uint32), other[name].view(np.uint32), name)


def test_a_light_that_shines_where_the_camera_looks_goes_with_it(device: Device) -> None:
    """Not one that does so in one of two pictures alone, or that is another light."""

    def lit(step: float, direction: tuple[float, ...] | None = None, **more: object) -> Job:
        scene = turned(scene_of(BULB), step)
        light = {"direction": direction or scene.camera.ahead, **more}
        return prepare(edited(scene, {"lights": [light]}), device, channels=CHANNELS)

    assert can_carry(lit(0), lit(0.1))
    assert can_carry(lit(0, (1, 1, -1)), lit(0.1, (1, 1, -1)))
    assert not can_carry(lit(0), lit(0.1, (1, 1, -1)))
    assert not can_carry(lit(0, (1, 1, -1)), lit(0.1))
    assert not can_carry(lit(0), lit(0.1, intensity=2.0))
    assert not can_carry(lit(0, (1, 1, -1)), lit(0.1, (1, 1, -2)))


@pytest.mark.parametrize(
    "more", [(), (ORTHOGRAPHIC,), (STEREO, "stereo.mode=pair")], ids=["mono", "orthographic", "pair"]
)
def test_a_moving_picture_is_near_to_what_rays_show(more: tuple[str, ...], device: Device) -> None:
    """Surfaces as rough as these are also off by so much if they are seen a fraction of a pixel farther."""
    scene = scene_of(BULB, *LARGER, *more)
    with session_on(device, Pacing(coarsest=1)) as watch:
        watch.finished(scene)
        for step in range(1, 9):
            frame = moved(watch, turned(scene, DEGREE * step))
            assert (frame.carried, frame.divider) == (True, 1)
        phase = PHASES[watch.session._painter._carrier._turn]  # type: ignore[union-attr]
        found, wanted = planes(frame), by_rays(device, watch, frame)
    for shown, exact in zip(found, wanted, strict=True):
        off = np.abs(linear_to_screen(shown) - linear_to_screen(exact))
        assert off.mean() < 0.02
        assert np.sqrt((off**2).mean()) < 0.06
        rays = off[:, phase[1] :: 2, phase[0] :: 2]
        assert rays.mean() < 0.004  # these are rays; only where they begin differs, and the background's rows
        there = np.isfinite(shown["Z"]) & np.isfinite(exact["Z"])
        assert np.mean(np.isfinite(shown["Z"]) != np.isfinite(exact["Z"])) < 0.03
        assert np.median(np.abs(shown["Z"][there] - exact["Z"][there])) < 0.01


def test_a_camera_that_stands_still_shows_in_four_frames_what_rays_show(device: Device) -> None:
    scene = scene_of(BULB, *LARGER, "renderer.samples=1")
    with session_on(device, Pacing(coarsest=1)) as watch:
        watch.finished(scene)
        moved(watch, turned(scene, 5 * DEGREE))
        for _ in range(len(PHASES)):
            frame = moved(watch, turned(scene, 6 * DEGREE))
        found, wanted = planes(frame)[0], by_rays(device, watch, frame)[0]
    off = np.abs(linear_to_screen(found) - linear_to_screen(wanted))
    assert off.mean() < 0.01


def test_nothing_is_older_than_some_frames(device: Device) -> None:
    scene = scene_of(BULB, *LARGER)
    with session_on(device, Pacing(coarsest=1)) as watch:
        watch.finished(scene)
        shares = []
        for step in range(1, 2 * OLDEST + 3):
            frame = moved(watch, turned(scene, DEGREE * step))
            carrier = watch.session._painter._carrier
            assert carrier is not None
            ages = carrier.ages(0)
            assert ages.max() <= OLDEST
            shares.append(float(np.mean(ages[np.isfinite(planes(frame)[0]["Z"])] >= len(PHASES))))
    assert max(shares[OLDEST:]) < 0.2  # most are rendered each fourth frame


def test_other_pictures_take_nothing_from_the_one_before(device: Device) -> None:
    """Also where the camera has moved with something else."""
    scene = scene_of(BULB)
    others = [
        scene_of(BULB, "formula.iterations=7"),
        scene_of(BULB, "image.width=80"),
        scene_of(BULB, "material.color=[0.2, 0.4, 0.6]"),
    ]
    with session_on(device, Pacing(coarsest=1)) as watch:
        watch.finished(scene)
        for other in others:
            assert not moved(watch, turned(other, DEGREE)).carried
            assert moved(watch, turned(other, 2 * DEGREE)).carried


def job_of(device: Device, *overrides: str) -> Job:
    return prepare(scene_of(BULB, *overrides), device, channels=CHANNELS)


@pytest.mark.parametrize(
    "more",
    [
        ("renderer={type: volume, resolution: 24, samples: 3}", "coloring.by=solid"),
        ("renderer={type: cut_plane, samples: 5, plane: {width: 3, height: 2}}",),
        ("lighting={mode: path}",),
        ("material.reflection=0.5",),
        ("camera.f_number=2",),
        (HALVES,),
        ("renderer.points={count: 9}",),
    ],
    ids=["volume", "cut plane", "paths", "mirror", "lens", "a cut plane beside it", "points"],
)
def test_what_hangs_on_more_than_the_place_of_a_surface_is_rendered(
    more: tuple[str, ...], device: Device
) -> None:
    job = job_of(device, *more)
    assert not can_carry(job, job)
    plain = job_of(device)
    assert can_carry(plain, plain)
    assert not can_carry(plain, job)
    assert not can_carry(job_of(device, ORTHOGRAPHIC), plain)


def test_a_part_of_a_picture_is_rendered(device: Device) -> None:
    job = job_of(device)
    view = job.views[0]
    plan = replace(view.plan, region=replace(view.plan.region, x=8, width=40))
    assert not can_carry(job, replace(job, views=(replace(view, plan=plan),)))


@pytest.mark.parametrize("more", [(), (ORTHOGRAPHIC,), (STEREO,)], ids=["perspective", "orthographic", "eye"])
@pytest.mark.parametrize("divider", [1, 2, 3])
def test_pixels_of_two_views_are_found_in_each_other(
    more: tuple[str, ...], divider: int, device: Device
) -> None:
    """Against the points in space that a view names."""
    other = job_of(device, *more)
    moved_job = prepare(turned(scene_of(BULB, *more), 0.3), device, channels=CHANNELS)
    here, there = moved_job.views[-1].coarse(divider), other.views[-1].coarse(2)
    image, perspective = here.scene.image, here.camera.eye is not None
    size, depth = (image.width, image.height), np.array([2.5, 3.0])
    x, y = np.array([3, 20]), np.array([5, 11])
    first = here.plan.first
    points = here.camera.points_at(divider * x + first[0], divider * y + first[1], size, depth)
    matrix, back = places(here, there)
    w = depth if perspective else np.ones(2)
    across, down, far, _ = matrix @ np.array([x * w, y * w, depth, np.ones(2)])
    share = far if perspective else np.ones(2)
    at = 2 * across / share + there.plan.first[0], 2 * down / share + there.plan.first[1]
    np.testing.assert_allclose(there.camera.points_at(*at, size, far), points, atol=1e-9)
    np.testing.assert_allclose(matrix @ back, np.eye(4), atol=1e-9)


def test_sparse_views_have_the_rays_of_the_whole_one(device: Device) -> None:
    view = job_of(device).views[0]
    for divider in (1, 2, 3):
        whole = view.coarse(divider).plan
        for phase in PHASES:
            sparse = view.sparse(divider, phase).plan
            assert sparse.divider == 2 * divider
            for axis in (0, 1):
                assert sparse.first[axis] == whole.first[axis] + divider * phase[axis]


@pytest.mark.parametrize("what", ["__init__", "begin", "carry"])
def test_where_it_fails_pictures_move_as_before(
    what: str, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **__: object) -> None:
        raise DeviceError("there is no room")

    monkeypatch.setattr(carrying.Carrier, what, fails)
    scene = scene_of(BULB)
    with session_on(device, Pacing(coarsest=1)) as watch:
        watch.finished(scene)
        assert not moved(watch, turned(scene, DEGREE)).carried
        assert watch.session.problem is None


@pytest.mark.parametrize("cost", [1e-7, 1e-6, 1e-5])
def test_the_coarseness_of_a_movement_does_not_swing(cost: float) -> None:
    """Once it is known what a pixel takes, it stays, although frames of another coarseness take another time."""
    pacing, pixels = Pacing(), 1280 * 720
    dividers = []
    for _ in range(60):
        divider = pacing.divider(pixels, carries=True)
        dividers.append(divider)
        whole = pixels // divider**2
        kernel = whole / 4 * cost
        pacing.learn(whole // 4, kernel, kernel + 0.002)
        pacing.learn_carrying(whole, whole * 3e-8)
    assert len(set(dividers[30:])) == 1
    assert dividers[-1] <= pacing.divider(pixels)
