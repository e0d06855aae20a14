"""The cut-plane renderer: its program, and the program's data."""

from __future__ import annotations

from clfractal.device.orbit import ORBIT
from clfractal.device.source import FlatText
from clfractal.device.structs import Field, Struct
from clfractal.renderers.carried import carried_text
from clfractal.renderers.escape_colors import (
    ESCAPE_COLORS,
    escape_colors_record,
    escape_defines,
    escape_palette,
)
from clfractal.renderers.kernel import KernelArgument, ProgramText, TileKernel, flat_text
from clfractal.renderers.passes import SAMPLING, pass_defines
from clfractal.renderers.plan import Plan
from clfractal.renderers.records import VIEW
from clfractal.renderers.surface import PALETTE_SIZE
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.model import Scene
from clfractal.solids import Body

PLANE_SETTINGS = Struct(
    "PlaneSettings",
    [
        Field("periodicity", "int", 0, "1: orbits that come back are found early"),
        Field("iterations", "int", 0, "most applications of the formula"),
    ],
)


def renderer_of(scene: Scene) -> CutPlaneRenderer:
    """The cut-plane renderer's settings, of a scene that has them."""
    assert isinstance(scene.renderer, CutPlaneRenderer)
    return scene.renderer


def program_text(scene: Scene, plan: Plan) -> FlatText:
    """The whole text of the scene's program."""
    renderer = renderer_of(scene)
    body = Body.of(scene)
    structs = "".join(struct.c_text() for struct in (VIEW, SAMPLING, ORBIT, PLANE_SETTINGS, ESCAPE_COLORS))
    defines = {
        **pass_defines(plan),
        **body.defines,
        "PALETTE_SIZE": PALETTE_SIZE,
        "SMOOTH": int(renderer.colors.mode == "smooth"),
    }
    generated = {
        **body.texts(files=("escape.h",), defines=escape_defines),
        "structs.h": structs,
        "carried.h": carried_text(),
    }
    return flat_text("cut_plane.cl", generated=generated, defines=defines)


class CutPlaneKernel(TileKernel):
    """One plane through a formula's set, coloured by escape counts."""

    name = "cut_plane"

    @property
    def has_alpha(self) -> bool:
        return False

    def texts(self) -> list[ProgramText]:
        return [ProgramText(self.name, program_text(self.scene, self.plan), (self.name,))]

    def own_arguments(self) -> list[KernelArgument]:
        scene, precision = self.scene, self.precision
        renderer = renderer_of(scene)
        iterations = renderer.iterations if renderer.iterations is not None else scene.formula.iterations
        settings = {"periodicity": int(renderer.periodicity), "iterations": iterations}
        body = Body.of(scene)
        return [
            PLANE_SETTINGS.value(precision, settings),
            body.records(precision),
            body.constants(precision),
            escape_colors_record(renderer.colors, iterations, precision),
            escape_palette(renderer.colors),
        ]
