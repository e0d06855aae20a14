"""Where a camera is: position, target and up, and shorter ways to say them, resolved when a scene is read."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, cast

from pydantic import Field

from clfractal.scene.stance import LARGEST, Framed, angles, axes, framing, orbited, rolled, shifted
from clfractal.schema.base import (
    Angle,
    Coordinate,
    Direction,
    Length,
    Position,
    Section,
    Vector,
    cross,
    length,
    minus,
    problem,
    rule,
)
from clfractal.schema.fields import SCALE

WORDS = ("orbit", "roll", "shift")
"""Keys of a camera that are other words for its position, target and up, and that films can move."""
PLACE = ("position", "target", "up")
"""Keys that say where a camera is."""
_SAID = "_said"


class Orbit(Section):
    """A camera's place on a sphere round its target; what is left out stays as `position` has it."""

    azimuth: Angle | None = Field(
        None, description="angle round `up`, degrees: 0 in front (-y), 90 on the right (x); null: position's"
    )
    elevation: Annotated[float, Field(strict=True, ge=-90, le=90, allow_inf_nan=False)] | None = Field(
        None, description="angle towards `up`, degrees: 90 straight above the target; null: position's"
    )
    distance: Annotated[Length, SCALE] | None = Field(
        None, description="from the target to the camera, scene units; null: position's"
    )

    @property
    def complete(self) -> bool:
        """Whether it needs no position."""
        return None not in (self.azimuth, self.elevation, self.distance)


class Shift(Section):
    """A shift of camera and target along the camera's own axes."""

    right: Coordinate = Field(0.0, description="to the picture's right, scene units")
    up: Coordinate = Field(0.0, description="to the picture's top, scene units")
    forward: Coordinate = Field(0.0, description="in the direction of view, scene units")


