"""The pictures of a film, one after the other, from one engine."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clfractal.engine.any_engine import AnyEngine, Elsewhere
from clfractal.engine.engine import engine_on
from clfractal.errors import SceneError, Where, arguments
from clfractal.scene.load import as_scene
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of

if TYPE_CHECKING:
    from clfractal.engine.run import ProgressCallback
    from clfractal.images.framebuffer import Framebuffer


def at_frame(scene: Scene | str | Path | Mapping[str, Any], frame: float) -> Scene:
    """A scene as it is at a frame of its animation: a still, with all values in the places of the tracks.

    Args:
        scene: a Scene, or what `load_scene` takes.
        frame: counted from 0; it may lie between two frames.

    Raises:
        SceneError: the scene has no animation, the framebuffer no such frame, or a value is out of its range then.
    """
    found = as_scene(scene)
    movement = movement_of(found)
    last = movement.animation.count - (not movement.animation.loop)
    number = arguments.number("frame", frame, 0, last)
    return movement.scene(number)


class FilmScenes:
    """The scenes of a film's frames, as they are rendered.

    `output.exposure: auto` is measured in frame 0, whichever frames are rendered, so that all have the same. What follows
    the camera, `camera.focus` and `stereo.fit`, is measured in each frame.

    Raises:
        SceneError, FormulaError, FileError: the scene has no animation, or a track is wrong.
    """

    def __init__(self, engine: AnyEngine, scene: Scene) -> None:
        self._engine, self.movement = engine, movement_of(scene)

    @property
    def count(self) -> int:
        """The number of frames."""
        return self.movement.animation.count

    def scene(self, number: int) -> Scene:
        """The scene of a frame.

        Raises:
            SceneError, FormulaError: a value is out of its range then; at its track.
            DeviceError, KernelBuildError: the preview failed that frame 0 needs.
        """
        found = self.movement.scene(number)
        if not isinstance(found.output.exposure, str):
            return found
        output = found.output.model_copy(update={"exposure": self._first.output.exposure})
        return found.model_copy(update={"output": output})

    @cached_property
    def _first(self) -> Scene:
        """Frame 0 with numbers in the place of what is to be measured."""
        return self._engine.settled(self.movement.scene(0))


def frames(
    scene: Scene | str | Path | Mapping[str, Any],
    device: str | Sequence[str] | None = None,
    progress: ProgressCallback | None = None,
    *,
    numbers: Iterable[int] | None = None,
    precision: str | None = None,
    samples: int | None = None,
    size: tuple[int, int] | None = None,
    channels: Sequence[str] | None = None,
    quality: str | None = None,
    executor: Elsewhere | None = None,
) -> Iterator[tuple[int, Framebuffer]]:
    """Renders the frames of a scene's animation, one after the other, in one engine.

        for number, framebuffer in clfractal.frames("dive.yaml"):
            framebuffer.save(f"frame_{number:04}.exr")

    Nothing is rendered before the first frame is asked for; who stops early loses nothing.

    Args:
        scene: a Scene, or what `load_scene` takes; it needs an `animation`.
        numbers: the wanted frames, in any order, counted from 0; None: all.
        device, progress, precision, samples, size, channels, quality, executor: as for `clfractal.render`, for each frame.

    Returns:
        An iterator of pairs: the frame's number, and its framebuffer.

    Raises:
        SceneError, FormulaError: the scene, its animation or a setting is wrong.
        DeviceError, KernelBuildError: as for `clfractal.render`.
    """
    found = as_scene(scene)
    wanted = _wanted(numbers, movement_of(found).animation.count)

    def rendered() -> Iterator[tuple[int, Framebuffer]]:
        with engine_on(device, executor) as engine:
            scenes = FilmScenes(engine, found)
            framebuffers = engine.render_in_order(
                map(scenes.scene, wanted),
                progress,
                precision=precision,
                samples=samples,
                size=size,
                channels=channels,
                quality=quality,
                pictures=len(wanted),
            )
            with closing(framebuffers):
                yield from zip(wanted, framebuffers, strict=True)

    return rendered()


def _wanted(numbers: Iterable[int] | None, count: int) -> Sequence[int]:
    """The frames to render, checked."""
    if numbers is None:
        return range(count)
    if isinstance(numbers, (str, bytes)) or not isinstance(numbers, Iterable):
        raise SceneError(
            f"must be a list of numbers of frames, got {arguments.shown(numbers)}", Where(path="numbers")
        )
    return [arguments.whole("numbers", number, 0, count - 1) for number in numbers]
