"""The folder that drivers write into: a process's own, where there is room, and gone with it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

from clfractal.device import cache, cache_folder, driver_files, drivers_folder, isolate
from clfractal.device.compiler import Argument, Warm
from clfractal.device.program import build
from clfractal.device.select import Device, is_pocl
from clfractal.errors import FileError
from tests.calls import raising
from tests.shell import Running, environment

# A process that has the folder, says so, and waits.
HOLDER = """
import time
from clfractal.device import drivers_folder
print(drivers_folder.path(), flush=True)
time.sleep(600)
"""


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A temporary folder of the test's own, and a process that has made no folder yet."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    monkeypatch.setattr(drivers_folder, "_MEMORY", str(tmp_path / "none"))
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(tmp_path / "cache"))
    monkeypatch.delenv(drivers_folder.POCL_VARIABLE, raising=False)
    monkeypatch.setattr(drivers_folder, "_own", None)
    monkeypatch.setattr(drivers_folder, "users", [])
    (tmp_path / "tmp").mkdir()
    yield tmp_path
    drivers_folder.remove()


def test_it_is_temporary_and_goes(fresh: Path) -> None:
    with drivers_folder.given_to_drivers():
        made = drivers_folder.path()
        assert os.environ[drivers_folder.POCL_VARIABLE] == str(made)
    assert drivers_folder.POCL_VARIABLE not in os.environ, "programs that are started later must not get it"
    assert made.is_dir()
    assert made.is_relative_to(fresh / "tmp")
    if os.name == "posix":
        assert made.stat().st_mode & 0o777 == 0o700
    (made / "CB").mkdir()
    (made / "CB" / "a.so").write_bytes(b"code")
    drivers_folder.remove()
    assert list(made.parent.iterdir()) == []
    assert drivers_folder.path() != made


def test_what_killed_processes_left_is_taken_away(fresh: Path) -> None:
    extra = {"TMPDIR": str(fresh / "tmp"), "TEMP": str(fresh / "tmp")}
    holders = [
        subprocess.Popen(
            [sys.executable, "-c", HOLDER], env=environment(extra), stdout=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    try:
        folders = [Path(str(holder.stdout and holder.stdout.readline().strip())) for holder in holders]
        for folder in folders:
            (folder / "a.so").write_bytes(b"code")
        holders[0].kill()
        holders[0].wait()
        own = drivers_folder.path()
        assert not folders[0].exists()
        assert (folders[1] / "a.so").read_bytes() == b"code", "a process that lives keeps its own"
        assert own.parent == folders[1].parent
    finally:
        for holder in holders:
            holder.kill()
            holder.wait()
            assert holder.stdout is not None
            holder.stdout.close()


@pytest.mark.skipif(os.name != "posix", reason="there is no fork")
def test_a_forked_process_has_its_own(fresh: Path) -> None:
    own = drivers_folder.path()
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        drivers_folder.remove()  # of the parent: not its own
        os.write(writing, os.fsencode(drivers_folder.path()))
        drivers_folder.remove()
        os._exit(0)
    os.waitpid(child, 0)
    found = Path(os.fsdecode(os.read(reading, 4096)))
    os.close(reading)
    os.close(writing)
    assert found != own
    assert own.is_dir()
    assert not found.exists()


@pytest.mark.parametrize("cause", ["room", "noexec", "unwritable"])
def test_it_is_in_the_cache_where_the_temporary_folder_does_not_serve(
    fresh: Path, monkeypatch: pytest.MonkeyPatch, cause: str
) -> None:
    def is_temporary(base: Path) -> bool:
        return base.is_relative_to(fresh / "tmp")

    if cause == "room":
        monkeypatch.setattr(drivers_folder, "_room", lambda base: 1000 if is_temporary(base) else 1 << 30)
    elif cause == "noexec":
        monkeypatch.setattr(drivers_folder, "_may_run_programs", lambda base: not is_temporary(base))
    else:
        monkeypatch.setattr(
            cache_folder, "private_temporary", raising(OSError(28, "No space left on device"))
        )
    assert drivers_folder.path().is_relative_to(fresh / "cache")


def test_memory_comes_first_where_no_other_place_is_named(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (fresh / "memory").mkdir()
    monkeypatch.setattr(drivers_folder, "_MEMORY", str(fresh / "memory"))
    for name in ("TMPDIR", "TEMP", "TMP"):
        monkeypatch.delenv(name, raising=False)
    assert drivers_folder.path().is_relative_to(fresh / "memory")
    drivers_folder.remove()
    monkeypatch.setenv("TMPDIR", str(fresh / "tmp"))
    assert drivers_folder.path().is_relative_to(fresh / "tmp")


def test_little_room_everywhere(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drivers_folder, "_room", lambda base: 2000 if "cache" in base.parts else 1000)
    assert drivers_folder.path().parent.name == "running"


def test_a_chosen_folder(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(drivers_folder.POCL_VARIABLE, str(fresh / "own"))
    with drivers_folder.given_to_drivers():
        assert drivers_folder.path().parent == fresh / "own"
    assert os.environ[drivers_folder.POCL_VARIABLE] == str(fresh / "own")


def test_no_folder_at_all(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache_folder, "private_temporary", raising(OSError(28, "No space left on device")))
    monkeypatch.setattr(cache_folder, "folder", raising(OSError(28, "No space left on device")))
    with pytest.raises(FileError, match=r"drivers have no folder to write into: "):
        drivers_folder.path()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_it_goes_with_an_interrupt(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(
        "version: 1\nformula: {name: mandelbulb, iterations: 8}\nimage: {width: 512, height: 288}\n"
        "camera: {position: [0, -3, 0]}\nrenderer: {samples: 4096}\n"
    )
    (tmp_path / "tmp").mkdir()
    order = ("render", "scene.yaml", "-o", "a.exr", "--quiet")
    running = Running(tmp_path, *order, extra={"TMPDIR": str(tmp_path / "tmp")})
    begun, drivers = tmp_path / "a.exr.partial", tmp_path / "tmp"
    running.wait_until(lambda: begun.exists() and any(drivers.rglob("*.lock")))
    assert running.ended_by(signal.SIGTERM)[0] == 143
    assert [path.name for path in (tmp_path / "tmp").rglob("*") if path.name != "running"] == [
        path.name for path in (tmp_path / "tmp").iterdir()
    ]


def test_children_leave_nothing(device: Device, empty_cache: Path) -> None:
    """A window compiles for hours, in one child after another."""
    root = drivers_folder.path()
    build(device, f"__constant long unique = {time.time_ns()};\n__kernel void k(void) {{}}\n", flags=())
    if is_pocl(device.info):
        assert list(root.glob("child-*"))
    isolate.end_children()
    assert not list(root.glob("child-*"))
    assert not list(root.glob("job-*"))


@pytest.mark.parametrize("loaded", [False, True])
def test_machine_code_that_is_made_later_is_kept_too(device: Device, empty_cache: Path, loaded: bool) -> None:
    """PoCL makes more of it at a launch with another size of work-group; the next process must not make it again."""
    if not is_pocl(device.info):
        pytest.skip("other drivers have it from the start")
    text = f"__constant long unique = {time.time_ns()};\n"
    text += "__kernel void twice(__global int *a) { a[get_global_id(0)] *= 2; }\n"
    warm = Warm("twice", (8,), (8,), (Argument("buffer", 32),))
    program = build(device, text, flags=(), warm=[warm], isolated=False)
    if loaded:
        device.loaded.clear()
        program = build(device, text, flags=(), warm=[warm])
        assert program.cached
    (entry,) = empty_cache.rglob("*.bin")

    def kept() -> set[str]:
        payload = cache.load_blob(entry.stem)
        assert payload is not None
        return {Path(name).parent.name.split("-")[0] for name, _ in driver_files.contents(payload)} - {""}

    before = kept()
    assert "8" in before
    kernel = program.kernel("twice")
    values = np.arange(32, dtype=np.int32)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    buffer = cl.Buffer(device.context, flags, hostbuf=values)
    kernel.set_args(buffer)
    cl.enqueue_nd_range_kernel(device.queue, kernel, (32,), (16,)).wait()
    assert kept() == before
    driver_files.keep_new()
    assert kept() == before | {"16"}
    device.loaded.clear()
    assert build(device, text, flags=(), warm=[warm]).cached


def test_a_name_that_leads_elsewhere_is_not_written(fresh: Path) -> None:
    payload = driver_files.MAGIC + b'[["CB/x"], [["../../evil", 4]]]\nevil'
    with pytest.raises(ValueError, match="leads out"), driver_files.laid_out(payload):
        pass