class CameraBase(Section):
    """Keys that every camera has.

    `orbit`, `roll`, `frame` and `shift` are other words for position, target and up. They are applied in this order and
    are then null: a camera that was read has a position, a target and an up, and nothing else has to know about them.
    Only what moves them in a film has to: for it a camera remembers what it was given (`said`).
    """

    position: Position = Field((0.0, -3.0, 0.0), description="where the camera is, scene units")
    target: Position = Field(
        (0.0, 0.0, 0.0), description="the point in the middle of the picture, scene units"
    )
    up: Direction = Field((0.0, 0.0, 1.0), description="the direction that is up in the picture")
    orbit: Orbit | None = Field(
        default=None, exclude=True, description="angles and distance round the target, instead of position"
    )
    frame: Literal["all", "seen"] | None = Field(
        default=None,
        exclude=True,
        description="target and distance are chosen so that 90 % of the picture's width or height are filled: all: by the"
        " bounds, or a volume's own box; seen: by what is seen",
    )
    roll: Angle | None = Field(
        default=None,
        exclude=True,
        description="turns the camera about its line of sight, degrees, clockwise as seen from behind it",
    )
    shift: Shift | None = Field(
        default=None, exclude=True, description="shifts camera and target along the camera's own axes"
    )

    @rule
    def _stands_somewhere(self) -> None:
        if _SAID not in self.__dict__:  # this is asked again of a camera that is put into another scene
            self._remember({name: getattr(self, name) for name in (*PLACE, *WORDS, "frame")})
        if self.orbit is None or not self.orbit.complete:
            self._check_target()
        if self.orbit is not None:
            self._take_orbit(self.orbit)
        self._check_view()
        if self.roll is not None:
            self._settle(up=rolled(self.position, self.target, self.up, self.roll), roll=None)
        if self.frame is None:
            # (Otherwise the scene does it, which knows the bounds.)
            self._take_shift()

    def framed(self, shown: Framed, aspect: float) -> Self:
        """The camera with its `frame` and `shift` done.

        Args:
            shown: what is to be seen.
            aspect: width of the picture divided by its height.

        Raises:
            SceneError: `shift` leads out of the range of coordinates.
        """
        fov = getattr(self, "fov", None)
        position, target, height = framing(axes(self.position, self.target, self.up), shown, aspect, fov)
        update = {"position": position, "target": target, "frame": None}
        found = self.model_copy(update=update if height is None else {**update, "height": height})
        found._remember(self.said)
        return found

    @property
    def said(self) -> Mapping[str, Any]:
        """Position, target, up, orbit, roll, frame and shift as they were given, before the words were applied."""
        return cast(Mapping[str, Any], self.__dict__[_SAID])

    def _remember(self, said: Mapping[str, Any]) -> None:
        # Beside the fields, as it is no part of what makes two cameras equal.
        self.__dict__[_SAID] = said

    def word(self, key: str) -> Any:
        """The value of one of `WORDS`: an Orbit, a roll, a Shift; where it was not given, what says the same."""
        said = self.said[key]
        if key != "orbit":
            return said if said is not None else Shift() if key == "shift" else 0.0
        given = (None, None, None) if said is None else (said.azimuth, said.elevation, said.distance)
        azimuth, elevation, distance = (
            present if wanted is None else wanted for present, wanted in zip(self.angles, given, strict=True)
        )
        return Orbit(azimuth=azimuth, elevation=elevation, distance=distance)

    def moved(self, update: Mapping[str, Any]) -> Self:
        """A copy with other values, of which words take the places of those that the camera was given.

        So a camera that was rolled by 10 degrees is rolled by 20 then, not by 30. An angle or distance of `orbit` that is
        left out is that of the position.

        Raises:
            SceneError: a value is wrong; the path says which.
        """
        if not any(word in update for word in WORDS):
            return self.model_copy(update=update)
        said = dict(self.said)
        if "position" in update:  # which the words for it would hide
            said |= {"orbit": None, "frame": None}
        changed = {**said, **update}
        if said["orbit"] is not None and update.get("orbit") is not None:
            left_out = [name for name in Orbit.model_fields if getattr(update["orbit"], name) is None]
            given = {name: getattr(said["orbit"], name) for name in left_out}
            changed["orbit"] = update["orbit"].model_copy(update=given)
        return self.model_copy(update=changed)

    @property
    def ahead(self) -> Vector:
        """Where it looks, from the position to the target."""
        x, y, z = (there - here for here, there in zip(self.position, self.target, strict=True))
        return x, y, z

    @property
    def angles(self) -> tuple[float, float, float]:
        """Azimuth and elevation, degrees, and distance: `orbit` with these values leads to this position."""
        return angles(self.position, self.target, self.up)

    def _take_orbit(self, orbit: Orbit) -> None:
        if self.frame is not None and orbit.distance is not None:
            raise problem("is chosen by camera.frame; remove one of them", "orbit.distance")
        given = (orbit.azimuth, orbit.elevation, orbit.distance)
        azimuth, elevation, distance = (
            present if wanted is None else wanted
            for present, wanted in zip(angles(self.position, self.target, self.up), given, strict=True)
        )
        position, up = orbited(self.target, self.up, azimuth, elevation, distance)
        self._check_near(position, "orbit.distance")
        self._settle(position=position, orbit=None)
        if up != self.up:
            self._settle(up=up)

    def _take_shift(self) -> None:
        if self.shift is None:
            return
        along = axes(self.position, self.target, self.up)
        by = (self.shift.forward, self.shift.right, self.shift.up)
        position, target = (shifted(point, along, *by) for point in (self.position, self.target))
        self._check_near(position, "shift")
        self._check_near(target, "shift")
        self._settle(position=position, target=target, shift=None)
        self._check_target()

    def _check_target(self) -> None:
        view = minus(self.target, self.position)
        size = max(1e-300, *(abs(x) for x in (*self.target, *self.position)))
        if length(view) <= 1e-14 * size:
            raise problem("must differ from camera.position", "target")

    def _check_view(self) -> None:
        self._check_target()
        view = minus(self.target, self.position)
        if length(cross(view, self.up)) <= 1e-6 * length(view) * length(self.up):
            raise problem("must not be parallel to the view, from camera.position to camera.target", "up")

    def _check_near(self, point: Vector, key: str) -> None:
        if max(abs(x) for x in point) > LARGEST:
            raise problem(f"must leave the camera's coordinates below {LARGEST:,.0f}", key)
