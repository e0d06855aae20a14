"""The cache folder: whole entries or none, and never an error for the state of the disk."""

from __future__ import annotations

import os
import subprocess
import sys
import time
import warnings
from collections.abc import Iterable
from pathlib import Path

import pytest

from clfractal.device import cache
from clfractal.errors import CacheWarning


def test_what_is_stored_comes_back(empty_cache: Path) -> None:
    cache.store_blob("a", b"binary")
    assert cache.load_blob("a") == b"binary"
    assert cache.load_blob("b") is None


@pytest.mark.parametrize("damage", [b"", b"x", b"clfractal-blob-1\n"])
def test_a_damaged_entry_is_none_and_goes(empty_cache: Path, damage: bytes) -> None:
    cache.store_blob("a", b"binary")
    (entry,) = empty_cache.rglob("a.bin")
    entry.write_bytes(damage)
    assert cache.load_blob("a") is None
    assert not entry.exists()


def test_one_changed_byte_is_noticed(empty_cache: Path) -> None:
    cache.store_blob("a", b"binary")
    (entry,) = empty_cache.rglob("a.bin")
    stored = bytearray(entry.read_bytes())
    for position in range(len(stored)):
        changed = bytearray(stored)
        changed[position] ^= 1
        entry.write_bytes(changed)
        assert cache.load_blob("a") is None, position


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
