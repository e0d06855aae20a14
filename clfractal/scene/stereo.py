"""Stereo: a real screen, the viewer in front of it, and how the two pictures are shown."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from clfractal.errors import SceneError, Where
from clfractal.schema.base import Direction, Position, Reflectance, Section, check_frame, problem, rule
from clfractal.schema.fields import SCALE, Usual

# Screen, distance and eyes are measured in one unit, so their ratios cannot be larger than this.
MAX_RATIO = 10_000

Positive = Annotated[float, Field(strict=True, gt=0, le=1e6, allow_inf_nan=False)]
EyeName = Literal["left", "right", "middle"]
Mode = Literal[
    "left",
    "right",
    "pair",
    "multi_view",
    "split",
    "over_under",
    "split_half",
    "over_under_half",
    "rows",
    "columns",
    "checkerboard",
    "anaglyph_chessboard",
    "anaglyph",
]


APART: tuple[Mode, ...] = ("pair", "multi_view")
"""Modes that keep both pictures whole; nothing is composed."""


@dataclass(frozen=True, slots=True)
class Eye:
    """The eye from which a scene is seen.

    Attributes:
        name: one of the two eyes, or the cyclopean one between them.
        wide, high: how many of the finished picture's pixels one of this eye's pixels takes up (2 if squeezed).
        share: the part of the screen's width that the picture takes up (less than 1 for a view of a layout).
    """

    name: EyeName = "middle"
    wide: int = 1
    high: int = 1
    share: float = 1.0


MIDDLE = Eye()
"""The eye of a picture that is nobody's in particular: the cyclopean one, and that of scenes without stereo."""


class StereoPlane(Section):
    """The rectangle in space that lies on the screen."""

    center: Position = Field((0.0, 0.0, 0.0), description="the plane's middle, scene units")
    normal: Direction = Field((0.0, -1.0, 0.0), description="direction towards the viewer")
    up: Direction = Field((0.0, 0.0, 1.0), description="direction towards the plane's top")
    width: Annotated[float, Field(strict=True, ge=1e-18, le=1e6), SCALE] = Field(
        4.0, description="scene units"
    )
    height: Annotated[float, Field(strict=True, ge=1e-18, le=1e6), SCALE] | None = Field(
        None, description="scene units; null: the height that makes pixels square on the screen"
    )

    @rule
    def _faces_somewhere(self) -> None:
        check_frame(self.normal, self.up)


class Stereo(Section):
    """A pair of pictures for the two eyes of a viewer in front of a real screen.

    Screen, distance and interpupillary distance are measured in the real world, all in the same unit.
    """

    mode: Mode = Field("split", description="how the pair is shown")
    screen_width: Annotated[Positive, Usual(0.1, 10)] = Field(
        0.52, description="width of the picture on the real screen, in any unit of length"
    )
    screen_distance: Annotated[Positive, Usual(0.2, 20)] = Field(
        0.6, description="distance from the viewer's eyes to the screen, in the same unit"
    )
    interpupillary_distance: Annotated[Positive, Usual(0.02, 0.1)] = Field(
        0.063, description="distance between the viewer's pupils, in the same unit"
    )
    swap: bool = Field(False, description="exchange the places of the two eyes in the picture")
    plane: StereoPlane | None = Field(
        None, description="the plane that lies on the screen; null: the plane through the camera's target"
    )
    convergence: Literal["off_axis", "parallel", "toe_in"] = Field(
        "off_axis",
        description="how the eyes are aimed: off_axis is right for a screen, the others are for comparison",
    )
    separation: Annotated[float, Field(strict=True, ge=0, le=10, allow_inf_nan=False), Usual(0, 3)] = Field(
        1.0, description="distance between the viewpoints; 1 is the viewer's interpupillary distance"
    )
    fit: Literal["auto"] | None = Field(
        None, description="auto: plane and separation are chosen so that the depth fits the budget"
    )
    budget: Annotated[float, Field(strict=True, gt=0, le=10, allow_inf_nan=False), Usual(0.1, 3)] = Field(
        1.0, description="largest parallax that `fit` allows, degrees"
    )
    method: Literal["color", "half_color", "gray", "dubois"] = Field(
        "dubois", description="for mode anaglyph: how the two pictures' colours are mixed"
    )
    glasses: Literal["red_cyan", "green_magenta", "amber_blue"] = Field(
        "red_cyan", description="for mode anaglyph: the colours of the left and the right filter"
    )
    colors: Annotated[tuple[Reflectance, Reflectance], Field(strict=False)] = Field(
        ((1.0, 0.0, 0.0), (0.0, 1.0, 1.0)),
        description="for mode anaglyph_chessboard: the left and the right filter, linear Rec. 709",
    )

    @rule
    def _of_one_viewer(self) -> None:
        for key in ("screen_distance", "interpupillary_distance"):
            measure = getattr(self, key)
            if not 1 / MAX_RATIO <= measure / self.screen_width <= MAX_RATIO:
                raise problem(
                    f"must be within a factor of {MAX_RATIO:,} of screen_width ({self.screen_width:g}), in the same unit,"
                    f" got {measure:g}",
                    key,
                )

    @property
    def eyes(self) -> tuple[EyeName, ...]:
        """The eyes whose pictures are shown."""
        if self.mode == "left":
            return ("left",)
        return ("right",) if self.mode == "right" else ("left", "right")

    @property
    def squeeze(self) -> tuple[int, int]:
        """How many of the finished picture's pixels an eye's pixel is wide and high."""
        return (2 if self.mode == "split_half" else 1, 2 if self.mode == "over_under_half" else 1)

    @property
    def mixes_colors(self) -> bool:
        """Whether the finished picture has other colours than the eyes' own."""
        return self.mode in ("anaglyph", "anaglyph_chessboard")

    def check_channels(self, channels: Collection[str]) -> None:
        """Raises SceneError, at `output.channels`, if a colour that the mode mixes is not among the channels."""
        missing = [name for name in "RGB" if name not in channels]
        if missing and self.mixes_colors:
            raise SceneError(
                f"{self.mode} needs the channels R, G, B; {', '.join(missing)} not among them",
                Where(path="output.channels"),
            )
