"""Materials by OpenPBR's names: https://academysoftwarefoundation.github.io/OpenPBR, version 1.1."""

from typing import Annotated, Any

from pydantic import Field, create_model

from clfractal.schema.base import problem, rule
from clfractal.schema.kinds import members
from clfractal.schema.mapped import FractionMap, Mapped
from clfractal.schema.material import Part
from clfractal.schema.names import MaterialName

MAX_MATERIALS = 64
PARTS = tuple(kind for kind in members("materials") if issubclass(kind, Part))
"""What a material is made of, in the order in which users see it."""


def _layers() -> Any:
    """A section with all parts, each of which may be left out."""
    fields: dict[str, Any] = {
        part.tag: (part, Field(default_factory=dict, validate_default=True, description=part.about()))
        for part in PARTS
    }
    return create_model("Layers", __base__=Mapped, **fields)


class PbrMaterial(_layers()):  # type: ignore[misc]  # (its parts are what a folder holds)
    """A material by OpenPBR's layers, for `lighting: {mode: path}`; or a blend of two others."""

    blend: Annotated[tuple[MaterialName, ...], Field(strict=False, min_length=2, max_length=2)] | None = (
        Field(
            None,
            description="names of two materials that this one is made of; it has no layers of its own then",
        )
    )
    mask: FractionMap = Field(0.5, description="of a blend: 0 is the first one, 1 the second")

    @rule
    def _layers_or_blend(self) -> None:
        if self.blend is None:
            if self.mask != 0.5:
                raise problem("applies to a blend of two materials", "mask")
            return
        for part in PARTS:
            if getattr(self, part.tag) != part():
                raise problem("cannot be combined with blend: a blend takes its layers from others", part.tag)


Materials = Annotated[dict[MaterialName, PbrMaterial], Field(max_length=MAX_MATERIALS)]
