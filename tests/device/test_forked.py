"""Forked processes: OpenCL works in them if it was not used before, and otherwise is refused at once."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.shell import SCENE, environment

pytestmark = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork"
)

PROGRAM = f"""
import gc, multiprocessing, os
import clfractal

SCENE = {SCENE!r}
context = multiprocessing.get_context("fork")

def told(work):
    try:
        work()
    except clfractal.DeviceError as error:
        return f"status {{error.status}}: {{error}}"
    return "fine"

WORK = {{
    "render": lambda: clfractal.render(SCENE, samples=1),
    "escape": lambda: clfractal.escape("mandelbulb", [[0.1, 0.2, 0.3]], iterations=8),
    "devices": lambda: clfractal.devices(),
    "engine": lambda: engine.render(SCENE),
    "refine": lambda: list(engine.refine(SCENE)),
}}

def in_child(name):
    return told(WORK[name])

# OpenCL has not been used so far.
with context.Pool(1) as pool:
    print("before:", pool.map(in_child, ["render"]))

with clfractal.Engine() as engine:
    print("parent:", told(WORK["engine"]))
    with context.Pool(2) as pool:
        for name, answer in zip(WORK, pool.map(in_child, WORK)):
            print(f"{{name}}: {{answer}}")
    child = os.fork()
    if child == 0:
        with engine:
            pass
        del engine
        gc.collect()
        raise SystemExit(7)
    print("ended:", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    print("parent:", told(WORK["engine"]))
"""


def test_forked_processes(tmp_path: Path) -> None:
    # A group of its own, so that no child is left if one should wait for ever.
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        cwd=tmp_path,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            out, err = process.communicate(timeout=120)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            pytest.fail(f"a forked process hangs: {process.communicate()}")
    assert process.returncode == 0, (out, err)
    lines = out.splitlines()
    refused = "status 3: OpenCL does not work in a process that was forked from one that has used it; "
    assert lines[0] == "before: ['fine']"
    assert lines[1] == "parent: fine"
    names = ("render", "escape", "devices", "engine", "refine")
    assert [line.split("; ")[0] + "; " for line in lines[2:7]] == [f"{name}: {refused}" for name in names]
    assert "get_context('spawn')" in lines[2]
    assert lines[7:] == ["ended: 7", "parent: fine"]
