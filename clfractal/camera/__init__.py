"""Moves of a scene's camera, for loops and notebooks: each function gives a scene with another camera.

    from clfractal import camera
    for step in range(36):
        film = engine.render(camera.turn(scene, azimuth=10 * step))

The same moves are keys of a scene's camera (`orbit`, `roll`, `shift`, `frame`). Angles are degrees, lengths scene units.
"""

from __future__ import annotations

from typing import Any, Literal

from clfractal.errors import arguments
from clfractal.scene.model import Scene


def angles(scene: Scene) -> tuple[float, float, float]:
    """Where the camera is on the sphere round its target: azimuth, elevation and distance, as `orbit` takes them.

    Raises:
        SceneError: it is no Scene.
    """
    return _checked(scene).camera.angles


def orbit(
    scene: Scene,
    *,
    azimuth: float | None = None,
    elevation: float | None = None,
    distance: float | None = None,
) -> Scene:
    """The camera at another place of the sphere round its target; what is None stays.

    Args:
        azimuth: round `up`: 0 in front (-y where z is up), 90 on the right (x).
        elevation: towards `up`, -90 to 90.
        distance: from the target.

    Raises:
        SceneError: a value is out of its range.
    """
    wanted = {"azimuth": azimuth, "elevation": elevation, "distance": distance}
    return _with(scene, orbit=wanted)


def turn(scene: Scene, *, azimuth: float = 0.0, elevation: float = 0.0) -> Scene:
    """The camera turned round its target by angles; it stops straight above and below it.

    Raises:
        SceneError: an angle is out of its range.
    """
    at, high, _ = angles(scene)
    round_it, upwards = arguments.number("azimuth", azimuth), arguments.number("elevation", elevation)
    return orbit(scene, azimuth=at + round_it, elevation=min(max(high + upwards, -90.0), 90.0))


def roll(scene: Scene, angle: float) -> Scene:
    """The camera turned about its line of sight, clockwise as seen from behind it.

    Raises:
        SceneError: the angle is out of its range.
    """
    return _with(scene, roll=angle)


def shift(scene: Scene, *, right: float = 0.0, up: float = 0.0, forward: float = 0.0) -> Scene:
    """Camera and target shifted along the camera's own axes: in the picture's directions, and in the direction of view.

    Raises:
        SceneError: they would be out of the range of coordinates.
    """
    return _with(scene, shift={"right": right, "up": up, "forward": forward})


def frame(scene: Scene, what: Literal["all", "seen"] = "all") -> Scene:
    """The camera, without a turn, where something fills 90 % of the picture's width or height; its middle is the target.

    Args:
        what: `all`: the bounds of the set, of which the ball fills the smaller side. They hold all of the set, and may be
            larger than it is. Of a volume with a box of its own, or a grid from a file, its corners. `seen`: what is seen,
            the set and the objects that have an end, as far as planes leave them.

    Raises:
        FormulaError: the scene's formula has no bounds, because it is wrong.
        SceneError: another word.
    """
    return _with(scene, frame=arguments.word("what", what, ("all", "seen")))


def _with(scene: Scene, **words: Any) -> Scene:
    camera = {**_checked(scene).camera.model_dump(mode="json"), **words}
    return scene.model_copy(update={"camera": camera})


def _checked(scene: Scene) -> Scene:
    if not isinstance(scene, Scene):
        arguments.refuse("scene", "must be a Scene, as load_scene gives it", arguments.plain(scene))
    return scene
