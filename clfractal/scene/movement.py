"""What a scene looks like at each frame of its animation."""

from collections.abc import Callable
from dataclasses import replace
from math import isfinite
from typing import Any, TypeAlias

from clfractal.errors import ClfractalError, FormulaError, SceneError, Where
from clfractal.scene.animation import Animation
from clfractal.scene.curves import Values
from clfractal.scene.model import Scene
from clfractal.scene.movers import Mover, Movers
from clfractal.scene.renderer import Renderer
from clfractal.scene.tracks import Target, target_of, with_values


class Movement:
    """All tracks of a scene's animation.

    Raises:
        SceneError, FormulaError, FileError: a track moves what cannot move, or is wrong; at its path.
    """

    def __init__(self, scene: Scene) -> None:
        assert scene.animation is not None
        self.animation: Animation = scene.animation
        self.targets, self.movers = scene.derived(_movers_of)
        self._original = scene
        self._scene = with_values(scene, {}, animation=None)

    def values(self, frame: float) -> dict[str, Any]:
        """The value of each track at a frame; after the end of a film that begins again, those of its beginning."""
        time = frame % self.animation.count if self.animation.loop else frame
        return {mover.name: mover.value(time) for mover in self.movers}

    def scene(self, frame: float) -> Scene:
        """A frame of the film as a still, with all values in the places of the tracks, and noise of its own.

        The frame may lie between two. The scene keeps its animation only if the shutter makes that a part of the picture.

        Raises:
            SceneError: a value is out of its range then, or the formula has no meaning with it; at its track.
        """
        return self._made(frame, self._noise(self._scene, frame), self._exposed(frame))

    def _noise(self, scene: Scene, frame: float) -> dict[tuple[str, ...], Any]:
        """The seeds of a frame, by path."""
        return dict(_seeds(scene, int(frame))) if self.animation.noise == "new" else {}

    def _exposed(self, frame: float) -> Animation | None:
        """The animation of a frame's scene, if its shutter makes it a part of the picture."""
        return self.animation.model_copy(update={"frame": float(frame)}) if self.animation.shutter else None

    def instant(self, time: float) -> Scene:
        """The scene at a moment of the film, frames, with the noise that it has; errors as above."""
        return self._made(time, {}, None)

    def still(self, frame: float) -> Scene:
        """The same, with its animation; errors as above."""
        return self._made(frame, {}, self.animation)

    def _made(self, frame: float, others: dict[tuple[str, ...], Any], animation: Animation | None) -> Scene:
        try:
            found = with_values(self._scene, {**self._by_path(frame), **others}, animation=animation)
            if animation is not None:
                found.take_tables(self._original)
            _ = found.chain, found.joined_chains
        except ClfractalError as error:
            raise self._blamed(error, frame) from error
        return found

    def _by_path(self, frame: float) -> dict[tuple[str, ...], Any]:
        values = self.values(frame)
        return {mover.target.path: values[mover.name] for mover in self.movers}

    def posed(self, frame: float) -> Scene:
        """The scene with the values of a frame, to be edited there: all else is as it was, its animation too.

        Raises:
            SceneError: as for `scene`.
        """
        try:
            found = with_values(self._original, self._by_path(frame))
            _ = found.chain, found.joined_chains
            return found
        except ClfractalError as error:
            raise self._blamed(error, frame) from error

    def rendered(self, posed: Scene, frame: float, *, blurred: bool = True) -> Scene:
        """What is rendered of a scene that was posed, and perhaps edited; without edits that is `scene`.

        Args:
            blurred: whether the film's shutter blurs it: then values of tracks are the film's, edited or not.
        """
        own = self._exposed(frame) if blurred else None
        found = with_values(posed, self._noise(posed, frame), animation=own)
        if own is not None:
            found.take_tables(posed)
        return found

    def _blamed(self, error: ClfractalError, frame: float) -> ClfractalError:
        """The error at the track that is the reason, with the frame."""
        path = error.where.path or ""
        told = f" at frame {frame:g}"
        for mover in self.movers:
            own = ".".join(mover.target.path)
            if path == own or path.startswith(f"{own}."):
                return type(error)(error.message + told, mover.where, details=error.details)
        shown = f"{path}: " if path else ""
        return type(error)(f"{shown}{error.message}{told}", Where(path="animation"), details=error.details)

    def check(self, check_parts: Callable[[Scene], None]) -> None:
        """Raises ClfractalError if a frame's scene is wrong: every frame at which one of the values is extreme is tried."""
        for frame in self._original.derived(_extreme_frames):
            found = self.scene(frame)
            try:
                check_parts(found)
            except ClfractalError as error:
                raise self._blamed(error, frame) from error


Moved: TypeAlias = tuple[dict[str, Target], tuple[Mover, ...]]


def _movers_of(scene: Scene) -> Moved:
    """What a scene's tracks move, and how."""
    assert scene.animation is not None
    targets = {name: _placed(name, target_of, scene, name) for name in scene.animation.tracks}
    return targets, Movers(scene, scene.animation, targets).made()


def _extreme_frames(scene: Scene) -> list[float]:
    """The first frame and the last, and those with the least and the largest of each component.

    Raises:
        FormulaError: a value is no finite number.
    """
    animation = scene.animation
    assert animation is not None
    found: set[float] = {0, animation.count - 1}
    times = _times(animation)
    for mover in scene.derived(_movers_of)[1]:
        columns: list[Values] = []
        for time in times:
            values = mover.at(time)
            if not all(isfinite(value) for value in values):
                raise FormulaError(f"is not a finite number at frame {time:g}", mover.where)
            columns.append(values)
        for component in zip(*columns, strict=True):
            found |= {times[component.index(min(component))], times[component.index(max(component))]}
        if mover.target.kind == "whole":  # of which some may be no choice
            found |= set(
                {round(values[0]): time for time, values in zip(times, columns, strict=True)}.values()
            )
    return sorted(found)


def _times(animation: Animation) -> list[float]:
    """Every frame, and while its shutter is open the middle and the end of that."""
    count, shutter = animation.count, animation.shutter
    if shutter == 0:
        return [float(frame) for frame in range(count)]
    shares = (0.0, 0.5 * shutter, shutter)
    times = (frame + share for frame in range(count) for share in shares)
    return [time % count if animation.loop else min(time, count - 1.0) for time in times]


def movement_of(scene: Scene) -> Movement:
    """How a scene moves, found once for each scene.

    Raises:
        SceneError: it has no animation, or a track of it is wrong; at its path.
        FormulaError, FileError: an expression or a table is wrong.
    """
    if scene.animation is None:
        raise SceneError("is missing: a film needs fps, frames and tracks", Where(path="animation"))
    return scene.once("movement", lambda: Movement(scene))


def _seeds(scene: Scene, frame: int) -> dict[tuple[str, ...], int]:
    """The seed of each renderer of a scene in a frame, by path."""
    views = scene.layout.views if scene.layout is not None else ()
    renderers: list[tuple[tuple[str, ...], Renderer | None]] = [
        (("renderer",), scene.renderer),
        *((("layout", "views", str(number), "renderer"), view.renderer) for number, view in enumerate(views)),
    ]
    return {
        (*path, "seed"): (renderer.seed + frame) % 2**32
        for path, renderer in renderers
        if renderer is not None
    }


def _placed(name: str, make: Callable[..., Any], *arguments: Any) -> Any:
    """What `make` gives; its errors get the place of a track, unless they have one."""
    try:
        return make(*arguments)
    except SceneError as error:
        where = replace(error.where, path=error.where.path or f"animation.tracks.{name}")
        raise SceneError(error.message, where, details=error.details) from error
