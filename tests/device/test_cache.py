"""The cache folder: whole entries or none, and never an error for the disk; another one where it cannot be used."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from clfractal.device import cache, cache_folder
from clfractal.errors import CacheWarning, FileError
from tests.shell import SCENE, process, python, works


def test_each_changed_or_missing_byte_is_noticed_and_the_entry_goes(empty_cache: Path) -> None:
    cache.store_blob("a", b"binary")
    (entry,) = empty_cache.rglob("a.bin")
    stored = bytearray(entry.read_bytes())
    assert cache.load_blob("a") == b"binary"
    for position in range(len(stored)):
        changed = bytearray(stored)
        changed[position] ^= 1
        for damaged in (changed, stored[:position]):
            entry.write_bytes(damaged)
            assert cache.load_blob("a") is None, position
            assert not entry.exists()


def stored_by_another(entries: Iterable[str], megabytes: float = 0.1) -> None:
    """Another process keeps entries; the first was used longest ago."""
    code = (
        "import sys; from clfractal.device import cache\n"
        "for key in sys.argv[2:]: assert cache.store_blob(key, bytes(int(float(sys.argv[1]) * 1e6)))"
    )
    names = list(entries)
    subprocess.run([sys.executable, "-c", code, str(megabytes), *names], check=True)
    for age, name in enumerate(reversed(names), start=1):
        path = cache.folder() / "programs" / f"{name}.bin"
        if path.exists():
            os.utime(path, (time.time() - 100 * age,) * 2)


def names(folder: Path) -> set[str]:
    return {path.stem for path in folder.rglob("*.bin")}


def test_what_was_used_longest_ago_goes(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.SIZE_VARIABLE, "0.55")
    stored_by_another("abcde")
    assert names(empty_cache) == set("abcde")
    assert cache.load_blob("a") is not None  # it is no longer the oldest
    assert cache.store_blob("f", bytes(100_000))
    assert names(empty_cache) == set("acdef")
    assert cache.size() <= cache.limit() == 550_000


def test_what_this_process_uses_does_not_go(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.SIZE_VARIABLE, "0.35")
    stored_by_another("abc")
    for name in "abc":
        assert cache.load_blob(name) is not None
        os.utime(empty_cache / "programs" / f"{name}.bin", (1, 1))
    assert not cache.store_blob("d", bytes(100_000))
    assert names(empty_cache) == set("abc")
    stored_by_another("e")  # which uses none of them
    assert "e" in names(empty_cache)
    assert len(names(empty_cache)) == 3


def test_an_entry_takes_its_own_place(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.SIZE_VARIABLE, "0.35")
    for _ in range(3):
        assert cache.store_blob("a", bytes(300_000))


def test_nothing_is_kept_where_the_limit_is_0(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.SIZE_VARIABLE, "0")
    assert not cache.store_blob("a", b"binary")
    assert cache.load_blob("a") is None
    assert cache.size() == 0


@pytest.mark.parametrize("given", ["-1", "many", "nan", "inf", "1e99", "9" * 400, "1000001", "\u0661"])
def test_a_limit_that_is_none_is_told_once(
    given: str, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cache, "_told", set())
    monkeypatch.setenv(cache.SIZE_VARIABLE, given)
    with pytest.warns(CacheWarning, match="^CLFRACTAL_CACHE_MB must be megabytes from 0 to 1000000, got "):
        assert cache.store_blob("a", b"binary")
    with warnings.catch_warnings(action="error"):
        assert cache.store_blob("b", b"binary")
    assert cache.load_blob("a") == b"binary"


def test_processes_that_make_room_do_not_disturb_each_other(
    empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(cache.SIZE_VARIABLE, "0.05")
    code = (
        "import sys; from clfractal.device import cache\n"
        "for i in range(60):\n"
        "    key = f'{i % 30}'\n"
        "    cache._used.clear()\n"
        "    assert cache.store_blob(key, key.encode() * 2000)\n"
        "    assert cache.load_blob(f'{(i * 7) % 30}') in (None, f'{(i * 7) % 30}'.encode() * 2000)"
    )
    children = [subprocess.Popen([sys.executable, "-W", "error", "-c", code]) for _ in range(3)]
    assert [child.wait() for child in children] == [0, 0, 0]
    assert cache.size() <= 2 * cache.limit()


def test_facts_add_up(empty_cache: Path) -> None:
    cache.remember("facts", "a", 1)
    cache.remember("facts", "b", [2.5, "x"])
    cache.remember("facts", "a", 3)
    assert cache.recall("facts") == {"a": 3, "b": [2.5, "x"]}


def test_processes_do_not_lose_each_others_facts(empty_cache: Path) -> None:
    code = (
        "import sys; from clfractal.device import cache\n"
        "for i in range(20): cache.remember('facts', sys.argv[1] + str(i), i)"
    )
    children = [subprocess.Popen([sys.executable, "-c", code, name]) for name in "ab"]
    assert [child.wait() for child in children] == [0, 0]
    assert len(cache.recall("facts")) == 40


def test_damaged_facts_are_no_facts(empty_cache: Path) -> None:
    empty_cache.mkdir()
    (empty_cache / "facts.json").write_text("{")
    assert cache.recall("facts") == {}
    for text in ("[1]", "{}", '{"facts": {"a": 1}}', '{"facts": [], "sha256": ""}', "[" * 100_000, "\x00"):
        (empty_cache / "facts.json").write_text(text)
        assert cache.recall("facts") == {}, text[:20]
    (empty_cache / "facts.json").write_bytes(b"\xff")
    assert cache.recall("facts") == {}


def test_every_changed_bit_of_facts_is_noticed(empty_cache: Path) -> None:
    """A number that changed a little would still be a number."""
    cache.remember("facts", "a", {"lanes": 16, "scalar": 78.25})
    stored = (empty_cache / "facts.json").read_bytes()
    for bit in range(8 * len(stored)):
        changed = bytearray(stored)
        changed[bit // 8] ^= 1 << bit % 8
        (empty_cache / "facts.json").write_bytes(changed)
        found = cache.recall("facts")
        assert found in ({}, {"a": {"lanes": 16, "scalar": 78.25}}), bit
        # (White space may be changed: what it says is still the same.)
        assert not found or chr(stored[bit // 8]).isspace() or chr(changed[bit // 8]).isspace(), bit
    for length in range(len(stored)):
        (empty_cache / "facts.json").write_bytes(stored[:length])
        assert cache.recall("facts") == {}, length
    cache.remember("facts", "b", 2)
    assert cache.recall("facts") == {"b": 2}


def test_what_earlier_versions_and_killed_processes_left_goes(empty_cache: Path) -> None:
    for name in (
        "pocl/CB/IIDBO/program.bc",
        "pocl/tempfile_x",
        "pocl/mine/a",
        ".new-old",
        "programs/.new-new",
    ):
        path = empty_cache / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    os.utime(empty_cache / ".new-old", (1, 1))
    cache.store_blob("a", b"binary")
    left = {path.relative_to(empty_cache).as_posix() for path in empty_cache.rglob("*") if path.is_file()}
    assert left == {"pocl/mine/a", "programs/.new-new", "programs/a.bin"}


def test_a_folder_that_can_no_longer_be_written_is_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(tmp_path / "cache"))
    assert cache.folder() == tmp_path / "cache"
    cache.folder().rmdir()
    cache.folder().touch()
    with pytest.warns(CacheWarning, match="takes nothing more: .*; working without it$") as told:
        assert not cache.store_blob("a", b"binary")
    cache.remember("facts", "a", 1)
    assert len(told) == 1
    cache.drop_blob("a")
    assert cache.load_blob("a") is None
    assert cache.recall("facts") == {}


def test_keys_tell_everything_apart() -> None:
    keys = {
        cache.key_of(*parts) for parts in [(), ("a",), ("a", "b"), ("ab",), (["a", "b"],), ("b", "a"), (1,)]
    }
    assert len(keys) == 7


# --- its folder ---


# Builds a program and launches it, with nothing of ours in the way; tells the folders in use.
PROGRAM = """
import json, os, warnings
import numpy as np
import pyopencl as cl
from clfractal.device import cache, drivers_folder, program
from clfractal.device.select import choose

