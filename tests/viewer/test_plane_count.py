"""A cut plane's picture tells the point under the pointer and its count: the numbers that Python and the shell give."""

from __future__ import annotations

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.engine.show import Look
from clfractal.viewer.panels import overlay
from clfractal.viewer.picking import picked
from clfractal.viewer.plane_count import PlaneCount, point_on_plane
from tests.viewer.panel_harness import make_ui
from tests.viewer.sessions import session_on, shown_frame, wait_for
from tests.window.scenes import CUT_PLANE, LAYOUT


def test_the_count_under_the_pointer(device: Device) -> None:
    scene = clfractal.load_scene(CUT_PLANE, overrides=["image={width: 90, height: 60}"])
    ui, _ = make_ui(scene)
    with session_on(device) as watch:
        frame = watch.finished(scene)
        shown, _ = shown_frame(device, watch, frame, Look())
        ui.studio.session = watch.session
        texts: list[str] = []
        for x, y in ((45.5, 30.5), (80.5, 5.5), (34.5, 20.5)):
            ui.pick = picked(shown, x, y)
            assert ui.pick is not None
            point = point_on_plane(ui.pick)
            assert point is not None
            # 3.6 x 2.4 about (-0.75, 0, 0), y upwards.
            assert point == pytest.approx((-0.75 + 3.6 * (x / 90 - 0.5), -2.4 * (y / 60 - 0.5), 0))

            def told() -> dict[str, str]:
                return {label: text for row in overlay.lines(ui) for label, text in row}

            assert told()["count"] in ("...", *texts)
            wait_for(lambda: told()["count"] != "...")
            counts, inside = clfractal.escape("hast", [point], iterations=60)
            texts.append(told()["count"])
            assert texts[-1] == (f"{counts[0]}, inside" if inside[0] else f"{counts[0]}")
            assert np.allclose(
                [float(each) for each in told()["point"].split(",")], point, rtol=1e-5, atol=1e-9
            )
        assert texts[0] == "60, inside"
        assert len(set(texts)) == 3


def test_in_a_split_picture_the_half_with_the_plane_has_counts(device: Device) -> None:
    scene = clfractal.load_scene(LAYOUT)
    counts = PlaneCount(make_ui(scene)[0].studio)
    with session_on(device) as watch:
        frame = watch.finished(scene)
        shown, _ = shown_frame(device, watch, frame, Look())
        left, right = picked(shown, 100.5, 120.5), picked(shown, 300.5, 120.5)
    assert left is not None
    assert right is not None
    assert point_on_plane(left) is None
    middle = point_on_plane(right)
    assert middle is not None
    assert counts.at(right, middle) == ""
