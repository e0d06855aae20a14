"""`clfractal watch`: a picture that follows its scene file, coarse at first."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING

from clfractal.cli.order import Order, naming_options
from clfractal.cli.pipes import INPUT, STREAM, refuse_stream
from clfractal.cli.render import check_outputs, ordered_scene, tell_reference
from clfractal.cli.shell import Shell
from clfractal.errors import ClfractalError, FileError, SceneError, Stopped, Where, speaking_of
from clfractal.files.atomic import check_output
from clfractal.files.inputs import noting, refuse_overwriting
from clfractal.files.watching import Watched
from clfractal.scene.model import Scene
from clfractal.scene.stereo import APART

if TYPE_CHECKING:
    from clfractal.device.cancel import CancelToken
    from clfractal.engine.engine import Engine

# Seconds between two looks at the disk, and between two pictures of one scene that are not its last.
_INTERVAL, _LEAST_APART = 0.25, 0.5


def watch_scene(order: Order, shell: Shell) -> None:
    """Renders a scene, and anew whenever it changes or a file that it names, until it is interrupted.

    A change ends a render that is under way. What is wrong is told, and waited out.

    Raises:
        ClfractalError: an option is wrong, there is no such scene, or no device.
    """
    if order.scene == STREAM:
        raise FileError("cannot be watched; name a scene file", Where(INPUT))
    for path in order.outputs:
        refuse_stream(path, "each picture replaces the one before; name a file")
    if not order.outputs:
        order = replace(order, outputs=(Path(Path(order.scene).with_suffix(".png").name),))
    # What no change of the scene can mend.
    for path in order.outputs:
        check_output(path)
    refuse_overwriting(order.outputs, [order.scene])
    watched = Watched([Path(order.scene)], interval=_INTERVAL)
    scene: Scene | None
    try:
        scene = _read(order, watched)
        tell_reference(order, scene, shell)
    except ClfractalError as error:
        if not Path(order.scene).exists() or (error.where.file or "").startswith("--"):
            raise
        scene = None
        shell.refuse(str(error))
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine.engine import Engine

    shell.state = lambda: f"clfractal: {order.scene} is no longer watched"
    with Engine(order.device, tell=shell.say) as engine:
        while True:
            if scene is not None and not _rendered(order, scene, engine, watched, shell):
                shell.say(f"{order.scene}: changed")
            else:
                _wait(watched)
            try:
                scene = _read(order, watched)
            except ClfractalError as error:
                scene = None
                shell.refuse(str(error))


def _wait(watched: Watched) -> None:
    """Returns once a file has changed."""
    while not watched.changed():
        time.sleep(_INTERVAL / 2)


def _read(order: Order, watched: Watched) -> Scene:
    """The scene as it is now; all files that it reads are watched, also if one of them is wrong.

    Raises:
        ClfractalError: the scene is wrong, or a file that it names, or what it would be written to.
    """
    while True:
        with noting() as files:
            try:
                scene = ordered_scene(order)
            finally:
                known = {path.absolute() for path in watched.paths}
                more = [path for path in files if path not in known]
                watched.follow([*watched.paths, *more])
        # Read again with all of its files watched, so that no change of a file in the meantime is missed.
        if not more:
            break
    if scene.stereo is not None and scene.stereo.mode in APART:
        raise SceneError(
            f"{scene.stereo.mode} makes two pictures; watch shows one, use another mode",
            Where(order.scene, path="stereo.mode"),
        )
    check_outputs(order, scene)
    return scene


def _rendered(order: Order, scene: Scene, engine: Engine, watched: Watched, shell: Shell) -> bool:
    """Renders a scene to all outputs, coarse at first; False if a file has changed in the meantime."""
    begun = time.perf_counter()
    output = scene.output
    check_outputs(order, scene)
    try:
        with _ended_by_change(watched) as token, speaking_of(order.scene), naming_options():
            written = 0.0
            for framebuffer in engine.refine(
                scene, precision=order.precision, samples=order.samples, token=token
            ):
                last = not framebuffer.stage
                if last or time.perf_counter() - written >= _LEAST_APART:
                    for path in order.outputs:
                        framebuffer.save(
                            path, half=output.half_channels, bits=output.png_bits, quality=output.quality
                        )
                    written = time.perf_counter()
    except Stopped:
        return False
    except ClfractalError as error:
        shell.refuse(str(error))
        return True
    names = ", ".join(map(str, order.outputs))
    shell.say(f"{names}: {scene.image.width} x {scene.image.height}, {time.perf_counter() - begun:.2f} s")
    for remark in framebuffer.remarks:
        shell.say(f"{order.scene}: {remark}")
    return True


@contextmanager
def _ended_by_change(watched: Watched) -> Iterator[CancelToken]:
    """Gives a token that is cancelled when a file changes."""
    from clfractal.device.cancel import CancelToken

    token, over = CancelToken(), Event()

    def look() -> None:
        while not over.wait(_INTERVAL / 2):
            if watched.changed():
                token.cancel()
                return

    thread = Thread(target=look, name="clfractal-watch", daemon=True)
    thread.start()
    try:
        yield token
    finally:
        over.set()
        thread.join()
    # A change that came with the last pixel.
    token.check()
