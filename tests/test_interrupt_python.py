"""Ctrl-C ends every call of the API soon, even where the rest of it would take minutes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from clfractal.device.select import choose, sees_host_writes
from tests.shell import environment

# The answer takes milliseconds on an idle machine; the bound lets a busy one be slow.
MOST_SECONDS = 2.0

# Work that would take minutes, and how it begins again afterwards: the first call is short, so that nothing is compiled
# while the clock runs.
PRELUDE = """
import os, signal, sys, threading, time
import numpy as np
import clfractal

places = np.random.default_rng(1).uniform(-0.3, 0.3, (400_000, 3))
# Light points first: the launches grow, and then each of them would take minutes.
mixed = np.concatenate([places + 5, places])
text = '''version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 40, height: 36}
camera: {position: [0, -3, 0]}
'''
scene = clfractal.load_scene(text)
large = scene.model_copy(update={"image": {"width": 4096, "height": 4096}})


def interrupted(call):
    asked = []

    def ask():
        asked.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.4, ask)
    timer.start()
    try:
        call()
    except KeyboardInterrupt:
        return time.perf_counter() - asked[0]
    finally:
        timer.cancel()
    return float("inf")
"""

CALLS = {
    "escape": (
        "clfractal.escape('mandelbulb', places[:9], iterations=9)",
        "clfractal.escape('mandelbulb', places, iterations=1_000_000)",
    ),
    "escape after light points": (
        "clfractal.escape('mandelbulb', places[:9], iterations=9)",
        "clfractal.escape('mandelbulb', mixed, iterations=100_000_000)",
    ),
    "distances": (
        "clfractal.distances('mandelbulb', places[:9])",
        "clfractal.distances('mandelbulb', mixed, iterations=1_000_000)",
    ),
    "render": ("clfractal.render(scene)", "clfractal.render(large, samples=10_000)"),
    "refine": (
        "list(engine.refine(scene))",
        "list(engine.refine(large.model_copy(update={'image': {'width': 512, 'height': 512}}), samples=20_000))",
    ),
    "voxelize": (
        "clfractal.voxelize(scene, resolution=16)",
        "clfractal.voxelize(text.replace('8}', '1_000_000}').replace('_', ''), resolution=256)",
    ),
    "mesh": (
        "clfractal.mesh(scene, resolution=16)",
        "clfractal.mesh(clfractal.Volume(noise), level=0.5)",
    ),
    "variations": (
        "clfractal.variations(scene, count=2)",
        "clfractal.variations(scene, count=100_000)",
    ),
}


def test_every_call_hears_ctrl_c(tmp_path: Path) -> None:
    if not sees_host_writes(choose().info):
        pytest.skip("the device ends no launch early")
    pytest.importorskip("skimage")
    code = (
        PRELUDE
        + "engine = clfractal.Engine()\nnoise = np.random.default_rng(1).random((400, 400, 400), np.float32)\n"
    )
    for name, (first, long) in CALLS.items():
        code += f"{first}\nprint({name!r}, interrupted(lambda: {long}), sep=': ', flush=True)\n{first}\n"
    command = [sys.executable, "-P", "-c", code]
    ended = subprocess.run(
        command, cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=200
    )
    assert ended.returncode == 0, ended.stderr[-3000:]
    took = dict(line.split(": ") for line in ended.stdout.splitlines())
    print(took)
    assert list(took) == list(CALLS)
    assert {name: seconds for name, seconds in took.items() if float(seconds) > MOST_SECONDS} == {}
    assert min(map(float, took.values())) >= 0
