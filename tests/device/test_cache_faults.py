"""Faults of the disk that the cache is on: each is told or healed, and after it everything is as it was.

A full disk is a small one in memory, in a name space of mounts that goes with the process; where the system permits none,
and beside it, writes are made to fail.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.device import cache, drivers_folder, isolate, tune
from clfractal.device.select import Device, choose, is_pocl
from clfractal.engine import thumbnails
from clfractal.errors import CacheWarning, DeviceError, FileError, UntriedError
from clfractal.integrators import lanes
from clfractal.integrators.trial import RULES
from tests.calls import raising
from tests.interrupts import planes
from tests.shell import SCENE, Ended, command, environment, process, works

SECTIONS = ("lanes", "marches", "speeds")
"""What is measured of a device; a first picture waits for the first of them alone."""


@pytest.fixture(scope="module", autouse=True)
def _lanes_are_tried() -> Iterator[None]:
    """As users' are: no lane count is given."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv(lanes.LANES_VARIABLE, raising=False)
        yield


SMALL = SCENE.replace("camera:", "renderer: {type: cut_plane}\ncamera:")
"""A picture that takes one program."""


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the scene, its picture, and the cache after it."""
    folder = tmp_path_factory.mktemp("good")
    rendered(folder, SMALL)
    assert (folder / "cache" / "lanes.json").exists()
    return folder


def rendered(folder: Path, scene: str) -> None:
    """Renders a scene of a folder, with the cache in it."""
    (folder / "scene.yaml").write_text(scene)
    works(
        process(["render", "scene.yaml", "-o", "a.exr"], folder, {"CLFRACTAL_CACHE": str(folder / "cache")})
    )
    assert list((folder / "cache" / "programs").iterdir())


def steady_job(request: Mapping[str, Any]) -> dict[str, Any]:
    """In the place of the march of each lane count, whose times are worth keeping only while nothing else runs."""
    return {"steady": True, **dict.fromkeys(RULES, [1.0] * len(request["lanes"]))}


def again(good: Path, folder: Path) -> Ended:
    """Renders the scene with the cache in `folder`; the picture has to be the same."""
    ended = works(
        process(
            ["render", str(good / "scene.yaml"), "-o", "b.exr", "--quiet"],
            folder,
            {"CLFRACTAL_CACHE": str(folder / "cache")},
        )
    )
    assert planes(folder / "b.exr") == planes(good / "a.exr")
    return ended


def is_whole(cache_folder: Path, good: Path) -> bool:
    """Whether nothing in it is damaged, and nothing is missing: the same facts are known, and the programs are there.

    (Another measurement may prefer another lane count, which is another program.)
    """
    found = []
    for each in (cache_folder, good / "cache"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv(cache.ENVIRONMENT_VARIABLE, str(each))
            blobs = [cache.load_blob(entry.stem) for entry in (each / "programs").glob("*.bin")]
            facts = {section: sorted(cache.recall(section)) for section in SECTIONS}
            found.append((bool(blobs), all(blobs), facts))
    return found[0] == found[1]


def _flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x10
    path.write_bytes(content)


def _cut(path: Path) -> None:
    os.truncate(path, path.stat().st_size * 2 // 3)


def _empty(path: Path) -> None:
    os.truncate(path, 0)


DAMAGES = {"a bit flipped": _flip, "cut short": _cut, "empty": _empty}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_damaged_programs(good: Path, tmp_path: Path, damage: Callable[[Path], None]) -> None:
    shutil.copytree(good / "cache", tmp_path / "cache")
    for path in (tmp_path / "cache" / "programs").iterdir():
        damage(path)
    assert again(good, tmp_path).err == ""
    assert is_whole(tmp_path / "cache", good)


def test_damaged_facts(good: Path, tmp_path: Path, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """A picture does without them, and what measures devices finds them again."""
    shutil.copytree(good / "cache", tmp_path / "cache")
    for section, damage in zip(SECTIONS, DAMAGES.values(), strict=True):
        fact = tmp_path / "cache" / f"{section}.json"
        shutil.copy(good / "cache" / "lanes.json", fact)
        damage(fact)
    assert again(good, tmp_path).err == ""
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setattr(lanes, "JOB", f"{__name__}:steady_job")
    lanes.march_reports(device, "float32")
    found = {section: set(cache.recall(section)) for section in SECTIONS}
    assert all(found.values())
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(good / "cache"))
    assert found["lanes"] >= set(cache.recall("lanes")) > set()


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_damaged_small_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: Callable[[Path], None]
) -> None:
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(tmp_path))
    pixels = np.random.default_rng(1).integers(0, 255, (thumbnails.SIZE[1], thumbnails.SIZE[0], 3), np.uint8)
    thumbnails.store("a", pixels)
    (path,) = (tmp_path / "thumbnails").iterdir()
    damage(path)
    assert thumbnails.load("a") is None
    thumbnails.store("a", pixels)
    np.testing.assert_array_equal(thumbnails.load("a"), pixels)


# In a name space of mounts: renders with a cache on a disk of some KB, where some facts may be known, then with room; tells
# how each ended.
FULL = """
import json, subprocess, sys
size, command = sys.argv[1], sys.argv[2:]

