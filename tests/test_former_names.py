"""Public names that were renamed: the former ones do the same for one release, with a warning."""

from __future__ import annotations

import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.images.framebuffer import Framebuffer
from tests.render.shots import engine_of


def test_an_engine_has_previews_as_looks(device: Device) -> None:
    engine = engine_of(device)
    with pytest.warns(DeprecationWarning, match="Engine.look is Engine.preview"):
        former = engine.look
    assert type(former) is type(engine.preview)
    assert former.executor is engine.preview.executor


def test_an_engine_says_how_long_previews_were_built(device: Device) -> None:
    engine = engine_of(device)
    with pytest.warns(DeprecationWarning, match="Engine.looks_built_ms is Engine.previews_built_ms"):
        assert engine.looks_built_ms == engine.previews_built_ms


def test_a_film_has_makers() -> None:
    framebuffer = Framebuffer(("R",), (8, 8))
    with pytest.warns(DeprecationWarning, match="Framebuffer.makers is Framebuffer.provenance"):
        assert framebuffer.makers is framebuffer.provenance


def test_a_framebuffer_was_a_film() -> None:
    with pytest.warns(DeprecationWarning, match="clfractal.Film is clfractal.Framebuffer"):
        former = clfractal.Film
    assert former is clfractal.Framebuffer
