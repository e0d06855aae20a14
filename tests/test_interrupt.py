"""Ctrl-C, and what batch systems, `timeout` and closed terminals send: one line, at once, whatever is being done."""

from __future__ import annotations

import importlib
import re
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from clfractal.cli import interrupt as interrupt_module
from clfractal.cli import shell as shell_module
from clfractal.cli.shell import Shell
from clfractal.cli.unfinished import Unfinished
from clfractal.device.quirks import sees_host_writes
from clfractal.device.select import choose
from clfractal.engine.prepare import prepare
from clfractal.scene.load import load_scene
from tests.interrupts import planes
from tests.long_renders import (
    ENDLESS,
    LIMIT_SECONDS,
    PROMISE_SECONDS,
    holding,
    interrupt,
    interrupted_in_a_kernel,
)
from tests.shell import SCENE, Running, has_tiles, process, python, wait_until, works

pytestmark = [
    pytest.mark.usefixtures("interrupts_are_not_ignored"),
    pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals"),
]


def _after(seconds: float) -> Callable[[], bool]:
    """Whether so much time has passed since it was asked first."""
    begun: list[float] = []

    def is_past() -> bool:
        begun.append(time.monotonic())
        return begun[-1] >= begun[0] + seconds

    return is_past


def test_the_promise(capsys: pytest.CaptureFixture[str]) -> None:
    """What makes up the half second: the orderly way's grace, and last words that take no time."""
    shell = Shell(owns_process=False)
    start = time.thread_time()
    shell.interrupted()
    assert interrupt_module.GRACE_SECONDS + time.thread_time() - start < PROMISE_SECONDS - 0.1
    assert capsys.readouterr().err == "clfractal: interrupted\n"


def test_in_the_middle_of_a_kernel(tmp_path: Path) -> None:
    for told in interrupted_in_a_kernel(tmp_path, "--quiet"):
        assert re.fullmatch(r"(clfractal|out\.exr(\.partial)?): interrupted.*\n", told), told


def test_in_the_middle_of_a_compilation(tmp_path: Path) -> None:
    """With an empty cache a child process compiles the kernel first: it must not outlive its parent."""
    (tmp_path / "endless.yaml").write_text(ENDLESS)
    cache = tmp_path / "cache"
    children: list[int] = []

    def compiling() -> bool:
        found = [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]
        for number in found:
            try:
                words = Path(f"/proc/{number}/cmdline").read_bytes().split(b"\0")
                owner = Path(f"/proc/{number}/environ").read_bytes()
            except OSError:
                continue
            if b"clfractal.device.child" in words and str(cache).encode() in owner:
                children.append(number)
        return bool(children)

    extra = {"CLFRACTAL_CACHE": str(cache), "CLFRACTAL_LANES": "1", "POCL_CACHE_DIR": str(tmp_path / "pocl")}
    status, told, took = interrupt(tmp_path, compiling, extra, "--quiet")
    assert status == 130
    assert told.count("\n") == 1
    assert "interrupted" in told
    assert took < LIMIT_SECONDS
    wait_until(lambda: not any(Path(f"/proc/{child}").exists() for child in children))
    assert {path.name for path in tmp_path.iterdir()} - {"cache", "pocl"} == {"endless.yaml"}


def test_while_everything_is_still_loading(tmp_path: Path) -> None:
    (tmp_path / "endless.yaml").write_text(ENDLESS)
    for delay in (0.0, 0.15, 0.3):
        status, told, took = interrupt(tmp_path, _after(delay), {}, "--quiet")
        assert status == 130
        assert told.count("\n") == 1
        assert "Traceback" not in told
        assert took < LIMIT_SECONDS


