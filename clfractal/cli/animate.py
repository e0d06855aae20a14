"""`clfractal animate`: the frames of a scene's animation as numbered pictures, and as films."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.cli.engines import engine_of, shares_of
from clfractal.cli.film_parts import check_pattern, frames_of, missing, ranges, shown_ranges
from clfractal.cli.kept import Kept
from clfractal.cli.order import naming_options
from clfractal.cli.pipes import piped, refuse_stream
from clfractal.cli.render import Order, ordered_scene, tell_reference
from clfractal.cli.shell import Shell
from clfractal.cli.slices import check_numbered
from clfractal.device.activity import doing
from clfractal.errors import FileError, SceneError, Where, speaking_of
from clfractal.files.atomic import check_output
from clfractal.files.film_kinds import Recipe
from clfractal.files.frame_names import PARTIAL, frame_file, is_film
from clfractal.files.whole import is_foreign, is_whole
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of

if TYPE_CHECKING:
    from clfractal.cli.film_count import FilmCount
    from clfractal.engine.any_engine import AnyEngine
    from clfractal.engine.job import Job
    from clfractal.files.moving import Plan

# Frames that took longer keep their tiles while they are in work, seconds.
_LONG_FRAME = 2.0
_ADVICE = "remove it, or render without --resume"


def animate_scene(order: Order, part: str | None, recipe: Recipe, shell: Shell) -> None:
    """Renders the frames of a scene's animation, each to its own files, and makes films of them.

    A frame's files appear complete or not at all. With `order.resume` frames that are there are kept; those of another
    scene are refused. The frames of a film are kept without loss, beside it, until the film is whole.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device.
    """
    for path in order.outputs:
        refuse_stream(path, "frames are several files")
        check_pattern(path)
    stats = () if order.stats is None else ((order.stats, ".json"),)
    with piped(shell, order.scene, [*((path, "") for path in order.outputs), *stats]) as files:
        written = files.outputs[-1] if stats else None
        named = replace(order, scene=files.source, folder=files.folder, stats=written)
        _animate(named, part, recipe, shell)


def _animate(order: Order, part: str | None, recipe: Recipe, shell: Shell) -> None:
    begun = time.perf_counter()
    scene = ordered_scene(order)
    with speaking_of(order.scene):
        animation = movement_of(scene).animation
    numbers = frames_of(part, animation.count)
    films = _planned_films(order, scene, recipe, animation.fps)
    patterns = [path for path in order.outputs if not is_film(path)]
    if not order.outputs:
        patterns = [_usual(order)]
    with Kept(films, shell, resume=order.resume) as kept:
        own = list(kept.patterns.values())
        patterns += own
        files = {number: tuple(frame_file(path, number) for path in patterns) for number in numbers}
        others = [film.path for film in films]
        if order.stats is not None:
            check_output(order.stats, (order.stats.suffix.lower(),))
            others.append(order.stats)
        check_numbered(scene, [*files.values()], others)
        tell_reference(order, scene, shell)
        for film in films:
            if not film.tells_stereo:
                shell.say(f"{film.path}: players are not told how it holds two pictures; choose it there")
        counted = _render_frames(order, scene, files, begun, kept, shell)
        rendered = time.perf_counter()
        if films:
            shell.state = lambda: f"{films[0].path}: interrupted; all frames are kept; --resume continues"
            kept.write(list(numbers))
    shell.state = lambda: "clfractal: interrupted"
    # Imported only now: mistakes in the input are reported without waiting for NumPy.
    from clfractal.engine.stats import sentence, write_statistics

    values = counted.statistics(1e3 * (time.perf_counter() - rendered))
    if order.stats is not None:
        write_statistics(order.stats, values)
    named = [f"{files[numbers[0]][0]} to {files[numbers[-1]][0].name}"] if patterns[0] not in own else []
    shell.say(f"{', '.join([*named, *(str(film.path) for film in films)])}: {counted.summary()}")
    left = [number for number in range(animation.count) if number not in numbers]
    lacking = _missing(scene, [path for path in patterns if path not in own], left)
    if lacking:
        shell.say(f"{len(lacking)} frames of the film are missing: {shown_ranges(lacking)}")
    if shell.verbose:
        shell.say(sentence(values))


def list_missing(order: Order, part: str | None, shell: Shell) -> None:
    """Prints which frames of numbered pictures are missing, or not whole: a line for each range, as `--frames` takes it.

    Raises:
        ClfractalError: anything wrong with the input.
    """
    if order.stats is not None:
        raise SceneError("applies to frames that are rendered; leave it out", Where("--stats"))
    if any(is_film(path) for path in order.outputs):
        raise SceneError("applies to numbered pictures; a film is only made whole", Where("--missing"))
    for path in order.outputs:
        refuse_stream(path, "frames are several files")
        check_pattern(path)
    with piped(shell, order.scene, ()) as files:
        scene = ordered_scene(replace(order, scene=files.source, folder=files.folder))
        with speaking_of(order.scene):
            numbers = frames_of(part, movement_of(scene).animation.count)
        patterns = [*order.outputs] or [_usual(order)]
        for found in ranges(_missing(scene, patterns, numbers)):
            shell.print(found)


def _usual(order: Order) -> Path:
    """The name of frames where none is given."""
    return Path(f"{Path(order.scene).stem}_####.png")


def _missing(scene: Scene, patterns: Sequence[Path], numbers: Sequence[int]) -> list[int]:
    """The frames of which a file is missing; without patterns there are none."""
    from clfractal.images.outputs import output_files

    files = (
        [file for pattern in patterns for file in output_files(scene.stereo, frame_file(pattern, number))]
        for number in numbers
    )
    return missing(numbers, files)


def _render_frames(
    order: Order,
    scene: Scene,
    files: Mapping[int, tuple[Path, ...]],
    begun: float,
    kept: Kept,
    shell: Shell,
) -> FilmCount:
    """Renders the frames that are not there yet."""
    with speaking_of(order.scene), doing("checking all frames"):
        for number in files:
            movement_of(scene).scene(number)
    if order.resume:
        _check_pictures(scene, files)
    with engine_of(order, shell) as engine:
        return _render_on(engine, order, scene, files, begun, kept, shell)


def _check_pictures(scene: Scene, files: Mapping[int, tuple[Path, ...]]) -> None:
    """Makes sure that no frame's file is somebody else's, before any is rendered.

    Raises:
        FileError: one of them is no picture.
    """
    from clfractal.images.outputs import output_files

    for paths in files.values():
        for file in (each for path in paths for each in output_files(scene.stereo, path)):
            if is_foreign(file):
                raise FileError(f"is no picture, as its name says; {_ADVICE}", Where(str(file)))


def _render_on(
    engine: AnyEngine,
    order: Order,
    scene: Scene,
    files: Mapping[int, tuple[Path, ...]],
    begun: float,
    kept: Kept,
    shell: Shell,
) -> FilmCount:
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.cli.film_count import FilmCount
    from clfractal.cli.numbered import render_one
    from clfractal.engine.frames import FilmScenes
    from clfractal.engine.remarks import mixed_kinds

    counted = FilmCount(shell, len(files), begun)
    scenes = FilmScenes(engine, scene)
    coming = iter(files.items())

    def is_missing(job: Job) -> bool:
        number, paths = next(coming)
        return not (order.resume and _is_there(job, paths, kept.at(number)))

    jobs = engine.in_order(
        map(scenes.scene, files),
        is_missing,
        precision=order.precision,
        samples=order.samples,
        pictures=len(files),
    )
    removed = told = False
    kinds: set[str] = set()
    with closing(jobs):
        for number, paths in files.items():
            with speaking_of(order.scene), naming_options():
                job, missing = next(jobs)
            if not removed:
                kept.begin()
                removed = True
                if job.others:
                    told = True
                    shell.say(f"{order.scene}: {mixed_kinds(1 + len(job.others))}")
            shell.state = partial(counted.interrupted, number, paths[0])
            if not missing:
                counted.stats.keep(job)
                continue
            each = counted.seconds_each
            made = render_one(
                job,
                engine,
                paths,
                shell,
                resume=order.resume,
                keep=each is None
                or each > _LONG_FRAME
                or paths[0].with_name(paths[0].name + PARTIAL).exists(),
                bits=kept.at(number),
            )
            counted.rendered(made.state.rays)
            counted.stats.add(number, job, made.state, wall_ms=made.wall_ms, write_ms=made.write_ms)
            kinds |= {
                each.key for each in made.state.render_devices
            }  # a cluster's are known when they have come
            if len(kinds) > 1 and not told:
                told = True
                shell.say(f"{order.scene}: {mixed_kinds(len(kinds))}")
    counted.previews_built_ms, counted.shares = engine.previews_built_ms, shares_of(engine)
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
    from clfractal.images.formats import Content

    content = Content.of(scene)
    if content.transparent:
        where = Where(order.scene, path="background")
        raise SceneError("must be a colour or a gradient for a film, which is not transparent", where)
    mode, swap = (scene.stereo.mode, scene.stereo.swap) if scene.stereo is not None else (None, False)
    return [plan_film(path, recipe, content.size, fps, stereo=mode, swap=swap) for path in films]


def _is_there(job: Job, paths: tuple[Path, ...], bits: Mapping[Path, int]) -> bool:
    """Whether all files of a frame are there, whole, and stored as they are asked for.

    Args:
        bits: of PNG files that have others than the scene wants.

    Raises:
        FileError: one of them is of another scene, or holds none.
    """
    from clfractal.files.embedded import read_scene_text
    from clfractal.files.png import read_form
    from clfractal.images.outputs import output_files

    scene = job.scene
    files = {
        file: bits.get(path, scene.output.png_bits)
        for path in paths
        for file in output_files(scene.stereo, path)
    }
    there = [file for file in files if is_whole(file)]
    wanted = job.header()["scene"]
    for file in there:
        try:
            text = read_scene_text(file)
        except FileError as error:
            raise FileError(f"{error.message}; {_ADVICE}", error.where) from error
        if text != wanted:
            raise FileError(f"is a frame of another scene, or of other settings; {_ADVICE}", Where(str(file)))
    components = 4 if scene.background == "transparent" else 3
    return len(there) == len(files) and all(
        file.suffix.lower() != ".png" or read_form(file) == (depth, components)
        for file, depth in files.items()
    )
