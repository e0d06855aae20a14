"""Unsaved changes survive the end of a process, and only that."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.viewer.autosave import Autosave, default_folder
from clfractal.viewer.files import Files
from clfractal.viewer.saving import SceneSource, open_source, save_scene
from clfractal.viewer.window_options import Options
from tests.viewer.scene_files import with_camera

# Another window: keeps a scene with the given field of view, says so, and waits for its end.
WINDOW = """
import sys
from pathlib import Path
from clfractal.viewer.autosave import Autosave
from clfractal.viewer.saving import open_source
source = open_source(sys.argv[1])
camera = source.loaded.camera.model_copy(update={"fov": float(sys.argv[3])})
kept = Autosave(Path(sys.argv[2]))
assert kept.write(source, source.loaded.model_copy(update={"camera": camera}))
print("kept", flush=True)
if sys.stdin.readline() == "close\\n":
    kept.close()
"""


@pytest.fixture
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("store") / "autosave"


def window(scene: Path, store: Path, fov: float) -> subprocess.Popen[str]:
    started = subprocess.Popen(
        [sys.executable, "-c", WINDOW, str(scene), str(store), str(fov)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert started.stdout is not None
    assert started.stdout.readline() == "kept\n"
    return started


def present_of(source: SceneSource, fov: float) -> Scene:
    assert source.loaded is not None
    return with_camera(source.loaded, fov=fov)


def test_what_a_killed_window_leaves_is_found(desk: Path, store: Path) -> None:
    path = desk / "scene.yaml"
    first, second = window(path, store, 20), window(path, store, 40)
    try:
        with Autosave(store) as own:
            assert own.found() == []  # both still run
            first.kill()
            first.wait()
            before = time.time()
            (found,) = own.found()
            assert before - 60 < found.time <= time.time()
            assert found.path == path
            assert found.scene() == present_of(open_source(path), 20)
            assert "# my own" in found.text
            assert "file: own.yaml" in found.text
            source = found.source()
            assert (source.kind, source.path) == ("scene", path)
            # It is this process's now, also for a window that starts meanwhile.
            assert Autosave(store).found() == []
            found.release()
            (again,) = Autosave(store).found()
            assert again.text == found.text
            save_scene(again.source(), again.scene(), path)
            assert load_scene(path) == again.scene()
            again.discard()
            assert own.found() == []
    finally:
        for each in (first, second):
            each.kill()
            each.wait()
    assert len(Autosave(store).found()) == 1


def test_a_window_that_is_closed_leaves_nothing(desk: Path, store: Path) -> None:
    other = window(desk / "scene.yaml", store, 20)
    other.communicate("close\n", timeout=60)
    assert list(store.iterdir()) == []
    source = open_source(desk / "scene.yaml")
    with Autosave(store) as own:
        assert list(store.iterdir()) == []
        assert own.write(source, present_of(source, 25))
        assert len(list(store.iterdir())) == 3
        own.clear()
        assert Autosave(store).found() == []
        assert own.write(source, present_of(source, 26))
    assert list(store.iterdir()) == []


def test_what_was_offered_and_not_taken_is_offered_again(
    desk: Path,
    store: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Also to a window of the same process, as a program of one's own may open them."""
    killed = window(desk / "scene.yaml", store, 20)
    killed.kill()
    killed.wait()
    monkeypatch.setenv("CLFRACTAL_CACHE", str(store.parent))
    first = Files(Options())
    first.recovered = Autosave(store).found()
    (offered,) = first.recovered
    assert Autosave(store).found() == []
    first.close()
    (again,) = Autosave(store).found()
    assert again.text == offered.text
    again.discard()
    assert Autosave(store).found() == []


def test_only_changes_to_one_scene_are_asked_for(desk: Path, store: Path, tmp_path: Path) -> None:
    """Those to other scenes wait for these; a link leads to the same scene."""
    link = tmp_path / "link.yaml"
    link.symlink_to(desk / "scene.yaml")
    other = desk / "other.yaml"
    other.write_text((desk / "scene.yaml").read_text())
    for path, fov in ((desk / "scene.yaml", 20), (other, 30)):
        own, source = Autosave(store), open_source(path)
        assert own.write(source, present_of(source, fov))
        own.release()
    assert Autosave(store).found(tmp_path / "third.yaml") == []
    (found,) = Autosave(store).found(link)
    assert found.path == desk / "scene.yaml"
    (rest,) = Autosave(store).found()
    assert rest.path == other
    for each in (found, rest):
        each.discard()


def test_an_error_keeps_the_work(desk: Path, store: Path) -> None:
    source = open_source(desk / "scene.yaml")

    def window() -> None:
        with Autosave(store) as own:
            own.write(source, present_of(source, 25))
            raise RuntimeError("of the window")

    with pytest.raises(RuntimeError):
        window()
    (found,) = Autosave(store).found()
    assert found.scene() == present_of(source, 25)


def test_the_last_state_is_kept(desk: Path, store: Path) -> None:
    source = open_source(desk / "scene.yaml")
    own = Autosave(store)
    for fov in (25, 26, 27):
        assert own.write(source, present_of(source, fov))
    (path,) = store.glob("*.yaml")
    assert load_scene(path.read_text(), folder=desk) == present_of(source, 27)
    note = json.loads(next(store.glob("*.json")).read_text())
    assert note["pid"] == os.getpid()
    before = path.stat().st_mtime_ns
    assert own.write(source, present_of(source, 27))
    assert path.stat().st_mtime_ns == before
    own.close()


def test_a_scene_from_nowhere_and_one_whose_file_is_gone(desk: Path, store: Path) -> None:
    nowhere = load_scene({"version": 1, "formula": {"name": "hast"}, "camera": {"fov": 20}})
    own = Autosave(store)
    own.write(SceneSource(), nowhere)
    own.release()
    (found,) = Autosave(store).found()
    assert (found.path, found.source().kind, found.scene()) == (None, "none", nowhere)
    found.discard()
    source = open_source(desk / "scene.yaml")
    own = Autosave(store)
    own.write(source, present_of(source, 25))
    own.release()
    (desk / "scene.yaml").unlink()
    (found,) = Autosave(store).found()
    assert found.scene() == present_of(source, 25)
    again = found.source()
    assert (again.kind, again.text) == ("none", found.text)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        (".json", b""),
        (".json", b"{}"),
        (".json", b"[1]"),
        (".json", b'{"version": 1, "time": "x", "path": null, "folder": "/"}'),
        (".json", b'{"version": 1, "time": 1, "path": 3, "folder": "/"}'),
        (".yaml", b""),
        (".yaml", b"a: [1"),
        (".yaml", b"\xff\xfe"),
        (".yaml", b"- 1"),
        (".yaml", None),
        (".json", None),
    ],
)
def test_damaged_leftovers_are_removed(desk: Path, store: Path, name: str, content: bytes | None) -> None:
    source = open_source(desk / "scene.yaml")
    own = Autosave(store)
    own.write(source, present_of(source, 25))
    own.release()
    (path,) = store.glob(f"*{name}")
    if content is None:
        path.unlink()
    else:
        path.write_bytes(content)
    assert Autosave(store).found() == []
    assert list(store.iterdir()) == []


def test_a_disk_that_cannot_be_written(desk: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    source = open_source(desk / "scene.yaml")
    own = Autosave(tmp_path / "file" / "autosave")
    assert not own.write(source, present_of(source, 25))
    assert own.found() == []
    own.close()


def test_the_folder_follows_the_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CLFRACTAL_CACHE", str(tmp_path))
    assert default_folder() == tmp_path / "autosave"
