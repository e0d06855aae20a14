"""Random events for the window, from a seed: `python -m tests.window.soak --minutes 10 --seed 1`, or `make soak`.

Opens the window in this process, on DISPLAY or a screen of its own, and sends it what a restless user does, all chosen by
the seed: drags, wheel, clicks, every key but those that quit or write files, edits, other sizes, other devices, scenes that
change on the disk. It fails (status 1) on an exception, on a message of an internal error, on a turn of the main loop that
takes longer than a second (what every thread did then is on standard error), and if memory grows: after nine tenths of the
time it may be at most 5 % above what it was after two tenths; in short runs 15 %, and the programs that a device keeps.
Both times the window shows the same scene, at rest.
"""

from __future__ import annotations

import argparse
import faulthandler
import gc
import os
import random
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.events import Events
from benchmarks.window import Watch, opened, start_xvfb
from clfractal.device.loaded import MOST
from clfractal.viewer.actions import ACTIONS
from tests.window import scenes

SIZE = (640, 400)
SLOWEST_TURN = 1.0
# Parts of the run at which memory is compared.
_EARLY, _LATE = 0.2, 0.9
# Those that would end the run, write files wherever they please, or leave the X server's screen.
_NEVER = {
    "quit",
    "open",
    "save",
    "save_as",
    "screenshot",
    "export",
    "render_still",
    "span_monitors",
    "window_per_monitor",
}
_MODIFIERS = {"Ctrl": "Control_L", "Shift": "Shift_L", "Alt": "Alt_L"}
_NAMES = {
    "-": "minus", "=": "equal", "[": "bracketleft", "]": "bracketright", "\\": "backslash", ",": "comma", ".": "period",
    "Space": "space", "Enter": "Return", "Backspace": "BackSpace", "PageUp": "Prior", "PageDown": "Next",
    "NumPlus": "KP_Add", "NumMinus": "KP_Subtract", "NumEnter": "KP_Enter",
}  # fmt: skip
_SCENES = ("SURFACE", "SPHERE", "VOLUME", "CUT_PLANE", "LAYOUT")


class User(threading.Thread):
    """Sends random events until it is told to stop.

    Args:
        seed: of everything that it does.
        pause: seconds between two things, on average.

    Attributes:
        free: cleared while it shall rest.
    """

    def __init__(self, seed: int, pause: float = 0.08) -> None:
        super().__init__(name="user", daemon=True)
        self.random = random.Random(seed)
        self.pause = pause
        self.ended = threading.Event()
        self.free = threading.Event()
        self.free.set()
        self.done = 0
        self.problem: BaseException | None = None
        self._events = Events()
        self._keys = [
            chord
            for name, action in ACTIONS.items()
            if name not in _NEVER
            for chord in action.keys
            if not chord.split("+")[-1].startswith("Num") or chord.split("+")[-1] in _NAMES
        ]

    def run(self) -> None:
        """The thread."""
        doings: list[tuple[int, Callable[[], None]]] = [
            (6, self._drag),
            (5, self._wheel),
            (3, self._click),
            (9, self._key),
            (2, self._hold),
            (1, self._rest),
        ]
        weights = [weight for weight, _ in doings]
        try:
            while not self.ended.is_set():
                self.free.wait(30)
                self.random.choices([doing for _, doing in doings], weights)[0]()
                self.done += 1
                time.sleep(self.random.expovariate(1 / self.pause))
        except BaseException as error:
            self.problem = error

    def _place(self) -> tuple[int, int]:
        return self.random.randrange(SIZE[0]), self.random.randrange(SIZE[1])

    def _drag(self) -> None:
        events, button = self._events, self.random.choice((1, 1, 2, 3))
        held = self.random.choice(("", "", "", *_MODIFIERS.values()))
        x, y = self._place()
        events.move(x, y)
        if held:
            events.key(held, True)
        events.button(button, True)
        for _ in range(self.random.randrange(1, 25)):
            x, y = x + self.random.randrange(-30, 31), y + self.random.randrange(-30, 31)
            events.move(min(max(x, 0), SIZE[0] - 1), min(max(y, 0), SIZE[1] - 1))
            time.sleep(0.008)
        events.button(button, False)
        if held:
            events.key(held, False)

    def _wheel(self) -> None:
        self._events.move(*self._place())
        # More out than in, so that there is something to see now and then.
        for _ in range(self.random.randrange(1, 6)):
            self._events.wheel(self.random.choice((1, -1, -1)))
            time.sleep(0.01)

    def _click(self) -> None:
        self._events.move(*self._place())
        button = self.random.choice((1, 1, 1, 2, 3))
        for _ in range(self.random.choice((1, 1, 2))):
            self._events.button(button, True)
            time.sleep(0.02)
            self._events.button(button, False)
            time.sleep(0.04)

    def _key(self) -> None:
        self._chord(self.random.choice(self._keys), 0.02)

    def _hold(self) -> None:
        self._chord(self.random.choice([chord for chord in self._keys if "+" not in chord]), 0.4)

    def _rest(self) -> None:
        time.sleep(self.random.uniform(0.2, 1.0))

    def _chord(self, chord: str, seconds: float) -> None:
        *held, key = chord.removeprefix("Pos:").split("+")
        names = [_MODIFIERS[each] for each in held]
        for name in names:
            self._events.key(name, True)
        name = _NAMES.get(key, key.lower() if len(key) == 1 else key)
        self._events.key(name, True)
        time.sleep(seconds)
        self._events.key(name, False)
        for name in reversed(names):
            self._events.key(name, False)


