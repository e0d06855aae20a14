"""`clfractal precompile`: compiles programs before a picture waits for them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from clfractal.cli.order import naming_options
from clfractal.cli.pipes import piped
from clfractal.cli.progress import Lines, counting_bar
from clfractal.cli.shell import Shell
from clfractal.cli.show_scenes import scene_files
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

_MEGABYTE = 1e6


def precompile(sources: Sequence[str], device: str | None, precision: str | None, shell: Shell) -> None:
    """Compiles what scenes, or formulas and scenes of the library if none is named, may need on a device.

    Each program is kept as soon as it is compiled: after an interrupt the next course goes on from there.

    Raises:
        ClfractalError: a scene or an option is wrong, or the device failed.
    """
    start = time.perf_counter()
    named = {source: _loaded(source, shell) for source in sources}
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.device import cache
    from clfractal.device.select import choose
    from clfractal.engine.precompile import Precompilation, library_count, library_scenes

    chosen = choose(device)
    files = scene_files().values()
    scenes = named.values() if named else library_scenes(files)
    read = _Done(shell, "reading scenes", len(named) or library_count(files))
    try:
        with naming_options():
            course = Precompilation(chosen, scenes, precision=precision, read=read, on_start=shell.say)
    finally:
        read.close()
    done = _Done(shell, "compiling", course.steps)
    shell.state = done.interrupted
    try:
        found = course.run(done)
    finally:
        done.close()
    shell.state = lambda: "clfractal: interrupted"
    shell.say(
        f"{chosen.info.name}: {found.programs} programs, {found.compiled} of them compiled now; "
        f"{time.perf_counter() - start:.1f} s, the cache has {cache.size() / _MEGABYTE:.1f} MB"
    )
    if found.unkept:
        shell.say(
            f"{found.unkept} programs are not kept: the cache takes no more than {cache.limit() / _MEGABYTE:g} MB; "
            f"{cache.SIZE_VARIABLE} sets the limit"
        )


def _loaded(source: str, shell: Shell) -> Scene:
    with piped(shell, source, ()) as files:
        return load_scene(Path(files.source), folder=files.folder)


class _Done:
    """Shows how much is done: a bar on a terminal, elsewhere a line now and then."""

    def __init__(self, shell: Shell, doing: str, steps: int) -> None:
        self._shell, self._doing, self._steps, self._count = shell, doing, steps, 0
        self._lines = Lines()
        is_shown = shell.terminal and not shell.quiet
        self._bar = counting_bar(shell, doing, steps) if is_shown else None

    def __call__(self, count: int) -> None:
        self._shell.alive()
        self._count = count
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=count)
            self._bar.refresh()
        elif self._lines.due(count / self._steps):
            self._shell.say(f"{self._doing}: {count} of {self._steps}")

    def close(self) -> None:
        """Removes the bar."""
        if self._bar is not None:
            self._bar.stop()

    def interrupted(self) -> str:
        return f"clfractal: interrupted with {self._count} of {self._steps} done; what is compiled is kept"