@pytest.mark.parametrize("tiles", [0, 1])
def test_a_main_thread_that_does_not_answer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], tiles: int
) -> None:
    """It is in a driver's call: what another thread does before the process is ended leaves no empty file behind."""
    (tmp_path / "a.yaml").write_text(SCENE)
    job = prepare(load_scene(tmp_path / "a.yaml"), choose())
    (tmp_path / "a.yaml").unlink()
    shell = Shell(owns_process=False)
    left = ["a.exr.partial"] * tiles
    with suppress(KeyboardInterrupt), Unfinished(job, {}, tmp_path / "a.exr", shell, resume=False) as work:
        shell.state = work.interrupted
        for tile in range(tiles):
            work.framebuffers[0].put(tile, np.zeros((len(job.channels), 32, 32), np.float32))
        shell.interrupted()
        assert [path.name for path in tmp_path.iterdir()] == left
        assert ("--resume" in capsys.readouterr().err) == bool(tiles)
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.iterdir()] == left
    assert not shell.leaving


def test_last_words_are_waited_for(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two threads that end the process the second would cut off those of the first."""
    monkeypatch.setattr(shell_module, "_LAST_WORDS_SECONDS", 200.0)
    shell = Shell(owns_process=False)
    begun, goes_on = threading.Event(), threading.Event()

    def state() -> str:
        begun.set()
        assert goes_on.wait(200)
        return "a.exr: interrupted"

    shell.state = state
    threads = [threading.Thread(target=shell.interrupted) for _ in range(2)]
    threads[0].start()
    assert begun.wait(200)
    threads[1].start()
    threads[1].join(0.1)
    assert threads[1].is_alive()
    goes_on.set()
    threads[1].join()
    assert capsys.readouterr().err == "a.exr: interrupted\n"
    threads[0].join()


# --- Python ---


# The answer takes milliseconds on an idle machine, and the work minutes; the bound lets a busy one be slow.
MOST_SECONDS = 15.0

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
    code = (
        PRELUDE
        + "engine = clfractal.Engine()\nnoise = np.random.default_rng(1).random((400, 400, 400), np.float32)\n"
    )
    for name, (first, long) in CALLS.items():
        code += f"{first}\nprint({name!r}, interrupted(lambda: {long}), sep=': ', flush=True)\n{first}\n"
    took = dict(line.split(": ") for line in works(python(code, folder=tmp_path)).out.splitlines())
    print(took)
    assert list(took) == list(CALLS)
    assert {name: seconds for name, seconds in took.items() if float(seconds) > MOST_SECONDS} == {}
    assert min(map(float, took.values())) >= 0


# --- SIGTERM and SIGHUP ---


# Many tiles, of which each takes some hundredths of a second.
TILED = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 512, height: 288}
camera: {position: [1.2, -2.2, 1.0]}
renderer: {samples: 64}
animation: {frames: 40}
"""


def begun(folder: Path, *arguments: str, **settings: Any) -> Running:
    (folder / "scene.yaml").write_text(TILED)
    return Running(folder, *arguments, **settings)


@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGHUP])
def test_a_render_is_continued(tmp_path: Path, sent: signal.Signals) -> None:
    few = ("render", "scene.yaml", "--samples", "4")
    work = begun(tmp_path, words=holding(1, *few, "-o", "a.exr", "--quiet"))
    work.wait_until(has_tiles(tmp_path / "a.exr.partial"))
    status, told = work.ended_by(sent)
    assert status == 128 + sent
    found = re.fullmatch(
        r"a\.exr\.partial: interrupted with (\d+) of (\d+) tiles done; --resume continues\n", told
    )
    assert found, told
    assert 0 < int(found[1]) < int(found[2])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr.partial", "scene.yaml"]
    if sent == signal.SIGHUP:
        return
    works(process([*few, "-o", "a.exr", "--resume"], tmp_path))
    works(process([*few, "-o", "b.exr", "--quiet"], tmp_path))
    assert planes(tmp_path / "a.exr") == planes(tmp_path / "b.exr")


