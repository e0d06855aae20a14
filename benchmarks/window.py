"""How the window feels: from an input to the picture that shows it, frames a second while orbiting, and its own frames.

    python -m benchmarks.window                  the table
    python -m benchmarks.window mandelbulb hast  only these
    python -m benchmarks.window --json FILE      also as JSON

Opens the window of `clfractal view` at 1280 x 720 on DISPLAY (on an Xvfb of its own if there is none), and drags and turns
the wheel with real events of the X server, sent by another process. An input's time is stamped when it is sent, a picture's
when its buffers have been swapped. Times are in milliseconds: median and 99th percentile.

- stream: the mouse is dragged, 125 events a second; each is answered by the first picture that is not older.
- single: an event every half second, which finds the window gathering samples or at rest.
- frames: different pictures a second during the stream. - draw: a frame of the window itself, panels and all.
- longest: the longest that the window's thread was busy without looking for events.
"""

from __future__ import annotations

import argparse
import atexit
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

SCENES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "mandelbulb": ("mandelbulb.yaml", ()),
    "hast": ("hast_rotated.yaml", ()),
    "mandelbox": (
        "mandelbox.yaml",
        (
            "lighting={mode: direct}",
            "objects={}",
            "fog=null",
            "camera={position: [4.0, -6.0, 3.2], target: [0.15, 0, -0.6], fov: 49}",
            "coloring={by: trap, trap: {shape: point}, scale: 0.5}",
            "renderer={samples: 9, ambient_occlusion: {rays: 2, distance: 0.6}}",
            "lights=[{direction: [-1.0, 0.35, -0.55], angular_size: 1}, {direction: [0.3, 1, -0.1], shadow: false}]",
        ),
    ),
    "volume": (
        "volume_alabaster.yaml",
        (
            "lighting={mode: direct}",
            "objects={}",
            "renderer={type: volume, box: {size: 2.8}, resolution: 256, value: coverage, store: float, shadows: true, "
            "samples: 4, transfer: {opacity: [{at: 0.05, opacity: 0}, {at: 0.4, opacity: 0.2}, {at: 1.0, opacity: 0.6}]}}",
        ),
    ),
    "cut_plane": ("cut_mandelbrot.yaml", ()),
}
"""Rows of the table: a scene that is shipped, and values of it."""

SIZE = (1280, 720)
_SETTLED_SECONDS = 60.0


@dataclass
class Measured:
    """What was seen of one scene; times in seconds.

    Attributes:
        stream, single: from inputs to their pictures.
        unanswered: inputs of which no picture came.
        frames: pictures a second.
        draws: frames of the window.
        turns: of its main loop, without waiting.
        dividers: how coarse the pictures of the stream were.
    """

    name: str
    stream: list[float] = field(default_factory=list)
    single: list[float] = field(default_factory=list)
    unanswered: int = 0
    frames: float = 0.0
    draws: list[float] = field(default_factory=list)
    turns: list[float] = field(default_factory=list)
    dividers: list[int] = field(default_factory=list)

    def figures(self) -> dict[str, float]:
        """The row of the table: milliseconds, frames a second."""
        return {
            "stream_median": 1e3 * percentile(self.stream, 50),
            "stream_99": 1e3 * percentile(self.stream, 99),
            "single_median": 1e3 * percentile(self.single, 50),
            "single_99": 1e3 * percentile(self.single, 99),
            "frames": self.frames,
            "divider": percentile([float(each) for each in self.dividers], 50),
            "draw_median": 1e3 * percentile(self.draws, 50),
            "draw_99": 1e3 * percentile(self.draws, 99),
            "longest": 1e3 * max(self.turns, default=math.nan),
            "unanswered": float(self.unanswered),
        }


def percentile(values: Sequence[float], share: float) -> float:
    """The value that `share` percent are not above; NaN of nothing."""
    ordered = sorted(values)
    return ordered[min(math.ceil(share / 100 * len(ordered)), len(ordered)) - 1] if ordered else math.nan


