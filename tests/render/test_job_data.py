"""A job is plain data: sent to wherever it is rendered, it gives the same bits there."""

from __future__ import annotations

import dataclasses
import pickle
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clfractal.device.select import Device
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.engine.run import run
from clfractal.errors import FileError
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.store import JournalFramebuffer
from clfractal.scene.model import Scene
from tests import scenes
from tests.environment_maps import write_map
from tests.render.bits import same_pictures
from tests.render.layouts import VIEWS
from tests.render.shots import BALL, PERSPECTIVE, engine_of
from tests.render.volumes import keep, middles
from tests.shell import command, environment

SIZE = (48, 40)


def scene_of(folder: Path, **sections: Any) -> Scene:
    usual: dict[str, Any] = {"formula": BALL, "camera": PERSPECTIVE, "size": SIZE}
    return scenes.scene_of(folder=folder, **{**usual, **sections})


def lit_by_a_file(folder: Path) -> Scene:
    write_map(folder / "sky.exr", np.random.default_rng(3).random((16, 32, 3), dtype=np.float32))
    return scene_of(
        folder,
        environment={"file": "sky.exr", "rays": 2},
        renderer={"samples": 4, "noise": 0.05, "min_samples": 4},
    )


def of_a_file(folder: Path) -> Scene:
    places = middles((24, 24, 24), [-1.2] * 3, [0.1] * 3)
    ball = np.clip(1.5 - np.linalg.norm(places, axis=-1), 0, 1).astype(np.float32)
    keep(folder / "ball.nrrd", ball, [-1.2] * 3, [0.1] * 3)
    fog = {"opacity": [{"at": 0.3, "opacity": 0}, {"at": 1, "opacity": 0.6}]}
    return scene_of(folder, renderer={"type": "volume", "file": "ball.nrrd", "transfer": fog})


def with_a_texture(folder: Path) -> Scene:
    codes = np.random.default_rng(5).integers(0, 256, (5, 8, 3), dtype=np.uint8)
    Image.fromarray(codes).save(folder / "tile.png")
    oak = {"base": {"color": {"texture": "tile.png"}, "weight": {"by": "trap"}}}
    both = {"blend": ["oak", "clay"], "mask": {"by": "normal"}}
    return scene_of(
        folder,
        lighting={"mode": "path", "bounces": 1},
        materials={"oak": oak, "clay": {}, "both": both},
        material={"name": "both"},
    )


SCENES: dict[str, Callable[[Path], Scene]] = {
    "surface": lambda folder: scene_of(folder, cut_planes=[{"plane": {"width": 3}, "opacity": 0.5}]),
    "environment": lit_by_a_file,
    "texture": with_a_texture,
    "volume": of_a_file,
    "cut plane": lambda folder: scene_of(folder, renderer={"type": "cut_plane"}),
    "chain": lambda folder: scene_of(folder, formula={"name": "hast", "iterations": 8}),
    "layout": lambda folder: scene_of(folder, layout={"views": VIEWS, "gap": 2}),
    "stereo": lambda folder: scene_of(folder, stereo={"mode": "anaglyph", "fit": "auto"}),
    "layout for two eyes": lambda folder: scene_of(
        folder, layout={"views": VIEWS[:2]}, stereo={"mode": "over_under"}
    ),
}


CHANNELS = ("R", "G", "B", "A", "Z", "N.X", "samples")

# What a worker of another process does with a job.
WORKER = """
import pickle, sys
import numpy as np
from clfractal.device.select import by_key
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import run
job = pickle.load(sys.stdin.buffer)
framebuffers = JobFramebuffers(job)
run(job, framebuffers.framebuffers, LocalExecutor(by_key(job.device.index, job.device.key)))
framebuffer = framebuffers.picture()
np.savez(sys.argv[1], **{name: framebuffer[name] for name in framebuffer})
"""


def rendered(job: Job, device: Device) -> Framebuffer:
    """By an executor that has never seen anything."""
    framebuffers = JobFramebuffers(job)
    run(job, framebuffers.framebuffers, LocalExecutor(device))
    return framebuffers.picture()


