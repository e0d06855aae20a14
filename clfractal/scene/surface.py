"""The surface renderer's settings: the search for the surface, its normals, and the sampling of pixels."""

from math import isqrt
from typing import Annotated, Literal

from pydantic import Field

from clfractal.scene.sampled import Sampled
from clfractal.schema.ball import Ball
from clfractal.schema.base import Length, Section, problem, rule
from clfractal.schema.fields import Usual

# Normals that need a middle point and its eight neighbours, so a grid with an odd side.
GRID_NORMALS = ("one_triangle", "eight_triangles_shading", "eight_triangles_normal")
MAX_POINTS = 64


class Points(Section):
    """The points of a pixel that share one march; each finds the surface on its own ray."""

    pattern: Literal["grid", "stochastic"] = Field("grid", description="a square grid, or random places")
    count: int = Field(9, ge=1, le=MAX_POINTS, description="number of points per pixel")

    @rule
    def _countable(self) -> None:
        if self.pattern == "grid" and isqrt(self.count) ** 2 != self.count:
            squares = ", ".join(str(n * n) for n in range(1, isqrt(MAX_POINTS) + 1))
            raise problem(f"must be a square for a grid ({squares}), got {self.count}", "count")
        if self.pattern == "stochastic" and self.count < 4:
            raise problem(f"must be from 4 to {MAX_POINTS} for stochastic points, got {self.count}", "count")


class AmbientOcclusion(Section):
    """How much of its surroundings a point of the surface sees."""

    rays: Annotated[int, Usual(1, 64)] = Field(
        8, ge=1, le=1024, description="rays into the hemisphere per sample"
    )
    distance: Length | None = Field(
        None, description="distance up to which obstacles count, scene units; null: half the bounds' radius"
    )


class SurfaceRenderer(Sampled):
    """The boundary of the set, found by marching along each ray."""

    tag = "surface"
    title = "Surface"
    place = 10
    shows_every_object = True
    type: Literal["surface"] = "surface"
    search: Literal["distance", "steps"] = Field(
        "distance",
        description="find the surface by estimated distances, or by fixed steps and inside tests alone",
    )
    step: Length | None = Field(
        None,
        description="step for `search: steps`, of ways through glass and in hollows, scene units;"
        " null: 1/100 of the bounds' radius",
    )
    points: Points | None = Field(
        None, description="points of a pixel; null: one in its middle, or 3 x 3 where `normal` needs them"
    )
    normal: Literal[
        "gradient",
        "potential",
        "one_triangle",
        "eight_triangles_shading",
        "eight_triangles_normal",
        "least_squares",
    ] = Field(
        "gradient",
        description="where normals come from: the Jacobian at the surface, or farther out, or the pixel's points",
    )
    detail: Annotated[float, Usual(0.1, 10)] = Field(
        1.0, ge=0.01, le=100, description="distance that counts as a hit, in pixel footprints"
    )
    max_steps: Annotated[int, Usual(50, 20000)] = Field(
        1000, ge=1, le=100_000, description="maximum number of distance evaluations along a ray"
    )
    over_relaxation: Annotated[float, Usual(1, 1.99)] = Field(
        3.0,
        ge=1,
        le=4,
        description="most that a step may exceed the distance; a step is taken back where it was unsafe",
    )
    step_scale: Annotated[float, Field(strict=True, gt=0, le=2), Usual(0.05, 1)] | None = Field(
        None, description="factor on estimated distances; null: the formula's own"
    )
    bounds: Ball | None = Field(
        None, description="the ball that holds the visible part of the set; null: the formula's own"
    )
    bounces: int = Field(3, ge=0, le=16, description="maximum number of mirror reflections of a ray")
    ambient_occlusion: AmbientOcclusion | None = Field(
        None, description="darkens hollows, which little light reaches; null: none"
    )
    firefly_limit: Annotated[float, Field(strict=True, gt=0, le=1e6), Usual(0.5, 100)] | None = Field(
        10.0,
        description="most light that one sample's mirrored or environment rays may add; null: no limit",
    )

    @rule
    def _enough_points(self) -> None:
        if not self.normal_of_points or self.points is None:
            return
        pattern, count = self.points.pattern, self.points.count
        if self.normal in GRID_NORMALS and (pattern != "grid" or count not in (9, 25, 49)):
            raise problem(
                f"{self.normal} needs points in a grid of 9, 25 or 49, got {pattern} {count}", "normal"
            )
        if count < 4:
            raise problem(f"{self.normal} needs at least 4 points, got {count}", "normal")

    @property
    def normal_of_points(self) -> bool:
        """Whether normals are made from the places of a pixel's points."""
        return self.normal not in ("gradient", "potential")

    @property
    def used_points(self) -> Points:
        """The points that are used; if `points` is null, `normal` decides."""
        if self.points is not None:
            return self.points
        return Points(pattern="grid", count=9 if self.normal_of_points else 1)
