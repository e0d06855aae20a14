"""`clfractal animate --preview`: small frames of a film on one sheet, before it is rendered."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

from clfractal.cli.film_parts import frames_of
from clfractal.cli.order import Order
from clfractal.cli.pipes import piped, refuse_stream
from clfractal.cli.render import ordered_scene
from clfractal.cli.shell import Shell
from clfractal.errors import SceneError, Where, speaking_of
from clfractal.files.inputs import refuse_overwriting
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of

# Frames on a sheet, and the longer side of each, pixels, if no size is given.
MOST_FRAMES = 24
_LONGER_SIDE = 240
_CHANNELS = ("R", "G", "B", "A")


def preview_film(order: Order, sheet: Path, part: str | None, shell: Shell) -> None:
    """Renders small frames, spread evenly over the film, and puts them on a sheet, each with its number and time.

    Frames are as `clfractal vary` shows scenes: with few samples, for one eye, and without motion blur.

    Raises:
        ClfractalError: anything wrong with the input, the file or the device.
    """
    if order.outputs:
        raise SceneError("writes a sheet alone; leave out -o", Where("--preview"))
    if order.stats is not None:
        raise SceneError("applies to frames that are rendered; leave it out", Where("--stats"))
    refuse_stream(sheet, "the sheet needs a file")
    with piped(shell, order.scene, ()) as files:
        _preview(replace(order, scene=files.source, folder=files.folder), sheet, part, shell)


def _preview(order: Order, sheet: Path, part: str | None, shell: Shell) -> None:
    from clfractal.images.formats import check_output

    begun = time.perf_counter()
    scene = ordered_scene(order)
    with speaking_of(order.scene):
        animation = movement_of(scene).animation
    numbers = spread(frames_of(part, animation.count))
    size = (scene.image.width, scene.image.height) if order.size is not None else _small(scene)
    check_output(sheet)
    refuse_overwriting([sheet], scene.files)
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine.engine import Engine
    from clfractal.engine.frames import FilmScenes
    from clfractal.engine.variations import small_scene
    from clfractal.images.sheet import sheet_of

    pictures = []
    with Engine(order.device, tell=shell.say) as engine, speaking_of(order.scene):
        scenes = FilmScenes(engine, scene)
        for number in numbers:
            shown = scenes.scene(number).model_copy(update={"animation": None})
            framebuffer = engine.render(small_scene(shown, *size), channels=_CHANNELS)
            pictures.append(framebuffer.to_rgb8())
    names = [f"{number}   {number / animation.fps:.2f} s" for number in numbers]
    sheet_of(pictures, names).save(sheet)
    seconds = time.perf_counter() - begun
    shell.say(f"{sheet}: {len(numbers)} of {animation.count} frames, {seconds:.2f} s")


def spread(numbers: range) -> list[int]:
    """At most MOST_FRAMES of some frames, evenly, the first and the last among them."""
    count = min(len(numbers), MOST_FRAMES)
    if count == 1:
        return [numbers[0]]
    return [numbers[round(place * (len(numbers) - 1) / (count - 1))] for place in range(count)]


def _small(scene: Scene) -> tuple[int, int]:
    """The size of a small frame with the scene's proportions, pixels."""
    width, height = scene.image.width, scene.image.height
    shrink = min(1.0, _LONGER_SIDE / max(width, height))
    return max(1, round(width * shrink)), max(1, round(height * shrink))
