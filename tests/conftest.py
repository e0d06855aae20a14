"""Settings shared by every test."""

from __future__ import annotations

import contextlib
import os
import random
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

from clfractal.device import drivers_folder, select
from clfractal.device.select import Device, choose, has_float64, is_simulator
from clfractal.device.tune import first_lanes
from clfractal.errors import ClfractalError
from clfractal.integrators.lanes import LANES_VARIABLE

if TYPE_CHECKING:
    from tests.shell import InProcess

# Asserts of what test modules share tell what they compared, as their own do.
pytest.register_assert_rewrite(
    *(
        f"tests.{path.stem}"
        for path in Path(__file__).parent.iterdir()
        if path.stem not in ("__init__", "conftest")
    )
)

# Where it belongs, although a test may be the first to use OpenCL that has a temporary folder of its own.
drivers_folder.path()

MOST_LANES = 8
"""Wider packets take longer to compile than small pictures gain by them."""


def _decide_once() -> None:
    """The device and the lane count of all tests and of the processes that they start, unless the environment names them.

    Users get what is fastest. What is measured beside other tests differs from process to process, also between formulas,
    and with each other answer all programs are compiled once more. Tests of the choice take these variables away.
    """
    # What no process has measured: a test that measures devices would change the choice of those that start later.
    with contextlib.suppress(ClfractalError), pytest.MonkeyPatch.context() as patch:
        patch.setattr(select, "SPEEDS", "of no device")
        device = choose()
        os.environ.setdefault(select.ENVIRONMENT_VARIABLE, device.info.index)
        if not os.environ.get(LANES_VARIABLE) and not is_simulator(device.info):
            counts = [first_lanes(device, "float32")]
            counts += [first_lanes(device, "float64")] if has_float64(device.info) else []
            os.environ[LANES_VARIABLE] = str(min(MOST_LANES, *counts))


_decide_once()

# The same examples on every run: a failure must be repeatable on another machine.
settings.register_profile(
    "repeatable",
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    max_examples=100,
)
settings.load_profile("repeatable")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--sample", type=int, help="of the tests that are chosen, only so many, at random")
    parser.addoption("--seed", type=int, default=0, help="which ones; the same number chooses the same tests")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep a sample of the tests, in their order."""
    count = config.getoption("--sample")
    if count is None or count >= len(items):
        return
    kept = set(random.Random(config.getoption("--seed")).sample(range(len(items)), count))
    config.hook.pytest_deselected(items=[item for index, item in enumerate(items) if index not in kept])
    items[:] = [item for index, item in enumerate(items) if index in kept]


@pytest.hookimpl(tryfirst=True)
def pytest_fixture_setup() -> None:
    _keep_the_environment()


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call() -> None:
    _keep_the_environment()


def _keep_the_environment() -> None:
    """No variable that is another one in each test: a child process that compiles serves one environment only."""
    os.environ.pop("PYTEST_CURRENT_TEST", None)


@pytest.fixture(scope="session")
def device() -> Device:
    """The device that pictures are rendered on: the one users get, or CLFRACTAL_DEVICE."""
    return choose()


@pytest.fixture
def here(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder: one of the test's own with a scene.yaml.

    That is the SCENE of the test's file, none if that is None, else a small one.
    """
    from tests.shell import SCENE

    monkeypatch.chdir(tmp_path)
    scene = getattr(request.module, "SCENE", SCENE)
    if scene is not None:
        (tmp_path / "scene.yaml").write_text(scene)
    return tmp_path


@pytest.fixture
def clf(here: Path, capfd: pytest.CaptureFixture[str]) -> InProcess:
    """The program, in this folder."""
    from tests.shell import InProcess

    return InProcess(capfd)


@pytest.fixture
def interrupts_are_not_ignored() -> Iterator[None]:
    """A test run in the background ignores Ctrl-C, and so would the processes it starts."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
