"""`clfractal animate`: the frames of a scene's animation as numbered pictures, and as films."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.commands.kept import Kept
from clfractal.commands.order import PARTIAL, naming_options
from clfractal.commands.pipes import piped, refuse_stream
from clfractal.commands.progress import shown_rate
from clfractal.commands.render import Order, ordered_scene
from clfractal.commands.shell import Shell
from clfractal.commands.slices import check_numbered
from clfractal.device.activity import doing
from clfractal.errors import FileError, SceneError, Where, speaking_of
from clfractal.files.film_kinds import CONTAINERS, Recipe
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of

if TYPE_CHECKING:
    from clfractal.files.moving import Plan
    from clfractal.work.job import Job

_MOST_DIGITS = 12
_LINE_SECONDS = 2.0
# Frames that took longer keep their tiles while they are in work, seconds.
_LONG_FRAME = 2.0


@dataclass(frozen=True, slots=True)
class Part:
    """The frames to render: `--frames A-B:STEP`, `A-B`, `A` or all of them."""

    text: str | None = None

    def numbers(self, count: int) -> range:
        """The frames of a film of `count` frames.

        Raises:
            SceneError: the text has another form, or names a frame that the film does not have.
        """
        if self.text is None:
            return range(count)
        found = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9})(?::(\d{1,9}))?)?", self.text.strip(), re.ASCII)
        if found is None:
            raise SceneError(
                f"must be A-B, A-B:STEP or a number, such as 0-119:2; got {self.text[:60]!r}",
                Where("--frames"),
            )
        first = int(found[1])
        last, step = int(found[2] or first), int(found[3] or 1)
        if step < 1 or last < first:
            raise SceneError(f"must go upwards, got {self.text[:60]!r}", Where("--frames"))
        if last >= count:
            raise SceneError(f"must be frames 0 to {count - 1} of the film, got {last}", Where("--frames"))
        return range(first, last + 1, step)


def animate_scene(order: Order, part: Part, recipe: Recipe, shell: Shell) -> None:
    """Renders the frames of a scene's animation, each to its own files, and makes films of them.

    A frame's files appear complete or not at all. With `order.resume` frames that are there are kept; those of another
    scene are refused. The frames of a film are kept without loss, beside it, until the film is whole.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device.
    """
    for path in order.outputs:
        refuse_stream(path, "frames are several files")
        _check_pattern(path)
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
    patterns = [path for path in order.outputs if not _is_film(path)]
    if not order.outputs:
        patterns = [Path(f"{Path(order.scene).stem}_####.png")]
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


def _render_frames(
    order: Order,
    scene: Scene,
    files: Mapping[int, tuple[Path, ...]],
    counted: _Count,
    kept: Kept,
    shell: Shell,
) -> _Count:
    """Renders the frames that are not there yet."""
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.commands.numbered import render_one
    from clfractal.work.engine import Engine
    from clfractal.work.frames import FilmScenes
    from clfractal.work.remarks import mixed_kinds

    with speaking_of(order.scene), doing("checking all frames"):
        for number in files:
            movement_of(scene).scene(number)
    engine = Engine(order.device, tell=shell.say)
    scenes = FilmScenes(engine, scene)
    begun = False
    for number, paths in files.items():
        with speaking_of(order.scene), naming_options():
            job = engine.prepare(scenes.scene(number), precision=order.precision, samples=order.samples)
        if not begun:
            kept.begin()
            begun = True
            if job.others:
                shell.say(f"{order.scene}: {mixed_kinds(1 + len(job.others))}")
        shell.state = partial(counted.interrupted, number, paths[0])
        if order.resume and _is_there(job, paths):
            counted.kept += 1
            continue
        long = counted.seconds_each is None or counted.seconds_each > _LONG_FRAME or _partial(paths).exists()
        state = render_one(
            job, engine, paths, shell, resume=order.resume, keep=long, bits={kept.at(number): kept.bits}
        )
        counted.rendered(state.rays)
    return counted


def _is_film(path: Path) -> bool:
    return path.suffix.lower() in CONTAINERS


def _planned_films(order: Order, scene: Scene, recipe: Recipe, fps: float) -> list[Plan]:
    """The film files of an order, checked."""
    films = [path for path in order.outputs if _is_film(path)]
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


def frame_file(pattern: Path, number: int) -> Path:
    """The file of a frame: its number stands for the last row of `#` in the pattern's name, with as many digits or more."""
    head, signs, tail = _split(pattern.name)
    return pattern.with_name(f"{head}{number:0{len(signs)}d}{tail}")


def _split(name: str) -> tuple[str, str, str]:
    found = re.fullmatch(r"(.*?)(#+)([^#]*)", name, re.DOTALL)
    assert found is not None
    return found[1], found[2], found[3]


def _check_pattern(path: Path) -> None:
    where = Where(str(path))
    if _is_film(path):
        return
    if "#" not in path.name:
        example = f"{path.stem}_####{path.suffix}"
        raise FileError(f"must have # where the frame's number goes, such as {example}", where)
    if len(_split(path.name)[1]) > _MOST_DIGITS:
        raise FileError(f"must have at most {_MOST_DIGITS} # in a row", where)


def _partial(paths: tuple[Path, ...]) -> Path:
    return paths[0].with_name(paths[0].name + PARTIAL)


def _is_there(job: Job, paths: tuple[Path, ...]) -> bool:
    """Whether all files of a frame are there.

    Raises:
        FileError: one of them is of another scene, or holds none.
    """
    from clfractal.files.embedded import read_scene_text
    from clfractal.pictures.outputs import output_files

    files = [file for path in paths for file in output_files(job.scene.stereo, path)]
    there = [file for file in files if file.exists()]
    wanted = job.header()["scene"]
    for file in there:
        if read_scene_text(file) != wanted:
            raise FileError(
                "is a frame of another scene, or of other settings; remove it, or render without --resume",
                Where(str(file)),
            )
    return len(there) == len(files)
