"""The window's picture at rest without its noise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.errors import FileError
from clfractal.viewer import resting
from tests.scenes import STEREO
from tests.viewer.sessions import BULB, framebuffers_of, scene_of, session_on, wait_for

PATHS = (
    "lighting={mode: path, bounces: 2}",
    "lights=[]",
    "environment={name: dusk}",
    "renderer={type: surface, samples: 4}",
)
CLEAN = "output.denoise=true"


def colors(framebuffer: Any) -> Any:
    return np.stack([framebuffer[name] for name in "RGB"], -1).astype(float)


def error(found: Any, exact: Any) -> float:
    """Of what a screen shows: bright light counts no more than white."""
    return float(np.sqrt(((np.clip(found, 0, 1) - np.clip(exact, 0, 1)) ** 2).mean()))


def test_at_rest_the_noise_is_gone(device: Device) -> None:
    noisy, wanted = scene_of(BULB, *PATHS), scene_of(BULB, *PATHS, CLEAN)
    exact = colors(clfractal.render(noisy, samples=128, channels=("R", "G", "B")))
    with session_on(device) as watch:
        before = colors(framebuffers_of(watch.finished(noisy)).framebuffers[0])
        frame = watch.finished(wanted)
        after = framebuffers_of(frame).framebuffers[0]
        frames = watch.frames
    assert error(colors(after), exact) < 0.65 * error(before, exact)
    # About as good as what is saved, which knows more of the surfaces.
    still = colors(clfractal.render(wanted, channels=("R", "G", "B")))
    assert error(colors(after), exact) < 1.3 * error(still, exact)
    assert [each.finished for each in frames if each.scene == wanted].count(True) == 1


@pytest.mark.parametrize(
    "sections",
    [
        (STEREO,),
        ("layout={columns: 2, views: [{}, {renderer: {type: cut_plane, samples: 3}}]}",),
        (
            "renderer={type: volume, resolution: 16, samples: 2}",
            "coloring.by=solid",
            "lighting={mode: direct}",
        ),
    ],
    ids=["anaglyph", "layout", "volume"],
)
def test_pairs_layouts_and_volumes(device: Device, sections: tuple[str, ...]) -> None:
    """Each part by itself, by its colours alone where no surface tells more."""
    wanted = scene_of(BULB, *PATHS, *sections, CLEAN)
    with session_on(device) as watch:
        frame = watch.finished(wanted)
        framebuffers = framebuffers_of(frame).framebuffers
    assert watch.session.problem is None
    assert all(np.isfinite(colors(framebuffer)).all() for framebuffer in framebuffers)
    assert frame.finished


def test_without_the_package_the_picture_stays_as_it_is(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing() -> None:
        raise FileError("needs the package pyoidn")

    monkeypatch.setattr(resting, "check_installed", missing)
    with session_on(device) as watch:
        before = colors(framebuffers_of(watch.finished(scene_of(BULB, *PATHS))).framebuffers[0])
        watch.session.request(scene_of(BULB, *PATHS, CLEAN))
        frame = watch.rest()
        assert frame.finished
        after = colors(framebuffers_of(frame).framebuffers[0])
        assert "pyoidn" in str(watch.session.problem)
    np.testing.assert_array_equal(before, after)


def test_what_moves_is_not_kept_waiting(device: Device) -> None:
    """A request ends the filter's preparations; the next picture is cleaned as well."""
    first = scene_of(BULB, *PATHS, CLEAN)
    second = scene_of(BULB, *PATHS, CLEAN, "camera.fov=35")
    with session_on(device) as watch:
        watch.session.request(first)
        wait_for(lambda: watch.session.frame is not None and watch.session.frame.samples == 4)
        frame = watch.finished(second)
        assert frame.scene == second
        assert frame.finished
