"""Places of a window: panels once or for each eye, and the pictures that fill it."""

from __future__ import annotations

from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.images.modes import picture_size
from clfractal.scene.model import Scene
from clfractal.scene.stereo import APART, Mode, Stereo
from clfractal.viewer.viewport import image_of, render_key
from clfractal.viewer.window_places import places_of
from tests.scenes import STEREO
from tests.viewer.sessions import scene_of

MODES = get_args(Mode)
SIDES = st.integers(2, 4000)


def stereo_of(mode: str, **values: object) -> Stereo:
    return Stereo.model_validate({"mode": mode, **values})


@given(st.sampled_from(MODES), SIDES, SIDES)
def test_a_picture_fills_the_window(mode: str, width: int, height: int) -> None:
    """But for a column or row, where a size cannot be halved."""
    stereo = stereo_of(mode)
    image = image_of(stereo, (width, height))
    shown = stereo_of("split") if mode in APART else stereo
    wide, high = picture_size(shown, image)
    assert width - 1 <= wide <= width
    assert height - 1 <= high <= height


@given(SIDES, SIDES)
def test_without_stereo_it_fills_all(width: int, height: int) -> None:
    assert image_of(None, (width, height)) == (width, height)
    places = places_of(None, (width, height))
    assert places.ui == ((0, 0, width, height),)
    assert places.to_ui(width - 1, 1) == (width - 1, 1)
    assert places.to_ui(width, 1) == (-1, -1)


@given(st.sampled_from(MODES), SIDES, SIDES, st.floats(0, 0.999), st.floats(0, 0.999))
def test_both_eyes_have_the_panels_in_the_same_place(
    mode: str, width: int, height: int, x: float, y: float
) -> None:
    places = places_of(stereo_of(mode), (width, height))
    ui_width, ui_height = places.ui_size
    at = []
    for left, bottom, wide, high in places.ui:
        assert 0 <= left <= left + wide <= width
        assert 0 <= bottom <= bottom + high <= height
        top = height - bottom - high
        at.append(places.to_ui(left + x * wide, top + y * high))
    for found in at:
        assert found == pytest.approx((x * ui_width, y * ui_height), abs=0.01)
        assert 0 <= found[0] <= ui_width
        assert 0 <= found[1] <= ui_height


@given(st.sampled_from(MODES), SIDES, SIDES)
def test_panels_of_two_eyes_do_not_overlap(mode: str, width: int, height: int) -> None:
    ui = places_of(stereo_of(mode), (width, height)).ui
    if len(ui) == 2:
        (x1, y1, w1, h1), (x2, y2, w2, h2) = ui
        assert x1 + w1 <= x2 or x2 + w2 <= x1 or y1 + h1 <= y2 or y2 + h2 <= y1


@pytest.mark.parametrize(
    "edit",
    [
        "output.exposure=2",
        "output.png_bits=16",
        "bookmarks={a: {}}",
        "stereo.swap=true",
        "stereo.glasses=amber_blue",
        "stereo.method=gray",
        "stereo.mode=rows",
        "stereo.mode=split",
        "stereo.mode=left",
        "stereo.colors=[[1, 1, 0], [0, 0, 1]]",
    ],
)
def test_what_concerns_only_showing_needs_no_rays(edit: str) -> None:
    assert render_key(scene_of_stereo()) == render_key(scene_of_stereo(edit))


@pytest.mark.parametrize(
    "edit",
    [
        "stereo.mode=split_half",
        "stereo.mode=over_under_half",
        "stereo.screen_width=1",
        "stereo.fit=auto",
        "stereo=null",
        "camera.fov=33",
        "lights.0.intensity=2",
        "image.width=100",
        "renderer.samples=5",
    ],
)
def test_what_concerns_the_rays_is_another_picture(edit: str) -> None:
    assert render_key(scene_of_stereo()) != render_key(scene_of_stereo(edit))


def scene_of_stereo(*overrides: str) -> Scene:
    from tests.viewer.sessions import BULB

    return scene_of(BULB, STEREO, *overrides)
