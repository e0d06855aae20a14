"""What lights have in common: colour, strength, shadows; and what else is asked of every kind."""

from collections.abc import Mapping, Sequence
from math import radians, sin
from pathlib import Path
from typing import Annotated, Any, ClassVar, cast

from pydantic import Field

from clfractal.schema.base import Amount, Color, Vector, problem, rule
from clfractal.schema.fields import Usual
from clfractal.schema.kinds import Element
from clfractal.schema.record import Number
from clfractal.schema.temperature import black_body

AXIS = Number("axis", "real", 3, "along which its light travels, length 1")


class LightBase(Element):
    """Keys that every light has.

    A light is a class in a file of `clfractal/elements/lights`. What kernels ask of it has the same name in
    `kernels/elements/lights`; `kernels/shading/light_at.h` says what functions that are.

    Attributes:
        about: with its title, what it is.
        is_seen: whether rays can meet it: it has a place and a size.
        beside: keys that the window shows no control of.
    """

    about: ClassVar[str] = ""
    is_seen: ClassVar[bool] = False
    beside: ClassVar[tuple[str, ...]] = ()

    color: Color = Field((1.0, 1.0, 1.0), description="linear Rec. 709")
    temperature: Annotated[float, Field(strict=True, ge=1000, le=40000), Usual(1500, 12000)] | None = Field(
        None,
        description="kelvin: the colour of a black body, of luminance 1, in place of `color`; null: `color`",
    )
    intensity: Annotated[Amount, Usual(0, 4)] = Field(1.0, description="factor on the colour")
    shadow: bool = Field(True, description="whether the set blocks this light")
    rays: Annotated[int, Field(strict=True, ge=1, le=1024), Usual(1, 64)] | None = Field(
        None, description="shadow rays per sample for a soft shadow; null: 8. A hard shadow takes one"
    )

    @rule
    def _one_color(self) -> None:
        if self.temperature is not None and self.color != (1.0, 1.0, 1.0):
            raise problem("cannot be combined with color: give one of color or temperature", "temperature")

    @classmethod
    def first(cls, away: float) -> dict[str, Any]:
        """Values of one that is added in the window so far from what it lights, beside its place and its directions."""
        return {}

    def controls(self, radius: float) -> Mapping[str, Mapping[str, Any]]:
        """How the window's controls of some keys differ from usual, where the bounds have this radius."""
        return {}

    def given(self, away: float) -> float:
        """What it gives with intensity 1 to a surface that faces it, so far away; a directional light gives 1."""
        return 1.0

    @property
    def stands_at(self) -> Vector | None:
        """Where it stands, its `position`; None: infinitely far away, or in many places."""
        return cast(Vector | None, getattr(self, "position", None))

    @property
    def reads(self) -> str | None:
        """The file beside the scene that its table is in, its key `file`; None if it needs none."""
        return None

    @classmethod
    def table_of(cls, path: Path) -> Sequence[float]:
        """Numbers of a file that kernels read, from `light->table` on.

        Raises:
            FileError: it cannot be read, or is wrong.
        """
        raise NotImplementedError(cls.tag)

    @classmethod
    def most_of(cls, table: Sequence[float]) -> float:
        """The most that such a table tells of any direction, as a factor on `given`: not negative."""
        raise NotImplementedError(cls.tag)

    @property
    def used_color(self) -> Vector:
        """Linear Rec. 709: the light's own colour, or that of its temperature."""
        return self.color if self.temperature is None else black_body(self.temperature)

    @property
    def has_size(self) -> bool:
        """Whether its light comes from more than one direction, so that shadows are soft."""
        return True

    @property
    def used_rays(self) -> int:
        """Shadow rays per sample: one for a hard shadow, because further rays would be the same."""
        if not self.has_size:
            return 1
        return self.rays if self.rays is not None else 8


class SingleLight(LightBase):
    """A light with a record of its own; its numbers there beside those of every light are `numbers`."""

    numbers: ClassVar[tuple[Number, ...]] = ()

    @property
    def extent(self) -> Vector:
        """How far it reaches from its place along x, y and z, scene units."""
        return (0.0, 0.0, 0.0)

    @property
    def weakens(self) -> bool:
        """Whether it weakens with the square of the distance."""
        return True

    @property
    def beam(self) -> tuple[Vector, float, float] | None:
        """Where it shines to: an axis, up to which angle about it as along it, and how much farther, weaker by the cosine;
        radians. None: all around."""
        return None

    def packed(self) -> dict[str, object]:
        """What its record has that differs from kind to kind, by names of `LIGHT`; the others are 0."""
        return {"vector": self.stands_at}


class SmallLight(SingleLight):
    """A light that has one direction at each place, or about one."""

    angular_size: Annotated[float, Usual(0, 45)] = Field(
        0.0,
        ge=0,
        le=170,
        description="diameter of the light as seen from the surface, degrees; 0: hard shadows",
    )

    @property
    def has_size(self) -> bool:
        """Whether shadows are soft."""
        return self.angular_size > 0

    def packed(self) -> dict[str, object]:
        """As of every light."""
        # 1 - cos a = 2 sin(a/2)^2, which keeps its digits for the smallest lights.
        return {**super().packed(), "spread": 2 * sin(radians(self.angular_size) / 4) ** 2}
