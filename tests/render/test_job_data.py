"""A job is plain data: sent to wherever it is rendered, it gives the same bits there."""

from __future__ import annotations

import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import run
from clfractal.images.framebuffer import Framebuffer
from tests.render.bits import same_pictures
from tests.render.job_scenes import SCENES, lit_by_a_file, scene_of
from tests.render.shots import engine_of
from tests.shell import command, environment

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
