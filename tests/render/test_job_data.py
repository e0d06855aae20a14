"""A job is plain data: sent to wherever it is rendered, it gives the same bits there."""

from __future__ import annotations

import pickle
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from clfractal.device.select import Device
from clfractal.files.exr import write_exr
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.work.films import JobFilms
from clfractal.work.job import Job
from clfractal.work.local import LocalExecutor
from clfractal.work.run import run
from tests.render.shots import BALL, BALL_ITERATIONS, PERSPECTIVE, engine_of
from tests.render.test_layout_views import VIEWS
from tests.render.volumes import keep, middles
from tests.shell import command, environment

SIZE = (48, 40)
CHANNELS = ("R", "G", "B", "A", "Z", "N.X", "samples")

Bits = dict[str, npt.NDArray[np.uint32]]


def scene_of(folder: Path, **sections: Any) -> Scene:
    plain = {
        "version": 1,
        "formula": {"inline": BALL, "iterations": BALL_ITERATIONS},
        "image": {"width": SIZE[0], "height": SIZE[1]},
        "camera": PERSPECTIVE,
    }
    return load_scene({**plain, **sections}, folder=folder)


def lit_by_a_file(folder: Path) -> Scene:
    sky = np.random.default_rng(3).random((3, 16, 32), dtype=np.float32)
    band = dict(zip("RGB", sky, strict=True))
    write_exr(
        folder / "sky.exr", [band], display=(32, 16), region=(0, 0, 32, 16), channels=tuple("RGB"), half=()
    )
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

# What a worker of another process does with a job.
WORKER = """
import pickle, sys
import numpy as np
from clfractal.device.select import by_key
from clfractal.work.films import JobFilms
from clfractal.work.local import LocalExecutor
from clfractal.work.run import run
job = pickle.load(sys.stdin.buffer)
films = JobFilms(job)
run(job, films.films, LocalExecutor(by_key(job.device.index, job.device.key)))
film = films.picture()
np.savez(sys.argv[1], **{name: film[name] for name in film})
"""


def rendered(job: Job, device: Device) -> Bits:
    """By an executor that has never seen anything."""
    films = JobFilms(job)
    run(job, films.films, LocalExecutor(device))
    film = films.picture()
    return {name: film[name].view(np.uint32) for name in film}


def same(found: Bits, expected: Bits) -> None:
    assert found.keys() == expected.keys()
    for name, plane in expected.items():
        np.testing.assert_array_equal(found[name], plane, name)


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
    same(rendered(copy, device), expected)


def test_sent_after_it_was_rendered(device: Device, tmp_path: Path) -> None:
    """What a render leaves in a job's scenes (chains, maps, grids) travels too, or is made again."""
    job = engine_of(device).prepare(lit_by_a_file(tmp_path), channels=CHANNELS)
    expected = rendered(job, device)
    same(rendered(pickle.loads(pickle.dumps(job)), device), expected)


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
        same({channel: found[channel].view(np.uint32) for channel in found}, expected)


def test_a_job_takes_up_little_room(device: Device, tmp_path: Path) -> None:
    """A scene and its plan, not what is made of them: some kilobytes, however large the picture."""
    scene = scene_of(tmp_path, image={"width": 16384, "height": 16384})
    job = engine_of(device).prepare(scene)
    assert len(pickle.dumps(job)) < 50_000
