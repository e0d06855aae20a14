"""`clfractal render` of a stereo scene: both eyes' pictures, each resumable, and the files that are made of them."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path

from clfractal.commands import stats
from clfractal.commands.order import PARTIAL, Order
from clfractal.commands.progress import Reporter
from clfractal.commands.shell import Shell
from clfractal.device.select import choose
from clfractal.errors import speaking_of
from clfractal.optics.view import scene_view
from clfractal.pictures.compose import Side
from clfractal.pictures.store import JournalFilm
from clfractal.scene.model import Scene
from clfractal.work.comfort import Comfort, comfort_of_depth, measured
from clfractal.work.pair import Pair, output_files, prepare_pair, render_eyes, save_pair

# The depth of a picture larger than this is not read again to measure parallax; a quick look tells as much.
_MOST_PIXELS = 1 << 24


def render_stereo(
    order: Order,
    scene: Scene,
    outputs: tuple[Path, ...],
    region: tuple[int, int, int, int] | None,
    shell: Shell,
    start: float,
) -> None:
    """Renders a stereo scene to all outputs of an order; `start` is when the command began.

    Unfinished work is kept beside the first output, a file for each eye.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device.
    """
    device = choose(order.device)
    with speaking_of(order.scene):
        pair = prepare_pair(scene, device, region=region, on_start=shell.say, on_compile=shell.say)
    job = pair.job
    if job.remark:
        shell.say(f"{order.scene}: {job.remark}")
    partials = {side: _partial(outputs[0], side, pair) for side in pair.eyes}
    with ExitStack() as left_open:
        films: dict[Side, JournalFilm] = {}
        for side, partial in partials.items():
            if partial.exists() and not order.resume:
                shell.say(f"{partial}: earlier work is dropped; --resume would continue it")
            films[side] = _open(pair, side, partial, resume=order.resume)
            left_open.callback(_leave, films[side])
        if not order.resume:
            _drop_second(outputs[0], partials, shell)
        reporter = Reporter(shell, pair.tiles)
        left_open.callback(reporter.close)
        shell.state = lambda: _interrupted(partials, films)
        state = render_eyes(pair, films, reporter, on_compile=shell.say)
        reporter.close()
        rendered = time.perf_counter()
        save_pair(pair, films, outputs)
        written = time.perf_counter()
        comfort = _comfort(pair, films)
        for film in films.values():
            film.discard()
        left_open.pop_all()
    shell.state = lambda: "clfractal: interrupted"
    values = stats.statistics(
        job, state, wall_ms=1e3 * (written - start), write_ms=1e3 * (written - rendered)
    )
    values |= {
        "width": pair.region.width,
        "height": pair.region.height,
        "stereo": stats.of_stereo(pair, comfort),
    }
    if order.stats is not None:
        stats.write_statistics(order.stats, values)
    files = [file for path in outputs for file in output_files(pair.stereo, path)]
    shell.say(f"{', '.join(map(str, files))}: {reporter.summary(state, written - start)}")
    if comfort is not None and comfort.warning():
        shell.say(f"{order.scene}: {comfort.warning()}")
    if shell.verbose:
        shell.say(stats.sentence(values))
        if comfort is not None:
            shell.say(comfort.sentence())


def _partial(output: Path, side: Side, pair: Pair) -> Path:
    """Where one eye's unfinished work is kept: the first one's where that of a picture with one eye is."""
    return output.with_name(f"{output.name}{PARTIAL}") if side == next(iter(pair.eyes)) else _second(output)


def _second(output: Path) -> Path:
    """Where the other eye's is kept, which of two is the right one."""
    return output.with_name(f"{output.name}.right{PARTIAL}")


def _drop_second(output: Path, partials: dict[Side, Path], shell: Shell) -> None:
    """Removes what an earlier render of both eyes left of the right one, if this one needs no such file."""
    stale = _second(output)
    if stale.exists() and stale not in partials.values():
        shell.say(f"{stale}: earlier work is dropped")
        stale.unlink(missing_ok=True)


def _open(pair: Pair, side: Side, partial: Path, *, resume: bool) -> JournalFilm:
    job = pair.eyes[side]
    size = (job.scene.image.width, job.scene.image.height)
    return JournalFilm(
        partial,
        pair.identity(side),
        job.plan.channels,
        size,
        job.plan.region,
        pair.header(side),
        resume=resume,
    )


def _leave(film: JournalFilm) -> None:
    """What is unfinished is kept; nothing is not."""
    if film.done.any():
        film.close()
    else:
        film.discard()


def _comfort(pair: Pair, films: dict[Side, JournalFilm]) -> Comfort | None:
    """The range of parallax in what was rendered: of all its pixels where their depth is at hand."""
    scene, whole = pair.job.scene, pair.job.scene.image
    exact = (
        "Z" in pair.job.plan.channels
        and scene.layout is None
        and scene.renderer.type != "cut_plane"
        and whole.width * whole.height <= _MOST_PIXELS
    )
    if not exact:
        return measured(scene, pair.job.device, shared=pair.shared)
    found = []
    for side, film in films.items():
        view = scene_view(pair.eyes[side].scene)
        for row, band in film.bands():
            part = comfort_of_depth(scene, view, band["Z"], film.display, (film.region.x, row))
            if part is not None:
                found.append(part)
    return Comfort.joined(found)


def _interrupted(partials: dict[Side, Path], films: dict[Side, JournalFilm]) -> str:
    done = sum(int(film.done.sum()) for film in films.values())
    tiles = sum(film.grid.count for film in films.values())
    first = next(iter(partials.values()))
    return f"{first}: interrupted with {done} of {tiles} tiles done; --resume continues"
