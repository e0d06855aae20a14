"""`pip install` works on the four systems: the recorded versions satisfy pyproject.toml there, and what these ask for."""

from __future__ import annotations

import importlib.metadata
import tomllib
from collections.abc import Iterator

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.platforms.systems import BUILT, LOCKS, PROJECT, SYSTEMS, System

BY_NAME = pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system.name)
# Drivers that come along, where they have wheels.
DRIVERS = {"linux-x86_64": "pocl-binary-distribution", "windows-x64": "intel-opencl-rt"}


def locked(system: System) -> dict[str, str]:
    lines = (LOCKS / f"{system.name}.txt").read_text(encoding="utf-8").splitlines()
    pairs = [line.split("==") for line in lines if line and not line.startswith("#")]
    return {canonicalize_name(name): version for name, version in pairs}


def asked() -> Iterator[Requirement]:
    """All requirements of the project, of its extras too."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    yield from map(Requirement, project["dependencies"])
    for extra, group in project["optional-dependencies"].items():
        if extra not in BUILT:
            yield from map(Requirement, group)


def holds(requirement: Requirement, system: System, extra: str = "") -> bool:
    return requirement.marker is None or requirement.marker.evaluate({**system.markers, "extra": extra})


@BY_NAME
def test_every_requirement_has_a_version_that_fits(system: System) -> None:
    """A requirement that was added or raised without `make locks` fails here."""
    versions = locked(system)
    for requirement in asked():
        if holds(requirement, system):
            name = canonicalize_name(requirement.name)
            assert name in versions, f"{requirement}: run `make locks`"
            assert requirement.specifier.contains(versions[name]), f"{requirement}: run `make locks`"


@BY_NAME
def test_what_these_ask_for_is_there_too(system: System) -> None:
    """As far as they are installed here: a package that one asks for on that system alone is in its list."""
    versions = locked(system)
    looked_at = 0
    for name, version in versions.items():
        try:
            found = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue
        if found.version != version:
            continue
        looked_at += 1
        for line in found.requires or ():
            requirement = Requirement(line)
            if holds(requirement, system):
                assert canonicalize_name(requirement.name) in versions, f"{name} asks for {line}"
    assert looked_at >= 5


@BY_NAME
def test_a_driver_comes_along_where_it_has_a_wheel(system: System) -> None:
    """pyopencl's extra `pocl` asks for one everywhere, and then nothing can be installed."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    needed = {Requirement(line).name for line in project["dependencies"] if holds(Requirement(line), system)}
    drivers = needed & set(DRIVERS.values())
    assert drivers == ({DRIVERS[system.name]} if system.name in DRIVERS else set())
    # Wherever it would have none, it is not in the list: neither by itself nor by the extra `intel`.
    elsewhere = set(DRIVERS.values()) - {DRIVERS.get(system.name), "intel-opencl-rt"}
    assert not elsewhere & set(locked(system))
    assert ("intel-opencl-rt" in locked(system)) == (system.name in DRIVERS)


def test_the_classifiers_tell_the_truth() -> None:
    """A system is named once somebody has rendered on it (docs/platforms.md)."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    told = {line for line in project["classifiers"] if line.startswith("Operating System")}
    assert told == {"Operating System :: POSIX :: Linux"}
    page = (PROJECT.parent / "docs" / "platforms.md").read_text(encoding="utf-8")
    assert "Windows and macOS, with any device" in page.split("## What was never tried")[1]