def moved_away(folder: Path) -> None:
    """Removes the files that a scene was made of: all that is needed of them is in the job."""
    for path in folder.iterdir():
        path.unlink()


@pytest.mark.parametrize("name", SCENES)
def test_a_copy_gives_the_same_bits(device: Device, tmp_path: Path, name: str) -> None:
    job = engine_of(device).prepare(
        SCENES[name](tmp_path),
        region=(3, 2, 40, 37),
        channels=CHANNELS,
        samples=3 if name == "chain" else None,
    )
    sent = pickle.dumps(job)
    expected = rendered(job, device)
    moved_away(tmp_path)
    copy = pickle.loads(sent)
    assert copy == job
    assert isinstance(copy, Job)
    assert copy.header()["scene"] == job.header()["scene"]
    for number in range(len(job.views)):
        assert copy.identity(number) == job.identity(number)
    same_pictures(rendered(copy, device), expected)


def test_sent_after_it_was_rendered(device: Device, tmp_path: Path) -> None:
    """What a render leaves in a job's scenes (chains, maps, grids) travels too, or is made again."""
    job = engine_of(device).prepare(lit_by_a_file(tmp_path), channels=CHANNELS)
    expected = rendered(job, device)
    same_pictures(rendered(pickle.loads(pickle.dumps(job)), device), expected)


@pytest.mark.parametrize("name", ["environment", "texture", "volume", "layout"])
def test_another_process_gives_the_same_bits(device: Device, tmp_path: Path, name: str) -> None:
    """In another folder, without the files."""
    source, elsewhere = tmp_path / "source", tmp_path / "elsewhere"
    source.mkdir()
    elsewhere.mkdir()
    job = engine_of(device).prepare(SCENES[name](source), channels=CHANNELS)
    expected = rendered(job, device)
    moved_away(source)
    ended = subprocess.run(
        [command()[0], "-P", "-c", WORKER, "found.npz"],
        input=pickle.dumps(job),
        cwd=elsewhere,
        env=environment(),
        capture_output=True,
        check=False,
        timeout=240,
    )
    assert ended.returncode == 0, ended.stderr.decode()
    with np.load(elsewhere / "found.npz") as found:
        for channel in expected:
            np.testing.assert_array_equal(found[channel].view(np.uint32), expected[channel].view(np.uint32))


def test_a_job_takes_up_little_room(device: Device, tmp_path: Path) -> None:
    """A scene and its plan, not what is made of them: some kilobytes, however large the picture."""
    scene = scene_of(tmp_path, image={"width": 16384, "height": 16384})
    job = engine_of(device).prepare(scene)
    assert len(pickle.dumps(job)) < 50_000


KEYS = {"scene", "environment", "grid", "version", "device", "driver", "lanes"}


def identity(scene: Scene, device: Device, **settings: Any) -> dict[str, Any]:
    return prepare(scene, device, **{"precision": "float32", **settings}).identity(0)


def begin(path: Path, known_by: Mapping[str, Any], *, resume: bool) -> JournalFramebuffer:
    return JournalFramebuffer(path, known_by, ("A",), (32, 32), resume=resume)


def with_lanes(job: Job) -> dict[str, Any]:
    """As if another lane count had been found the fastest meanwhile."""
    view = job.views[0]
    other = dataclasses.replace(view.plan, lanes=4 if view.plan.lanes != 4 else 8)
    return dataclasses.replace(job, views=(dataclasses.replace(view, plan=other),)).identity(0)


@pytest.mark.parametrize("name", ["environment", "volume", "layout for two eyes"])
def test_work_is_resumed_only_if_all_of_it_is_equal(device: Device, tmp_path: Path, name: str) -> None:
    """Each key in turn, and what a journal adds."""
    known_by = identity(SCENES[name](tmp_path), device)
    assert known_by.keys() == KEYS | ({"eye", "view"} if name == "layout for two eyes" else set())
    path = tmp_path / "a.partial"
    film = begin(path, known_by, resume=False)
    film.put(0, np.ones((1, 32, 32), np.float32))
    film.close()
    kept = path.read_bytes()
    for key, value in known_by.items():
        other = {**value, "version": 2} if isinstance(value, dict) else f"another {value}"
        for changed in ({**known_by, key: other}, {k: v for k, v in known_by.items() if k != key}):
            with pytest.raises(FileError, match=f"cannot be resumed: the {key} "):
                begin(path, changed, resume=True)
            assert path.read_bytes() == kept
    again = begin(path, known_by, resume=True)
    assert again.done.all()
    again.close()