@pytest.mark.parametrize(
    "arguments",
    [
        ("animate", "scene.yaml", "-o", "f_####.exr"),
        ("animate", "scene.yaml", "-o", "f.mkv"),
        ("voxelize", "scene.yaml", "-o", "a.nrrd", "--resolution", "1024"),
        ("mesh", "scene.yaml", "-o", "a.ply", "--resolution", "1024"),
        ("watch", "scene.yaml", "-o", "a.png"),
        ("render", "scene.yaml", "-o", "a.png", "--cluster", "local:1"),
    ],
    ids=lambda arguments: " ".join((*arguments[:1], *arguments[3:])),
)
def test_long_commands(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    if "--cluster" in arguments:
        pytest.importorskip("distributed")
    work = begun(tmp_path, *arguments, "--quiet")
    work.wait_until_it_listens()
    work.wait_until(_after(1.0))
    status, told = work.ended_by(signal.SIGTERM)
    assert status == 143, told
    assert re.fullmatch(r"[^\n]*(interrupted|no longer watched)[^\n]*\n", told), told
    left = {path.name for path in tmp_path.iterdir()}
    assert not [name for name in left if name.endswith(".tmp")]
    if "--resume" in told and "0 of" not in told:
        assert [name for name in left if name != "scene.yaml"]


def test_what_was_ignored_stays_so(tmp_path: Path) -> None:
    """`nohup`, and a job in the background of a script; SIGTERM ends both."""

    def ignore() -> None:
        for each in (signal.SIGHUP, signal.SIGINT):
            signal.signal(each, signal.SIG_IGN)

    words = holding(2, "render", "scene.yaml", "-o", "a.exr", "--quiet")
    work = begun(tmp_path, words=words, before=ignore)
    work.wait_until(has_tiles(tmp_path / "a.exr.partial", 2))
    work.process.send_signal(signal.SIGHUP)
    work.process.send_signal(signal.SIGINT)
    (tmp_path / "go").touch()
    work.wait_until(has_tiles(tmp_path / "a.exr.partial", 3))
    status, told = work.ended_by(signal.SIGTERM)
    assert status == 143
    assert "--resume continues" in told


# The program; when it has heard the first signal the others come. (From outside nobody can tell when it has, and two that
# wait for a process are heard in the order of their numbers.)
SEVERAL = """
import os, signal
from clfractal.cli import interrupt, main
plain = signal.signal

def noted(number, handler):
    plain(number, handler)
    if handler is interrupt._ignore and number == signal.SIGHUP:
        for each in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT):
            os.kill(os.getpid(), each)

signal.signal = noted
main()
"""

# The program, in which an interrupt meets what makes another error of it.
TURNED = """
from clfractal.cli import main
from clfractal.engine.local_executor import LocalExecutor
execute = LocalExecutor.execute

def turned(*arguments):
    try:
        yield from execute(*arguments)
    finally:
        raise RuntimeError("release unlocked lock")

LocalExecutor.execute = turned
main()
"""


@pytest.mark.parametrize("code", [SEVERAL, TURNED], ids=["several", "turned"])
def test_the_first_signal_counts(tmp_path: Path, code: str) -> None:
    """Whatever comes afterwards: other signals, or an error that is a consequence."""
    words = holding(1, "render", "scene.yaml", "-o", "a.exr", "--quiet", code=code)
    work = begun(tmp_path, words=words)
    work.wait_until(has_tiles(tmp_path / "a.exr.partial"))
    status, told = work.ended_by(signal.SIGTERM)
    assert status == 143, told
    assert told.count("\n") == 1
    assert "--resume continues" in told


def test_where_python_only_prints_an_exception_the_interrupt_comes_a_moment_later() -> None:
    """The callback of an import's lock, by the name that this Python gives it."""
    inner = importlib._bootstrap._get_module_lock.__code__.co_consts  # type: ignore[attr-defined]
    (callback,) = (each for each in inner if getattr(each, "co_name", "") == "cb")
    assert interrupt_module._swallows(SimpleNamespace(f_code=callback))  # type: ignore[arg-type]
    assert not interrupt_module._swallows(SimpleNamespace(f_code=_after.__code__))  # type: ignore[arg-type]
