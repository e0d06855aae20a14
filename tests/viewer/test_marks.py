"""What is drawn over the picture: lights, fainter where they stand behind what is looked at."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.camera.views import scene_view
from clfractal.viewer import handles
from clfractal.viewer import marked_lines as marks
from tests.render.shots import BALL, PERSPECTIVE
from tests.scenes import scene_of
from tests.viewer.panel_harness import headless

SIZE = (64, 64)


class Canvas:
    """Remembers circles, their middles and opacities, and lines: middle, thickness, opacity."""

    def __init__(self) -> None:
        self.filled: list[tuple[float, float, int]] = []
        self.rims: list[tuple[float, float, int]] = []
        self.texts: list[str] = []
        self.lines: list[tuple[float, float, float, int]] = []

    def add_line(self, start: Any, end: Any, color: int, thick: float) -> None:
        self.lines.append(((start.x + end.x) / 2, (start.y + end.y) / 2, thick, color >> 24))

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


def test_edges_behind_the_surface_are_faint() -> None:
    """A cube around a wall: its near half is bright, its far half faint; without depths all of it is bright."""
    view = scene_view(scene_of(BALL, PERSPECTIVE, SIZE))
    distance = float(np.linalg.norm(view.origin))
    toward = -view.origin / distance
    segment = np.array(
        [
            [
                view.origin + toward * (distance - 0.5),
                view.origin + toward * (distance + 0.5) + 1e-3 * view.side,
            ]
        ]
    )
    for depths, share in ((np.full((8, 8), distance), 0.5), (np.full((8, 8), np.inf), 0.0), (None, 0.0)):
        canvas = Canvas()
        with headless():
            marks._lines(canvas, view, segment, SIZE, 1.0, (1, 1, 1), 1.0, 2.0, depths)
        faint = [each for each in canvas.lines if each[3] < 128]
        assert len(faint) == pytest.approx(share * len(canvas.lines), abs=1)
        assert {each[2] for each in canvas.lines} == ({1.0, 2.0} if share else {2.0})