def mount(*options):
    subprocess.run(["mount", *options, "cache"], check=True, capture_output=True)

def run():
    ended = subprocess.run(command, capture_output=True, text=True)
    kept = subprocess.run(["sh", "-c", "cd cache && find . -type f -size +0"], capture_output=True, text=True)
    return [ended.returncode, ended.stderr, sorted(kept.stdout.split())]

mount("-t", "tmpfs", "-o", f"size={size}", "tmpfs")
subprocess.run("cp known/* cache", shell=True, capture_output=True)
told = [run()]
mount("-o", "remount,size=64m")
told += [run(), run()]
subprocess.run(["cp", "-r", "cache", "kept"], check=True)
print(json.dumps(told))
"""


def _mounts() -> list[str] | None:
    """How a process gets a name space in which it may mount; None if it may not."""
    for how in (["unshare", "-m"], ["unshare", "-r", "-m"]):
        if shutil.which("unshare") and shutil.which("mount"):
            tried = [*how, "sh", "-c", f"mount -t tmpfs tmpfs {tempfile.gettempdir()}"]
            if subprocess.run(tried, capture_output=True, check=False).returncode == 0:
                return how
    return None


@pytest.mark.parametrize(("size", "known"), [("4k", ()), ("100k", ("lanes",))])
def test_a_full_disk(good: Path, tmp_path: Path, size: str, known: tuple[str, ...]) -> None:
    """On which there is no room for facts, or none for a program."""
    how = _mounts()
    if how is None:
        pytest.skip("this system lets nobody mount a small disk; writes that fail are tried beside it")
    (tmp_path / "cache").mkdir()
    (tmp_path / "known").mkdir()
    for section in known:
        shutil.copy(good / "cache" / f"{section}.json", tmp_path / "known")
    render = [*command("render", good / "scene.yaml", "-o", "b.exr")]
    ended = subprocess.run(
        [*how, sys.executable, "-c", FULL, size, *render],
        cwd=tmp_path,
        env=environment({"CLFRACTAL_CACHE": str(tmp_path / "cache")}),
        capture_output=True,
        text=True,
        check=True,
    )
    full, healed, warm = json.loads(ended.stdout)
    assert [run[0] for run in (full, healed, warm)] == [0, 0, 0], (full, healed, warm)
    told = [line for line in full[1].splitlines() if "the cache folder" in line]
    assert len(told) == 1, full[1]
    assert str(tmp_path / "cache") in told[0]
    assert "No space left on device" in told[0]
    assert "the cache folder" not in healed[1]
    assert healed[2] == warm[2]
    assert "measuring" not in warm[1]
    assert is_whole(tmp_path / "kept", good)
    assert planes(tmp_path / "b.exr") == planes(good / "a.exr")


no_space = raising(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache, and a device that has loaded nothing."""
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setattr(cache, "_told", set())
    choose().loaded.clear()
    yield tmp_path / "cache"
    choose().loaded.clear()


