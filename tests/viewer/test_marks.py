"""What is drawn over the picture: lights, fainter where they stand behind what is looked at."""

from __future__ import annotations

from typing import Any

import pytest

from clfractal.optics.view import scene_view
from clfractal.viewer import handles, marks
from tests.render.shots import BALL, PERSPECTIVE, scene_of
from tests.viewer.panel_harness import headless

SIZE = (64, 64)


class Canvas:
    """Remembers circles: their middles, radii and colours."""

    def __init__(self) -> None:
        self.filled: list[tuple[float, float, int]] = []
        self.rims: list[tuple[float, float, int]] = []
        self.texts: list[str] = []

    def add_circle_filled(self, middle: Any, radius: float, color: int, segments: int) -> None:
        self.filled.append((middle.x, middle.y, color >> 24))

    def add_circle(self, middle: Any, radius: float, color: int, segments: int, thick: float) -> None:
        self.rims.append((middle.x, middle.y, color >> 24))

    def add_text(self, place: Any, color: int, text: str) -> None:
        self.texts.append(text)


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_lights_behind_are_fainter(scale: float) -> None:
    ahead, behind = {"direction": [-1.5, 2.5, -1.5]}, {"direction": [1.0, -2.5, 1.0]}
    scene = scene_of(BALL, PERSPECTIVE, SIZE, lights=[ahead, behind])
    view = scene_view(scene)
    assert [handles.is_behind(light, view) for light in scene.lights] == [False, True]
    canvas = Canvas()
    with headless():
        marks._lights(canvas, scene, view, SIZE, scale)
    assert canvas.texts == ["1", "2"]
    _, *rims = canvas.rims  # the first is the circle on which they move
    for number, light in enumerate(scene.lights):
        place = handles.handle_position(light, view, SIZE, scene.bounds)
        assert place is not None
        for x, y, _ in (canvas.filled[number], rims[number]):
            assert (x, y) == pytest.approx((place[0] / scale, place[1] / scale), abs=1e-3)
    assert [alpha for *_, alpha in canvas.filled] == [pytest.approx(255 * a, abs=1) for a in (0.9, 0.35)]
    assert [alpha for *_, alpha in rims] == [pytest.approx(255 * a, abs=1) for a in (1.0, 0.5)]
