"""AV1: SVT-AV1 makes no thread a real-time one, and is silent; who has no such encoder is told."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from clfractal.errors import ClfractalError
from clfractal.files.film_kinds import Recipe
from clfractal.files.moving import plan_film
from tests.shell import environment

WRITING = """
import os, sys, threading
from pathlib import Path
from clfractal.files import moving
from clfractal.files.film_kinds import Recipe

def schedules():
    return {os.sched_getscheduler(int(each.name)) for each in Path("/proc/self/task").iterdir()}

seen = []
def noted(*arguments):
    seen.append(schedules())
    return frame(*arguments)

frame, moving._frame = moving._frame, noted
before = schedules()
plan = moving.plan_film(Path("film.mp4"), Recipe("av1"), (128, 96), 25)
moving.write_film(plan, [Path("a.png")] * 3)
late = threading.Thread(target=lambda: seen.append(schedules()))
late.start(), late.join()
assert len(seen) == 4 and all(each == before for each in seen), (before, seen)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell how threads are scheduled")
def test_no_thread_is_scheduled_otherwise(tmp_path: Path) -> None:
    """Also as root, who may; the same process afterwards starts usual threads, and nothing was said."""
    Image.new("RGB", (128, 96), (40, 90, 200)).save(tmp_path / "a.png")
    ended = subprocess.run(
        [sys.executable, "-c", WRITING],
        env=environment() | {"PYTHONPATH": os.pathsep.join(sys.path)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr == ""


def test_it_is_av1_with_ten_bits(tmp_path: Path) -> None:
    from clfractal.files.moving import write_film

    ramp = np.repeat(np.repeat(np.linspace(0, 255, 128).astype(np.uint8)[None, :, None], 96, 0), 3, 2)
    Image.fromarray(ramp).save(tmp_path / "a.png")
    path = tmp_path / "film.mkv"
    write_film(plan_film(path, Recipe("av1"), (128, 96), 25), [tmp_path / "a.png"] * 2)
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        assert stream.codec_context.codec.canonical_name == "av1"
        assert [frame.format.name for frame in file.decode(stream)] == ["yuv420p10le"] * 2


def test_who_has_no_such_encoder_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(av, "codecs_available", av.codecs_available - {"libsvtav1"})
    with pytest.raises(ClfractalError, match="the installed package av has no libsvtav1") as caught:
        plan_film(tmp_path / "a.mp4", Recipe("av1"), (128, 96), 25)
    assert str(caught.value).startswith("--codec: ")
