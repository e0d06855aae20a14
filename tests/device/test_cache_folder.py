"""A missing or unwritable home, and what drivers need a folder for: another folder serves, or the variable is named."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from clfractal.device import cache_folder
from clfractal.errors import CacheWarning, FileError
from tests.shell import SCENE, process, python, works

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
