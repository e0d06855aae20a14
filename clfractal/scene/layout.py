"""Several views in one picture, as in the thesis's split window."""

from dataclasses import dataclass, replace
from typing import Annotated, TypeVar

from pydantic import Field

from clfractal.errors import ClfractalError
from clfractal.scene.coloring import Coloring
from clfractal.scene.cut_plane import CutPlanes
from clfractal.scene.glow import Glow
from clfractal.scene.lighting import Environment, Fog, Lights
from clfractal.scene.mist import Mist
from clfractal.scene.parts import Background, Camera, Material
from clfractal.scene.renderer import Renderer
from clfractal.schema.base import Color, Fraction, Section, problem, rule

MAX_VIEWS = 16

Mistake = TypeVar("Mistake", bound=ClfractalError)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a view lies in the picture: its top left corner and its size, pixels."""

    x: int
    y: int
    width: int
    height: int


class LayoutView(Section):
    """One view: the sections that it replaces in the scene."""

    area: Annotated[tuple[Fraction, Fraction, Fraction, Fraction], Field(strict=False)] | None = Field(
        None,
        description="left, top, width, height as fractions of the picture; null: the next cell of the grid",
    )
    camera: Camera | None = Field(None, description="replaces the scene's camera; null: keeps it")
    renderer: Renderer | None = Field(None, description="replaces the scene's renderer; null: keeps it")
    lights: Lights | None = Field(None, description="replaces the scene's lights; null: keeps them")
    material: Material | None = Field(None, description="replaces the scene's material; null: keeps it")
    coloring: Coloring | None = Field(None, description="replaces the scene's coloring; null: keeps it")
    background: Background | None = Field(None, description="replaces the scene's background; null: keeps it")
    environment: Environment | None = Field(
        None, description="replaces the scene's environment; null: keeps it"
    )
    fog: Fog | None = Field(None, description="replaces the scene's fog; null: keeps it")
    glow: Glow | None = Field(None, description="replaces the scene's glow; null: keeps it")
    mist: Mist | None = Field(None, description="replaces the scene's mist; null: keeps it")
    cut_planes: CutPlanes | None = Field(
        None, description="replaces the scene's cut planes; null: keeps them, except for a cut_plane renderer"
    )

    @rule
    def _within(self) -> None:
        if self.area is not None:
            left, top, width, height = self.area
            if width <= 0 or height <= 0 or left + width > 1 + 1e-9 or top + height > 1 + 1e-9:
                raise problem("must lie within the picture, [0, 0, 1, 1], and not be empty", "area")

    def own_error(self, error: Mistake, number: int) -> Mistake:
        """What is wrong with the view's scene, told of the whole scene, in which it is the view of that number.

        A key that the view does not replace is the scene's: it is wrong there, for this view.
        """
        name, path = f"layout.views.{number}", error.where.path or ""
        if path.partition(".")[0] in self.changes():
            where, message = replace(error.where, path=f"{name}.{path}"), error.message
        else:
            where, message = error.where, f"{error.message} (for {name})"
        return type(error)(message, where, details=error.details)

    def changes(self) -> dict[str, object]:
        """The sections that the view replaces."""
        names = [name for name in type(self).model_fields if name != "area"]
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}


class Layout(Section):
    """Views in a grid, from left to right and from top to bottom, or wherever their `area` says."""

    views: Annotated[tuple[LayoutView, ...], Field(strict=False, min_length=1, max_length=MAX_VIEWS)] = Field(
        description="what each view replaces; the scene gives everything else"
    )
    columns: Annotated[int, Field(strict=True, ge=1, le=MAX_VIEWS)] | None = Field(
        None, description="cells per row; null: all views in one row"
    )
    gap: int = Field(0, ge=0, le=1024, description="space between cells, pixels of the reference")
    background: Color = Field((0.0, 0.0, 0.0), description="colour of the gaps, linear Rec. 709")

    def places(self, width: int, height: int, reference: float) -> list[Place]:
        """Where each view lies in a picture of `width` x `height` pixels with a reference height; one may be empty."""
        columns = self.columns or sum(1 for view in self.views if view.area is None) or 1
        cells = sum(1 for view in self.views if view.area is None)
        rows = max(-(-cells // columns), 1)
        # (One that is there stays visible in a thumbnail.)
        gap = max(round(self.gap * height / reference), 1) if self.gap else 0
        across, down = _cells(width, columns, gap), _cells(height, rows, gap)
        found, cell = [], 0
        for view in self.views:
            if view.area is None:
                (x, w), (y, h) = across[cell % columns], down[cell // columns]
                cell += 1
            else:
                left, top, wide, high = view.area
                x, y = round(left * width), round(top * height)
                w, h = round((left + wide) * width) - x, round((top + high) * height) - y
            found.append(Place(x, y, w, h))
        return found


def _cells(length: int, count: int, gap: int) -> list[tuple[int, int]]:
    """Begin and length of each of `count` cells with gaps between them."""
    room = length - gap * (count - 1)
    edges = [number * room // count + number * gap for number in range(count + 1)]
    return [(edges[number], edges[number + 1] - gap - edges[number]) for number in range(count)]