with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    device = choose()
    text = "__kernel void fill(__global int *out) { out[get_global_id(0)] = 7; }"
    built = program.build(device, text, flags=[], isolated=False)
    buffer = device.buffer(64, "a test")
    kernel = built.kernel("fill")
    kernel.set_args(buffer)
    cl.enqueue_nd_range_kernel(device.queue, kernel, (16,), None).wait()
    values = np.empty(16, np.int32)
    cl.enqueue_copy(device.queue, values, buffer)
    cache.remember("facts", "a", 1)
assert (values == 7).all()
print(json.dumps({
    "folder": str(cache.folder()),
    "pocl": str(drivers_folder.path()),
    "told pocl": os.environ.get("POCL_CACHE_DIR"),
    "kept": cache.recall("facts"),
    "told": [str(each.message) for each in told if each.category.__name__ == "CacheWarning"],
}))
"""
LOST = ("CLFRACTAL_CACHE", "POCL_CACHE_DIR", "XDG_CACHE_HOME")


def without(variables: dict[str, str], temporary: Path, patch: pytest.MonkeyPatch) -> dict[str, str]:
    """An environment without folders but those given and the temporary one."""
    temporary.mkdir(exist_ok=True)
    for name in LOST:
        patch.delenv(name, raising=False)
    return {"TMPDIR": str(temporary), "TEMP": str(temporary), **variables}


def run(variables: dict[str, str], temporary: Path) -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        ended = python(PROGRAM, extra=without(variables, temporary, patch))
    found: dict[str, Any] = json.loads(works(ended).out)
    return found


posix = pytest.mark.skipif(os.name != "posix", reason="HOME does not name the folder on this system")


@posix
@pytest.mark.parametrize("home", ["/proc", "{file}", "{file}/deeper"])
def test_homes_that_cannot_be_used(tmp_path: Path, home: str) -> None:
    file = tmp_path / "file"
    file.touch()
    found = run({"HOME": home.format(file=file)}, tmp_path / "tmp")
    folder = tmp_path / "tmp" / f"clfractal-cache-{os.getuid()}"
    assert found["folder"] == str(folder)
    assert Path(found["pocl"]).parent == folder / "running"
    assert list((folder / "running").iterdir()) == []
    assert found["kept"] == {"a": 1}
    (told,) = found["told"]
    assert f"using {str(folder)!r}" in told
    assert "CLFRACTAL_CACHE names another" in told


@posix
def test_a_file_as_the_folder_of_caches(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    found = run({"HOME": str(tmp_path), "XDG_CACHE_HOME": str(file)}, tmp_path / "tmp")
    assert str(found["folder"]).startswith(str(tmp_path / "tmp"))


@posix
def test_our_variable_alone_is_enough(tmp_path: Path) -> None:
    found = run({"HOME": "/proc", "CLFRACTAL_CACHE": str(tmp_path / "own")}, tmp_path / "tmp")
    assert found["told"] == []
    assert found["told pocl"] is None
    (left,) = (tmp_path / "tmp").iterdir()
    assert Path(found["pocl"]).parent == left / "running"
    assert [path.name for path in left.rglob("*")] == ["running"]


def test_a_chosen_folder_that_cannot_be_used_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "file").touch()
    monkeypatch.setenv("CLFRACTAL_CACHE", str(tmp_path / "file"))
    with pytest.warns(CacheWarning, match="^CLFRACTAL_CACHE: the cache folder .*file' cannot be used: "):
        found = cache_folder.folder()
    assert found.parent == tmp_path
    assert cache_folder.problem(str(found)) == ""


@posix
def test_nobody_else_s_folder_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another user could have made it, and put programs there."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "file").touch()
    place = tmp_path / f"clfractal-cache-{os.getuid()}"
    (tmp_path / "other").mkdir()
    place.symlink_to("other")
    monkeypatch.setenv("CLFRACTAL_CACHE", str(tmp_path / "file" / "linked"))
    with pytest.warns(CacheWarning):
        assert cache_folder.folder().name.startswith("clfractal-")
    assert cache_folder.folder() != place
    place.unlink()
    place.mkdir()
    place.chmod(0o777)
    monkeypatch.setenv("CLFRACTAL_CACHE", str(tmp_path / "file" / "open"))
    with pytest.warns(CacheWarning):
        assert cache_folder.folder() != place


def test_no_temporary_folder_either(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "file"))
    monkeypatch.setenv("CLFRACTAL_CACHE", str(tmp_path / "file"))
    with pytest.raises(FileError, match=r"^CLFRACTAL_CACHE: the cache folder .*no temporary folder"):
        cache_folder.folder()


@posix
def test_the_shell_tells_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE + "renderer: {type: cut_plane}\n")  # one program
    (tmp_path / "file").touch()
    own = {"HOME": str(tmp_path / "file"), "CLFRACTAL_LANES": "1"}
    extra = without(own, tmp_path / "tmp", monkeypatch)
    ended = works(process(["render", "scene.yaml"], tmp_path, extra))
    told = [line for line in ended.err.splitlines() if "cache folder" in line]
    assert len(told) == 1
    assert told[0].startswith(
        f"the cache folder '{tmp_path}/file/.cache/clfractal' cannot be used: Not a dir"
    )
    assert (tmp_path / "scene.png").exists()


@pytest.mark.parametrize("name", ["file", "file/deeper"])
def test_a_folder_chosen_for_pocl(tmp_path: Path, name: str) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE)
    (tmp_path / "file").touch()
    wrong = str(tmp_path / name)
    extra = {"POCL_CACHE_DIR": wrong, "CLFRACTAL_DEVICE": "Portable"}
    ended = process(["render", "scene.yaml"], tmp_path, extra)
    assert ended.is_one_line(2, f"POCL_CACHE_DIR: PoCL cannot write into {wrong!r}: ")
    assert not (tmp_path / "scene.png").exists()
