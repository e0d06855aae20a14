"""Progress of a render, on standard error: a bar on a terminal, otherwise a line now and then."""

from __future__ import annotations

import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING, Any

from clfractal.cli.shell import Shell
from clfractal.device.activity import Activity, current

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import ProgressColumn

    from clfractal.engine.run import Progress

BAR_AFTER_SECONDS = 0.5
"""Quick renders show no bar: loading the library that draws it takes longer than the render."""
BAR_EVERY_SECONDS = 0.1
LINE_EVERY_SECONDS = 2.0
"""Lines, which stay, come no faster."""
LINE_SHARE = 0.1
LINE_SILENCE_SECONDS = 60.0
"""A line comes with each tenth of the work, or after a minute without one."""


SILENT_SECONDS = 2.0
"""After so long without a sign of life the user is told what the program is doing."""
_LONGEST_SILENCE = 60.0
_LOOK_SECONDS = 0.25
_LAST_SECONDS = 0.1


class Patience:
    """Says what the program is doing (compiling, filling a grid, writing files) whenever nothing was shown for two seconds.

    On a terminal it is a line that the next output replaces, otherwise a line each time, and each time twice as late.
    """

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="clfractal-patience", daemon=True)

    def __enter__(self) -> None:
        self._shell.alive()
        self._thread.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        # What it is just showing comes before the last words. (Whoever shows it may hang: they do not wait for that.)
        self._thread.join(_LAST_SECONDS)
        self._shell.clear_status()

    def _watch(self) -> None:
        shell, silence = self._shell, SILENT_SECONDS
        last: Activity | None = None
        while not self._ended.wait(_LOOK_SECONDS):
            activity, now = current(), time.monotonic()
            if activity is not last:
                last, silence = activity, SILENT_SECONDS
            if activity is None or shell.quiet or not shell.patient or now - shell.told < silence:
                continue
            line = f"{activity.what}, {now - activity.began:.0f} s"
            if shell.terminal:
                shell.stalled(line)
            else:
                shell.say(line)
                silence = min(2 * silence, _LONGEST_SILENCE)


class Lines:
    """When a line about progress is due where lines stay: a log of a long course shall be short."""

    def __init__(self) -> None:
        self._told, self._share = time.monotonic(), 0.0

    def due(self, share: float) -> bool:
        """Whether a line is told now that so much of the work is done, 0 to 1; the next one counts from here."""
        now = time.monotonic()
        since = now - self._told
        if since < LINE_EVERY_SECONDS or (share < self._share + LINE_SHARE and since < LINE_SILENCE_SECONDS):
            return False
        self._told, self._share = now, share
        return True


class Reporter:
    """Called with the state after each batch of tiles."""

    def __init__(self, shell: Shell, tiles: int) -> None:
        self._shell = shell
        self._tiles = tiles
        self._bar: Bar | None = None
        self._terminal = shell.terminal and not shell.quiet
        self._next = time.monotonic() + BAR_AFTER_SECONDS
        self._lines = Lines()

    def __call__(self, state: Progress) -> None:
        now = time.monotonic()
        self._shell.alive()
        if self._shell.quiet or state.tiles_done >= state.tiles:
            return
        share = state.tiles_done / max(state.tiles, 1)
        if self._terminal:
            if now >= self._next:
                self._next = now + BAR_EVERY_SECONDS
                self._draw(state)
        elif self._lines.due(share):
            self._shell.say(f"rendering: {share:4.0%}, {shown_rate(state.rays_per_second)}, {_left(state)}")

    def close(self) -> None:
        """Removes the bar."""
        if self._bar is not None:
            self._shell.stalled = self._shell.status
            self._bar.stop()
            self._bar = None

    def summary(self, state: Progress, seconds: float) -> str:
        """The text of the last line: the time and the speed."""
        return (
            f"{seconds:.2f} s, {shown_rate(state.rays_per_second)}"
            if state.rays
            else f"{seconds:.2f} s, nothing was left to render"
        )

    def _draw(self, state: Progress) -> None:
        if self._bar is None:
            self._bar = _new_bar(self._shell, self._tiles)
            self._shell.stalled = self._stalled
        task = self._bar.task_ids[0]
        self._bar.update(
            task,
            completed=state.tiles_done,
            rate=shown_rate(state.rays_per_second),
            left=_left(state),
            stalled="",
        )
        self._bar.refresh()

    def _stalled(self, line: str) -> None:
        bar = self._bar
        if bar is not None:
            bar.update(bar.task_ids[0], stalled=line)
            bar.refresh()


def shown_rate(rays: float) -> str:
    """Rays per second in a unit that shows at least two digits: `1.20 Mrays/s`, `4.5 krays/s`, `12 rays/s`."""
    if rays >= 1e5:
        return f"{rays / 1e6:.2f} Mrays/s"
    return f"{rays / 1e3:.1f} krays/s" if rays >= 1e3 else f"{rays:.0f} rays/s"


def _left(state: Progress) -> str:
    remaining = state.remaining
    if remaining is None:
        return "time left unknown"
    minutes, seconds = divmod(round(remaining), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours:d}:{minutes:02d}:{seconds:02d} left" if hours else f"{minutes:d}:{seconds:02d} left"


def counting_bar(shell: Shell, doing: str, total: int) -> Bar:
    """A bar for so many things, on a terminal; it is refreshed by hand."""
    from rich.progress import MofNCompleteColumn, TimeElapsedColumn

    return _started(shell, doing, total, MofNCompleteColumn(), TimeElapsedColumn())


def _new_bar(shell: Shell, tiles: int) -> Bar:
    from rich.progress import TaskProgressColumn, TextColumn

    words = {"rate": "", "left": "", "stalled": ""}
    columns = [TextColumn(f"{{task.fields[{name}]}}") for name in words]
    return _started(shell, "rendering", tiles, TaskProgressColumn(), *columns, **words)


def _started(shell: Shell, doing: str, total: int, *columns: ProgressColumn, **words: Any) -> Bar:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    shell.clear_status()
    # Refreshed by hand: a drawing thread would spoil the message while Ctrl-C is handled.
    bar = Bar(
        TextColumn(doing),
        BarColumn(),
        *columns,
        console=Console(file=shell.errors),
        auto_refresh=False,
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
    )
    bar.add_task(doing, total=total, **words)
    bar.start()
    return bar
