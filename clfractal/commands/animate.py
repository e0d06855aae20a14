"""`clfractal animate`: the frames of a scene's animation as numbered pictures, and as films."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.commands.engines import engine_of
from clfractal.commands.film_parts import (
    Part,
    check_pattern,
    frame_file,
    is_film,
    missing,
    ranges,
    shown_ranges,
)
from clfractal.commands.kept import Kept
from clfractal.commands.order import PARTIAL, naming_options
from clfractal.commands.pipes import piped, refuse_stream
from clfractal.commands.progress import shown_rate
from clfractal.commands.render import Order, ordered_scene
from clfractal.commands.shell import Shell
from clfractal.commands.slices import check_numbered
from clfractal.device.activity import doing
from clfractal.errors import FileError, SceneError, Where, speaking_of
from clfractal.files.film_kinds import Recipe
from clfractal.files.whole import is_whole
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of

if TYPE_CHECKING:
    from clfractal.files.moving import Plan
    from clfractal.work.any_engine import AnyEngine
    from clfractal.work.job import Job

_LINE_SECONDS = 2.0
# Frames that took longer keep their tiles while they are in work, seconds.
_LONG_FRAME = 2.0


def animate_scene(order: Order, part: Part, recipe: Recipe, shell: Shell) -> None:
    """Renders the frames of a scene's animation, each to its own files, and makes films of them.

    A frame's files appear complete or not at all. With `order.resume` frames that are there are kept; those of another
    scene are refused. The frames of a film are kept without loss, beside it, until the film is whole.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device.
    """
    for path in order.outputs:
        refuse_stream(path, "frames are several files")
        check_pattern(path)
    with piped(shell, order.scene, [(path, "") for path in order.outputs]) as files:
        _animate(replace(order, scene=files.source, folder=files.folder), part, recipe, shell)


def _animate(order: Order, part: Part, recipe: Recipe, shell: Shell) -> None:
    begun = time.perf_counter()
    shell.mute_drivers()
    scene = ordered_scene(order)
    with speaking_of(order.scene):
        animation = movement_of(scene).animation
    numbers = part.numbers(animation.count)
    films = _planned_films(order, scene, recipe, animation.fps)
    patterns = [path for path in order.outputs if not is_film(path)]
    if not order.outputs:
        patterns = [_usual(order)]
    with Kept(films, shell, resume=order.resume) as kept:
        if kept.pattern is not None:
            patterns.append(kept.pattern)
        files = {number: tuple(frame_file(path, number) for path in patterns) for number in numbers}
        check_numbered(scene, [*files.values()], [film.path for film in films])
        for film in films:
            if not film.tells_stereo:
                shell.say(f"{film.path}: players are not told how it holds two pictures; choose it there")
        counted = _render_frames(order, scene, files, _Count(shell, len(numbers), begun), kept, shell)
        if kept.pattern is not None:
            shell.state = lambda: f"{films[0].path}: interrupted; all frames are kept; --resume continues"
            kept.write([frame_file(kept.pattern, number) for number in numbers])
    shell.state = lambda: "clfractal: interrupted"
    named = [f"{files[numbers[0]][0]} to {files[numbers[-1]][0].name}"] if patterns[0] != kept.pattern else []
    shell.say(f"{', '.join([*named, *(str(film.path) for film in films)])}: {counted.summary()}")
    others = [number for number in range(animation.count) if number not in numbers]
    lacking = _missing(scene, [path for path in patterns if path != kept.pattern], others)
    if lacking:
        shell.say(f"{len(lacking)} frames of the film are missing: {shown_ranges(lacking)}")


def list_missing(order: Order, part: Part, shell: Shell) -> None:
    """Prints which frames of numbered pictures are missing, or not whole: a line for each range, as `--frames` takes it.

    Raises:
        ClfractalError: anything wrong with the input.
    """
    if any(is_film(path) for path in order.outputs):
        raise SceneError("applies to numbered pictures; a film is only made whole", Where("--missing"))
    for path in order.outputs:
        refuse_stream(path, "frames are several files")
        check_pattern(path)
    with piped(shell, order.scene, ()) as files:
        scene = ordered_scene(replace(order, scene=files.source, folder=files.folder))
        with speaking_of(order.scene):
            numbers = part.numbers(movement_of(scene).animation.count)
        patterns = [*order.outputs] or [_usual(order)]
        for found in ranges(_missing(scene, patterns, numbers)):
            shell.print(found)


def _usual(order: Order) -> Path:
    """The name of frames where none is given."""
    return Path(f"{Path(order.scene).stem}_####.png")


def _missing(scene: Scene, patterns: Sequence[Path], numbers: Sequence[int]) -> list[int]:
    """The frames of which a file is missing; without patterns there are none."""
    from clfractal.pictures.outputs import output_files

    files = (
        [file for pattern in patterns for file in output_files(scene.stereo, frame_file(pattern, number))]
        for number in numbers
    )
    return missing(numbers, files)


def _render_frames(
    order: Order,
    scene: Scene,
    files: Mapping[int, tuple[Path, ...]],
    counted: _Count,
    kept: Kept,
    shell: Shell,
) -> _Count:
    """Renders the frames that are not there yet."""
    with speaking_of(order.scene), doing("checking all frames"):
        for number in files:
            movement_of(scene).scene(number)
    with engine_of(order, shell) as engine:
        return _render_on(engine, order, scene, files, counted, kept, shell)


def _render_on(
    engine: AnyEngine,
    order: Order,
    scene: Scene,
    files: Mapping[int, tuple[Path, ...]],
    counted: _Count,
    kept: Kept,
    shell: Shell,
) -> _Count:
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.commands.numbered import render_one
    from clfractal.work.frames import FilmScenes
    from clfractal.work.remarks import mixed_kinds

    scenes = FilmScenes(engine, scene)
    coming = iter(files.values())

    def is_missing(job: Job) -> bool:
        return not (_is_there(job, next(coming)) if order.resume else False)

    jobs = engine.in_order(
        map(scenes.scene, files), is_missing, precision=order.precision, samples=order.samples
    )
    begun = told = False
    kinds: set[str] = set()
    with closing(jobs):
        for number, paths in files.items():
            with speaking_of(order.scene), naming_options():
                job, missing = next(jobs)
            if not begun:
                kept.begin()
                begun = True
                if job.others:
                    told = True
                    shell.say(f"{order.scene}: {mixed_kinds(1 + len(job.others))}")
            shell.state = partial(counted.interrupted, number, paths[0])
            if not missing:
                counted.kept += 1
                continue
            each = counted.seconds_each
            state = render_one(
                job,
                engine,
                paths,
                shell,
                resume=order.resume,
                keep=each is None or each > _LONG_FRAME or _partial(paths).exists(),
                bits={kept.at(number): kept.bits},
            )
            counted.rendered(state.rays)
            kinds |= {maker.key for maker in state.makers}  # a cluster's are known when they have come
            if len(kinds) > 1 and not told:
                told = True
                shell.say(f"{order.scene}: {mixed_kinds(len(kinds))}")
    return counted


def _planned_films(order: Order, scene: Scene, recipe: Recipe, fps: float) -> list[Plan]:
    """The film files of an order, checked."""
    films = [path for path in order.outputs if is_film(path)]
    given = {
        "--codec": recipe.codec,
        "--bits": recipe.bits,
        "--chroma": recipe.chroma,
        "--crf": recipe.quality,
    }
    if not films:
        for option, value in given.items():
            if value is not None:
                raise SceneError("applies to films, such as -o film.mp4", Where(option))
        return []
    # Imported only now: films are rare, and NumPy takes long to import.
    from clfractal.files.moving import plan_film
    from clfractal.pictures.formats import Content

    content = Content.of(scene)
    if content.transparent:
        where = Where(order.scene, path="background")
        raise SceneError("must be a colour or a gradient for a film, which is not transparent", where)
    mode, swap = (scene.stereo.mode, scene.stereo.swap) if scene.stereo is not None else (None, False)
    return [plan_film(path, recipe, content.size, fps, stereo=mode, swap=swap) for path in films]


class _Count:
    """How far a film is."""

    def __init__(self, shell: Shell, frames: int, begun: float) -> None:
        self._shell, self._frames, self._begun, self._told = shell, frames, begun, begun
        self._first = begun  # when the first frame was done, for which programs are compiled
        self.kept, self._rendered, self._rays = 0, 0, 0

    @property
    def seconds_each(self) -> float | None:
        """The time that a frame takes; None as long as that is unknown: the first one waits for programs."""
        further = self._rendered - 1
        return (time.perf_counter() - self._first) / further if further > 0 else None

    def rendered(self, rays: int) -> None:
        """Counts a frame; now and then it is told how many are left."""
        self._rendered += 1
        self._rays += rays
        now = time.perf_counter()
        if self._rendered == 1:
            self._first = now
            return
        left = self._frames - self.kept - self._rendered
        if left and now - self._told > _LINE_SECONDS:
            self._told = now
            done = self._frames - left
            self._shell.say(
                f"animate: {done} of {self._frames} frames, {left * (self.seconds_each or 0):.0f} s left"
            )

    def interrupted(self, number: int, file: Path) -> str:
        """What to say of an interrupt during a frame."""
        done = self.kept + self._rendered
        return f"{file}: interrupted in frame {number}, with {done} of {self._frames} frames done; --resume continues"

    def summary(self) -> str:
        """The text of the last line."""
        seconds = time.perf_counter() - self._begun
        if not self._rendered:
            return f"all {self._frames} frames were there already"
        kept = f", {self.kept} were there already" if self.kept else ""
        return f"{self._rendered} frames{kept}, {seconds:.2f} s, {shown_rate(self._rays / seconds)}"


def _partial(paths: tuple[Path, ...]) -> Path:
    return paths[0].with_name(paths[0].name + PARTIAL)


def _is_there(job: Job, paths: tuple[Path, ...]) -> bool:
    """Whether all files of a frame are there, and whole.

    Raises:
        FileError: one of them is of another scene, or holds none.
    """
    from clfractal.files.embedded import read_scene_text
    from clfractal.pictures.outputs import output_files

    files = [file for path in paths for file in output_files(job.scene.stereo, path)]
    there = [file for file in files if is_whole(file)]
    wanted = job.header()["scene"]
    for file in there:
        if read_scene_text(file) != wanted:
            raise FileError(
                "is a frame of another scene, or of other settings; remove it, or render without --resume",
                Where(str(file)),
            )
    return len(there) == len(files)