class Watch:
    """Takes note of what a viewer does, without changing it."""

    def __init__(self, viewer: Any) -> None:
        self.viewer = viewer
        self.handled: list[tuple[str, tuple[Any, ...], int]] = []
        """Events that asked for a picture: kind, values, number of the request."""
        self.swaps: list[tuple[float, int, int, int]] = []
        """Swaps: time, request and number of the frame that is shown, its divider."""
        self.draws: list[float] = []
        self.turns: list[float] = []
        handle, draw = viewer.inputs.handle, viewer.draw

        def handled(event: Any, now: float) -> None:
            before = viewer.studio.session.newest
            handle(event, now)
            after = viewer.studio.session.newest
            if after != before:
                self.handled.append((event.kind, event.values, after))

        def drawn(now: float) -> None:
            start = time.perf_counter()
            draw(now)
            end = time.perf_counter()
            self.draws.append(end - start)
            shown = viewer.surface.shown
            if shown is not None:
                self.swaps.append((end, shown.frame.request, shown.frame.number, shown.frame.divider))

        viewer.inputs.handle, viewer.draw = handled, drawn

    def clear(self) -> None:
        """Forgets what it saw."""
        for each in (self.handled, self.swaps, self.draws, self.turns):
            each.clear()

    def turn(self) -> None:
        """A turn of the main loop; its wait for events does not count."""
        from clfractal.viewer import window

        waited = 0.0
        poll = window.poll

        def timed(timeout: float) -> None:
            nonlocal waited
            start = time.perf_counter()
            poll(timeout)
            waited += time.perf_counter() - start

        window.poll = timed
        start = time.perf_counter()
        try:
            self.viewer.turn()
        finally:
            window.poll = poll
        self.turns.append(time.perf_counter() - start - waited)


def latencies(
    sent: Sequence[Sequence[Any]],
    handled: Sequence[tuple[str, tuple[Any, ...], int]],
    swaps: Sequence[tuple[float, int, int, int]],
) -> tuple[list[float], int]:
    """Seconds from sending to the first swap that answers, for each move and step of the wheel; and how many have none.

    Moves are told apart by their places, which are all different; steps of the wheel by their order. A move that the
    window skipped is answered with the next one that it took.
    """
    requests = {(kind, *values): request for kind, values, request in handled if kind == "move"}
    wheels = iter([request for kind, _, request in handled if kind == "scroll"])
    found, missing = [], 0
    waiting: list[float] = []
    for at, kind, *values in sent:
        request = None
        if kind == "move":
            request = requests.get(("move", *map(float, values)))
        elif kind == "wheel":
            request = next(wheels, None)
        else:
            continue
        waiting.append(at)
        if request is None:
            continue
        first = next((time for time, shown, *_ in swaps if shown >= request), None)
        missing += len(waiting) if first is None else 0
        found += [first - at for at in waiting] if first is not None else []
        waiting.clear()
    return found, missing


