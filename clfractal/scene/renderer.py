"""The kinds of renderer, chosen by `renderer.type`."""

from typing import Annotated

from pydantic import Tag

from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.base import chosen_by

Renderer = Annotated[
    Annotated[SurfaceRenderer, Tag("surface")]
    | Annotated[VolumeRenderer, Tag("volume")]
    | Annotated[CutPlaneRenderer, Tag("cut_plane")],
    chosen_by("type", "surface"),
]
