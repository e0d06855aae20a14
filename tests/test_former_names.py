"""Public names that were renamed: the former ones do the same for one release, with a warning."""

from __future__ import annotations

import pytest

from clfractal.device.select import Device, choose
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
