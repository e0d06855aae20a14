"""What the tests of the cluster share: renders on one machine, to compare with."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cluster.farm import FILM, FRAMES, HEAVY, Farm
from tests.interrupts import planes
from tests.shell import process


@pytest.fixture(scope="session")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a picture and a film that one machine has rendered."""
    folder = tmp_path_factory.mktemp("alone")
    (folder / "heavy.yaml").write_text(HEAVY)
    (folder / "film.yaml").write_text(FILM)
    assert process(["render", "heavy.yaml", "-o", "out.exr", "--quiet"], folder).status == 0
    assert process(["animate", "film.yaml", "-o", "frame_##.exr", "--quiet"], folder).status == 0
    return folder


@pytest.fixture(scope="session")
def picture(alone: Path) -> dict[str, bytes]:
    """The bytes of that picture's channels."""
    return planes(alone / "out.exr")


@pytest.fixture(scope="session")
def film(alone: Path) -> list[dict[str, bytes]]:
    """The same of that film's frames."""
    return [planes(alone / f"frame_{number:02d}.exr") for number in range(FRAMES)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with both scenes."""
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    (tmp_path / "film.yaml").write_text(FILM)
    return tmp_path


@pytest.fixture
def farm(folder: Path) -> Iterator[Farm]:
    """A scheduler and two workers."""
    with Farm(folder) as made:
        yield made
