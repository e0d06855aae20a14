"""A scene: frozen, strict, its attribute names the keys of a scene file.

Right-handed space, z up, scene units; angles in degrees; colours linear Rec. 709. Every key but `version`,
`formula` and `camera` has a default.
"""

from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from clfractal.scene.base import Section
from clfractal.scene.coloring import Coloring
from clfractal.scene.formula import FormulaSpec
from clfractal.scene.lighting import Environment, Fog, Lights
from clfractal.scene.parts import Background, Camera, Image, Material, Output
from clfractal.scene.surface import Renderer

if TYPE_CHECKING:
    from clfractal.formulas.language import Chain


class Scene(Section):
    """A picture to be made: one formula, one camera, one way of looking."""

    version: Literal[1] = Field(description="version of this schema")
    formula: FormulaSpec
    camera: Camera
    # Defaults are data, checked when used: an instance here would build its model on import.
    image: Image = Field(default_factory=dict, validate_default=True)
    renderer: Renderer = Field(default_factory=dict, validate_default=True)
    lights: Lights = Field(default_factory=lambda: [{}], validate_default=True)
    material: Material = Field(default_factory=dict, validate_default=True)
    coloring: Coloring = Field(default_factory=dict, validate_default=True)
    background: Background = Field(default_factory=dict, validate_default=True)
    environment: Environment | None = None
    fog: Fog | None = None
    output: Output = Field(default_factory=dict, validate_default=True)

    @cached_property
    def chain(self) -> "Chain":
        """The formula, ready to be evaluated or written as OpenCL.

        Raises:
            FormulaError: it is wrong; the path says where (a loaded scene's formula has been checked).
        """
        from clfractal.errors import Where
        from clfractal.formulas import catalog

        return catalog.resolve(self.formula.mapping(), None, Where(path="formula"))

    def resolved(self) -> dict[str, Any]:
        """Plain data (as for YAML or JSON) with every default filled in; it loads back to an equal scene."""
        plain: dict[str, Any] = self.model_dump(mode="json")
        plain["formula"] = self.formula.mapping()
        return plain