class Soak:
    """One run.

    Args:
        minutes: how long.
        seed: of all that happens.
        say: is told how it goes.
    """

    def __init__(self, minutes: float, seed: int, say: Callable[[str], None] = lambda line: None) -> None:
        self.seconds, self.seed, self.say = 60 * minutes, seed, say
        self.random = random.Random(seed + 1)
        self.weights: list[float] = []
        """MiB that the process uses, early and late, with the same scene at rest."""
        self.problems: list[str] = []
        self.messages: set[str] = set()

    def run(self) -> list[str]:
        """Does it; what went wrong, one line each."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            os.chdir(folder)
            for each in _SCENES:
                (folder / f"{each.lower()}.yaml").write_text(getattr(scenes, each))
            self._go(folder)
            os.chdir("/")
        return self.problems

    def _go(self, folder: Path) -> None:
        viewer = opened(folder / "surface.yaml", (), SIZE, None)
        watch = Watch(viewer)
        for _ in range(50):
            watch.turn()
        user = User(self.seed)
        user.start()
        start = last = time.perf_counter()
        due = start + 5
        weighed = [_EARLY * self.seconds, _LATE * self.seconds]
        try:
            while (now := time.perf_counter()) - start < self.seconds:
                faulthandler.dump_traceback_later(SLOWEST_TURN + 0.6, exit=False)
                watch.turn()
                faulthandler.cancel_dump_traceback_later()
                self._look(viewer, watch, now - start)
                if now > due:
                    due = now + self.random.uniform(3, 8)
                    self._upset(viewer, folder)
                if weighed and now - start > weighed[0]:
                    weighed.pop(0)
                    self.weights.append(self._weigh(viewer, watch, user, folder))
                if now - last >= 10:
                    last = now
                    used = f"{_memory():7.1f} MiB"
                    self.say(
                        f"{now - start:5.0f} s  {user.done:6d} doings  {used}  {len(self.problems)} problems"
                    )
        except Exception as error:
            self.problems.append(
                f"after {time.perf_counter() - start:.0f} s: {type(error).__name__}: {error}"
            )
            self.say(traceback.format_exc())
        finally:
            user.ended.set()
            user.join(5)
            if user.problem is not None:
                self.problems.append(f"the events failed: {user.problem}")
            viewer.close()
        self._judge_memory()

    def _weigh(self, viewer: Any, watch: Watch, user: User, folder: Path) -> float:
        """MiB that the process uses, when nothing happens and the first scene is shown."""
        import glfw

        user.free.clear()
        glfw.restore_window(viewer.window.handle)
        glfw.set_window_size(viewer.window.handle, *SIZE)
        (folder / "surface.yaml").write_text(scenes.SURFACE)
        end = time.perf_counter() + 4
        while time.perf_counter() < end:
            watch.turn()
        viewer.act(f"open:{folder / 'surface.yaml'}")
        viewer.ui.show.clear()
        viewer.studio.forget_thumbnails(lambda key: True)
        end = time.perf_counter() + 3
        while time.perf_counter() < end or not viewer.studio.session.idle:
            watch.turn()
        gc.collect()
        watch.turn()
        used = _memory()
        watch.clear()
        user.free.set()
        self.say(f"at rest: {used:.1f} MiB")
        return used

    def _look(self, viewer: Any, watch: Watch, seconds: float) -> None:
        for message in viewer.studio.messages:
            if "internal" in message.text and message.text not in self.messages:
                self.problems.append(f"after {seconds:.0f} s: {message.text}")
            self.messages.add(message.text)
        if watch.turns[-1] > SLOWEST_TURN:
            self.problems.append(f"after {seconds:.0f} s: a turn of the loop took {watch.turns[-1]:.2f} s")
        watch.clear()
        watch.turns.append(0.0)

    def _upset(self, viewer: Any, folder: Path) -> None:
        """What comes from outside: sizes, devices, other scenes, files that change."""
        import glfw

        width, height = (round(side * self.random.uniform(0.5, 1.0)) for side in SIZE)
        chosen = self.random.choice(("size", "scene", "scene", "file", "device", "edit", "minimise"))
        if chosen == "size":
            glfw.set_window_size(viewer.window.handle, max(width, 320), max(height, 200))
        elif chosen == "scene":
            viewer.act(f"open:{folder / self.random.choice(_SCENES).lower()}.yaml")
        elif chosen == "file":
            path = folder / "surface.yaml"
            text = scenes.SURFACE.replace("power: 8", f"power: {self.random.randrange(2, 9)}")
            path.write_text(self.random.choice((text, text.replace("samples", "sample"))))
        elif chosen == "device":
            viewer.act(f"device:{self.random.choice(_devices())}")
        elif chosen == "edit":
            viewer.studio.edit({"formula.iterations": self.random.randrange(2, 14)}, None)
        else:
            (glfw.iconify_window if self.random.random() < 0.5 else glfw.restore_window)(viewer.window.handle)

    def _judge_memory(self) -> None:
        if len(self.weights) == 2:
            early, late = self.weights
            # The programs that a device keeps are some 8 MiB each, and a short run ends before there are as many as may be.
            allowed = 1.05 * early if self.seconds >= 540 else 1.15 * early + 8 * MOST
            if late > allowed:
                self.problems.append(f"memory grew from {early:.0f} to {late:.0f} MiB")


def _devices() -> list[str]:
    from clfractal.device.select import devices

    return [device.index for device in devices()]


def _memory() -> float:
    """MiB that the process has in memory."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    server = None if os.environ.get("DISPLAY") else start_xvfb()
    try:
        problems = Soak(chosen.minutes, chosen.seed, lambda line: print(line, flush=True)).run()
    finally:
        if server is not None:
            server.terminate()
    for problem in problems:
        print(problem, file=sys.stderr)
    print("no problem" if not problems else f"{len(problems)} problems, seed {chosen.seed}")
    sys.stdout.flush()
    os._exit(bool(problems))  # a driver's clean-up may take long


if __name__ == "__main__":
    main()
