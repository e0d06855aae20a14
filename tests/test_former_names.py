"""Public names that were renamed: the former ones do the same for one release, with a warning."""

from __future__ import annotations

import pytest

from clfractal.device.select import Device, choose
from clfractal.images.film import Film
from tests.render.shots import engine_of


@pytest.fixture(scope="module")
def device() -> Device:
    return choose()


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
    film = Film(("R",), (8, 8))
    with pytest.warns(DeprecationWarning, match="Film.makers is Film.provenance"):
        assert film.makers is film.provenance