def test_no_space_for_programs(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from clfractal.device.program import build

    device, text = choose(), "__kernel void one(__global int *a) { a[0] = 1; }"
    with monkeypatch.context() as patch:
        patch.setattr(cache, "_replace", no_space)
        with pytest.warns(
            CacheWarning, match="takes nothing more: No space left on device; working without it"
        ):
            assert not build(device, text, flags=()).cached
    assert not list(here.rglob("*.bin"))
    device.loaded.clear()
    build(device, text, flags=())
    device.loaded.clear()
    assert build(device, text, flags=()).cached


def test_no_space_for_facts(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(cache, "_replace", no_space)
        with pytest.warns(CacheWarning, match="No space left on device"):
            cache.remember("lanes", "a", 1)
    assert cache.recall("lanes") == {}
    cache.remember("lanes", "a", 1)
    assert cache.recall("lanes") == {"a": 1}


def test_no_space_for_what_drivers_write(here: Path, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is no fault of the device, and the cache keeps what it has."""
    from clfractal.device.program import build

    if not is_pocl(device.info):
        pytest.skip("this driver writes no files")
    text = "__kernel void two(__global int *a) { a[0] = 2; }"
    build(device, text, flags=())
    (entry,) = here.rglob("*.bin")
    device.loaded.clear()
    shutil.rmtree(drivers_folder.path())
    drivers_folder.path().mkdir()
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", no_space)
        with pytest.raises(
            FileError, match=r"has no room for temporary files: No space left on device$"
        ) as caught:
            build(device, text, flags=())
    assert str(drivers_folder.path().parent) in str(caught.value)
    assert entry.exists()
    assert build(device, text, flags=()).cached


@pytest.mark.parametrize("of_the_device", [False, True])
def test_only_what_a_device_does_is_remembered(
    here: Path, device: Device, monkeypatch: pytest.MonkeyPatch, of_the_device: bool
) -> None:
    kind = DeviceError if of_the_device else UntriedError

    with monkeypatch.context() as patch:
        patch.setattr(isolate, "run", raising(kind("aborted")))
        patch.setattr(lanes, "_reports", {})
        with pytest.raises(DeviceError, match=r"no kernel works on this device: 1\d? lanes: aborted$"):
            lanes.march_reports(device, "float32")
    assert bool(cache.recall("lanes")) == of_the_device
    assert tune.is_of_the_device(kind("x")) == of_the_device


def test_a_full_disk_under_the_driver_is_not_the_driver_s_fault(
    here: Path, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It aborts, or fails in any other way; the disk is looked at afterwards."""
    monkeypatch.setenv("CLFRACTAL_TEST_ABORT", "trying 1")
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", no_space)
        with pytest.raises(FileError, match="has no room for temporary files: No space left on device"):
            tune.lane_reports(device, "float32", (1,))
    assert cache.recall("lanes") == {}
    assert "aborted (signal 6)" in tune.lane_reports(device, "float32", (1,))[0].fault
    assert len(cache.recall("lanes")) == 1


def test_a_cache_that_cannot_be_written(good: Path, tmp_path: Path) -> None:
    """Another folder serves, which is named; with the folder there again everything is as before."""
    (tmp_path / "cache").write_bytes(b"")
    (tmp_path / "tmp").mkdir()
    extra = {"CLFRACTAL_CACHE": str(tmp_path / "cache"), "TMPDIR": str(tmp_path / "tmp")}
    ended = works(
        process(
            ["render", str(good / "scene.yaml"), "-o", "b.exr"], tmp_path, {**extra, "CLFRACTAL_LANES": "1"}
        )
    )
    assert f"the cache folder {str(tmp_path / 'cache')!r} cannot be used: " in ended.err
    (tmp_path / "cache").unlink()
    shutil.copytree(good / "cache", tmp_path / "cache")
    assert again(good, tmp_path).err == ""


def test_processes_that_fill_one_cache_at_once(good: Path, tmp_path: Path) -> None:
    shutil.copytree(good / "cache", tmp_path / "cache")
    shutil.rmtree(tmp_path / "cache" / "programs")
    extra = environment({"CLFRACTAL_CACHE": str(tmp_path / "cache")})
    running = [
        subprocess.Popen(
            command("render", good / "scene.yaml", "-o", f"{n}.exr", "-q"),
            cwd=tmp_path,
            env=extra,
        )
        for n in range(3)
    ]
    assert [each.wait(240) for each in running] == [0, 0, 0]
    assert all(planes(tmp_path / f"{n}.exr") == planes(good / "a.exr") for n in range(3))
    assert is_whole(tmp_path / "cache", good)