def stream_script(size: tuple[int, int], seconds: float, rate: float = 125.0) -> list[list[Any]]:
    """A drag in large loops, with the speed of a hand."""
    width, height = size
    steps: list[list[Any]] = [["move", width // 2, height // 2], ["sleep", 0.1], ["button", 1, True]]
    been: set[tuple[int, int]] = set()
    for n in range(1, int(seconds * rate) + 1):
        angle = 2 * math.pi * n / rate / 1.7
        # A little farther with each loop; no place comes twice.
        x = width / 2 + (0.05 * width + 0.1 * n) * math.sin(angle)
        y = height / 2 + (0.05 * height + 0.07 * n) * math.sin(2 * angle)
        steps.append(["sleep", 1 / rate])
        if (place := (round(x), round(y))) not in been:
            been.add(place)
            steps.append(["move", *place])
    return [*steps, ["sleep", 0.1], ["button", 1, False]]


def dragged(sent: Sequence[Sequence[Any]]) -> list[Sequence[Any]]:
    """The moves while a button is down."""
    down = next(place for place, (_, kind, *_) in enumerate(sent) if kind == "button")
    return [each for each in sent[down + 1 :] if each[1] == "move"]


def single_script(size: tuple[int, int], count: int) -> list[list[Any]]:
    """Steps of the wheel to and fro, half a second between them."""
    _width, _height = size
    steps: list[list[Any]] = []
    for n in range(count):
        steps += [["sleep", 0.5], ["wheel", 1 if n % 4 < 2 else -1]]
    return [*steps, ["sleep", 0.5]]


def send(script: Sequence[Sequence[Any]], turn: Callable[[], None]) -> list[list[Any]]:
    """Sends a script from another process while the window's loop turns; what was sent, with its times."""
    told: list[list[Any]] = []
    child = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.events"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )

    def talk() -> None:
        out, _ = child.communicate(json.dumps(script))
        told.extend(json.loads(line) for line in out.splitlines())

    thread = threading.Thread(target=talk)
    thread.start()
    while thread.is_alive():
        turn()
    thread.join()
    if child.returncode != 0:
        raise OSError("events could not be sent")
    return told


def settle(viewer: Any, turn: Callable[[], None], seconds: float) -> None:
    """Turns until the picture is whole, or some seconds are over (samples may be gathered for minutes)."""
    end = time.perf_counter() + _SETTLED_SECONDS
    while viewer.surface.shown is None or viewer.surface.shown.frame.divider > 1:
        turn()
        if time.perf_counter() > end:
            raise TimeoutError("there is no whole picture")
    end = time.perf_counter() + seconds
    while time.perf_counter() < end and not viewer.studio.session.idle:
        turn()


def opened(scene: str | Path, overrides: Sequence[str], size: tuple[int, int], device: str | None) -> Any:
    """The window, in this process. What crashes of the user's windows have left is neither offered nor touched."""
    from clfractal.viewer import autosave
    from clfractal.viewer.begin import begin
    from clfractal.viewer.settings import Settings
    from clfractal.viewer.window_options import Options

    os.environ.setdefault("PYOPENGL_USE_ACCELERATE", "0")
    sys.setswitchinterval(0.0002)
    unused = Path(tempfile.mkdtemp(prefix="clfractal-"))
    atexit.register(shutil.rmtree, unused, ignore_errors=True)
    autosave.default_folder = lambda: unused
    begun = begin(Options(str(scene), device, size, overrides=tuple(overrides)))
    from clfractal.viewer.app import Viewer

    return Viewer(begun, Settings(), "", lambda line: None)


def measure(
    name: str,
    scene: str | Path,
    overrides: Sequence[str] = (),
    *,
    size: tuple[int, int] = SIZE,
    seconds: float = 6.0,
    singles: int = 24,
    device: str | None = None,
) -> Measured:
    """Opens a window on a scene, moves it, and closes it."""
    found = Measured(name)
    viewer = opened(scene, overrides, size, device)
    watch = Watch(viewer)
    try:
        settle(viewer, watch.turn, 2.0)
        # What the first drag compiles or measures is not what is measured here.
        send(stream_script(size, 1.0), watch.turn)
        settle(viewer, watch.turn, 1.0)
        watch.clear()
        sent = send(stream_script(size, seconds), watch.turn)
        drags = dragged(sent)
        times = [at for at, *_ in drags]
        pictures = {
            number: time for time, _, number, _ in reversed(watch.swaps) if times[0] <= time <= times[-1]
        }
        found.frames = len(pictures) / (times[-1] - times[0])
        found.dividers = [divider for time, *_, divider in watch.swaps if times[0] <= time <= times[-1]]
        settle(viewer, watch.turn, 0.5)
        found.stream, missing = latencies(drags, watch.handled, watch.swaps)
        handled, swaps = len(watch.handled), len(watch.swaps)
        send([["move", size[0] // 2 + 20, size[1] // 2]], watch.turn)
        sent = send(single_script(size, singles), watch.turn)
        settle(viewer, watch.turn, 0.5)
        found.single, more = latencies(sent, watch.handled[handled:], watch.swaps[swaps:])
        found.unanswered = missing + more
        found.draws, found.turns = list(watch.draws), list(watch.turns)
    finally:
        viewer.close()
    return found


def table(rows: Sequence[Measured]) -> str:
    """The figures, a row for each scene."""
    head = f"{'':12}{'stream':>16}{'single':>16}{'frames':>9}{'divider':>9}{'draw':>16}{'longest':>9}"
    lines = [head]
    for row in rows:
        f = row.figures()
        pairs = [f"{f[f'{kind}_median']:8.0f}{f[f'{kind}_99']:8.0f}" for kind in ("stream", "single", "draw")]
        lines.append(
            f"{row.name:12}{pairs[0]}{pairs[1]}{f['frames']:9.1f}{f['divider']:9.0f}{pairs[2]}{f['longest']:9.0f}"
            + (f"  ({row.unanswered} unanswered)" if row.unanswered else "")
        )
    return "\n".join(lines)


def main() -> None:
    """Measures, prints the table, and writes JSON if that is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"some of {', '.join(SCENES)}")
    parser.add_argument("--device", help="as for `clfractal view`")
    parser.add_argument("--seconds", type=float, default=6.0, help="of each drag")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures as JSON")
    chosen = parser.parse_args()
    unknown = [name for name in chosen.scenes if name not in SCENES]
    if unknown:
        parser.error(f"unknown scene {unknown[0]!r}; there are {', '.join(SCENES)}")
    server = None if os.environ.get("DISPLAY") else start_xvfb()
    from clfractal.files import resources

    rows = []
    try:
        for name in chosen.scenes or SCENES:
            file, overrides = SCENES[name]
            path = resources.folder("scenes") / file
            rows.append(measure(name, path, overrides, seconds=chosen.seconds, device=chosen.device))
            print(table(rows[-1:]) if len(rows) == 1 else table(rows[-1:]).split("\n")[1], flush=True)
    finally:
        if server is not None:
            server.terminate()
    if chosen.json is not None:
        chosen.json.write_text(json.dumps({row.name: row.figures() for row in rows}, indent=1) + "\n")


def start_xvfb() -> subprocess.Popen[bytes]:
    """A screen that nobody sees, on a free number, as DISPLAY."""
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24", "-noreset"]
    server = subprocess.Popen(
        command, pass_fds=(writing,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(writing)
    with os.fdopen(reading) as pipe:
        os.environ["DISPLAY"] = f":{pipe.readline().strip()}"
    return server


if __name__ == "__main__":
    main()
