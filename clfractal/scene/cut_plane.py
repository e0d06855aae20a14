"""The cut-plane renderer's settings, and cut planes in another renderer's picture."""

from typing import Annotated, Literal

from pydantic import Field

from clfractal.scene.objects import MAX_OBJECTS
from clfractal.scene.rectangle import Plane
from clfractal.scene.sampled import Sampled
from clfractal.schema.base import Color, Coordinate, Fraction, Section, Vector
from clfractal.schema.fields import WHOLE, Usual
from clfractal.schema.names import MaterialName, ObjectName
from clfractal.schema.stops import Palette

Iterations = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]


class EscapeColors(Section):
    """Colours of a plane: the palette at scale * curve(count / limit) + offset, and a colour for points inside."""

    palette: Palette = "viridis"
    mode: Literal["smooth", "stepped"] = Field("smooth", description="smooth counts, or whole ones")
    curve: Literal["linear", "root", "log"] = Field(
        "linear", description="the quantity: count / limit, its square root, or log(count) / log(limit)"
    )
    scale: Annotated[Coordinate, Usual(-4, 4)] = Field(
        1.0, description="palette lengths between count 0 and the limit"
    )
    offset: Annotated[Coordinate, Usual(-1, 1)] = Field(
        0.0, description="position in the palette where the quantity is 0"
    )
    repeat: bool = Field(
        False, description="true: the palette repeats; false: its first and last colour continue"
    )
    inside: Color = Field((0.0, 0.0, 0.0), description="colour of points that never escape, linear Rec. 709")


class CutPlaneRenderer(Sampled):
    """The formula on a plane: escape counts as colours, one evaluation for each sample."""

    tag = "cut_plane"
    title = "Plane"
    place = 30
    is_flat = True
    type: Literal["cut_plane"] = "cut_plane"
    plane: Plane = Field(default_factory=dict, validate_default=True, description="where the plane lies")
    colors: EscapeColors = Field(
        default_factory=dict, validate_default=True, description="colours by escape counts"
    )
    iterations: Annotated[Iterations, Usual(1, 1000), WHOLE] | None = Field(
        None, description="maximum number of iterations on the plane; null: formula.iterations"
    )
    periodicity: bool = Field(
        True, description="find points inside early, by orbits that repeat; never changes the picture"
    )


class CutPlane(Section):
    """A plane in the picture of the object, coloured by escape counts."""

    plane: Plane = Field(default_factory=dict, validate_default=True, description="where the plane lies")
    colors: EscapeColors = Field(
        default_factory=dict, validate_default=True, description="colours by escape counts"
    )
    opacity: Fraction = Field(0.8, description="opacity of the rectangle; 0: only the face of a cut is shown")
    inside_opacity: Fraction | None = Field(
        None, description="opacity where the rectangle is in the set; null: as `opacity`"
    )
    cut: bool = Field(False, description="whether the object in front of the plane is removed")
    set: bool = Field(
        True,
        description="with `cut`, whether the set is cut, with all that is joined to it; false: only what `objects` names",
    )
    objects: Annotated[tuple[ObjectName, ...], Field(strict=False, max_length=MAX_OBJECTS)] = Field(
        (),
        description="with `cut`, what this plane cuts too: names of `objects` beside the set, and with `set: false` of"
        " parts that are joined to it",
    )
    iterations: Annotated[Iterations, Usual(1, 1000), WHOLE] | None = Field(
        None, description="maximum number of iterations on the plane; null: formula.iterations"
    )
    material: MaterialName | None = Field(
        None,
        description="with `cut`, along paths: one of `materials` for its faces, in the plane's colours where its"
        " `base` has none; null: they are matt",
    )
    count: Annotated[int, Usual(1, 32)] = Field(1, ge=1, le=256, description="number of parallel planes")
    spacing: Coordinate = Field(
        0.1, description="distance between neighbouring planes along the normal, scene units"
    )

    @property
    def cuts_set(self) -> bool:
        """Whether it removes a part of the set."""
        return self.cut and self.set

    @property
    def cut_objects(self) -> tuple[str, ...]:
        """What it removes parts of beside the set, or of the set's parts, by name."""
        return self.objects if self.cut else ()

    def in_front(self, point: Vector) -> bool:
        """Whether a point is in front of the plane, or of one of its stack: of what is removed if it cuts."""
        placed = self.plane.placed
        height = sum((p - c) * n for p, c, n in zip(point, placed.center, placed.normal, strict=True))
        return height > min(0.0, (self.count - 1) * self.spacing)


CutPlanes = Annotated[tuple[CutPlane, ...], Field(strict=False, max_length=64)]