@pytest.mark.parametrize(("name", "file"), [("environment", "sky.exr"), ("volume", "ball.nrrd")])
def test_a_file_that_the_scene_names_has_changed(
    device: Device, tmp_path: Path, name: str, file: str
) -> None:
    """The scene is the same, letter by letter."""
    before = identity(SCENES[name](tmp_path), device)
    assert identity(SCENES[name](tmp_path), device) == before
    changed = bytearray((tmp_path / file).read_bytes())
    changed[-1] ^= 1
    # A new file, because the old one may be mapped into memory.
    (tmp_path / "new").write_bytes(changed)
    (tmp_path / "new").replace(tmp_path / file)
    job = prepare(_read_again(name, tmp_path), device, precision="float32")
    after = job.identity(0)
    key = "environment" if name == "environment" else "grid"
    assert {k for k in KEYS if before[k] != after[k]} == {key}


def _read_again(name: str, folder: Path) -> Scene:
    if name == "environment":
        return scene_of(
            folder,
            environment={"file": "sky.exr", "rays": 2},
            renderer={"samples": 4, "noise": 0.05, "min_samples": 4},
        )
    fog = {"opacity": [{"at": 0.3, "opacity": 0}, {"at": 1, "opacity": 0.6}]}
    return scene_of(folder, renderer={"type": "volume", "file": "ball.nrrd", "transfer": fog})


def test_decisions_and_the_device(device: Device, tmp_path: Path) -> None:
    """What the program decided counts like what the scene says."""
    job = prepare(scene_of(tmp_path), device, precision="float32")
    before = job.identity(0)
    assert {k for k in KEYS if before[k] != with_lanes(job)[k]} == {"lanes"}
    for samples in (1, 7):
        found = identity(scene_of(tmp_path), device, samples=samples)
        assert found["scene"]["renderer"]["samples"] == samples
    driver = dataclasses.replace(job, device=dataclasses.replace(job.device, driver="99.9")).identity(0)
    assert {k for k in KEYS if before[k] != driver[k]} == {"driver"}
    name = dataclasses.replace(job, device=dataclasses.replace(job.device, name="Another")).identity(0)
    assert {k for k in KEYS if before[k] != name[k]} == {"device", "driver"}


@pytest.mark.parametrize(
    "shown",
    [
        {"method": "gray"},
        {"glasses": "amber_blue"},
        {"mode": "rows"},
        {"swap": True},
        {"mode": "anaglyph_chessboard", "colors": [[1, 0, 0], [0, 1, 1]]},
    ],
    ids=str,
)
def test_the_way_to_show_a_pair_may_change(device: Device, tmp_path: Path, shown: dict[str, Any]) -> None:
    pair = {"mode": "anaglyph", "separation": 0.3}
    before = identity(scene_of(tmp_path, stereo=pair), device)
    assert identity(scene_of(tmp_path, stereo={**pair, **shown}), device) == before
    assert identity(scene_of(tmp_path, stereo={**pair, "separation": 0.4}), device) != before


def test_bookmarks_and_how_files_are_written_may_change(device: Device, tmp_path: Path) -> None:
    before = identity(scene_of(tmp_path), device)
    assert identity(scene_of(tmp_path, output={"exposure": 2, "png_bits": 16}), device) == before
    bookmarks = {"here": {"position": [0, -3, 0], "target": [0, 0, 0]}}
    assert identity(scene_of(tmp_path, bookmarks=bookmarks), device) == before
    assert identity(scene_of(tmp_path, material={"specular": 0.11}), device) != before
