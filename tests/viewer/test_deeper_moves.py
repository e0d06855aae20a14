"""The window goes deeper by itself: what is under the pointer stays there, wherever float64 ends, and back again."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

import pytest

from clfractal.device.select import Device
from clfractal.scene.deeper import Exact, exact_point, magnified, seen_point
from clfractal.viewer.controls import RIGHT
from clfractal.viewer.motion import TRANSITION_SECONDS
from clfractal.viewer.navigation import dolly
from tests.scenes import bulb_text
from tests.viewer.hands import VIEW, Hand
from tests.viewer.sessions import scene_of

PLACE = (70.3, 51.8)


@pytest.fixture
def hand(device: Device, request: pytest.FixtureRequest) -> Iterator[Hand]:
    more = getattr(request, "param", "")
    made = Hand(scene_of(bulb_text(VIEW, f"renderer: {{samples: 1, max_steps: 3000}}\n{more}")), device)
    yield made
    made.close()


def wheel(hand: Hand, steps: float) -> None:
    """Turns the wheel over the picture, and lets the scene settle: what is under it stays there, and is nearer."""
    aim = hand.aim(*PLACE)
    assert aim.point is not None
    under = exact_point(aim.point, hand.studio.scene.deep)
    before = away(hand, under)
    hand.now += 1
    hand.controls.wheel(steps, 0, aim, hand.now)
    hand.deeper.look()
    assert hand.at(seen_point(under, hand.studio.scene.deep)) == pytest.approx(PLACE, abs=0.01)
    assert away(hand, under) / before == pytest.approx(0.88**steps, rel=1e-6)


def away(hand: Hand, point: Exact) -> float:
    """How far the camera is from a point, in the formula's space."""
    scene = hand.studio.scene
    eye = exact_point(scene.camera.position, scene.deep)
    return math.hypot(*(float(a - b) for a, b in zip(eye, point, strict=True)))


def test_the_wheel_goes_on_below_what_float64_resolves(hand: Hand) -> None:
    iterations = hand.studio.scene.formula.iterations
    while magnified(hand.studio.scene) < 1e19:
        wheel(hand, 12)
    scene = hand.studio.scene
    assert scene.deep is not None
    assert all(len(each) > 30 for each in scene.deep.center)
    assert max(map(abs, scene.camera.position)) < 20
    # Details come that many applications later; that is no change of the user's.
    assert iterations + 15 < scene.formula.iterations < iterations + 60
    assert hand.studio.history.depth("scene") == (0, 0)
    # The steps of a wheel that never rested are one; it leads back to where it began.
    assert hand.studio.undo("camera")
    assert (hand.studio.scene.deep, hand.studio.scene.camera) == (None, hand.studio.saved.camera)
    assert hand.studio.redo("camera")
    assert hand.studio.scene == scene
    while hand.studio.scene.deep is not None:
        hand.studio.set_camera(dolly(hand.studio.scene.camera, 20.0))
        hand.deeper.look()
    assert magnified(hand.studio.scene) < 1e4
    assert hand.studio.scene.formula.iterations == iterations


def test_a_move_under_way_goes_on_in_the_new_place(hand: Hand) -> None:
    camera = hand.studio.scene.camera
    hand.motion.go_to(dolly(camera, 1e-8), 0.0)
    for share in (0.2, 0.5, 0.8, 0.95, 1.01):
        hand.motion.step(share * TRANSITION_SECONDS, 0.01)
        hand.deeper.look()
    assert hand.studio.scene.deep is not None
    assert magnified(hand.studio.scene) == pytest.approx(1e8 * 3 / math.dist(camera.position, camera.target))


def test_a_drag_in_a_deep_place_moves_what_is_under_it(hand: Hand) -> None:
    for _ in range(10):
        wheel(hand, 12)
    aim = hand.aim(*PLACE)
    under = exact_point(aim.point, hand.studio.scene.deep)
    end = (40.0, 30.0)
    hand.drag(RIGHT, PLACE, end)
    hand.deeper.look()
    assert hand.at(seen_point(under, hand.studio.scene.deep)) == pytest.approx(end, abs=0.01)


@pytest.mark.parametrize(
    ("hand", "why"),
    [("fog: {density: 0.1}\n", "fog"), ("objects: {a: {type: sphere, position: [9, 9, 9]}}\n", "objects")],
    indirect=["hand"],
)
def test_what_would_have_to_move_along_is_told_once(hand: Hand, why: str) -> None:
    for _ in range(5):
        hand.studio.set_camera(dolly(hand.studio.scene.camera, 0.03), "wheel")
        hand.deeper.look()
    told = [message.text for message in hand.studio.messages]
    assert [why in text for text in told] == [True]
    assert hand.studio.scene.deep is None


def test_a_scene_that_was_opened_stays_as_its_file_has_it(hand: Hand) -> None:
    near = hand.studio.scene.model_copy(update={"camera": dolly(hand.studio.scene.camera, 1e-6)})
    hand.studio.open(near)
    hand.deeper.look()
    assert hand.studio.scene is near
    assert not hand.studio.unsaved


def test_places_keep_all_digits(hand: Hand) -> None:
    center = [f"0.1{'234567890' * 11}1", "-0.5", "1e-90"]
    assert hand.studio.edit({"deep": {"center": center, "magnification": 1e95}})
    deep = hand.studio.scene.deep
    assert deep is not None
    assert hand.studio.undo("camera")
    assert hand.studio.redo("camera")
    assert list(hand.studio.scene.deep.center) == center  # type: ignore[union-attr]
    assert hand.studio.edit({"deep.center.1": "-0.50000000000000000000000000000000000001"})
    moved = hand.studio.scene.deep
    assert moved is not None
    assert Fraction(moved.center[1]) - Fraction(deep.center[1]) == -Fraction(1, 10**38)
    assert not hand.studio.edit({"deep.center.1": "half"})
    assert "decimal" in hand.studio.problems["deep.center.1"]
