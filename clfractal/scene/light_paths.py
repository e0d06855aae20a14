"""How light reaches the eye: by one bounce from each light, or along paths of many bounces."""

from typing import Annotated, Literal

from pydantic import Field, Tag

from clfractal.schema.base import ChosenBy, Section
from clfractal.schema.fields import Usual

MAX_BOUNCES = 256


class DirectLighting(Section):
    """Light that comes straight from lights and the environment, shaded by Phong's model (thesis, Eq. 5)."""

    tag = "direct"
    mode: Literal["direct"] = "direct"


class PathLighting(Section):
    """Light along paths that bounce from surface to surface (Kajiya 1986): right, and noise with few samples."""

    tag = "path"
    mode: Literal["path"] = "path"
    bounces: Annotated[int, Usual(0, 16)] = Field(
        8, ge=0, le=MAX_BOUNCES, description="most bounces of a path after the first surface"
    )
    roulette: Annotated[int, Usual(0, 16)] = Field(
        1,
        ge=0,
        le=MAX_BOUNCES,
        description="bounces after which paths that carry little light end by chance; the mean stays the same",
    )
    detail: Annotated[float, Usual(0.01, 1)] = Field(
        0.02,
        ge=0.01,
        le=1,
        description="part of `renderer.detail` to which all rays of a surface's paths find it; 1: faster, and"
        " too bright in hollows finer than some pixels",
    )
    clamp: Annotated[float, Field(strict=True, gt=0, le=1e6), Usual(0.5, 100)] | None = Field(
        None,
        description="most light that one bounce of a sample may add; less noise, but too dark; null: no limit",
    )


Lighting = Annotated[
    Annotated[DirectLighting, Tag("direct")] | Annotated[PathLighting, Tag("path")],
    ChosenBy("mode", "direct"),
]
