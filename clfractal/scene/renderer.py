"""The kinds of renderer, chosen by `renderer.type`."""

from typing import TYPE_CHECKING, TypeAlias

from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.sampled import Sampled
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.kinds import in_order, one_of

_KINDS: list[type[Sampled]] = [SurfaceRenderer, VolumeRenderer, CutPlaneRenderer]
RENDERERS = {kind.tag: kind for kind in in_order(_KINDS)}
"""All of them by their words."""
if TYPE_CHECKING:
    Renderer: TypeAlias = SurfaceRenderer | VolumeRenderer | CutPlaneRenderer
else:
    Renderer = one_of(_KINDS, "type", "surface")
