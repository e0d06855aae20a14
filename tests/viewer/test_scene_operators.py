"""Every action of the table of keys is done by something, and does what it says."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.engine.prepare import prepare
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.viewer.actions import ACTIONS
from clfractal.viewer.aim import Aim, aimed
from clfractal.viewer.controls import Controls
from clfractal.viewer.motion import TRANSITION_SECONDS, Motion
from clfractal.viewer.operators import HELD, Operators
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.picking import Pick
from clfractal.viewer.playing import Player
from clfractal.viewer.scene_operators import STEREO_MODES, SceneOperators
from clfractal.viewer.settings import Settings
from clfractal.viewer.studio import Studio
from tests.scenes import STEREO
from tests.viewer.sessions import BULB, scene_of

VIEW = (128, 96)
PLANE = "renderer={type: cut_plane, plane: {width: 3, height: 2.25}}"
VOLUME = ("renderer={type: volume, resolution: 16}", "coloring.by=solid")


class Desk:
    """A studio whose session waits, so that only the scene is looked at, and the actions of keys."""

    def __init__(self, device: Device, *overrides: str) -> None:
        self.studio = Studio(scene_of(BULB, *overrides), device, Pacing(), lambda: None)
        self.studio.viewport = VIEW
        self.device = device
        self.studio.session.request = lambda *_, **__: 0  # type: ignore[method-assign]
        self.motion = Motion(self.studio)
        self.controls = Controls(self.studio, Settings(), self.motion)
        self.now = 0.0
        self.hit: float = 2.0
        self.operators = SceneOperators(self.studio, self.controls, self.motion, self.aim, lambda: self.now)

    def aim(self) -> Aim:
        """What is in the middle of the picture: at a depth of `hit`."""
        scene = self.studio.shown_scene
        view = prepare(scene, self.device).views[0]
        size = (view.scene.image.width, view.scene.image.height)
        point = None
        if math.isfinite(self.hit) and view.camera.eye is not None:
            point = tuple((view.camera.eye + self.hit * view.camera.axis).tolist())
        return aimed(scene, Pick(view, view.camera, size[0] / 2, size[1] / 2, size, self.hit, point))

    def do(self, name: str) -> None:
        """Does an action, and waits until the camera has stopped."""
        self.operators.operators[name]()
        self.now += 2 * TRANSITION_SECONDS
        while self.motion.step(self.now, 0.02):
            pass

    @property
    def camera(self) -> Any:
        return self.studio.scene.camera

    @property
    def plane(self) -> Any:
        renderer = self.studio.scene.renderer
        assert isinstance(renderer, CutPlaneRenderer)
        return renderer.plane.placed


@pytest.fixture
def desk(device: Device, request: pytest.FixtureRequest) -> Iterator[Desk]:
    made = Desk(device, *getattr(request, "param", ()))
    yield made
    made.studio.close()


def test_every_action_is_done_by_something(desk: Desk) -> None:
    """Those of the scene and those of the window, and none that no key can name."""

    class Anything:
        def __getattr__(self, _: str) -> Callable[..., None]:
            return lambda *_, **__: None

    viewer = SimpleNamespace(
        studio=desk.studio,
        controls=desk.controls,
        motion=desk.motion,
        player=Player(desk.studio),
        settings=Settings(),
        aim=desk.aim,
        now=0.0,
        files=Anything(),
        outputs=Anything(),
        window=Anything(),
        ui=SimpleNamespace(show=set()),
    )
    operators = Operators(cast(Any, viewer))
    # (One is a button of a panel alone.)
    assert operators.names - set(ACTIONS) <= {"focus_pick"}
    assert set(ACTIONS) <= operators.names
    assert {action.name for action in ACTIONS.values() if action.held} == set(HELD)


@pytest.mark.parametrize("desk", [(), (STEREO,), (PLANE,), VOLUME], indirect=True)
def test_no_action_fails_and_scenes_stay_valid(desk: Desk) -> None:
    """All of them, one after the other, twice: whatever they find."""
    from clfractal.scene.load import load_scene

    for _ in range(2):
        for name in sorted(desk.operators.operators):
            desk.do(name)
            assert load_scene(desk.studio.scene.resolved()) == desk.studio.scene, name


def azimuth(desk: Desk) -> float:
    x, y, _ = desk.camera.position
    return math.degrees(math.atan2(x, -y))


def test_orbits(desk: Desk) -> None:
    """The keys move the camera about what the middle shows: to its right it sees more of the right side."""
    first, pivot = desk.camera, desk.aim().point
    assert pivot is not None
    desk.do("orbit_right")
    assert azimuth(desk) > 1
    assert math.dist(desk.camera.position, pivot) == pytest.approx(math.dist(first.position, pivot))
    desk.do("orbit_left")
    assert desk.camera.position == pytest.approx(first.position, abs=1e-9)
    desk.do("orbit_up")
    assert desk.camera.position[2] > first.position[2]
    desk.do("orbit_down")
    assert desk.camera.position == pytest.approx(first.position, abs=1e-6)
    assert desk.studio.history.depth("camera") == (4, 0)


@pytest.mark.parametrize(
    ("way", "axis", "sign"), [("left", 0, -1), ("right", 0, 1), ("up", 2, 1), ("down", 2, -1)]
)
def test_pans(way: str, axis: int, sign: int, desk: Desk) -> None:
    before = np.array(desk.camera.position)
    desk.do(f"pan_{way}")
    assert (np.array(desk.camera.position) - before)[axis] * sign > 0.01


def test_zooms(desk: Desk) -> None:
    def distance() -> float:
        return float(np.linalg.norm(np.subtract(desk.camera.position, desk.camera.target)))

    before = distance()
    desk.do("zoom_in")
    assert distance() < before
    desk.do("zoom_out")
    assert distance() == pytest.approx(before)


@pytest.mark.parametrize(
    ("side", "direction"),
    [
        ("front", (0, -1, 0)),
        ("back", (0, 1, 0)),
        ("right", (1, 0, 0)),
        ("left", (-1, 0, 0)),
        ("top", (0, 0, 1)),
        ("bottom", (0, 0, -1)),
    ],
)
def test_the_six_views(side: str, direction: tuple[int, int, int], desk: Desk) -> None:
    desk.do(f"view_{side}")
    center = np.array(desk.studio.scene.bounds[0])
    offset = np.array(desk.camera.position) - center
    assert offset / np.linalg.norm(offset) == pytest.approx(direction, abs=1e-6)


def test_projection_and_back(desk: Desk) -> None:
    first = desk.camera
    desk.do("projection")
    assert desk.camera.projection == "orthographic"
    desk.do("projection")
    assert desk.camera.position == pytest.approx(first.position, abs=1e-6)
    assert desk.camera.fov == pytest.approx(first.fov)


def test_levelling(desk: Desk) -> None:
    desk.studio.edit({"camera.up": [0.4, 0, 1]})
    desk.do("level")
    assert desk.camera.up[0] == pytest.approx(0, abs=1e-9)


def test_framing_shows_the_whole_object(desk: Desk) -> None:
    desk.studio.edit({"camera.position": [0, -30, 0], "camera.target": [3, 0, 0]})
    desk.do("frame_all")
    center, radius = desk.studio.scene.bounds
    assert desk.camera.target == pytest.approx(center, abs=1e-6)
    distance = np.linalg.norm(np.subtract(desk.camera.position, center))
    assert radius < distance < 6 * radius


def test_the_pointer_is_centred_and_focused(desk: Desk) -> None:
    desk.do("focus_pointer")
    assert desk.studio.value("camera.focus_distance") == pytest.approx(2.0)
    point = desk.aim().point
    desk.do("center_pointer")
    assert desk.camera.target == pytest.approx(point, abs=1e-9)
    desk.hit = math.inf
    before = desk.studio.scene
    desk.do("center_pointer")
    desk.do("focus_pointer")
    assert desk.studio.scene is before
    assert desk.studio.messages[-1].wrong
    desk.do("focus_pick")
    assert desk.controls.focusing


def test_bookmarks(desk: Desk) -> None:
    first = desk.camera
    desk.do("bookmark_add")
    desk.do("orbit_right")
    second = desk.camera
    desk.do("bookmark_add")
    assert list(desk.studio.scene.bookmarks) == ["view 1", "view 2"]
    desk.do("bookmark_1")
    assert desk.camera == first
    desk.do("bookmark_2")
    assert desk.camera == second
    desk.do("bookmark_3")
    assert desk.studio.messages[-1].wrong
    assert desk.camera == second


@pytest.mark.parametrize("desk", [(PLANE,)], indirect=True)
def test_planes_are_moved_and_turned(desk: Desk) -> None:
    first = desk.plane
    for one, other in (
        ("move_out", "move_in"),
        ("move_left", "move_right"),
        ("move_up", "move_down"),
        ("turn_left", "turn_right"),
        ("turn_up", "turn_down"),
        ("spin_left", "spin_right"),
        ("larger", "smaller"),
    ):
        desk.do(one)
        moved = desk.plane
        assert moved != first, one
        desk.do(other)
        for name in ("center", "normal", "up"):
            assert getattr(desk.plane, name) == pytest.approx(getattr(first, name), abs=1e-9), one
        assert desk.plane.height == pytest.approx(first.height)


@pytest.mark.parametrize("desk", [(PLANE,)], indirect=True)
def test_zooming_a_plane(desk: Desk) -> None:
    height = desk.plane.height
    desk.do("zoom_in")
    assert desk.plane.height == pytest.approx(0.85 * height)
    desk.do("move_out")
    desk.do("frame_all")
    assert desk.plane.center == pytest.approx((0, 0, 0), abs=1e-9)


def test_cutting_open_and_closing(desk: Desk) -> None:
    desk.do("cut")
    assert [plane.cut for plane in desk.studio.scene.cut_planes] == [True]
    desk.do("cut")
    assert [plane.cut for plane in desk.studio.scene.cut_planes] == [False]
    before = desk.studio.scene.cut_planes[0]
    desk.do("move_out")
    assert desk.studio.scene.cut_planes[0] != before


@pytest.mark.parametrize("desk", [VOLUME], indirect=True)
def test_the_zoom_cube(desk: Desk) -> None:
    desk.do("zoom_apply")
    assert desk.controls.marking
    box = desk.controls.box
    assert box is not None
    for one, other in (("move_left", "move_right"), ("move_up", "move_down"), ("move_in", "move_out")):
        desk.do(one)
        assert desk.controls.box != box, one
        desk.do(other)
        desk.controls.box = box
    desk.do("smaller")
    assert desk.controls.box is not None
    assert desk.controls.box.scale > box.scale  # a magnification
    desk.do("larger")
    assert desk.controls.box.scale == pytest.approx(box.scale)
    desk.do("zoom_apply")
    assert len(desk.studio.value("renderer.zoom")) == 1
    desk.do("zoom_back")
    assert desk.studio.value("renderer.zoom") == []
    desk.do("zoom_mark")
    assert not desk.controls.marking


def test_renderers_in_turn(desk: Desk) -> None:
    kinds = []
    for _ in range(3):
        desk.do("next_renderer")
        kinds.append(desk.studio.scene.renderer.type)
    assert kinds == ["volume", "cut_plane", "surface"]
    assert desk.studio.scene.renderer.samples == 4
    # Each one keeps the objects that it shows.
    assert desk.studio.edit({"objects": {"ball": {"type": "sphere"}, "sea": {"type": "water"}}})
    left = []
    for _ in range(2):
        desk.do("next_renderer")
        left.append(list(desk.studio.scene.objects))
    assert left == [["ball"], ["ball"]]


def test_ways_of_stereo_in_turn(desk: Desk) -> None:
    """All of them, there and back; settings survive switching it off."""
    seen = []
    for _ in range(len(STEREO_MODES)):
        desk.do("next_stereo")
        stereo = desk.studio.scene.stereo
        seen.append(stereo.mode if stereo is not None else None)
    assert seen == [*STEREO_MODES[1:], None]
    desk.do("next_stereo")
    desk.do("screen_wider")
    wide = desk.studio.value("stereo.screen_width")
    desk.do("previous_stereo")
    assert desk.studio.scene.stereo is None
    desk.do("previous_stereo")
    assert desk.studio.value("stereo.mode") == STEREO_MODES[-1]
    assert desk.studio.value("stereo.screen_width") == wide


@pytest.mark.parametrize("desk", [(STEREO, "image.width=77", "image.height=41")], indirect=True)
def test_ways_that_a_scene_does_not_fit_are_left_out(desk: Desk) -> None:
    """A width and a height that cannot be halved."""
    seen = set()
    for _ in range(len(STEREO_MODES)):
        desk.do("next_stereo")
        seen.add(desk.studio.value("stereo.mode"))
    assert seen == set(STEREO_MODES) - {"split_half", "over_under_half"}


@pytest.mark.parametrize("desk", [(STEREO,)], indirect=True)
@pytest.mark.parametrize(
    ("one", "other", "key"),
    [
        ("eyes_farther", "eyes_nearer", "interpupillary_distance"),
        ("screen_farther", "screen_nearer", "screen_distance"),
        ("screen_wider", "screen_narrower", "screen_width"),
    ],
)
def test_distances_of_stereo(one: str, other: str, key: str, desk: Desk) -> None:
    before = desk.studio.value(f"stereo.{key}")
    desk.do(one)
    assert desk.studio.value(f"stereo.{key}") == pytest.approx(before * 1.05)
    desk.do(other)
    assert desk.studio.value(f"stereo.{key}") == pytest.approx(before)


@pytest.mark.parametrize("desk", [(STEREO,)], indirect=True)
def test_swapping_and_fitting(desk: Desk) -> None:
    desk.do("swap_eyes")
    assert desk.studio.value("stereo.swap") is True
    desk.do("fit_stereo")
    assert desk.studio.value("stereo.fit") == "auto"
    desk.do("fit_stereo")
    assert desk.studio.value("stereo.fit") is None


@pytest.mark.parametrize(
    ("desk", "name"),
    [
        ((STEREO,), "projection"),
        (("camera={projection: orthographic, position: [0, -3, 0]}",), "next_stereo"),
        *(((), name) for name in ("swap_eyes", "fit_stereo", "eyes_nearer", "zoom_mark")),
    ],
    indirect=["desk"],
)
def test_what_cannot_be_done_is_told(name: str, desk: Desk) -> None:
    """Stereo needs perspective, and two eyes; a cube is for volumes."""
    before = desk.studio.scene
    desk.do(name)
    assert desk.studio.scene == before
    assert not desk.controls.marking
    assert sum(message.wrong for message in desk.studio.messages) == 1


def test_exposure(desk: Desk) -> None:
    desk.do("exposure_up")
    desk.do("exposure_up")
    assert desk.studio.value("output.exposure") == 0.5
    desk.do("exposure_down")
    assert desk.studio.value("output.exposure") == 0.25
    desk.do("exposure_reset")
    assert desk.studio.value("output.exposure") == 0


def test_undo_and_redo(desk: Desk) -> None:
    first = desk.studio.scene
    desk.do("exposure_up")
    desk.do("orbit_left")
    last = desk.studio.scene
    desk.do("undo")
    assert desk.studio.scene.camera == last.camera
    assert desk.studio.value("output.exposure") == 0
    desk.do("undo_camera")
    assert desk.studio.scene == first
    desk.do("undo")
    assert "nothing" in desk.studio.messages[-1].text
    desk.do("redo_camera")
    desk.do("redo")
    assert desk.studio.scene == last


def test_keys_add_up_while_the_camera_moves(desk: Desk) -> None:
    """Three presses in a row turn three times as far, also if each comes before the camera has stopped."""
    other = Desk(desk.device)
    for _ in range(3):
        desk.do("orbit_right")
        other.operators.operators["orbit_right"]()
        other.motion.step(other.now + 0.1 * TRANSITION_SECONDS, 0.02)
    other.now = 5
    other.motion.step(other.now, 0.02)
    assert azimuth(other) == pytest.approx(azimuth(desk), abs=1e-6)
    other.studio.close()


def test_regions(desk: Desk) -> None:
    desk.do("region")
    assert desk.controls.choosing_region
    desk.studio.set_region((1, 2, 30, 40))
    desk.do("region_clear")
    assert desk.studio.region is None
